// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/warrant_section.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/report/page.hpp>
#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

// Classes of the style sheet, which is in every page: none of them is one of the words.
const char* badge_class(Warrant warrant) {
  switch (warrant) {
    case Warrant::guaranteed: return "from-sensors";
    case Warrant::extrapolated: return "from-log";
    case Warrant::statistical: return "from-chance";
  }
  return "from-log";
}

}  // namespace

std::string warrant_badge(Warrant warrant) {
  return fmt::format("<span class=\"badge {}\">{}</span>", badge_class(warrant), warrant_word(warrant));
}

std::string warrant_note(Warrant warrant) {
  std::string meaning(warrant_meaning(warrant));
  meaning.erase(0, meaning.find(' ') + 1);  // the word itself is in the badge
  return paragraph(warrant_badge(warrant) + " " + escape(capital(meaning)));
}

std::string assumptions_section(const std::vector<Assumption>& assumptions) {
  if (assumptions.empty()) {
    return {};
  }
  std::vector<Assumption> sorted = assumptions;
  std::ranges::stable_partition(sorted, [](const Assumption& a) { return a.verdict == AssumptionVerdict::fails; });
  std::vector<std::vector<Cell>> rows;
  for (const Assumption& a : sorted) {
    const char* status = a.verdict == AssumptionVerdict::holds   ? "holds"
                         : a.verdict == AssumptionVerdict::fails ? "broken"
                                                                 : "open";
    rows.push_back({escape(a.statement), a.declared_by.empty() ? "–" : "<code>" + escape(a.declared_by) + "</code>",
                    a.test.empty() ? "none" : escape(a.test),
                    fmt::format("<span class=\"verdict-{}\">{}</span>", status, verdict_word(a.verdict)) +
                        (a.detail.empty() ? "" : "<small>" + escape(a.detail) + "</small>")});
  }
  return paragraph(
             "What is taken as given, where it is declared, how the commissioning log was tested for it, and what "
             "it said. What is not tested is for whoever relies on the numbers to know.") +
         table({"Assumption", "declared by", "test", "this log"}, rows);
}

}  // namespace wheelwright::report
