// SPDX-License-Identifier: Apache-2.0
/// \file
/// Naive selection rule for comparison with selection.hpp (docs/gap.md has its results).
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/gap/candidate.hpp>

namespace wheelwright::gap {

/// A set of causes that the naive rule chose.
struct NaiveChoice {
  std::vector<std::size_t> members;  ///< indices of candidates, in the order in which they were taken
  double criterion = 0.0;            ///< the smallest n ln s² + k ln n that was reached
};

/// Forward selection of single effects by the Bayesian information criterion (Schwarz 1978), θ fitted again beside
/// them, in sample: at each step the candidate that lowers n ln s² + k ln n most, until none does or there are
/// `largest`. s² is the mean square over all n rows of the table, k counts the coefficients of θ and of the causes and
/// their shapes.
///
/// The criterion takes rows for independent. Filtered rows are not, so that chance pays for its columns: without any
/// effect about two logs in three are given one. A forward search never takes back what it took.
[[nodiscard]] NaiveChoice naive_selection(const CandidateTable& table, std::size_t largest = 3);

}  // namespace wheelwright::gap
