// SPDX-License-Identifier: Apache-2.0
#include "commission/model_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
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

// The parameters of the sets, `entries` of θ_L, as the physical quantities behind them.
void in_physical_words(SetComparison& sets, const Model& model, const std::vector<PhysicalScale>& all_scales,
                       const std::vector<std::size_t>& entries) {
  for (std::size_t j = 0; j < entries.size(); ++j) {
    const PhysicalScale& scale = all_scales[entries[j]];
    const auto at = [&](Interval theta, bool moved) {
      const Interval scaled = core::point(scale.scale) * theta;
      return moved ? scaled - core::point(scale.offset) : scaled;
    };
    ParameterChange& parameter = sets.parameters[j];
    parameter.quantity = model.parameters[entries[j]].physical;
    parameter.unit = model.parameters[entries[j]].physical_unit;
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

// The entries of θ of two models in one order: those that both have, then those of one alone.
struct CommonOrder {
  std::vector<std::size_t> before, after;  ///< place of each entry of a model's θ
  std::size_t common = 0, all = 0;
  std::vector<std::size_t> of_before;  ///< entry of the first model's θ at each common place
  std::vector<std::size_t> of_after;   ///< likewise of the second
};

CommonOrder common_order(const Model& before, const Model& after) {
  CommonOrder order;
  order.before.assign(before.p(), before.p());
  order.after.assign(after.p(), after.p());
  for (std::size_t j = 0; j < before.p(); ++j) {
    const auto other = std::ranges::find(after.parameters, before.parameters[j].name, &model::Parameter::name);
    if (other == after.parameters.end()) {
      continue;
    }
    const auto k = static_cast<std::size_t>(other - after.parameters.begin());
    order.of_before.push_back(j);
    order.of_after.push_back(k);
    order.before[j] = order.after[k] = order.common++;
  }
  order.all = order.common;
  for (std::size_t j = 0; j < before.p(); ++j) {
    order.before[j] = order.before[j] == before.p() ? order.all++ : order.before[j];
  }
  for (std::size_t k = 0; k < after.p(); ++k) {
    order.after[k] = order.after[k] == after.p() ? order.all++ : order.after[k];
  }
  return order;
}

// A set of one model in the order of both. What only the other has is anything in that one's box.
struct LaidSet {
  std::vector<HalfSpace> facets;
  Box box;
};

LaidSet laid(const ParameterSet& set, const std::vector<std::size_t>& places, const ParameterSet& other,
             const std::vector<std::size_t>& other_places, std::size_t all) {
  LaidSet out;
  out.box.sides.resize(all);
  for (std::size_t k = 0; k < other_places.size(); ++k) {
    out.box.sides[other_places[k]] = other.box.sides[k];
  }
  for (std::size_t j = 0; j < places.size(); ++j) {
    out.box.sides[places[j]] = set.box.sides[j];
  }
  for (const HalfSpace& facet : set.facets) {
    HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(all)), facet.b, facet.origin};
    for (std::size_t j = 0; j < places.size(); ++j) {
      row.a[static_cast<Eigen::Index>(places[j])] = facet.a[static_cast<Eigen::Index>(j)];
    }
    out.facets.push_back(std::move(row));
  }
  return out;
}

