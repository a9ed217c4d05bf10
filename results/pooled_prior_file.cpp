// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/pooled_prior_file.hpp>

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

#include <wheelwright/files/number.hpp>

namespace wheelwright {
namespace {

// `text` as comment lines of at most 100 bytes; line ends and control characters become blanks.
std::string comment(std::string text) {
  constexpr std::size_t most = 98;
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  std::string out;
  std::string_view rest = text;
  while (rest.size() > most) {
    std::size_t cut = rest.rfind(' ', most);
    cut = cut == std::string_view::npos || cut == 0 ? rest.size() : cut;
    out += fmt::format("# {}\n", rest.substr(0, cut));
    rest.remove_prefix(std::min(cut + 1, rest.size()));
  }
  return out + fmt::format("# {}\n", rest);
}

}  // namespace

std::string pooled_prior_yaml(const FleetResult& fleet, const std::string& software) {
  const PooledPrior& prior = fleet.prior;
  std::string out = comment("Pooled prior of a fleet, by " + software + ": copy it into the next robot's file.");
  out += comment((prior.exists ? "Coverage: " : "No box: ") + prior.message + ".");
  if (prior.exists) {
    out += comment(
        "It is distribution-free (split conformal prediction on the robots' bounds); \"drawn alike\" means "
        "exchangeable: the next robot is of the same kind, not one that was chosen for being different.");
  }
  std::string rows;
  for (const PooledParameter& p : prior.parameters) {
    const FleetColumn& column = fleet.table.columns[p.column];
    if (prior.exists && p.included) {
      rows += fmt::format("  {}: [{}, {}]  # {}\n", column.name, number_text(p.box.lower), number_text(p.box.upper),
                          column.unit);
    } else if (prior.exists) {
      out += comment("Left out: " + column.name + ", " + p.reason + ".");
    }
  }
  return out + (rows.empty() ? "prior: {}\n" : "prior:\n" + rows);
}

}  // namespace wheelwright
