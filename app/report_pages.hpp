// SPDX-License-Identifier: Apache-2.0
/// \file
/// Pages of the commands: the context of a report, and the page of a step that fails.
#pragma once

#include "app/common.hpp"
#include "core/error.hpp"
#include "core/log.hpp"
#include "formats/logs/recorded_log.hpp"
#include "results/report/failure_report.hpp"
#include "results/report/page.hpp"

namespace wheelwright::app {

/// The context of a report: files, repairs, software, command line, raw signals of `log` (which is walked once).
[[nodiscard]] report::ReportContext report_context(const CommonOptions& options, const logs::LogReport& data,
                                                   LogSource& log);

/// Runs `work` and returns what it returns. Where it throws an Error and results are wanted, write_failure_page() shows
/// the message and the raw signals of `context`; the error is thrown on.
template <typename Work>
auto or_failure_page(const CommonOptions& options, const report::ReportContext& context, const Work& work) {
  try {
    return work();
  } catch (const Error& error) {
    write_failure_page(options, report::failure_report(error.what(), context));
    throw;
  }
}

}  // namespace wheelwright::app
