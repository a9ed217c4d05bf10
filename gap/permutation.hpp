// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether a series is larger in some regimes than chance would have it, for series that remember.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// p-values, corrected for the number of regimes, that the mean of `values` over each of `regimes` (one value a row) is
/// above that of the rest by chance: contiguous blocks of `values` are permuted against the regimes, and the standardised
/// sums are compared with the permutations' maximum over all regimes, step by step (Westfall and Young 1993, section
/// 2.6). Valid for values that are stationary and forget within a block; blocks are ten times `memory` (rows), and there
/// are 12 to 48 of them. All are 1 for fewer than 64 values.
[[nodiscard]] std::vector<double> block_permutation_p_values(const Eigen::VectorXd& values,
                                                             const std::vector<Mask>& regimes, double memory,
                                                             std::size_t permutations, std::uint64_t seed);

/// Integrated autocorrelation time, in rows, of the squares of a Gaussian series with the autocorrelations ρ_k of
/// `series`: 1 + 2 Σ ρ_k², up to the first |ρ_k| <= 0.2. Unlike that of the squares themselves it is little changed by a
/// variance that differs from regime to regime.
[[nodiscard]] double memory_of_squares(const Eigen::VectorXd& series);

}  // namespace wheelwright
