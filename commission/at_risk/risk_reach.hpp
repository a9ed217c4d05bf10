// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the detector at a stated risk will see: the smallest certain fault of each kind that its weights are like.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "detector/sum_weight.hpp"

namespace wheelwright::commission {

/// Smallest certain size of one kind of fault, on a drive like a log.
struct RiskReach {
  detector::SumWeight weight{};
  std::string unit{};  ///< of the sizes; "1" for a share
  /// Sizes that are seen within RiskReachOptions::within from half of all moments at which they may set in; infinite
  /// where there is none.
  std::vector<double> size{};
  std::vector<double> within{};  ///< s
};

/// Options of risk_reach().
struct RiskReachOptions {
  std::vector<double> within{1.0, 5.0, 20.0};  ///< s
  double every = 2.0;                          ///< s, between the moments that are looked at
  double most = 600.0;                         ///< s of the log that are looked at
  std::size_t threads = 1;                     ///< the result does not depend on it
};

/// Of what the weights are like: effort readings that are off by a constant, or by a share of the effort that is lost,
/// and parameters that grow by a share. Certain as margins_at_risk() has it. Of the beginning of the log's first
/// segment, 60,000 rows at most.
[[nodiscard]] std::vector<RiskReach> risk_reach(LogSource& log, const OnlineModel& model,
                                                const RiskReachOptions& options = {});

/// The beginning of the first segment of `log`: `most` s, 60,000 rows at most, with these columns alone. Rewinds the
/// log. Throws InvalidArgument where it lacks one.
[[nodiscard]] LogTable beginning_of(LogSource& log, const std::vector<std::string>& columns, double most);

/// "a bias of the effort (tau_r): 0.06, 0.024, 0.011 N·m".
[[nodiscard]] std::string sentence(const RiskReach& reach, const Model& model);

}  // namespace wheelwright::commission
