// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a detection.
#pragma once

#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/trace.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright {

/// One self-contained HTML page: what the detector says in words, its events (a click zooms all charts to one), the residual
/// inside [l, u] with the events shaded, prediction, raw signals, data. It loads nothing when opened; every name is escaped,
/// every number is finite. `context.own_log` is not used.
[[nodiscard]] std::string detect_report(const Detection& detection, const CommissionedModel& model,
                                        const ReportContext& context);

}  // namespace wheelwright
