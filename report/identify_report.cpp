// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/identify_report.hpp>

#include <utility>
#include <vector>

#include <wheelwright/inference/identification_words.hpp>
#include <wheelwright/report/identify_sections.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/signals.hpp>
#include <wheelwright/report/text.hpp>

namespace wheelwright {

using namespace report;

namespace {

const char* status_class(IdentificationStanding standing) {
  switch (standing) {
    case IdentificationStanding::good: return "good";
    case IdentificationStanding::caution: return "caution";
    case IdentificationStanding::bad: break;
  }
  return "bad";
}

}  // namespace

std::string identify_report(const Identification& result, const ReportContext& context) {
  const TimeAxis axis = context.signals && context.signals->rows() > 0 ? TimeAxis(context.signals->t) : TimeAxis();
  PageContent content;
  content.title = context.title.empty() ? "Identification of " + result.setting.robot.name : context.title;
  content.status = status_class(standing(result));
  content.verdict = verdict(result);
  content.sentences = findings(result);
  content.software = context.software;
  const auto add = [&](const char* id, const char* heading, std::string body) {
    if (!body.empty()) {
      content.sections.push_back({id, heading, std::move(body)});
    }
  };
  add("next", "What to do next", bullets(next_steps(result)));
  add("estimates", "Estimates and intervals", comparison_section(result));
  add("identifiability", "What the log can tell", identifiability_section(result));
  add("information", "Which seconds tell it", information_section(result, axis));
  add("shapes", "Beside the model", shapes_section(result));
  add("kinematics", "Kinematics", kinematics_section(result));
  add("robust", "Outliers and physical sense", robust_section(result, axis));
  add("noise", "Noise", column_noise_section(result));
  add("signals", "Raw signals",
      context.signals ? signal_charts(*context.signals, {}, axis, context.rows) : std::string());
  std::vector<std::string> remarks = result.notes;
  remarks.insert(remarks.end(), context.warnings.begin(), context.warnings.end());
  add("data", "Data", provenance(context, axis) + bullets(remarks));
  return page(content);
}

}  // namespace wheelwright
