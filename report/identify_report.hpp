// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of an identification.
#pragma once

#include <string>

#include <wheelwright/inference/identification.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright {

/// One self-contained HTML page: what was found in words, what to do next, estimators and intervals side by side with what
/// each promises, what the log can and cannot tell, which seconds tell it, robust and constrained fits, delay, lags and
/// Stribeck speed with their curves, kinematics, noise, raw signals, data. `context.own_log` is not used.
[[nodiscard]] std::string identify_report(const Identification& result, const ReportContext& context);

}  // namespace wheelwright
