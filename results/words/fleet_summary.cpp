// SPDX-License-Identifier: Apache-2.0
#include "results/words/fleet_summary.hpp"

#include <algorithm>
#include <functional>
#include <vector>

#include <fmt/format.h>

namespace wheelwright::words {
namespace {

// Why logs failed, the most frequent reasons first, each with one log that it befell.
std::string failure_lines(const study::FleetResult& fleet) {
  constexpr std::size_t kMostReasons = 5;
  struct Reason {
    const study::FleetFinding* first;
    std::size_t count;
  };
  std::vector<Reason> reasons;
  for (const study::FleetFinding& finding : fleet.failed) {
    const auto known = std::ranges::find_if(reasons, [&](const Reason& r) { return r.first->text == finding.text; });
    if (known == reasons.end()) {
      reasons.push_back({&finding, 1});
    } else {
      ++known->count;
    }
  }
  std::ranges::stable_sort(reasons, std::ranges::greater(), &Reason::count);
  std::string out;
  for (std::size_t i = 0; i < std::min(reasons.size(), kMostReasons); ++i) {
    const auto& [first, count] = reasons[i];
    out += fmt::format("  {}{}{}: {}\n", fleet.table.robots[first->robot], first->log.empty() ? "" : ", " + first->log,
                       count > 1 ? fmt::format(" and {} more", count - 1) : "", first->text);
  }
  if (reasons.size() > kMostReasons) {
    out +=
        fmt::format("  and {} other reasons: see fleet.json or report.html in --out\n", reasons.size() - kMostReasons);
  }
  return out;
}

}  // namespace

std::string summary(const study::FleetResult& fleet) {
  std::string out;
  for (const std::string& sentence : study::sentences(fleet)) {
    out += sentence + "\n";
  }
  return out + failure_lines(fleet);
}

}  // namespace wheelwright::words
