// SPDX-License-Identifier: Apache-2.0
/// \file
/// The numbers of a set of causes: coefficients and shapes with their intervals, and each cause's share of the gap.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/gap/prepared.hpp>

namespace wheelwright {

/// A set of causes fitted to a drive.
struct FittedCauses {
  std::vector<FittedEffect> effects;              ///< in the order of the set's members
  std::vector<std::vector<GapEstimate>> numbers;  ///< of each effect, as a report has them (Effect::physical)
  std::vector<std::vector<Interval>> intervals;   ///< of each effect's coefficients, 95 %
  Eigen::VectorXd theta;                          ///< p, θ_L with the causes beside it
  Eigen::VectorXd theta_error;                    ///< p, its standard errors; 0 where θ was held
  double freedom = 0.0;                           ///< of Student's t
  Subset subset;                                  ///< of the rows' columns at the set's own shapes
  Eigen::VectorXd coefficients;                   ///< of the subset
};

/// Fits `set` to the rows of `problem`. Continuous shapes are fitted by variable projection from where the search found
/// them; all intervals (95 %) are those of the jackknife over blocks of time (BlockGram::fit) of the model linearised in its
/// shapes. With `base` nominal θ is held where it is trusted.
[[nodiscard]] FittedCauses fit_causes(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set,
                                      BaseModel base, const BlockOptions& blocks);

/// Shapley value of each member of `set`: its mean gain in held-out mean square over all orders in which the causes could
/// have been added, as a share of `gap` (mean squares of the floor).
[[nodiscard]] std::vector<double> shapley_shares(const CandidateTable& table, const CauseSet& set, BaseModel base,
                                                 double gap);

}  // namespace wheelwright
