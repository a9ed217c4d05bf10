// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a command that stopped with an error.
#pragma once

#include <string>

#include "results/report/page.hpp"

namespace wheelwright::report {

/// The page of any command that stopped with an error: the error, what is known of the log, and its raw signals.
[[nodiscard]] std::string failure_report(const std::string& error_message, const ReportContext& context);

}  // namespace wheelwright::report
