// SPDX-License-Identifier: Apache-2.0
#include "commission/model_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "bounds/polytope.hpp"
#include "commission/physical.hpp"
#include "core/check.hpp"
#include "core/words.hpp"

namespace wheelwright::commission {
namespace {

using bounds::HalfSpace;

// The set of (θ, θ'_S): θ in the first set, and in the second with the entries S replaced. Nothing where it is empty.
std::optional<Polytope> pairs(const ParameterSet& before, const ParameterSet& after,
                              const std::vector<std::size_t>& changed) {
  const std::size_t p = before.box.dimension();
  std::vector<std::size_t> place(p);  // of θ'_j
  Box box = before.box;
  for (std::size_t j = 0; j < p; ++j) {
    place[j] = j;
  }
  for (const std::size_t j : changed) {
    place[j] = box.dimension();
    box.sides.push_back(after.box.sides[j]);
  }
  for (std::size_t j = 0; j < p; ++j) {
    if (place[j] == j) {
      Interval& side = box.sides[j];
      side = {std::max(side.lower, after.box.sides[j].lower), std::min(side.upper, after.box.sides[j].upper)};
      if (side.lower > side.upper) {
        return std::nullopt;
      }
    }
  }
  std::vector<HalfSpace> rows;
  const auto add = [&](const HalfSpace& facet, bool second) {
    HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(box.dimension())), facet.b, {}};
    row.origin.sample = rows.size();
    for (std::size_t j = 0; j < p; ++j) {
      row.a[static_cast<Eigen::Index>(second ? place[j] : j)] = facet.a[static_cast<Eigen::Index>(j)];
    }
    rows.push_back(std::move(row));
  };
  for (const HalfSpace& facet : before.facets) {
    add(facet, false);
  }
  for (const HalfSpace& facet : after.facets) {
    add(facet, true);
  }
  auto set = Polytope::intersect(rows, box, {.vertex_limit = 1});
  Polytope* const found = std::get_if<Polytope>(&set);
  return found == nullptr ? std::nullopt : std::optional(std::move(*found));
}

// Calls `visit` for each set of `size` of the numbers below p.
template <typename Visit>
void for_subsets(std::size_t p, std::size_t size, const Visit& visit) {
  std::vector<bool> in(p, false);
  std::fill_n(in.begin(), size, true);
  do {
    std::vector<std::size_t> members;
    for (std::size_t j = 0; j < p; ++j) {
      if (in[j]) {
        members.push_back(j);
      }
    }
    visit(members);
  } while (std::prev_permutation(in.begin(), in.end()));
}

double subsets(std::size_t p, std::size_t size) {
  double count = 1.0;
  for (std::size_t k = 0; k < size; ++k) {
    count = count * static_cast<double>(p - k) / static_cast<double>(k + 1);
  }
  return count;
}

// The interval of θ'_j − θ_j over `set`, where θ'_j is entry `other`.
Interval change_in(const Polytope& set, std::size_t j, std::size_t other) {
  std::vector<double> direction(set.dimension(), 0.0);
  direction[j] = -1.0;
  direction[other] = 1.0;
  const double upper = set.support(direction);
  direction[j] = 1.0;
  direction[other] = -1.0;
  return {-set.support(direction), upper};
}

Interval intersection(Interval x, Interval y) { return {std::max(x.lower, y.lower), std::min(x.upper, y.upper)}; }

// θ_L of the sets as the physical quantities behind them.
void in_physical_words(SetComparison& sets, const Model& model, const std::vector<PhysicalScale>& scales) {
  for (std::size_t j = 0; j < model.p(); ++j) {
    const auto at = [&](Interval theta, bool moved) {
      const Interval scaled = core::point(scales[j].scale) * theta;
      return moved ? scaled - core::point(scales[j].offset) : scaled;
    };
    ParameterChange& parameter = sets.parameters[j];
    parameter.quantity = model.parameters[j].physical;
    parameter.unit = model.parameters[j].physical_unit;
    parameter.before = at(parameter.before, true);
    parameter.after = at(parameter.after, true);
    parameter.change = at(parameter.change, false);
    if (parameter.together) {
      parameter.together = at(*parameter.together, true);
    }
    for (ChangeExplanation& explanation : sets.explanations) {
      for (std::size_t k = 0; k < explanation.parameters.size(); ++k) {
        if (explanation.parameters[k] == j) {
          explanation.change[k] = at(explanation.change[k], false);
        }
      }
    }
  }
}

std::string regressor_difference(const Model& before, const Model& after) {
  const auto same_term = [](const Term& x, const Term& y) {
    return x.output == y.output && x.parameter == y.parameter && x.kind == y.kind && x.coordinate == y.coordinate &&
           x.scale == y.scale && x.function == y.function;
  };
  std::vector<std::string> names[2];
  for (const auto& [model, list] : {std::pair(&before, &names[0]), std::pair(&after, &names[1])}) {
    for (const model::Parameter& parameter : model->parameters) {
      list->push_back(parameter.name);
    }
  }
  if (before.name != after.name) {
    return fmt::format("kinds of robot: {} and {}", before.name, after.name);
  }
  if (names[0] != names[1]) {
    return fmt::format("parameters: {} and {}", core::listed(names[0]), core::listed(names[1]));
  }
  const auto same_geometry = [](const model::Parameter& x, const model::Parameter& y) {
    return x.per_physical == y.per_physical;
  };
  const bool same = before.motion == after.motion && before.input == after.input &&
                    std::ranges::equal(before.terms, after.terms, same_term) &&
                    std::ranges::equal(before.parameters, after.parameters, same_geometry);
  return same ? "" : "geometries in the robot files (wheel_radius, track_width, lever_arm)";
}

}  // namespace

