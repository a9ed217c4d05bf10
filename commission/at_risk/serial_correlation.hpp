// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether efforts' errors are correlated for longer than is declared.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include "bounds/polytope.hpp"
#include "core/log.hpp"
#include "model/filter/element_filter.hpp"
#include "model/filter/error_class.hpp"

namespace wheelwright::commission {

/// Result of serial_correlation().
struct SerialCorrelation {
  double excess = 0.0;    ///< > 1: the log contradicts what is assumed; the largest of all joints and delays
  double delay = 0.0;     ///< s, age of what that residual was multiplied with, in the mean
  std::size_t joint = 0;  ///< whose effort it is
};

/// What the model leaves of a joint's effort, times what it left before, over a whole log:
///
///     S(θ) = Σ q_k(θ) r_k(θ),   r_k = N⁺_j (torque_k − Y_k θ),   q_k the mean of earlier r, older by the correlation
///                               time and more than every error that r_k holds
///
/// over several delays of that mean. At the true θ each q_k was settled before the errors that it is multiplied with:
/// S is then a martingale beside what bias and motion may add, as any foreseen weight makes it, and exceeds
/// cost/λ + λV/2, V = Σ q² · length² · their variance proxies, with a probability of at most e^{−cost}, for any λ that
/// is fixed beforehand, whatever the errors' law and however it changes (averaged_radius()). Errors that are alike for
/// longer make S positive. Nothing is fitted: the log contradicts the assumption where S(θ) is too large for every θ
/// of `set`, in which S is a polynomial of degree two.
///
/// Bias, errors of the motion column, and motion and efforts between samples count at their worst. The probability that
/// `excess` is above 1 is at most `risk`, that of the set apart, if errors are as `classes` says. `excess` is 0 where
/// efforts' errors do not average out. The log lasts `seconds`; it is walked once.
[[nodiscard]] SerialCorrelation serial_correlation(LogSource& log, filter::ElementFilter elements,
                                                   const filter::ErrorClasses& classes, const bounds::Polytope& set,
                                                   double seconds, double risk);

}  // namespace wheelwright::commission
