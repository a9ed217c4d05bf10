// SPDX-License-Identifier: Apache-2.0
/// \file
/// Model confidence sets over held-out losses, and permutation tests for autocorrelated series.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/drive.hpp>

namespace wheelwright::gap {

/// p-values, corrected for the number of regimes, that the mean of `values` over each of `regimes` (one value a row) is
/// above that of the rest by chance: contiguous blocks of `values` are permuted against the regimes, and the
/// standardised sums are compared with the permutations' maximum over all regimes, step by step (Westfall and Young
/// 1993, section 2.6). Valid for values that are stationary and forget within a block; blocks are ten times `memory`
/// (rows), and there are 12 to 48 of them. All are 1 for fewer than 64 values.
[[nodiscard]] std::vector<double> block_permutation_p_values(const Eigen::VectorXd& values,
                                                             const std::vector<Mask>& regimes, double memory,
                                                             std::size_t permutations, std::uint64_t seed);

/// Integrated autocorrelation time, in rows, of the squares of a Gaussian series with the autocorrelations ρ_k of
/// `series`: 1 + 2 Σ ρ_k², up to the first |ρ_k| <= 0.2. Unlike that of the squares themselves it is little changed by
/// a variance that differs from regime to regime.
[[nodiscard]] double memory_of_squares(const Eigen::VectorXd& series);

/// Options of model_confidence_set().
struct ConfidenceSetOptions {
  double margin = 0.0;  ///< mean loss per block by which a model may be worse than the best and still be as good
  std::size_t resamples = 1999;  ///< > 0, of whole blocks
  std::uint64_t seed = 1;
};

/// p-value of each model of a model confidence set (Hansen, Lunde and Nason 2011): models are dropped one by one, the
/// one with the largest studentised mean loss beyond that of the best (plus the margin) first, and the p-value of each
/// is the largest of the tests up to its own; the best has 1. A model belongs to the set of level 1 − a where its
/// p-value is at least a, and all models that are equally good are in it together with that probability, to what a
/// bootstrap of the blocks can do: which of them comes out best by chance is resampled too. `losses` holds one vector
/// per model, one value per block; blocks are resampled whole, so that they may be correlated inside. Throws
/// InvalidArgument unless all have the same length, at least four.
[[nodiscard]] std::vector<double> model_confidence_set(const std::vector<Eigen::VectorXd>& losses,
                                                       const ConfidenceSetOptions& options = {});

}  // namespace wheelwright::gap
