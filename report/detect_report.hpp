// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a detection.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/commission/risk_watch.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright::report {

/// Findings of the kinematic residual.
struct KinematicFindings {
  std::optional<Detection> detection{};  ///< nothing where it was not watched
  std::string message{};                 ///< why not
};

/// One self-contained HTML page: what the detector says in words, its events (a click zooms all charts to one), the
/// residual inside [l, u] with the events shaded, prediction, raw signals, data, and the same of
/// the kinematic residual. `at_risk` is the same log under the detector at a stated risk. `isolations` belong to the
/// first events, in their order. It loads nothing when opened; every name is escaped, every number is finite.
/// `context.own_log` is not used.
[[nodiscard]] std::string detect_report(const Detection& detection, const OnlineModel& model,
                                        const ReportContext& context, const KinematicFindings& kinematic = {},
                                        const std::vector<detector::Isolation>& isolations = {},
                                        const commission::RiskWatch& at_risk = {});

}  // namespace wheelwright::report
