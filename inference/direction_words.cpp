// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/direction_words.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/words.hpp>

namespace wheelwright::inference {

TermKind kind_of(std::string_view name) {
  static constexpr std::pair<std::string_view, TermKind> kinds[] = {
      {"viscous", TermKind::viscous}, {"coulomb", TermKind::coulomb}, {"offset", TermKind::offset},
      {"mass", TermKind::inertia},    {"inertia", TermKind::inertia}, {"armature", TermKind::inertia},
      {"payload", TermKind::inertia},
  };
  for (const auto& [word, kind] : kinds) {
    if (name.find(word) != std::string_view::npos) {
      return kind;
    }
  }
  return TermKind::other;
}

Eigen::VectorXd largest_part_one(const Eigen::VectorXd& c, const Eigen::VectorXd& size, double least) {
  const Eigen::VectorXd part = c.cwiseAbs().cwiseProduct(size);
  Eigen::Index largest = 0;
  if (c.size() == 0 || !(part.maxCoeff(&largest) > 0.0)) {
    return c;
  }
  Eigen::Index first = 0;
  while (part[first] < least * part[largest]) {
    ++first;
  }
  return c / std::copysign(c[largest], c[first]);
}

std::string combination_in_words(const Eigen::VectorXd& c, const std::vector<ParameterWords>& parameters,
                                 const Eigen::VectorXd& size, double least) {
  check::that(static_cast<std::size_t>(c.size()) == parameters.size() && size.size() == c.size(), "combination",
              "one coefficient and one size for each parameter");
  const Eigen::VectorXd part = c.cwiseAbs().cwiseProduct(size);
  Eigen::Index largest = 0;
  if (c.size() == 0 || !(part.maxCoeff(&largest) > 0.0)) {
    return "nothing";
  }
  std::vector<Eigen::Index> members;
  for (Eigen::Index j = 0; j < c.size(); ++j) {
    if (part[j] >= least * part[largest]) {
      members.push_back(j);
    }
  }
  std::string words;
  std::vector<std::string> units;
  bool same_unit = true;
  for (const Eigen::Index j : members) {
    const ParameterWords& parameter = parameters[static_cast<std::size_t>(j)];
    words += words.empty() ? (c[j] < 0.0 ? "−" : "") : (c[j] < 0.0 ? " − " : " + ");
    const std::string number = fmt::format("{:.2g}", std::abs(c[j]));
    words += number == "1" ? parameter.name : number + "·" + parameter.name;
    units.push_back(parameter.name + " in " + (parameter.unit.empty() ? "1" : parameter.unit));
    same_unit = same_unit && parameter.unit == parameters[static_cast<std::size_t>(members.front())].unit;
  }
  if (same_unit) {
    const std::string& unit = parameters[static_cast<std::size_t>(members.front())].unit;
    return unit.empty() ? words : fmt::format("{} ({})", words, unit);
  }
  return fmt::format("{} ({})", words, fmt::join(units, ", "));
}

std::vector<std::string> missing_manoeuvres(const std::vector<Eigen::Index>& members,
                                            const std::vector<ParameterWords>& parameters) {
  std::vector<std::string> names, own;
  std::vector<TermKind> kinds;
  for (const Eigen::Index j : members) {
    const ParameterWords& parameter = parameters.at(static_cast<std::size_t>(j));
    names.push_back(parameter.name);
    kinds.push_back(parameter.kind);
    if (!parameter.excite.empty() && std::find(own.begin(), own.end(), parameter.excite) == own.end()) {
      own.push_back(parameter.excite);
    }
  }
  const auto has = [&](TermKind kind) { return std::find(kinds.begin(), kinds.end(), kind) != kinds.end(); };
  const auto only = [&](TermKind kind) {
    return std::all_of(kinds.begin(), kinds.end(), [&](TermKind k) { return k == kind; });
  };
  std::vector<std::string> advice;
  if (members.size() < 2) {
    return own;
  }
  if (only(TermKind::inertia)) {
    advice.push_back("no motion may tell " + core::enumerated(names) +
                     " apart: state one of them, or drive once more with a load of known mass");
  }
  if (has(TermKind::viscous) && has(TermKind::coulomb)) {
    advice.emplace_back("drive in both directions and at many speeds, from slow to fast");
  }
  if (has(TermKind::offset) && has(TermKind::coulomb)) {
    advice.emplace_back("drive forwards and backwards for equal times");
  }
  if (has(TermKind::offset) && has(TermKind::viscous)) {
    advice.emplace_back("hold several different speeds, standstill among them");
  }
  if (has(TermKind::inertia) && (has(TermKind::viscous) || has(TermKind::coulomb))) {
    advice.emplace_back("speed up and brake often, and hold constant speeds in between");
  }
  return advice.empty() ? own : advice;
}

}  // namespace wheelwright::inference
