// SPDX-License-Identifier: Apache-2.0
#include "app/report_pages.hpp"

#include "results/report/signals.hpp"
#include "results/software.hpp"

namespace wheelwright::app {

report::ReportContext report_context(const CommonOptions& options, const logs::LogReport& data, LogSource& log) {
  report::ReportContext context;
  for (const logs::LogFileReport& file : data.files) {
    context.log_files.push_back(file.path);
  }
  context.software = results::software();
  context.command_line = options.command_line;
  context.warnings = logs::sentences(data);
  if (!options.out.empty()) {
    context.signals = report::raw_signals(log);
    context.rows = data.rows;
  }
  return context;
}

}  // namespace wheelwright::app
