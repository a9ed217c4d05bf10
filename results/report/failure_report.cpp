// SPDX-License-Identifier: Apache-2.0
#include "results/report/failure_report.hpp"

#include <utility>

#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

std::string failure_report(const std::string& error_message, const ReportContext& context) {
  const TimeAxis axis = context.signals && context.signals->rows() > 0 ? TimeAxis(context.signals->t) : TimeAxis();
  PageContent content;
  content.title = context.title.empty() ? "No result" : context.title;
  content.status = "bad";
  content.verdict = "No result: the command stopped with an error.";
  content.sentences = {error_message, "What could be read of the log is shown below, as it was measured."};
  content.software = context.software;
  content.sections.push_back({"signals", "Raw signals", signals_section(context, {}, axis)});
  std::string data = provenance(context, axis);
  if (!context.warnings.empty()) {
    data += "<h3>Repairs and remarks of the log reader</h3>\n" + bullets(context.warnings);
  }
  if (!data.empty()) {
    content.sections.push_back({"data", "Data", std::move(data)});
  }
  return page(content);
}

}  // namespace wheelwright::report
