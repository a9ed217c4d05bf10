// SPDX-License-Identifier: Apache-2.0
#include "results/words/health_summary.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace wheelwright::words {
namespace {

// `t` to the hundredth of a second, or to five digits where these are more.
std::string seconds(double t) { return std::abs(t) < 1e3 ? fmt::format("{:.5g}", t) : fmt::format("{:.2f}", t); }

std::string stretches(const doctor::LogFinding& finding, const std::function<std::string(double)>& clock) {
  if (finding.when.empty()) {
    return {};
  }
  constexpr std::size_t kShown = 4;
  std::string text = "at t = ";
  for (std::size_t k = 0; k < std::min(kShown, finding.when.size()); ++k) {
    const std::string moment = clock ? clock(finding.when[k].lower) : std::string();
    text += fmt::format("{}{} to {} s{}", k > 0 ? ", " : "", seconds(finding.when[k].lower),
                        seconds(finding.when[k].upper), moment.empty() ? "" : fmt::format(" ({})", moment));
  }
  return finding.stretches > kShown ? text + fmt::format(" and {} more", finding.stretches - kShown) : text;
}

// `text` in lines of at most 100 bytes, each behind `indent`.
std::string indented(const std::string& text, const std::string& indent) {
  constexpr std::size_t width = 100;
  std::string out;
  std::size_t begin = 0;
  while (begin < text.size()) {
    std::size_t end = text.size();
    if (end - begin > width) {
      end = text.rfind(' ', begin + width);
      end = end == std::string::npos || end <= begin ? text.find(' ', begin + width) : end;
      end = std::min(end, text.size());
    }
    out += indent + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return out;
}

}  // namespace

std::string summary(const doctor::LogHealth& health, bool all, const std::function<std::string(double)>& clock) {
  std::string text;
  for (const doctor::LogFinding& finding : health.findings) {
    if (finding.severity == doctor::FindingSeverity::fine && !all) {
      continue;
    }
    text += fmt::format("{}: {}\n", doctor::to_string(finding.severity), finding.id) +
            indented(finding.sentence, "  ") + indented(stretches(finding, clock), "  ") +
            indented(finding.next, "  → ");
  }
  const std::size_t fine = health.count(doctor::FindingSeverity::fine);
  if (!all && fine > 0) {
    text += fmt::format("{} check{} found nothing to mention (--all shows them)\n", fine, fine == 1 ? "" : "s");
  }
  return text + (health.assumed.empty() ? "" : health.assumed + "\n") + health.sentence + "\n";
}

}  // namespace wheelwright::words
