// SPDX-License-Identifier: Apache-2.0
#include "results/report/health_report.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "results/report/page.hpp"
#include "results/report/signals.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using doctor::FindingSeverity;

using namespace words;

namespace {

std::string stretches(const doctor::LogFinding& finding, const TimeAxis& axis) {
  constexpr std::size_t kShown = 6;
  std::string html;
  for (std::size_t k = 0; k < std::min(kShown, finding.when.size()); ++k) {
    const Interval& w = finding.when[k];
    const double margin = std::max(0.2 * (w.upper - w.lower), 0.1);
    if (k > 0) {
      html += ' ';
    }
    html += time_button(w.lower - margin, w.upper + margin,
                        fmt::format("{}–{} s", number(w.lower, 4), number(w.upper, 4)), axis);
  }
  if (finding.stretches > kShown) {
    html += escape(fmt::format(" and {} more", finding.stretches - kShown));
  }
  return html;
}

std::string findings_table(const doctor::LogHealth& health, const TimeAxis& axis) {
  std::vector<std::vector<Cell>> rows;
  for (const doctor::LogFinding& f : health.findings) {
    if (f.severity != FindingSeverity::fine) {
      rows.push_back({escape(doctor::to_string(f.severity)), "<code>" + escape(f.id) + "</code>",
                      escape_with_code(f.sentence), escape_with_code(f.next), stretches(f, axis)});
    }
  }
  return rows.empty() ? "" : table({"severity", "finding", "what was found", "what to do next", "when"}, rows);
}

std::string fine_table(const doctor::LogHealth& health) {
  std::vector<std::vector<Cell>> rows;
  for (const doctor::LogFinding& f : health.findings) {
    if (f.severity == FindingSeverity::fine) {
      rows.push_back({"<code>" + escape(f.id) + "</code>", escape_with_code(f.sentence)});
    }
  }
  return rows.empty() ? "" : table({"check", "what was found"}, rows);
}

std::vector<ChartMark> marks_of(const doctor::LogHealth& health) {
  std::vector<ChartMark> marks;
  for (const doctor::LogFinding& f : health.findings) {
    for (const Interval& when : f.when) {
      if (f.severity != FindingSeverity::fine) {
        marks.push_back({when.lower, when.upper, f.id});
      }
    }
  }
  return marks;
}

std::vector<std::string> sentences(const doctor::LogHealth& health) {
  std::vector<std::string> out;
  for (const doctor::LogFinding& f : health.findings) {
    if (f.severity >= FindingSeverity::warning) {
      out.push_back(f.sentence + (f.next.empty() ? "" : " What to do: " + f.next));
    }
  }
  for (const doctor::LogFinding& f : health.findings) {
    if (f.id == "time.rate" && f.severity == FindingSeverity::fine) {
      out.push_back(f.sentence);
    }
  }
  out.push_back(fmt::format("{}, {}, {} that found nothing to mention.",
                            core::capital(plural(health.count(FindingSeverity::warning), "warning")),
                            plural(health.count(FindingSeverity::notice), "notice"),
                            plural(health.count(FindingSeverity::fine), "check")));
  if (!health.assumed.empty()) {
    out.push_back(core::capital(health.assumed) + ".");
  }
  return out;
}

}  // namespace

std::string health_report(const doctor::LogHealth& health, const ReportContext& context) {
  const TimeAxis axis = context.signals && context.signals->rows() > 0 ? TimeAxis(context.signals->t) : TimeAxis();
  PageContent content;
  content.title = context.title.empty() ? "Examination of a log" : context.title;
  const bool clean = health.count(FindingSeverity::warning) == 0;
  content.status = health.verdict == doctor::LogVerdict::unusable              ? "bad"
                   : health.verdict == doctor::LogVerdict::commission && clean ? "good"
                                                                               : "caution";
  content.verdict = health.sentence;
  content.sentences = sentences(health);
  content.software = context.software;
  const auto add = [&](const char* id, const char* heading, std::string body) {
    if (!body.empty()) {
      content.sections.push_back({id, heading, std::move(body)});
    }
  };
  add("findings", "What was found", findings_table(health, axis));
  add("fine", "What is as it should be", fine_table(health));
  add("signals", "Raw signals",
      context.signals ? signal_charts(*context.signals, marks_of(health), axis, context.rows) : std::string());
  add("data", "Data", provenance(context, axis) + bullets(context.warnings));
  return page(content);
}

}  // namespace wheelwright::report
