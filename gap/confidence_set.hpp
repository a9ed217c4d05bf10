// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which of several models may be the best one, judged by their losses on held-out blocks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// Options of model_confidence_set().
struct ConfidenceSetOptions {
  double margin = 0.0;  ///< mean loss per block by which a model may be worse than the best and still be as good
  std::size_t resamples = 1999;  ///< > 0, of whole blocks
  std::uint64_t seed = 1;
};

/// p-value of each model of a model confidence set (Hansen, Lunde and Nason 2011): models are dropped one by one, the one
/// with the largest studentised mean loss beyond that of the best (plus the margin) first, and the p-value of each is the
/// largest of the tests up to its own; the best has 1. A model belongs to the set of level 1 − a where its p-value is at
/// least a, and all models that are equally good are in it together with that probability, to what a bootstrap of the
/// blocks can do: which of them comes out best by chance is resampled too. `losses` holds one vector per model, one value
/// per block; blocks are resampled whole, so that they may be correlated inside. Throws InvalidArgument unless all have the
/// same length, at least four.
[[nodiscard]] std::vector<double> model_confidence_set(const std::vector<Eigen::VectorXd>& losses,
                                                       const ConfidenceSetOptions& options = {});

}  // namespace wheelwright
