// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a commissioning.
#pragma once

#include <string>

#include "commission/commission.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// One self-contained HTML page: the result in words, parameters, residual inside [l, u] and prediction over the whole
/// log (where `context.own_log` is given), raw signals, validation, noise and filter, data. It loads nothing when
/// opened; every name is escaped, every number is finite.
[[nodiscard]] std::string commission_report(const Commissioning& result, const ReportContext& context);

/// The page of any command that stopped with an error: the error, what is known of the log, and its raw signals.
[[nodiscard]] std::string failure_report(const std::string& error_message, const ReportContext& context);

}  // namespace wheelwright::report
