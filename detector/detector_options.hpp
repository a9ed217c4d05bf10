// SPDX-License-Identifier: Apache-2.0
/// \file
/// Options of a detector: the set that its thresholds stand on, the comparison that decides, persistence.
#pragma once

#include <optional>
#include <string_view>

#include <Eigen/Core>

#include "detector/events.hpp"

namespace wheelwright::detector {

/// Outer description of the feasible set from which a threshold is computed.
enum class ParameterSetKind {
  box,       ///< the interval hull: closed form, never tighter than the polytope
  polytope,  ///< the set itself
};

/// Comparison that decides.
enum class Test {
  two_sided,  ///< l <= ε <= u: does not depend on θ̂ and is never less sensitive
  symmetric,  ///< |ε| <= ρ: the paper's (35)
};

/// Residual that decides.
enum class Residual {
  d1,  ///< D1 of (35): the time-varying threshold of the feasible set
  d2,  ///< D2 of (39): a constant threshold μ_o for each output, by experiment, without guarantee
};

/// "d1" or "d2".
[[nodiscard]] constexpr std::string_view residual_word(Residual residual) {
  return residual == Residual::d2 ? "d2" : "d1";
}

/// Options of a detector.
struct DetectorOptions {
  ParameterSetKind set = ParameterSetKind::polytope;
  Test test = Test::two_sided;
  /// k of n; 1 of 1 (or what a commissioned model says) where it is not given, which keeps the certain detections of
  /// fault_margin.hpp.
  std::optional<Persistence> persistence{};
  std::optional<Eigen::VectorXd> mu{};  ///< μ_o of (39), one for each output: constant thresholds instead of ρ(t)
  Residual residual = Residual::d1;     ///< d2: make_detector() takes μ_o from the model (LearntSet::constant)
};

}  // namespace wheelwright::detector
