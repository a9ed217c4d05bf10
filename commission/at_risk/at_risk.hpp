// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a commissioning says at a stated risk: set, detector, and the log's own word on the assumptions behind both.
#pragma once

#include <optional>
#include <string>

#include "commission/commission.hpp"
#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::commission {

/// Id of the assumption (core::Assumption) behind what is said at a risk. The guaranteed bounds do not stand on it, but
/// what makes it fail may be more than errors: see withdraw_what_averages_would_hide().
inline constexpr const char* kNoiseAverages = "noise_averages";

/// Options of learn_at_risk().
struct AtRiskOptions {
  RiskSetOptions set{};
  std::vector<double> scales{0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0};  ///< s, of the detector's sums
  bool estimate = true;  ///< where the robot file leaves the efforts' noise to be estimated: see learn_at_risk()
  /// Probability that a log which keeps to its assumptions is said to contradict them: by one sum, by the mean square
  /// of many, or by what is left being like what was left before, a third each.
  double test_risk = 3e-3;
  bool reach = true;        ///< whether Commissioning::reach is asked for: a large part of the time
  std::size_t threads = 1;  ///< for a log that can be walked twice at once; the result does not depend on it
};

/// Adds Commissioning::at_risk and OnlineModel::at_risk to a guaranteed result whose robot file declares errors that
/// average out (error_classes()), and an assumption with the log's verdict on them. The log contradicts them where it
/// leaves no set, where a sum over any scale stands outside what such errors can do at AtRiskOptions::test_risk, where
/// the sums' mean square over many windows does, or where what the model leaves is like what it left before
/// (serial_correlation()), which both show errors that are alike for longer than is declared: then nothing is said at a
/// risk, and the worst case stands alone.
///
/// Where the robot file leaves the efforts' noise to be estimated, so are the classes (error_estimate.hpp), with the
/// least bias of which this log uses no more than half: the result is extrapolated, and holds while noise and driving
/// stay as they were. Nothing is said where even a bias as large as the deviation is not enough. What is left may be
/// like what was left before: an estimate takes what the log has of that into deviation and bias.
///
/// Walks the log eight times; to estimate, about forty times. `set`: declared_risk_set() of the same, where that was
/// made before.
void learn_at_risk(LogSource& log, Commissioning& result, const AtRiskOptions& options = {},
                   std::optional<RiskSet> set = {});

/// The set that learn_at_risk() will ask for, which what is said of the pose has no part in; nothing where it will ask
/// for none, or for one with estimated classes. Reads model, noise and feasible set of `result` alone.
[[nodiscard]] std::optional<RiskSet> declared_risk_set(LogSource& log, const Commissioning& result,
                                                       const AtRiskOptions& options = {});

}  // namespace wheelwright::commission