std::string regressor_difference(const Model& before, const Model& after, const CommonOrder& order) {
  if (before.name != after.name) {
    return fmt::format("kinds of robot: {} and {}", before.name, after.name);
  }
  if (order.common == 0) {
    return "parameters";
  }
  const auto terms_of = [&](const Model& model, const std::vector<std::size_t>& places) {
    std::vector<Term> terms;
    for (const Term& term : model.terms) {
      if (places[term.parameter] < order.common) {
        terms.push_back(term);
        terms.back().parameter = places[term.parameter];
      }
    }
    return terms;
  };
  const auto same_term = [](const Term& x, const Term& y) {
    return x.output == y.output && x.parameter == y.parameter && x.kind == y.kind && x.coordinate == y.coordinate &&
           x.scale == y.scale && x.function == y.function;
  };
  bool same = before.motion == after.motion && before.input == after.input &&
              std::ranges::equal(terms_of(before, order.before), terms_of(after, order.after), same_term);
  for (std::size_t c = 0; c < order.common; ++c) {
    same =
        same && before.parameters[order.of_before[c]].per_physical == after.parameters[order.of_after[c]].per_physical;
  }
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

double GuessChange::standard_errors() const {
  return (after.value - before.value) / std::hypot(before.standard_error, after.standard_error);
}

std::vector<GuessChange> compare_guesses(const std::vector<BestGuess>& before, const std::vector<BestGuess>& after) {
  std::vector<GuessChange> out;
  for (const BestGuess& first : before) {
    const auto second = std::ranges::find_if(
        after, [&](const BestGuess& each) { return each.quantity == first.quantity && each.unit == first.unit; });
    if (second != after.end() && first.standard_error > 0.0 && second->standard_error > 0.0) {
      out.push_back({first, *second});
    }
  }
  return out;
}

std::vector<GuessChange> ModelComparison::likely() const {
  std::vector<GuessChange> out;
  std::ranges::copy_if(guesses, std::back_inserter(out), &GuessChange::told);
  std::ranges::stable_sort(out, std::ranges::greater{},
                           [](const GuessChange& each) { return std::abs(each.standard_errors()); });
  return out;
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

ModelComparison compare_models(const detector::OnlineModel& before, const detector::OnlineModel& after,
                               const std::vector<BestGuess>& guesses_before,
                               const std::vector<BestGuess>& guesses_after) {
  const CommonOrder order = common_order(before.model, after.model);
  if (const std::string what = regressor_difference(before.model, after.model, order); !what.empty()) {
    throw InvalidArgument("models that cannot be compared, since their parameters do not mean the same: different " +
                          what + "; expected two models of one robot file's kind and geometry");
  }
  if (before.robot.effort != after.robot.effort) {
    throw InvalidArgument(
        "models that cannot be compared: their efforts are of different kinds; expected the same effort.kind in both "
        "robot files");
  }
  ModelComparison result;
  for (std::size_t j = 0; j < before.model.p(); ++j) {
    if (order.before[j] >= order.common) {
      result.only_before.push_back(before.model.parameters[j].name);
    }
  }
  for (std::size_t k = 0; k < after.model.p(); ++k) {
    if (order.after[k] >= order.common) {
      result.only_after.push_back(after.model.parameters[k].name);
    }
  }
  // With another set of parameters a best guess is of another model, whatever the robot did.
  if (result.only_before.empty() && result.only_after.empty()) {
    result.guesses = compare_guesses(guesses_before, guesses_after);
  }
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
    bool same_scales = scales && others;
    for (std::size_t c = 0; c < order.common; ++c) {
      const model::Parameter& parameter = before.model.parameters[order.of_before[c]];
      sets.parameters[c].name = sets.parameters[c].quantity = parameter.name;
      sets.parameters[c].unit = parameter_unit(before.robot, parameter);
      same_scales = same_scales && same((*scales)[order.of_before[c]], (*others)[order.of_after[c]]);
    }
    if (same_scales) {
      in_physical_words(sets, before.model, *scales, order.of_before);
    }
  };
  // What only one has explains no change: it is free in the other, whatever its value.
  const auto of_theta = [&](const ParameterSet& x, const ParameterSet& y, core::Warrant warrant,
                            std::optional<double> risk) {
    const LaidSet first = laid(x, order.before, y, order.after, order.all);
    const LaidSet second = laid(y, order.after, x, order.before, order.all);
    SetComparison& sets = compare({first.facets, first.box}, {second.facets, second.box}, warrant, risk);
    sets.parameters.resize(order.common);
    std::erase_if(sets.explanations, [&](const ChangeExplanation& explanation) {
      return std::ranges::any_of(explanation.parameters, [&](std::size_t j) { return j >= order.common; });
    });
    name(sets);
  };
  of_theta({before.facets, before.box}, {after.facets, after.box}, core::weaker(before.warrant, after.warrant),
           std::nullopt);
  if (before.at_risk && after.at_risk) {
    of_theta({before.at_risk->facets, before.at_risk->box}, {after.at_risk->facets, after.at_risk->box},
             core::weaker(before.at_risk->warrant, after.at_risk->warrant),
             core::round_up(before.at_risk->risk + after.at_risk->risk));
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