SetComparison compare_sets(const ParameterSet& before, const ParameterSet& after, std::size_t most_sets) {
  const std::size_t p = before.box.dimension();
  check::that(after.box.dimension() == p, "compare_sets", "sets of the same dimension");
  SetComparison result;
  const std::optional<Polytope> both = pairs(before, after, {});
  result.compatible = both.has_value();
  for (std::size_t j = 0; j < p; ++j) {
    ParameterChange change;
    change.before = before.box.sides[j];
    change.after = after.box.sides[j];
    change.change = change.after - change.before;
    if (both) {
      change.together = both->hull().sides[j];
    }
    result.parameters.push_back(std::move(change));
  }
  double tried = 0.0;
  for (std::size_t size = 1; !both && size <= p && result.explanations.empty(); ++size) {
    tried += subsets(p, size);
    if (tried > static_cast<double>(most_sets)) {
      break;
    }
    result.sought = size;
    for_subsets(p, size, [&](const std::vector<std::size_t>& changed) {
      const std::optional<Polytope> set = pairs(before, after, changed);
      if (!set) {
        return;
      }
      ChangeExplanation explanation{changed, {}};
      for (std::size_t k = 0; k < size; ++k) {
        explanation.change.push_back(
            intersection(change_in(*set, changed[k], p + k), result.parameters[changed[k]].change));
      }
      result.explanations.push_back(std::move(explanation));
    });
  }
  return result;
}

std::vector<const SetComparison*> ModelComparison::telling() const {
  std::vector<const SetComparison*> out;
  for (const bool at_risk : {false, true}) {
    for (const SetComparison& each : sets) {
      if (!each.compatible && each.risk.has_value() == at_risk) {
        out.push_back(&each);
      }
    }
  }
  return out;
}

ModelComparison compare_models(const detector::OnlineModel& before, const detector::OnlineModel& after) {
  if (const std::string what = regressor_difference(before.model, after.model); !what.empty()) {
    throw InvalidArgument("models that cannot be compared, since their parameters do not mean the same: different " +
                          what + "; expected two models of one robot file's kind and geometry");
  }
  if (before.robot.effort != after.robot.effort) {
    throw InvalidArgument(
        "models that cannot be compared: their efforts are of different kinds; expected the same effort.kind in both "
        "robot files");
  }
  ModelComparison result;
  const auto compare = [&](const ParameterSet& x, const ParameterSet& y, core::Warrant warrant,
                           std::optional<double> risk) -> SetComparison& {
    SetComparison sets = compare_sets(x, y);
    sets.risk = risk;
    sets.warrant = warrant;
    return result.sets.emplace_back(std::move(sets));
  };
  const auto scales = physical_scales(before.robot, before.model), others = physical_scales(after.robot, after.model);
  const auto same = [](const PhysicalScale& x, const PhysicalScale& y) {
    return x.scale == y.scale && x.offset == y.offset;
  };
  const auto name = [&](SetComparison& sets) {
    for (std::size_t j = 0; j < before.model.p(); ++j) {
      const model::Parameter& parameter = before.model.parameters[j];
      sets.parameters[j].name = sets.parameters[j].quantity = parameter.name;
      sets.parameters[j].unit = parameter_unit(before.robot, parameter);
    }
    if (scales && others && std::ranges::equal(*scales, *others, same)) {
      in_physical_words(sets, before.model, *scales);
    }
  };
  name(compare({before.facets, before.box}, {after.facets, after.box}, core::weaker(before.warrant, after.warrant),
               std::nullopt));
  if (before.at_risk && after.at_risk) {
    name(compare({before.at_risk->facets, before.at_risk->box}, {after.at_risk->facets, after.at_risk->box},
                 core::weaker(before.at_risk->warrant, after.at_risk->warrant),
                 core::round_up(before.at_risk->risk + after.at_risk->risk)));
  }
  if (!before.kinematic || !after.kinematic ||
      before.kinematic->measurement.parameters() != after.kinematic->measurement.parameters()) {
    return result;
  }
  const detector::KinematicModel &x = *before.kinematic, &y = *after.kinematic;
  const std::vector<std::string> names = x.measurement.parameters(), units = x.measurement.parameter_units();
  const auto name_wheels = [&](SetComparison& sets) {
    sets.wheels = true;
    for (std::size_t j = 0; j < names.size(); ++j) {
      sets.parameters[j].name = sets.parameters[j].quantity = names[j];
      sets.parameters[j].unit = units[j];
    }
  };
  name_wheels(compare({x.facets, x.box}, {y.facets, y.box}, core::weaker(x.warrant, y.warrant), std::nullopt));
  if (x.at_risk && y.at_risk) {
    name_wheels(compare({x.at_risk->facets, x.at_risk->box}, {y.at_risk->facets, y.at_risk->box},
                        core::weaker(x.at_risk->warrant, y.at_risk->warrant),
                        core::round_up(x.at_risk->risk + y.at_risk->risk)));
  }
  return result;
}

}  // namespace wheelwright::commission
