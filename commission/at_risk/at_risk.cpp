// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/at_risk.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "commission/assumptions.hpp"
#include "commission/at_risk/serial_correlation.hpp"
#include "commission/at_risk/sum_spread.hpp"
#include "commission/error_estimate.hpp"
#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "core/for_all.hpp"

namespace wheelwright::commission {
namespace {

// Factor on the sums of a log's errors below which a violation would say nothing.
constexpr double kToldSums = 10.0;

// What a log makes of one assumption on its errors.
struct Attempt {
  RiskSet set;
  std::optional<detector::RiskModel> model;  // where there is a set
  detector::SumState worst;                  // the sum that stands farthest out at the test's risk
  double utilisation = 0.0;                  // its |value|/threshold
  double spread = 0.0;                       // of sums over a scale, in units of what errors can do: see SumSpread
  std::size_t widest = 0;                    // that scale
};

// `risk` each: a sum too large, and too many large ones.
void look_at_sums(LogSource& log, const OnlineModel& model, double risk, double seconds, Attempt& attempt) {
  const detector::ScaleDetectorOptions options{.false_alarms = risk / std::max(seconds, 1.0)};
  detector::ScaleDetector detector(model, options);
  SumSpread spread(model.at_risk->usual, options.checks, risk);
  detector::walk_log(log, detector, [&](double, bool, bool looked) {
    if (!looked) {
      return;
    }
    const Eigen::MatrixXd variances = detector.variances();
    for (const detector::SumState& state : detector.looks()) {
      spread.add(state, variances);
      if (std::abs(state.value) > attempt.utilisation * state.threshold) {
        attempt.utilisation = std::abs(state.value) / state.threshold;
        attempt.worst = state;
      }
    }
  });
  std::tie(attempt.spread, attempt.widest) = spread.largest();
}

RiskSet set_with(LogSource& log, const Commissioning& result, const filter::ErrorClasses& classes,
                 const AtRiskOptions& options) {
  return risk_set(log, result.model.model, result.model.measurement, result.row_errors, classes,
                  *result.feasible.polytope, options.set);
}

Attempt attempt_with(LogSource& log, const Commissioning& result, const filter::ErrorClasses& classes, RiskSet set,
                     const AtRiskOptions& options) {
  Attempt attempt;
  attempt.set = std::move(set);
  if (!attempt.set.set) {
    return attempt;
  }
  const bounds::Polytope& polytope = *attempt.set.set;
  detector::RiskModel risk{
      .risk = options.set.risk, .errors = classes, .facets = polytope.facets(), .box = polytope.hull()};
  risk.scales = options.scales;
  risk.delay = options.set.delays[std::min<std::size_t>(1, options.set.delays.size() - 1)];
  OnlineModel model = result.model;
  model.at_risk = std::move(risk);
  model.at_risk->usual = detector::usual_variances(log, model);
  look_at_sums(log, model, options.test_risk / 3.0, result.survey.seconds, attempt);
  attempt.model = std::move(model.at_risk);
  return attempt;
}

// The least bias, in steps of √2 of the deviation, with which the log's sums use no more than half of what such errors
// could make of them; with a `reason` and no model where even a bias as large as the deviation is not enough.
struct Estimate {
  Attempt attempt;
  std::string reason;
};
Estimate least_bias(LogSource& log, const Commissioning& result, const AtRiskOptions& options) {
  constexpr double kHalf = 0.5;
  constexpr int kSteps = 20;
  std::optional<filter::ErrorClasses> classes = estimated_classes(log, result.model);
  Estimate best;
  if (!classes) {
    best.reason =
        motion_error(result.model.robot, result.model.measurement)
            ? "the log is too short to show how its errors average out"
            : "the error of the motion column is not known: `noise: {wheel_speed: ...}` or `encoder_counts_per_turn` "
              "in the robot file would tell it";
    return best;
  }
  int none = -1, enough = kSteps + 1;  // the number of a bias that is too small, and of one that is not
  while (enough - none > 1) {
    const int step = (none + enough) / 2;
    classes->effort.bias = classes->effort.deviation * std::exp2(0.5 * (step - kSteps));
    Attempt attempt = attempt_with(log, result, *classes, set_with(log, result, *classes, options), options);
    if (attempt.model && attempt.utilisation <= kHalf && attempt.spread <= 1.0) {
      enough = step;
      best.attempt = std::move(attempt);
    } else {
      none = step;
      if (enough > kSteps) {
        best.reason = attempt.model ? fmt::format(
                                          "over {:g} s the model leaves more than errors with a bias of {:.2g} "
                                          "would, as where it lacks an effect (`gap` looks for it)",
                                          options.scales[attempt.worst.scale], classes->effort.bias)
                                    : attempt.set.reason;
      }
    }
  }
  return best;
}

core::Assumption assumption_of(const filter::ErrorClasses& classes, const std::string& unit) {
  const filter::ErrorClass& effort = classes.effort;
  const std::string since = effort.correlation > 0.0
                                ? fmt::format("Whatever happened up to {:g} s before a sample", effort.correlation)
                                : "Whatever happened before a sample";
  return {.id = kNoiseAverages,
          .statement = fmt::format(
              "{}, the mean error of its effort is {}{}.", since,
              effort.bias > 0.0 ? fmt::format("at most {:.3g} {}", effort.bias, unit) : "zero",
              effort.deviation < effort.bound
                  ? fmt::format(", the root of its mean square about it at most {:.3g} {}", effort.deviation, unit)
                  : ""),
          .declared_by = "noise.effort.bias",
          .test = "sums of what the model leaves, over all scales, are as small as such errors make them",
          .verdict = core::AssumptionVerdict::holds,
          .detail = {}};
}

}  // namespace

std::optional<RiskSet> declared_risk_set(LogSource& log, const Commissioning& result, const AtRiskOptions& options) {
  if (!result.has_model() || !result.feasible.polytope || interval_warrant(result) != core::Warrant::guaranteed) {
    return std::nullopt;
  }
  const auto classes = error_classes(result.model.robot, result.model.measurement);
  return classes && classes->average() ? std::optional(set_with(log, result, *classes, options)) : std::nullopt;
}

void learn_at_risk(LogSource& log, Commissioning& result, const AtRiskOptions& options, std::optional<RiskSet> set) {
  OnlineModel& model = result.model;
  if (!result.has_model() || !result.feasible.polytope) {
    return;
  }
  const std::string unit = output_unit(model.robot, model.model.output_units.front());
  std::optional<filter::ErrorClasses> classes = error_classes(model.robot, model.measurement);
  core::Assumption assumption;
  if (classes) {
    if (!classes->average() || interval_warrant(result) != core::Warrant::guaranteed) {
      return;
    }
    assumption = assumption_of(*classes, unit);
    assumption.test += ", and it is not like what it left before";
    RiskSet asked = set ? std::move(*set) : set_with(log, result, *classes, options);
    SerialCorrelation serial;
    Attempt attempt;
    const auto look_back = [&](LogSource& walk) {
      serial = serial_correlation(walk, {model.model, model.measurement, result.row_errors}, *classes, *asked.set,
                                  result.survey.seconds, options.test_risk / 3.0);
    };
    const std::unique_ptr<LogSource> other = options.threads > 1 && asked.set ? log.another_walk() : nullptr;
    core::both(
        other ? options.threads : 1, [&] { attempt = attempt_with(log, result, *classes, asked, options); },
        [&] {
          if (other) {
            look_back(*other);
          } else if (attempt.model && attempt.utilisation <= 1.0 && attempt.spread <= 1.0) {
            look_back(log);
          }
        });
    const auto contradicted = [&](std::string detail) {
      assumption.verdict = core::AssumptionVerdict::fails;
      assumption.detail = std::move(detail);
      result.notes.push_back(fmt::format(
          "nothing is said at a stated risk, and nothing is called guaranteed: {}; a larger `bias` or `correlation` of "
          "`noise: effort` in the robot file would allow for it",
          assumption.detail));
      attempt.set.set.reset();
    };
    if (!attempt.model) {
      if (!attempt.set.facets.empty()) {
        contradicted(attempt.set.reason);
      } else {
        assumption.verdict = core::AssumptionVerdict::not_tested;
        assumption.detail = attempt.set.reason;
      }
    } else if (attempt.utilisation > 1.0) {
      contradicted(fmt::format("over {:g} s the model leaves {:.2g} times as much ({}) as such errors can",
                               attempt.model->scales[attempt.worst.scale], attempt.utilisation,
                               detector::sum_weights(model.model)[attempt.worst.weight].name));
    } else if (attempt.spread > 1.0) {
      contradicted(fmt::format("over {:g} s what the model leaves spreads wider, time and again, than such errors can",
                               attempt.model->scales[attempt.widest]));
    } else if (serial.excess > 1.0) {
      contradicted(fmt::format(
          "what the model leaves{} is like what it left {:.2g} s before, {:.2g} times as much as such errors can be",
          model.model.joints.size() > 1 ? " of " + model.model.joints[serial.joint].torque : std::string(),
          serial.delay, serial.excess));
    } else {
      const double used = std::max({attempt.utilisation, attempt.spread, serial.excess});
      assumption.detail =
          fmt::format("sums of what the model leaves use at most {:.0f} % of what such errors can make", 100.0 * used);
      assumption.verdict =
          kToldSums * used >= 1.0 ? core::AssumptionVerdict::holds : core::AssumptionVerdict::not_tested;
      model.at_risk = std::move(attempt.model);
    }
    result.at_risk = std::move(attempt.set);
  } else {
    if (!options.estimate || model.robot.noise.effort.value) {
      return;
    }
    Estimate estimate = least_bias(log, result, options);
    Attempt& attempt = estimate.attempt;
    assumption = assumption_of(attempt.model ? attempt.model->errors : filter::ErrorClasses{}, unit);
    if (attempt.model) {
      assumption.declared_by = "estimated from this log";
      attempt.model->warrant = core::Warrant::extrapolated;
      attempt.set.warrant = core::Warrant::extrapolated;
      result.at_risk = std::move(attempt.set);
      model.at_risk = std::move(attempt.model);
    } else {
      assumption.verdict = core::AssumptionVerdict::not_tested;
      assumption.detail = estimate.reason;
    }
  }
  if (model.at_risk && options.reach) {
    result.reach = risk_reach(log, model, {.threads = options.threads});
  }
  result.assumptions.push_back(assumption);
  model.assumptions = result.assumptions;
  if (assumption.verdict == core::AssumptionVerdict::fails) {
    withdraw_what_averages_would_hide(result, assumption.detail);
  }
}

}  // namespace wheelwright::commission
