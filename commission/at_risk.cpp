// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/at_risk.hpp>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/commission/assumptions.hpp>
#include <wheelwright/commission/physical.hpp>

namespace wheelwright::commission {
namespace {

// The sum that stands farthest outside, in units of its threshold.
std::optional<detector::SumState> farthest_outside(LogSource& log, const OnlineModel& model, double false_alarms) {
  detector::ScaleDetector detector(model, {.false_alarms = false_alarms});
  const std::vector<std::size_t> pick = core::positions_of(log, model.measurement.columns());
  std::vector<double> sample(pick.size());
  std::optional<detector::SumState> worst;
  double most = 0.0;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    if (starts) {
      detector.restart();
    }
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = block.columns[pick[c]][k];
    }
    detector.step(block.t[k], sample);
    for (const detector::SumState& state : detector.looks()) {
      if (state.excess > most * state.threshold) {
        most = state.excess / state.threshold;
        worst = state;
      }
    }
  });
  return worst;
}

core::Assumption assumption_of(const filter::ErrorClasses& classes, const std::string& unit) {
  const filter::ErrorClass& effort = classes.effort;
  const std::string since = effort.correlation > 0.0
                                ? fmt::format("Whatever happened up to {:g} s before a sample", effort.correlation)
                                : "Whatever happened before a sample";
  return {.id = kNoiseAverages,
          .statement = fmt::format("{}, the mean error of its effort is {}.", since,
                                   effort.bias > 0.0 ? fmt::format("at most {:g} {}", effort.bias, unit) : "zero"),
          .declared_by = "noise.effort.bias",
          .test = "sums of what the model leaves, over all scales, are as small as such errors make them",
          .verdict = core::AssumptionVerdict::holds,
          .detail = {}};
}

}  // namespace

void learn_at_risk(LogSource& log, Commissioning& result, const AtRiskOptions& options) {
  OnlineModel& model = result.model;
  const std::optional<filter::ErrorClasses> classes = error_classes(model.robot, model.measurement);
  if (!classes || !result.has_model() || !result.feasible.polytope || !classes->average() ||
      interval_warrant(result) != core::Warrant::guaranteed) {
    return;
  }
  core::Assumption assumption = assumption_of(*classes, output_unit(model.robot, model.model.output_units.front()));
  const auto contradicted = [&](std::string detail) {
    assumption.verdict = core::AssumptionVerdict::fails;
    assumption.detail = std::move(detail);
    result.notes.push_back(fmt::format(
        "nothing is said at a stated risk, the worst case stands alone: {}; a larger `bias` or `correlation` of "
        "`noise: effort` in the robot file would allow for it",
        assumption.detail));
    result.at_risk->set.reset();
    model.at_risk.reset();
  };
  result.at_risk = risk_set(log, model.model, model.measurement, result.row_errors, *classes, *result.feasible.polytope,
                            options.set);
  if (!result.at_risk->set) {
    if (!result.at_risk->facets.empty()) {
      contradicted(result.at_risk->reason);
    } else {
      assumption.verdict = core::AssumptionVerdict::not_tested;
      assumption.detail = result.at_risk->reason;
    }
  } else {
    const bounds::Polytope& set = *result.at_risk->set;
    detector::RiskModel risk{.risk = options.set.risk, .errors = *classes, .facets = set.facets(), .box = set.hull()};
    risk.scales = options.scales;
    risk.delay = options.set.delays[std::min<std::size_t>(1, options.set.delays.size() - 1)];
    model.at_risk = std::move(risk);
    model.at_risk->usual = detector::usual_variances(log, model);
    const double seconds = std::max(result.survey.seconds, 1.0);
    if (const auto worst = farthest_outside(log, model, options.test_risk / seconds)) {
      const detector::SumWeight weight = detector::sum_weights(model.model)[worst->weight];
      contradicted(fmt::format("over {:g} s the model leaves {:.2g} times as much ({}) as such errors can",
                               model.at_risk->scales[worst->scale], 1.0 + worst->excess / worst->threshold,
                               weight.name));
    }
  }
  if (model.at_risk) {
    result.reach = risk_reach(log, model);
  }
  result.assumptions.push_back(assumption);
  model.assumptions = result.assumptions;
}

}  // namespace wheelwright::commission
