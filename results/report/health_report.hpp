// SPDX-License-Identifier: Apache-2.0
/// \file
/// The examination of a log as a page.
#pragma once

#include <string>

#include "commission/doctor/log_health.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// The findings of `health`, the gravest first, with the stretches of the log that they are about as buttons that zoom
/// the raw signals of `context` to them. One self-contained HTML page.
[[nodiscard]] std::string health_report(const doctor::LogHealth& health, const ReportContext& context);

}  // namespace wheelwright::report
