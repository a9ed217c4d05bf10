// SPDX-License-Identifier: Apache-2.0
#include "commission/assumptions.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/commission.hpp"
#include "commission/contradiction_search.hpp"
#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "core/limits.hpp"

namespace wheelwright::commission {

using core::Assumption;
using core::AssumptionVerdict;
using core::Warrant;

namespace {

constexpr const char* kSpeedFilter = "speed_filter";

constexpr double kMostTurning = 1.0;  // on the spot over driving: a mirrored wheel turns the ratio round
// Violations that a test would not have shown below these say nothing: factor on the errors of a log, s and steps of a
// shift, shares of a length and of the efforts' gain.
constexpr double kToldErrors = 5.0, kToldShift = 0.01, kToldSteps = 2.0, kToldLength = 0.05, kToldGain = 0.25;

constexpr const char* kRowsExplained =
    "some parameters explain every row within its bound, and none of the held-out rows "
    "leaves the threshold that was made without it";

// What the rows themselves say of model and noise, taken together.
struct RowsVerdict {
  AssumptionVerdict verdict = AssumptionVerdict::not_tested;
  std::string detail;
};

bool learnt(const OutputNoise& noise) { return noise.origin == core::NoiseOrigin::estimated; }

RowsVerdict rows_verdict(const Commissioning& r) {
  if (r.status == Commissioning::Status::empty) {
    return {AssumptionVerdict::fails,
            fmt::format("no parameters explain the log: one of the assumptions fails, or the noise is "
                        "{:.3g} times as large",
                        r.minimax)};
  }
  std::size_t outside = 0, instants = 0;
  for (const OutputValidation& v : r.validation) {
    outside += v.outside;
    instants = std::max(instants, v.instants);
  }
  if (outside > 0) {
    return {AssumptionVerdict::fails,
            fmt::format("{} held-out rows of {} instants leave their threshold: one of the assumptions "
                        "fails",
                        outside, instants)};
  }
  const auto doubt = std::ranges::find_if(r.contradictions, [](const LogContradiction& c) {
    using Kind = LogContradiction::Kind;
    const bool of_its_own = c.kind == Kind::effort_timing || c.kind == Kind::halves_disagree ||
                            c.kind == Kind::effort_offset || c.kind == Kind::friction_shape;
    return c.demotes && !of_its_own;
  });
  if (doubt != r.contradictions.end()) {
    return {AssumptionVerdict::fails, doubt->sentence};
  }
  if (instants == 0 || std::ranges::any_of(r.noise, learnt)) {
    return {AssumptionVerdict::not_tested, instants == 0
                                               ? "no row was held out"
                                               : "the noise bounds were learnt from the rows that they would have to "
                                                 "judge"};
  }
  double used = 0.0;
  for (const OutputValidation& v : r.validation) {
    used = std::max(used, v.utilisation);
  }
  const std::string none = fmt::format("{} instants held out, none outside", instants);
  if (!(kToldErrors * used >= 1.0)) {
    return {AssumptionVerdict::not_tested,
            none + (used > 0.0 ? fmt::format(": errors {:.2g} times as large as those of this log would be inside, too",
                                             1.0 / used)
                               : std::string())};
  }
  return {AssumptionVerdict::holds,
          fmt::format("{}; errors {:.2g} times as large as those of this log would have been", none, 1.0 / used)};
}

// What the rows say of a premise together with what statistics say of it.
RowsVerdict premise_verdict(const RowsVerdict& rows, const PremiseVerdict& premise) {
  return rows.verdict == AssumptionVerdict::fails ? rows : RowsVerdict{premise.verdict, premise.detail};
}

Assumption assumed_hold(const Robot& robot) {
  Assumption a{.id = "effort_hold", .declared_by = "effort.hold, effort.changes"};
  a.statement = robot.hold == Hold::first_order
                    ? (robot.effort_changes == model::EffortChanges::at_samples
                           ? "Efforts are measured: straight between two stamps."
                           : "Efforts are measured: between two stamps somewhere from straight to a parabola through "
                             "the stamps about them.")
                : robot.effort_changes == model::EffortChanges::at_samples
                    ? "Efforts are commands: each acts from its stamp to the stamp of the next."
                    : "Efforts are commands: each acts until the next replaces it, at an unknown moment between their "
                      "stamps.";
  return a;
}

Assumption assumed_delay(const Commissioning& r) {
  const Interval d = r.model.robot.effort_delay;
  Assumption a{.id = "effort_delay",
               .declared_by = "effort.delay",
               .test = "no constant shift beyond the declared one explains the log better"};
  const auto latency =
      std::ranges::find(r.contradictions, LogContradiction::Kind::effort_timing, &LogContradiction::kind);
  if (latency != r.contradictions.end()) {
    a.verdict = AssumptionVerdict::fails;
    a.detail = latency->sentence;
  } else if (r.effort_shift) {
    const bool told = r.effort_shift_told <= std::max(kToldShift, kToldSteps * r.survey.median_step);
    const double beyond =
        EffortTiming{.delay = *r.effort_shift, .allowed = allowed_shift(r.model.measurement, r.survey.median_step)}
            .beyond();
    const bool within = beyond <= kLeastShift * r.survey.median_step;
    a.verdict = told && within ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
    a.detail = fmt::format("the best shift is {:.2g} s{}; one of {:.2g} s beyond what is declared would have shown",
                           *r.effort_shift, within ? "" : fmt::format(", {:.2g} s beyond what is declared", beyond),
                           r.effort_shift_told);
  } else {
    a.detail = "the log tells no shift";
  }
  a.statement = d.lower == 0.0 && d.upper == 0.0 ? "Efforts are neither late nor early against the motion."
                : d.lower == d.upper
                    ? fmt::format("Efforts are late against the motion by {:g} s, all by the same.", d.lower)
                    : fmt::format(
                          "Efforts are late against the motion by something between {:g} and {:g} s, all by "
                          "the same.",
                          d.lower, d.upper);
  return a;
}

Assumption assumed_smoothing(const Interval& time) {
  return {
      .id = "effort_smoothing",
      .statement = fmt::format("Efforts passed through a low-pass filter of {:g} to {:g} s, row by row, before they "
                               "were logged, and the motion did not.",
                               time.lower, time.upper),
      .declared_by = "effort.smoothing"};
}

Assumption assumed_clocks(const Commissioning& r) {
  Assumption a{.id = "clocks",
               .statement = "Stamps are those of the instants of measurement, of motion and effort by one clock.",
               .declared_by = {}};
  if (const auto& clock = r.model.robot.clock; clock && clock->step > 0.0) {
    a.declared_by = "clock";
    a.statement = fmt::format(
        "Samples of motion and effort are even, {:.9g} s apart to a share of {:.1g}, whatever their stamps say.",
        clock->step, clock->drift);
  }
  if (r.model.measurement.motion == MotionKind::angle) {
    a.test = "the angles are no smoother over row numbers than over their stamps";
  }
  const auto scatter =
      std::ranges::find(r.contradictions, LogContradiction::Kind::stamps_scatter, &LogContradiction::kind);
  if (scatter != r.contradictions.end()) {
    a.verdict = AssumptionVerdict::fails;
    a.detail = scatter->sentence;
  }
  return a;
}

Assumption assumed_speeds(const Measurement& m) {
  Assumption a{.id = "speed_kind", .declared_by = "speed_source, encoder_counts_per_turn"};
  switch (m.motion) {
    case MotionKind::angle: a.statement = "Wheel angles are those at their stamps."; break;
    case MotionKind::mean_speed:
      a.statement = "Wheel speeds are differences of encoder counts, stamped in the middle of their interval.";
      a.detail = m.count > 0.0 ? "the speeds are whole multiples of one count a step" : "taken as the robot file says";
      break;
    case MotionKind::speed: a.statement = "Wheel speeds are samples of the speed at their stamps."; break;
  }
  return a;
}

// A filter commutes with what is linear: not with the sign of a speed, nor with products. Detail: why nothing that
// stands on it is guaranteed.
Assumption assumed_filter(const Commissioning& r, const model::SpeedFilter& filter) {
  Assumption a{.id = kSpeedFilter,
               .statement = fmt::format("Wheel speeds passed through a low-pass filter ({}) of {:g} to {:g} s before "
                                        "they were logged, and efforts did not.",
                                        to_string(filter.kind), filter.time.lower, filter.time.upper),
               .declared_by = "speed_filter"};
  const bool linear =
      std::ranges::none_of(r.model.model.terms, [](const Term& term) { return term.kind == Term::Kind::function; });
  const bool exact =
      filter.kind != model::SpeedFilterKind::lag &&
      (r.model.robot.hold == Hold::first_order || r.model.robot.effort_changes == model::EffortChanges::at_samples);
  if (!linear) {
    a.detail =
        "efforts that pass through the same filter are those of filtered speeds only where the model is linear "
        "in speeds, and this one is not";
  } else if (!exact) {
    a.detail = "what the efforts do between samples goes through the filter unseen";
  } else if (filter.found) {
    a.detail = "time constant and kind of the filter were learnt from the log, and are not declared";
  }
  return a;
}

Assumption assumed_geometry(const Commissioning& r) {
  Assumption a{.id = "geometry",
               .statement = "Wheel radius and track width are those of the robot file, the same for both wheels.",
               .declared_by = "wheel_radius, track_width",
               .test = "the radii and yaw gains that pose or gyro allow include the robot file's"};
  const KinematicCommissioning& k = r.kinematic;
  if (k.status != KinematicCommissioning::Status::done) {
    a.detail = "pose or gyro do not show all radii and yaw gains";
    return a;
  }
  bool far = false;  // by more than the width of an interval, which no learnt bound makes doubtful
  for (const KinematicParameter& p : k.parameters) {
    if (p.name != "gyro_bias" && !(p.lower <= p.nominal && p.nominal <= p.upper)) {
      a.detail += fmt::format("{}{} in [{:.5g}, {:.5g}], {:.5g} in the robot file", a.detail.empty() ? "" : "; ",
                              p.name, p.lower, p.upper, p.nominal);
      far = far || std::max(p.lower - p.nominal, p.nominal - p.upper) > p.upper - p.lower;
    }
  }
  const bool bounds_learnt = std::ranges::any_of(k.noise, learnt);
  double open = 0.0;  // the largest half width
  for (const KinematicParameter& p : k.parameters) {
    if (p.name != "gyro_bias" && p.nominal != 0.0) {
      open = std::max(open, 0.5 * (p.upper - p.lower) / std::abs(p.nominal));
    }
  }
  if (a.detail.empty() && !bounds_learnt) {
    a.detail = fmt::format("each is told to ± {:.2g} %", 100.0 * open);
    a.verdict = open <= kToldLength ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
    return a;
  }
  a.verdict = a.detail.empty()        ? AssumptionVerdict::holds
              : bounds_learnt && !far ? AssumptionVerdict::not_tested
                                      : AssumptionVerdict::fails;
  if (a.verdict == AssumptionVerdict::fails) {
    a.detail += "; so the radius of a wheel or the track width is another";
  }
  if (bounds_learnt) {
    a.detail += a.detail.empty() ? "against bounds learnt from the log" : ": against bounds learnt from the log";
  }
  return a;
}

void add_noise_bounds(std::vector<Assumption>& list, const Commissioning& r, const RowsVerdict& rows) {
  if (std::ranges::any_of(r.noise, learnt)) {
    list.push_back(
        {.id = "noise_learnt",
         .statement = "Noise and driving to come stay as they were in this log.",
         .declared_by = "noise: estimate",
         .test = "no held-out row leaves its threshold",
         .verdict = rows.verdict == AssumptionVerdict::fails ? AssumptionVerdict::fails : AssumptionVerdict::not_tested,
         .detail =
             rows.verdict == AssumptionVerdict::fails ? rows.detail : "says nothing of driving that is unlike it"});
    return;
  }
  const model::SensorNoise& noise = r.model.robot.noise;
  const auto add = [&](const char* name, const model::NoiseBound& bound, const char* unit) {
    if (bound.value) {
      list.push_back({.id = fmt::format("noise_{}", name),
                      .statement = fmt::format("The error of {} never exceeds {:g} {}.", name, *bound.value, unit),
                      .declared_by = fmt::format("noise.{}", name),
                      .test = kRowsExplained,
                      .verdict = rows.verdict,
                      .detail = rows.detail});
      std::ranges::replace(list.back().statement, '_', ' ');
    }
  };
  const bool from_counts = r.model.measurement.motion == MotionKind::mean_speed && r.model.measurement.count > 0.0;
  if (from_counts || r.model.robot.encoder_counts_per_turn) {
    list.push_back({.id = "noise_encoder",
                    .statement = "The encoder's angle is wrong by half a count at most.",
                    .declared_by = "encoder_counts_per_turn",
                    .test = kRowsExplained,
                    .verdict = rows.verdict,
                    .detail = rows.detail});
  } else {
    add("wheel_speed", noise.wheel_speed, "rad/s");
    add("wheel_angle", noise.wheel_angle, "rad");
  }
  const model::EffortKind kind = r.model.robot.effort;
  add("effort", noise.effort,
      kind == model::EffortKind::torque    ? "N·m"
      : kind == model::EffortKind::current ? "A"
                                           : "V");
  if (r.noise_mode == filter::NoiseMode::statistical) {
    list.push_back({.id = "noise_independent",
                    .statement = "Errors of the sensors are of zero mean and independent from sample to sample.",
                    .declared_by = "--statistical"});
  }
}

// A constant part of the efforts' errors, which averages out of nothing.
void add_effort_offset(std::vector<Assumption>& list, const Commissioning& r) {
  const model::NoiseBound& effort = r.model.robot.noise.effort;
  if (!effort.value || std::ranges::any_of(r.noise, learnt)) {
    return;
  }
  list.push_back({.id = "effort_offset",
                  .statement = fmt::format("No effort is off throughout by more than {:g} {}.",
                                           std::min(effort.bias.value_or(*effort.value), *effort.value),
                                           r.model.model.output_units.empty()
                                               ? std::string()
                                               : output_unit(r.model.robot, r.model.model.output_units.front())),
                  .declared_by = effort.bias ? "noise.effort.bias" : "noise.effort",
                  .test = "each joint's offset beside the model, by least squares, reaches into that",
                  .verdict = r.premises.offset.verdict,
                  .detail = r.premises.offset.detail});
}

// What the rows allow a parameter to be; where a bound is the prior's, how far from θ̂ it would have to be for θ̂ to
// stand outside of the set (LogContradiction::Kind::estimate_outside).
Interval shown_by_efforts(const ParameterResult& p, const Interval& prior, double freedom) {
  Interval shown{p.lower, p.upper};
  const double reach =
      std::max(0.5 * (prior.upper - prior.lower), certain(freedom) * p.standard_error.value_or(core::kInfinity));
  const double middle = p.estimate.value_or(0.0);
  if (p.lower_is_prior) {
    shown.lower = middle - reach;
  }
  if (p.upper_is_prior) {
    shown.upper = middle + reach;
  }
  return shown;
}

// A gain that all efforts have is a factor on all parameters: only a quantity known from outside tells it.
Assumption effort_gain(const Commissioning& r) {
  Assumption a{.id = "effort_gain",
               .statement = "Efforts are what acts at the wheels: torque constant, gear and unit are right.",
               .declared_by = "effort, motor",
               .test = "the mass (inertia) that the efforts show lies within its declared prior"};
  a.detail =
      "a gain of the efforts and all parameters times that gain explain the same log: a weighed mass, declared "
      "as `prior: {mass: [lower, upper]}`, would tell";
  for (std::size_t j = 0; j < r.parameters.size() && j < r.prior.sides.size(); ++j) {
    const ParameterResult& p = r.parameters[j];
    const Interval& prior = r.prior.sides[j];
    const std::string& name = p.parameter.physical;
    if (!p.parameter.moved_mass || !r.model.robot.prior.contains(name) || !(prior.lower > 0.0)) {
      continue;
    }
    if (p.estimate && !prior.contains(*p.estimate)) {
      const bool stands_out = std::ranges::any_of(r.contradictions, [&](const LogContradiction& c) {
        return c.kind == LogContradiction::Kind::estimate_outside && c.subject == name && (c.demotes || c.withdraws);
      });
      const bool outside = r.status == Commissioning::Status::empty || stands_out;
      a.verdict = outside ? AssumptionVerdict::fails : AssumptionVerdict::not_tested;
      a.detail =
          fmt::format("by least squares the {0} is {1:.3g} times the middle of its declared prior, outside of it", name,
                      *p.estimate / (0.5 * (prior.lower + prior.upper)));
      continue;
    }
    const Interval shown = shown_by_efforts(p, prior, r.residuals.freedom);
    if (!(shown.lower > 0.0)) {
      a.detail = fmt::format("efforts and motion say too little of the {} for its declared prior to tell", name);
      continue;
    }
    const double told = std::max(prior.upper / shown.lower, shown.upper / prior.lower) - 1.0;
    a.verdict = told <= kToldGain ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
    a.detail = fmt::format("a gain off by {:.2g} % would have left the prior of {}", 100.0 * told, name);
  }
  return a;
}

Assumption wheel_directions(const Commissioning& r) {
  Assumption a{
      .id = "wheel_directions",
      .statement = "Both wheels count up, and their efforts with them, when the robot drives ahead.",
      .declared_by = "wheel_directions",
      .test =
          "gyro or pose turn as the wheels do; without them, it turns on the spot at most as much as it drives, "
          "unless the robot file says that they were checked"};
  if (r.premises.turning && r.model.robot.wheel_directions_checked) {
    a.detail = "checked, says the robot file";
  } else if (r.premises.turning && *r.premises.turning > kMostTurning) {
    a.verdict = AssumptionVerdict::fails;
    a.detail = fmt::format(
        "as its wheels count, it turns on the spot more than it drives ({:.2g} times as fast), and neither gyro nor "
        "pose tells whether one of them counts backwards; where both were seen to count up, driving ahead, the robot "
        "file says so: `wheel_directions: checked`",
        *r.premises.turning);
  } else if (r.kinematic.status == KinematicCommissioning::Status::done) {
    a.verdict = AssumptionVerdict::holds;
    a.detail = "each wheel turns the robot to the side that it should";
  } else {
    a.detail = "neither gyro nor pose shows it";
  }
  return a;
}

Assumption model_shape(const Commissioning& r, const RowsVerdict& rows) {
  const bool dry = std::ranges::any_of(r.parameters, [](const ParameterResult& p) { return p.parameter.dry_friction; });
  const RowsVerdict said = premise_verdict(rows, r.premises.friction);
  const std::string friction = dry ? "viscous and dry" : "viscous only";
  const std::string effects = r.model.robot.effects.empty() ? "" : ", with the effects that the robot file names";
  return {.id = "friction_shape",
          .statement = fmt::format("A rigid robot on level ground without slip; friction is {}{}.", friction, effects),
          .declared_by = "parameters, effects",
          .test = fmt::format("{}; friction of other shapes, by least squares, is none", kRowsExplained),
          .verdict = said.verdict,
          .detail = said.detail};
}

Assumption constant_parameters(const Commissioning& r, const RowsVerdict& rows) {
  const RowsVerdict said = premise_verdict(rows, r.premises.constant);
  return {.id = "constant_parameters",
          .statement = "Mass, inertia and friction are the same throughout the log, and in driving to come.",
          .declared_by = {},
          .test =
              "no held-out row leaves the threshold that was made without it; parts of the log, by least squares, "
              "give the same",
          .verdict = said.verdict,
          .detail = said.detail};
}

Assumption lost_rows(const Measurement& m, const Survey& survey) {
  const double longest = m.longest_step();
  Assumption a{.id = "lost_rows",
               .statement = "No row is missing between two that are filtered together.",
               .declared_by = {},
               .test = "the shortest steps of the log tell two steps from one"};
  const bool apart = m.motion == MotionKind::mean_speed || m.shortest_step <= 0.0 || 2.0 * m.shortest_step > longest;
  a.verdict = longest > 0.0 && apart ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
  a.detail = fmt::format("a step longer than {:.3g} s is left out; the longest is {:.3g} s, the median {:.3g} s{}",
                         longest, survey.largest_step, survey.median_step,
                         apart ? "" : ", and steps vary so much that one missing row would not show");
  return a;
}

Assumption motion_between_samples(const Commissioning& r) {
  Assumption a{.id = "motion_between_samples", .declared_by = "limits.acceleration", .test = "none"};
  const Measurement& m = r.model.measurement;
  const auto limit = r.model.robot.limits.find("acceleration");
  if (limit == r.model.robot.limits.end()) {
    a.statement = fmt::format(
        "In the commissioning log no wheel accelerates between two samples more than {:g} times as much as its samples "
        "show.",
        kBeyondSamples);
    return a;
  }
  a.statement = fmt::format("No wheel ever accelerates by more than {:g} rad/s² (m/s²).", limit->second);
  a.test = "the samples, less what their errors may add, show no more";
  const auto error = motion_error(r.model.robot, m);
  if (!error || r.survey.median_step <= 0.0) {
    return a;
  }
  double shown = 0.0, noise = 0.0;
  for (std::size_t j = 0; j < r.survey.sharpest_change.size(); ++j) {
    const double hidden = acceleration_by_noise(r.survey, j, m.motion, *error, m.shortest_step);
    shown = std::max(shown, r.survey.sharpest_change[j] - hidden);
    noise = std::max(noise, hidden);
  }
  // A violation shows once it is beyond what errors may hide of it.
  a.verdict = shown > limit->second   ? AssumptionVerdict::fails
              : noise > limit->second ? AssumptionVerdict::not_tested
                                      : AssumptionVerdict::holds;
  a.detail = fmt::format("the samples show {:.3g}, of which their errors may hide {:.3g}", shown, noise);
  return a;
}

Assumption motion_in_driving(const Commissioning& r) {
  const bool bounded = r.model.errors.motion.mobility.size() > 0;
  return {.id = kMotionInDriving,
          .statement = "In driving to come the dynamics bound what motion does between two samples.",
          .declared_by = "limits.acceleration",
          .test = "no robot of the set is without inertia",
          .verdict = bounded ? AssumptionVerdict::holds : AssumptionVerdict::fails,
          .detail = bounded
                        ? ""
                        : "some are: driving was taken to be no livelier than four times the log; accelerate more, or "
                          "declare `limits: {acceleration: …}` or a lower bound of the inertia in `prior:`"};
}

Assumption assumed_prior(const Commissioning& r) {
  Assumption a{.id = "prior",
               .statement = "Every parameter lies in its prior: the robot file's, or the tool's wide default.",
               .declared_by = "prior",
               .test = "no bound is the prior's own"};
  for (const ParameterResult& p : r.parameters) {
    if (p.lower_is_prior || p.upper_is_prior) {
      a.detail += (a.detail.empty() ? "a bound is the prior's for " : ", ") + p.parameter.name;
    }
  }
  const bool bounded = r.status != Commissioning::Status::empty && !r.parameters.empty();
  a.verdict = bounded && a.detail.empty() ? AssumptionVerdict::holds : AssumptionVerdict::not_tested;
  return a;
}

void add_limits(std::vector<Assumption>& list, const Robot& robot) {
  for (const auto& [name, value] : robot.limits) {
    list.push_back(
        {.id = "limit_" + name,
         .statement = fmt::format("The {} of a wheel never exceeds {:g}, between samples either.", name, value),
         .declared_by = "limits." + name});
  }
}

Warrant warrant_of(const OutputNoise& noise, filter::NoiseMode mode, bool contradicted) {
  return contradicted || learnt(noise)            ? Warrant::extrapolated
         : mode == filter::NoiseMode::statistical ? Warrant::statistical
                                                  : Warrant::guaranteed;
}

// Sets the warrant of each output's noise and thresholds; the weakest of them.
Warrant settle_outputs(std::vector<OutputNoise>& noise, std::vector<OutputValidation>& validation,
                       filter::NoiseMode mode, bool contradicted) {
  Warrant all = noise.empty() ? Warrant::extrapolated : Warrant::guaranteed;
  for (OutputNoise& each : noise) {
    each.warrant = warrant_of(each, mode, contradicted);
    all = core::weaker(all, each.warrant);
  }
  for (OutputValidation& each : validation) {
    each.warrant = all;  // a threshold stands on the set, and the set on all outputs
  }
  return all;
}

}  // namespace

std::vector<Assumption> assumptions_of(const Commissioning& result) {
  const RowsVerdict rows = rows_verdict(result);
  const Robot& robot = result.model.robot;
  std::vector<Assumption> list = {assumed_hold(robot), assumed_delay(result), assumed_clocks(result),
                                  assumed_speeds(result.model.measurement)};
  if (robot.effort_smoothing != Interval{}) {
    list.push_back(assumed_smoothing(robot.effort_smoothing));
  }
  if (robot.speed_filter && result.model.measurement.correction.smoothing) {
    list.push_back(assumed_filter(result, *robot.speed_filter));
  }
  add_noise_bounds(list, result, rows);
  add_effort_offset(list, result);
  list.push_back(effort_gain(result));
  list.push_back(model_shape(result, rows));
  list.push_back(constant_parameters(result, rows));
  list.push_back(lost_rows(result.model.measurement, result.survey));
  list.push_back(motion_between_samples(result));
  if (result.model.errors.between_samples && !robot.limits.contains("acceleration")) {
    list.push_back(motion_in_driving(result));
  }
  list.push_back(assumed_prior(result));
  add_limits(list, robot);
  if (model::on_two_wheels(robot)) {
    list.push_back(assumed_geometry(result));
    list.push_back(wheel_directions(result));
  }
  if (result.kinematic.model) {
    list.push_back({.id = "pose_independent",
                    .statement = "Pose and gyro are measured without the wheels: none is wheel odometry.",
                    .declared_by = {},
                    .test = "no combination of the wheel angles is all that a pose says",
                    .verdict = AssumptionVerdict::holds});
  }
  return list;
}

void settle_warrants(Commissioning& result) {
  result.assumptions = assumptions_of(result);
  apply_verdicts(result);
}

void withdraw_what_averages_would_hide(Commissioning& result, const std::string& detail) {
  for (Assumption& assumption : result.assumptions) {
    if (assumption.id == "friction_shape" || assumption.id == "constant_parameters" || assumption.id == "geometry") {
      assumption.verdict = AssumptionVerdict::fails;
      assumption.detail = fmt::format("errors of efforts do not average out as declared: {}", detail);
    }
  }
  result.message += fmt::format("; nothing is called guaranteed: {}", detail);
  apply_verdicts(result);
}

void apply_verdicts(Commissioning& result) {
  bool contradicted = false, driving_contradicted = false;
  for (const Assumption& assumption : result.assumptions) {
    if (assumption.verdict == AssumptionVerdict::fails ||
        (assumption.id == kSpeedFilter && !assumption.detail.empty())) {
      (assumption.id == kMotionInDriving ? driving_contradicted : contradicted) = true;
    }
  }
  result.model.assumptions = result.assumptions;
  const Warrant set = settle_outputs(result.noise, result.validation, result.noise_mode, contradicted);
  for (ParameterResult& parameter : result.parameters) {
    parameter.warrant = set;
  }
  result.model.warrant = driving_contradicted ? core::weaker(set, Warrant::extrapolated) : set;
  for (OutputValidation& each : result.validation) {
    each.warrant = result.model.warrant;
  }
  KinematicCommissioning& kinematic = result.kinematic;
  const Warrant warrant =
      settle_outputs(kinematic.noise, kinematic.validation, filter::NoiseMode::worst_case, contradicted);
  for (KinematicParameter& parameter : kinematic.parameters) {
    parameter.warrant = warrant;
  }
  for (std::optional<detector::KinematicModel>* model : {&kinematic.model, &result.model.kinematic}) {
    if (*model) {
      (*model)->warrant = warrant;
    }
  }
}

Warrant interval_warrant(const Commissioning& result) {
  return result.parameters.empty() ? result.model.warrant : result.parameters.front().warrant;
}

}  // namespace wheelwright::commission
