// SPDX-License-Identifier: Apache-2.0
#include "commission/commission.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "bounds/feasible_set.hpp"
#include "bounds/minimax.hpp"
#include "commission/assumptions.hpp"
#include "commission/at_risk/at_risk.hpp"
#include "commission/at_risk/pose_at_risk.hpp"
#include "commission/constant_thresholds.hpp"
#include "commission/contradictions.hpp"
#include "commission/evidence.hpp"
#include "commission/fit.hpp"
#include "commission/noise_budget.hpp"
#include "commission/premises.hpp"
#include "commission/refined_set.hpp"
#include "commission/setting.hpp"
#include "commission/setting_rows.hpp"
#include "commission/speed_unit.hpp"
#include "commission/two_walks.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/log.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

using filter::SignalErrors;

namespace {

constexpr double kMuchUnexplained = 0.2;  // residual over effort, root mean square

std::vector<OutputNoise> output_noise(const Setting& s, const Fit& fit, const identify::ExtrapolationOptions& options) {
  std::vector<OutputNoise> noise(s.model.n());
  for (std::size_t i = 0; i < noise.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    if (s.noise_complete) {
      noise[i].origin = core::NoiseOrigin::declared;
      noise[i].learning = noise[i].bound = s.declared.output[at];
    } else {
      const identify::ResidualSummary& residuals = fit.watched ? *fit.watched : fit.residuals;
      noise[i] = estimated_noise(residuals.outputs[i], residuals.instants, fit.plausible[at], options);
    }
  }
  return noise;
}

SignalErrors with_noise(const Setting& s, const std::vector<OutputNoise>& noise, RowUse use) {
  SignalErrors errors = s.declared;
  errors.bridges = errors.bridges || use == RowUse::driving;
  errors.interpolates = errors.interpolates && use == RowUse::learning;
  // Noise that is learnt is that of one moment of change; the truth may have another. Thresholds learn from residuals,
  // which any moment is in.
  errors.held_between = use == RowUse::learning && !s.noise_complete && s.measurement.hold == Hold::zero_order &&
                        s.measurement.changes == model::EffortChanges::between;
  errors.output.resize(static_cast<Eigen::Index>(noise.size()));
  for (std::size_t i = 0; i < noise.size(); ++i) {
    errors.output[static_cast<Eigen::Index>(i)] = use == RowUse::learning ? noise[i].learning : noise[i].bound;
  }
  return errors;
}

// With noise that is estimated a column of noise alone would be taken for motion without noise: its parameter would be
// bounded by what that leaves unexplained.
std::vector<bool> left_out(const Setting& s, const Fit& fit) {
  const bool any = !s.noise_complete && std::ranges::find(fit.noise_alone, true) != fit.noise_alone.end();
  return any ? fit.noise_alone : std::vector<bool>();
}

// The feasible set; where estimated bounds are too small for the prior box (θ̂ may lie outside it), they are raised.
RefinedSet bounded_set(LogSource& log, const Setting& setting, Part part, const Fit& fit, double risk,
                       std::vector<OutputNoise>& noise, std::size_t outliers, std::vector<std::string>& notes) {
  Setting s = setting;
  s.model = without_columns(std::move(s.model), left_out(setting, fit));
  const auto set_with = [&](const std::vector<OutputNoise>& bounds) {
    return refined_set(log, s, part, with_noise(s, bounds, RowUse::learning), outliers);
  };
  const auto told = [&](RefinedSet bounded) {
    if (!bounded.result.dropped.empty()) {
      notes.push_back(fmt::format("{} instants were left out of the feasible set as outliers (at rows {})",
                                  bounded.result.dropped.size(), fmt::join(bounded.result.dropped, ", ")));
    }
    return bounded;
  };
  if (!s.noise_complete) {
    TorqueRows rows = make_rows(log, setting, s.declared);
    FoldedSource folded(rows, part, s.survey.rows, s.folds);
    if (cover_untold_outputs(noise, folded, s.prior, fit.excitation, fit.noise_alone, s.model.input)) {
      notes.push_back(
          "an output of the model in which a parameter was not excited does not tell what noise it has: its bounds "
          "allow for any value within the prior, and may be so wide that no fault is seen by it; excite it, declare "
          "`noise:`, or narrow `prior:` in the robot file");
    }
  }
  RefinedSet first = told(set_with(noise));
  if (first.result.set.status == FeasibleSet::Status::nonempty || s.noise_complete) {
    return first;
  }
  TorqueRows bare = make_rows(log, s, s.declared);
  FoldedSource bare_folded(bare, part, s.survey.rows, s.folds);
  const double factor = raise_until_explained(
      noise, bare_folded, s.prior, {fit.estimate, fit.residuals, risk}, [&](const std::vector<OutputNoise>& more) {
        return set_with(more).result.set.status == FeasibleSet::Status::nonempty;
      });
  notes.push_back(
      fmt::format("the estimated noise bound was raised by {:.3g}: within the prior box no parameters "
                  "explain the log with less",
                  factor));
  RefinedSet raised = told(set_with(noise));
  raised.raised = factor;
  return raised;
}

// By how much the efforts' bounds of `empty` must be raised for a set, up to kClose. The minimax fit of its rows does
// not say: with more noise there is a first set, whose dynamics bound the motion between samples more narrowly and may
// leave none.
double needed_noise(LogSource& log, const Setting& s, const Commissioning& empty, std::size_t outliers) {
  constexpr double kClose = 5e-4, kApart = 1.3;
  constexpr int kMost = 40;
  const auto explained = [&](double factor) {
    SignalErrors errors = with_noise(s, empty.noise, RowUse::learning);
    errors.output *= factor;
    errors.motion.effort *= factor;
    return refined_set(log, s, Part::everything, std::move(errors), outliers).result.set.status ==
           FeasibleSet::Status::nonempty;
  };
  bounds::MinimaxOptions options;
  options.excluded_samples = empty.dropped;
  for (Eigen::Index i = 0; i < empty.row_errors.output.size(); ++i) {
    options.weights.push_back(std::max(empty.row_errors.output[i], std::numeric_limits<double>::min()));
  }
  SignalErrors without_output = empty.row_errors;
  without_output.output.setZero();
  TorqueRows bare = make_rows(log, s, without_output);
  const double fit = bounds::minimax_fit(bare, s.prior, options).upper;
  // The first rows are met again with any noise.
  const bool no_less = outliers == 0 && empty.row_errors.motion.mobility.size() == 0;
  double lower = no_less ? std::max(1.0, fit) : 1.0, upper = std::max(lower, fit) * (1.0 + kClose);
  for (int k = 0; k < kMost && !explained(upper); ++k) {
    lower = upper;
    upper *= kApart;
  }
  while (upper > lower * (1.0 + kClose)) {
    const double middle = std::sqrt(lower * upper);
    (explained(middle) ? upper : lower) = middle;
  }
  return upper;
}

std::vector<bounds::RowOrigin> binding(const bounds::CertifiedBound& bound) {
  std::vector<bounds::RowOrigin> rows;
  for (const bounds::WeightedRow& weighted : bound.binding) {
    if (weighted.multiplier > 0.0) {
      rows.push_back(weighted.row.origin);
    }
  }
  return rows;
}

bool is_prior(const std::vector<bounds::RowOrigin>& rows, const Interval& prior, double bound, double other) {
  const bool on_side = bound == prior.lower || bound == prior.upper;
  const bool only_prior = std::ranges::all_of(rows, [](const bounds::RowOrigin& row) { return row.is_prior; });
  return on_side || (only_prior && bound != other);
}

std::vector<ParameterResult> parameter_results(const Setting& s, const Fit& fit, const FeasibleSet& set) {
  std::vector<ParameterResult> results;
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    ParameterResult r;
    r.parameter = s.model.parameters[j];
    r.excitation = fit.excitation[j].state;
    r.reason = fit.excitation[j].reason;
    if (r.excitation == identify::Excitation::not_excited) {
      r.reason += ": " + r.parameter.excite;
    } else {
      r.estimate = fit.estimate[at];
      r.standard_error = fit.residuals.standard_error[at];
    }
    r.lower = set.hull.sides[j].lower;
    r.upper = set.hull.sides[j].upper;
    if (set.status == FeasibleSet::Status::nonempty) {
      r.chebyshev = set.polytope->chebyshev_centre()[j];
      r.lower_binding = binding(set.lower[j]);
      r.upper_binding = binding(set.upper[j]);
    }
    r.lower_is_prior = is_prior(r.lower_binding, s.prior.sides[j], r.lower, r.upper);
    r.upper_is_prior = is_prior(r.upper_binding, s.prior.sides[j], r.upper, r.lower);
    r.estimate_inside = !r.estimate || (r.lower <= *r.estimate && *r.estimate <= r.upper);
    results.push_back(std::move(r));
  }
  return results;
}

OnlineModel described_model(const Setting& s, detector::Persistence persistence) {
  OnlineModel model;
  model.robot = s.robot;
  model.model = s.model;
  model.measurement = s.measurement;
  model.filter = s.filter;
  model.persistence = persistence;
  return model;
}

void finish_model(OnlineModel& model, const Setting& s, const std::vector<OutputNoise>& noise, const Fit& fit,
                  const FeasibleSet& set, const filter::MotionBound& motion) {
  model.errors = with_noise(s, noise, RowUse::driving);
  model.errors.motion = motion;
  model.estimate = best_guess(fit.estimate, fit.excitation, *set.polytope);
  model.facets = set.polytope->facets();
  model.box = set.hull;
}

void tell(const CommissionOptions& options, std::string_view stage, double share) {
  if (options.progress) {
    options.progress(stage, share);
  }
}

KinematicCommissioning kinematics(LogSource& log, const Setting& s, const CommissionOptions& options) {
  return options.kinematic_part
             ? options.kinematic_part->residual
             : commission_kinematics(log, s.robot, filter::find_odometry(log, s.robot, s.model, s.measurement),
                                     s.survey, kinematic_options(s.robot, options));
}

// A trial on held-out blocks of a model made from the other ones.
struct HeldOut {
  std::vector<OutputValidation> validation;  // empty where the other blocks leave no model
  double polytope_over_box = 1.0;
};

// Factors on the estimated noise bounds, one for each output; empty: none.
using Raises = std::vector<double>;

std::vector<OutputNoise> raised_noise(const Setting& s, const Fit& fit, const CommissionOptions& options,
                                      const Raises& raises) {
  std::vector<OutputNoise> noise = output_noise(s, fit, options.extrapolation);
  for (std::size_t i = 0; i < raises.size(); ++i) {
    noise[i].bound *= raises[i];
    noise[i].learning *= raises[i];
  }
  return noise;
}

HeldOut try_held_out(LogSource& log, const Setting& s, const CommissionOptions& options, const Raises& raises) {
  HeldOut held_out;
  const Fit trained = fit_log(log, s, Part::training, options.extrapolation.risk);
  std::vector<std::string> unused;
  std::vector<OutputNoise> noise = raised_noise(s, trained, options, raises);
  const RefinedSet learnt =
      bounded_set(log, s, Part::training, trained, options.extrapolation.risk, noise, options.outliers, unused);
  const FeasibleSet& set = learnt.result.set;
  if (set.status != FeasibleSet::Status::nonempty) {
    return held_out;
  }
  SignalErrors errors = with_noise(s, noise, RowUse::driving);
  errors.motion = learnt.driving;
  TorqueRows unseen = make_rows(log, s, errors);
  FoldedSource rows(unseen, Part::held_out, s.survey.rows, s.folds);
  held_out.validation = validate_on(
      rows, detector::ThresholdRule(*set.polytope, best_guess(trained.estimate, trained.excitation, *set.polytope)));
  held_out.polytope_over_box = 0.0;
  for (const OutputValidation& v : held_out.validation) {
    const double ratio = v.median_width_box > 0.0 ? v.median_width / v.median_width_box : 1.0;
    held_out.polytope_over_box = std::max(held_out.polytope_over_box, ratio);
  }
  return held_out;
}

// What the whole log says of the torque; where it could be walked twice at once, the trial, too.
struct Learnt {
  Fit fit;
  SignalFindings signals;
  RefinedSet bounded;
  std::optional<HeldOut> held_out;
  std::exception_ptr held_out_failed;
};

// Fills in noise, notes and the kinematic residual of `result`, too.
Learnt learn_beside(LogSource& log, const Setting& s, const CommissionOptions& options, const Raises& raises,
                    Commissioning& result) {
  const std::unique_ptr<LogSource> other = options.threads > 1 ? log.another_walk() : nullptr;
  Learnt learnt;
  core::both(
      other ? options.threads : 1,
      [&] {
        tell(options, "comparing pose and wheels", 0.15);
        result.kinematic = kinematics(log, s, options);
        if (!other) {
          return;
        }
        tell(options, "validating on held-out blocks", 0.3);
        try {
          learnt.held_out = try_held_out(log, s, options, raises);
        } catch (...) {
          learnt.held_out_failed = std::current_exception();  // asked for where a model came out
        }
        tell(options, "bounding", 0.5);
      },
      [&] {
        LogSource& walk = other ? *other : log;
        const auto tell_alone = [&](std::string_view stage, double share) {
          if (!other) {
            tell(options, stage, share);
          }
        };
        tell_alone("identifying", 0.2);
        learnt.fit = fit_log(walk, s, Part::everything, options.extrapolation.risk);
        tell_alone("looking for contradictions", 0.35);
        learnt.signals = contradictions_in_log(walk, s, learnt.fit);
        tell_alone("bounding", 0.4);
        result.noise = raised_noise(s, learnt.fit, options, raises);
        learnt.bounded = bounded_set(walk, s, Part::everything, learnt.fit, options.extrapolation.risk, result.noise,
                                     options.outliers, result.notes);
      });
  return learnt;
}

void describe_assumptions(const Setting& s, Commissioning& result) {
  auto& notes = result.notes;
  if (s.measurement.motion == MotionKind::mean_speed) {
    notes.push_back(
        s.measurement.count > 0.0
            ? fmt::format("wheel speeds are differenced encoder counts ({:.0f} counts per turn): angles were "
                          "rebuilt from them, each speed taken as the mean over the interval around its time",
                          2.0 * 3.14159265358979323846 / (s.measurement.count * s.measurement.nominal_step))
            : "wheel speeds were taken as means over the sampling interval, as the robot file says");
  } else if (s.measurement.motion == MotionKind::speed && s.filter.order == 2) {
    notes.push_back(
        s.measurement.unused_count > 0.0
            ? fmt::format(
                  "wheel speeds are whole multiples of {:.4g} rad/s; they were taken as samples of the speed with "
                  "the declared `wheel_speed` noise: write `encoder_counts_per_turn: {:.0f}` into the robot file "
                  "if they are differenced counts",
                  s.measurement.unused_count,
                  2.0 * 3.14159265358979323846 / (s.measurement.unused_count * s.measurement.nominal_step))
            : "wheel speeds are not differenced encoder counts: they were taken as samples of the speed");
  }
  if (!s.noise_complete) {
    notes.push_back(
        "the noise bounds are extrapolated from the residuals of this log: they hold while the noise and "
        "the driving stay like it; declare `noise:` in the robot file for bounds that stand on the sensors");
  }
  if (s.noise_complete && s.measurement.hold == Hold::zero_order &&
      s.measurement.changes == model::EffortChanges::between) {
    notes.push_back(
        "commands were taken to change at an unknown moment between two samples: where they change at the samples, "
        "`effort: {changes: at_samples}` in the robot file says so and narrows the bounds; else a higher rate does");
  }
  if (s.measurement.effort_unsigned) {
    notes.push_back(
        "the effort is unsigned: its sign was taken from the direction of motion, which is wrong while a "
        "motor brakes");
  }
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    if (!s.prior_declared[j] && (result.parameters[j].lower_is_prior || result.parameters[j].upper_is_prior)) {
      const model::Parameter& p = result.parameters[j].parameter;
      notes.push_back(
          fmt::format("a bound of {} is the tool's own wide default ({} from {:.3g} to {:.3g} {}), not the robot's: "
                      "`prior:` in the robot file replaces it",
                      p.name, p.physical, p.prior.lower, p.prior.upper, p.physical_unit));
    }
  }
}

// What the model fails to explain, and which numbers not to lean on.
std::string reservations(const Setting& s, const Commissioning& result) {
  std::string text;
  for (std::size_t i = 0; i < s.model.n(); ++i) {
    const identify::OutputResidual& o = result.residuals.outputs[i];
    const double share = o.torque_rms > 0.0 ? o.rms / o.torque_rms : 0.0;
    if (share > kMuchUnexplained) {
      text += fmt::format("; the model leaves {:.0f} % of the effort in the {} channel unexplained", 100.0 * share,
                          s.model.outputs[i]);
    }
  }
  std::string indistinct;
  for (const ParameterResult& p : result.parameters) {
    if (p.excitation == identify::Excitation::indistinct) {
      indistinct += (indistinct.empty() ? "" : ", ") + p.parameter.name;
    }
  }
  if (!indistinct.empty()) {
    text += "; not told from zero: " + indistinct;
  }
  const auto doubt = std::ranges::find_if(result.contradictions, &LogContradiction::demotes);
  if (doubt != result.contradictions.end() && s.noise_complete) {
    text += fmt::format("; nothing is called guaranteed: {}", doubt->sentence);
  }
  if (s.measurement.effort_unsigned) {
    text +=
        "; the effort is unsigned, so that braking and driving cannot be told apart: take the friction terms as "
        "approximate, and do not take the inertias at all";
  }
  return text;
}

// The contradictions that `counts`, each with what to do.
template <typename Counts>
std::string withdrawal(const Commissioning& result, const Counts& counts) {
  std::string text;
  for (const LogContradiction& c : result.contradictions) {
    if (counts(c)) {
      text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", c.sentence, c.next);
    }
  }
  return text;
}

// Where least squares lies beyond the tool's own default prior: what to write into the robot file.
std::string default_prior_in_the_way(const Setting& s, const Commissioning& result) {
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const std::optional<double>& estimate = result.parameters[j].estimate;
    if (estimate && !s.prior_declared[j] && *estimate > s.prior.sides[j].upper) {
      const model::Parameter& p = s.model.parameters[j];
      return fmt::format(
          "no {0} within the tool's own default prior, at most {1:.3g} {2}, explains the log: check the units of "
          "efforts "
          "and motion, or, where the robot is that large, write `prior: {{{0}: [lower, upper]}}` into the robot file",
          p.physical, p.prior.upper, p.physical_unit);
    }
  }
  return {};
}

bool holds(const std::vector<LogContradiction>& contradictions, LogContradiction::Kind kind) {
  return std::ranges::find(contradictions, kind, &LogContradiction::kind) != contradictions.end();
}

// A model that the log contradicts is not published.
void withdraw(Commissioning& result) {
  OnlineModel& model = result.model;
  model.estimate.resize(0);
  model.facets.clear();
  model.box = {};
  model.kinematic.reset();
  result.status = Commissioning::Status::contradicted;
}

bool withdrawn(const Commissioning& result) {
  return std::ranges::any_of(result.contradictions, [](const LogContradiction& c) { return c.withdraws; });
}

// Half width of a parameter's interval over its estimate; 0 where there is no estimate.
double relative_half_width(const ParameterResult& p) {
  return p.estimate && *p.estimate != 0.0 ? 0.5 * (p.upper - p.lower) / std::abs(*p.estimate) : 0.0;
}

// Parameters that the efforts of the log stand on, by the share that they have in them at least.
std::vector<std::size_t> weighty(const Fit& fit) {
  constexpr double kWeighty = 0.2;
  const auto instants = static_cast<double>(std::max<std::size_t>(fit.squares.instants, 1));
  const double effort = std::sqrt(fit.squares.weighted_tss / instants);
  std::vector<std::size_t> result;
  for (std::size_t j = 0; j < fit.excitation.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (fit.excitation[j].state != identify::Excitation::not_excited &&
        fit.squares.column_rms[at] * std::abs(fit.estimate[at]) >= kWeighty * effort) {
      result.push_back(j);
    }
  }
  return result;
}

// What makes a model that came out one of little use; empty where nothing does.
std::string little_learned(const Setting& s, const Commissioning& result, const Fit& fit) {
  std::vector<std::string> reasons;
  if (sees_nothing(result.validation)) {
    reasons.emplace_back(
        "no fault that scales the effort is certain to be seen on driving like this, since thresholds are as wide as "
        "the efforts");
  }
  std::string open, wide;
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const ParameterResult& p = result.parameters[j];
    const bool well_known = s.prior_declared[j] && relative_half_width(p) < 1.0;
    if (p.lower_is_prior && p.upper_is_prior && p.excitation != identify::Excitation::not_excited && !well_known) {
      open += (open.empty() ? "" : ", ") + p.parameter.name;
    }
  }
  for (const std::size_t j : weighty(fit)) {
    const ParameterResult& p = result.parameters[j];
    if (relative_half_width(p) >= 1.0 && !(p.lower_is_prior && p.upper_is_prior)) {
      wide += fmt::format("{}{} by ± {:.0f} %", wide.empty() ? "" : ", ", p.parameter.physical,
                          100.0 * relative_half_width(p));
    }
  }
  if (!open.empty()) {
    reasons.push_back(fmt::format("the bounds of {} are still those of the prior", open));
  }
  if (!wide.empty()) {
    reasons.push_back(fmt::format("the bounds leave {} open", wide));
  }
  return fmt::format("{}", fmt::join(reasons, ", and "));
}

constexpr const char* kHowToDrive = "`wheelwright design --for bounds` plans such a drive";

std::string status_message(const Setting& s, const Commissioning& result) {
  std::string missing, todo;
  for (const ParameterResult& p : result.parameters) {
    if (p.excitation == identify::Excitation::not_excited) {
      missing += (missing.empty() ? "" : ", ") + p.parameter.name;
      if (todo.find(p.parameter.excite) == std::string::npos) {
        todo += (todo.empty() ? "" : "; ") + p.parameter.excite;
      }
    }
  }
  switch (result.status) {
    case Commissioning::Status::done:
      return (result.little.why.empty() ? "commissioned"
                                        : fmt::format("little was learned: {}; {}", result.little.why,
                                                      fmt::join(result.little.remedies, "; "))) +
             reservations(s, result);
    case Commissioning::Status::partial:
      return fmt::format(
                 "{}the log says nothing about {}: {}, and commission again ({}); until then "
                 "their bounds are those of the prior",
                 result.little.why.empty() ? "commissioned, but "
                                           : fmt::format("little was learned: {}; {}; ", result.little.why,
                                                         fmt::join(result.little.remedies, "; ")),
                 missing, todo, kHowToDrive) +
             reservations(s, result);
    case Commissioning::Status::nothing: return "the log says nothing about any parameter: " + todo;
    case Commissioning::Status::empty: {
      const std::string why = withdrawal(result, [](const LogContradiction& c) {
        return c.withdraws || c.kind == LogContradiction::Kind::effort_timing;
      });
      if (std::string prior = default_prior_in_the_way(s, result); !prior.empty()) {
        return prior;
      }
      return fmt::format(
          "no parameters explain the log within the declared noise: it would have to be {:.3g} times as "
          "large; {}",
          result.minimax,
          why.empty()
              ? "a fault, an effect that the model lacks (`gap` looks for it), or noise bounds that are too small"
              : why);
    }
    case Commissioning::Status::contradicted:
      return "no model: " + withdrawal(result, std::mem_fn(&LogContradiction::withdraws));
  }
  return {};
}

// The widths of a set, relative to the estimates, of the parameters that matter: "mass ± 4.2 %, …".
std::string widths_in_words(const Commissioning& result, const std::vector<std::size_t>& which, const Box& hull) {
  std::vector<std::string> items;
  for (const std::size_t j : which) {
    const ParameterResult& p = result.parameters[j];
    if (p.estimate && *p.estimate != 0.0) {
      const double half = 0.5 * (hull.sides[j].upper - hull.sides[j].lower) / std::abs(*p.estimate);
      items.push_back(fmt::format("{} ± {:.2g} %", p.parameter.physical, 100.0 * half));
    }
  }
  return fmt::format("{}", fmt::join(items, ", "));
}

// What would bring more where little was learned, with the bounds that it would have left of this log.
std::vector<std::string> remedies(LogSource& log, const Setting& s, const Commissioning& result, const Fit& fit,
                                  const CommissionOptions& options) {
  std::vector<std::string> list;
  std::vector<std::size_t> which = weighty(fit);
  const auto would_leave = [&](const Setting& other, const SignalErrors& errors) -> std::string {
    const bounds::OutlierResult set = refined_set(log, other, Part::everything, errors, options.outliers).result;
    return set.set.status == FeasibleSet::Status::nonempty ? widths_in_words(result, which, set.set.hull)
                                                           : std::string();
  };
  if (s.noise_complete && s.measurement.changes == model::EffortChanges::between) {
    Robot robot = s.robot;
    robot.effort_changes = model::EffortChanges::at_samples;
    robot.filter = {.order = s.filter.order, .alpha = s.filter.alpha, .beta = s.filter.beta};
    const Setting at_samples = settle(log, robot,
                                      {.filter_choice = {},
                                       .folds = options.folds,
                                       .noise_mode = options.noise_mode,
                                       .confidence = options.confidence,
                                       .progress = {}});
    if (const std::string left = would_leave(at_samples, at_samples.declared); !left.empty()) {
      list.push_back(fmt::format(
          "where efforts {} samples, write `effort: {{changes: at_samples}}` into the robot file, which leaves {} of "
          "this log",
          s.measurement.hold == Hold::zero_order ? "change at the" : "are straight between two", left));
    }
  }
  if (s.noise_complete) {
    SignalErrors nothing_between = s.declared;
    nothing_between.between_samples = false;
    if (const std::string left = would_leave(s, nothing_between); !left.empty()) {
      list.push_back(fmt::format(
          "log at a higher rate than {:.3g} Hz, since what motion and efforts may do between two samples shrinks with "
          "the step: down to {} at most",
          1.0 / s.survey.median_step, left));
    }
  }
  for (const std::size_t j : which) {
    const model::Parameter& p = s.model.parameters[j];
    if (!s.prior_declared[j] && relative_half_width(result.parameters[j]) >= 1.0) {
      list.push_back(fmt::format("declare what is known of the {0}, `prior: {{{0}: [lower, upper]}}`", p.physical));
      break;
    }
  }
  list.push_back(fmt::format("speed up and brake, drive curves to both sides ({})", kHowToDrive));
  list.emplace_back("declare smaller noise bounds where they hold");
  return list;
}

// What the noise bounds must be raised by for the driving that was held out to stay within its thresholds, and what was
// found of it: where a model with estimated noise is withdrawn for that alone. Nothing where the noise would have to be
// another one than that of the rest of the log.
struct FailedTrial {
  Raises raises;
  std::vector<LogContradiction> found;
};

FailedTrial failed_trial(const Commissioning& result) {
  constexpr double kMostRaised = 3.0;
  constexpr double kSpare = 1.05;  // the set changes with its noise
  FailedTrial trial;
  for (const LogContradiction& c : result.contradictions) {
    if (c.withdraws && c.kind != LogContradiction::Kind::held_out_outside) {
      return {};
    }
    if (c.withdraws) {
      trial.found.push_back(c);
    }
  }
  for (std::size_t i = 0; i < result.validation.size() && !trial.found.empty(); ++i) {
    const double used = result.validation[i].utilisation;
    if (result.noise[i].origin != core::NoiseOrigin::estimated || used > kMostRaised) {
      return {};
    }
    trial.raises.push_back(used > 1.0 ? kSpare * used : 1.0);
  }
  for (LogContradiction& c : trial.found) {
    const auto output = std::ranges::find(result.model.model.outputs, c.subject) - result.model.model.outputs.begin();
    const double by = trial.raises[static_cast<std::size_t>(output)];
    c.withdraws = false;
    c.sentence += fmt::format(": its noise bound was raised by {:.2g}, with which they do not", by);
  }
  return trial;
}

// Efforts late by something of which the log leaves `open`.
Robot with_open_timing(Robot robot, const Interval& open) {
  constexpr double kPerSecond = 1e4;  // rounded outward, for people to copy
  robot.effort_delay = {std::min(robot.effort_delay.lower, std::floor(kPerSecond * open.lower) / kPerSecond),
                        std::max(robot.effort_delay.upper, std::ceil(kPerSecond * open.upper) / kPerSecond)};
  robot.effort_time_origin = model::EffortTimeOrigin::found;
  return robot;
}

Commissioning commissioned(LogSource& log, const Robot& robot, const CommissionOptions& options,
                           const FailedTrial& trial) {
  Commissioning result;
  result.noise_mode = options.noise_mode;
  const Setting s = settle(log, robot,
                           {.filter_choice = options.filter_choice,
                            .folds = options.folds,
                            .noise_mode = options.noise_mode,
                            .confidence = options.confidence,
                            .progress = options.progress});
  result.survey = s.survey;
  result.filter_choice = s.filter_choice;
  result.notes = s.notes;
  result.folds = s.folds;
  result.model = described_model(s, options.persistence);

  Learnt learnt = learn_beside(log, s, options, trial.raises, result);
  result.model.kinematic = result.kinematic.model;
  const Fit& fit = learnt.fit;
  RefinedSet& bounded = learnt.bounded;
  result.estimators = fit.choice;
  result.residuals = fit.residuals;
  result.rank = fit.squares.rank;
  result.condition = fit.squares.condition;
  result.contradictions = std::move(learnt.signals.contradictions);
  result.premises = std::move(learnt.signals.premises);
  if (learnt.signals.timing) {
    result.effort_shift = learnt.signals.timing->delay;
    result.effort_shift_told = told_shift(*learnt.signals.timing, s.survey.median_step);
    result.effort_shift_open = learnt.signals.timing->open;
  }
  result.feasible = std::move(bounded.result.set);
  result.dropped = std::move(bounded.result.dropped);
  result.earlier = std::move(bounded.earlier);
  result.prior = s.prior;
  result.left_out = left_out(s, fit);
  result.row_errors = with_noise(s, result.noise, RowUse::learning);
  result.row_errors.motion = bounded.learning;
  result.parameters = parameter_results(s, fit, result.feasible);
  describe_assumptions(s, result);
  if (!result.kinematic.message.empty()) {
    result.notes.push_back(result.kinematic.message);
  }

  if (result.feasible.status == FeasibleSet::Status::empty) {
    tell(options, "measuring the contradiction", 0.7);
    const auto& timing = learnt.signals.timing;
    if (timing && looks_shifted(*timing, s.survey.median_step) &&
        !holds(result.contradictions, LogContradiction::Kind::effort_timing)) {
      result.contradictions.push_back(shift_finding(log, s, fit, *timing));
    }
    if (s.noise_complete && halves_are_explained(log, robot)) {
      result.contradictions.push_back({.kind = LogContradiction::Kind::halves_disagree,
                                       .sentence = std::string(kOnlyInHalves),
                                       .next = std::string(kWhatChanged)});
    }
    result.minimax = needed_noise(log, s, result, options.outliers);
    result.status = Commissioning::Status::empty;
    result.message = status_message(s, result);
    return result;
  }

  const auto unexcited = std::ranges::count_if(
      result.parameters, [](const ParameterResult& p) { return p.excitation == identify::Excitation::not_excited; });
  result.status = unexcited == 0                                          ? Commissioning::Status::done
                  : unexcited == static_cast<std::ptrdiff_t>(s.model.p()) ? Commissioning::Status::nothing
                                                                          : Commissioning::Status::partial;
  result.message = status_message(s, result);
  if (result.status == Commissioning::Status::nothing) {
    return result;
  }
  finish_model(result.model, s, result.noise, fit, result.feasible, bounded.driving);

  if (learnt.held_out_failed) {
    std::rethrow_exception(learnt.held_out_failed);
  }
  if (!learnt.held_out) {
    tell(options, "validating on held-out blocks", 0.7);
  }
  const HeldOut held_out = learnt.held_out ? *learnt.held_out : try_held_out(log, s, options, trial.raises);
  result.validation = held_out.validation;
  result.polytope_over_box = held_out.polytope_over_box;
  for (LogContradiction& found : contradictions_in_result(result, s, learnt.signals.timing, bounded.raised)) {
    result.contradictions.push_back(std::move(found));
  }
  std::ranges::copy(trial.found, std::back_inserter(result.contradictions));
  weigh_efforts(log, s, result.row_errors, result.feasible.hull, result.contradictions);
  if (wants_weighing(result, s)) {
    weigh_contradictions(result, s, fit, learnt.signals.timing,
                         explained_by_errors(log, s, fit, result.row_errors, result.feasible.hull),
                         errors_average(log, s, fit));
  }
  if (withdrawn(result)) {
    withdraw(result);
  } else if (result.little.why = little_learned(s, result, fit); !result.little.why.empty()) {
    tell(options, "looking for what would bring more", 0.95);
    result.little.remedies = remedies(log, s, result, fit, options);
  }
  result.message = status_message(s, result);
  log.rewind();
  tell(options, "done", 1.0);
  return result;
}

// Where the log does not tell whether its speeds were rounded or cut off, the intervals hold both.
void hold_open_cut(LogSource& log, const Robot& robot, const CommissionOptions& options, Commissioning& result) {
  if (!result.has_model() || result.model.measurement.motion != MotionKind::speed) {
    return;
  }
  const auto cut = open_cut(log, robot, result.model.measurement.motion_columns);
  if (!cut) {
    return;
  }
  Robot as_cut = robot;
  as_cut.speed_cut = cut;
  const Commissioning other = commissioned(log, as_cut, options, {});
  if (!other.has_model()) {
    return;
  }
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    result.parameters[j].lower = std::min(result.parameters[j].lower, other.parameters[j].lower);
    result.parameters[j].upper = std::max(result.parameters[j].upper, other.parameters[j].upper);
  }
  result.notes.push_back(
      fmt::format("speeds are in whole multiples of {:.4g} rad/s, rounded or cut off, which `speed_cut` in the robot "
                  "file says: the intervals of the parameters hold both",
                  cut->unit));
}

}  // namespace

KinematicCommissionOptions kinematic_options(const Robot& robot, const CommissionOptions& options) {
  KinematicCommissionOptions kinematic = options.kinematic;
  kinematic.folds = options.folds;
  kinematic.extrapolation = options.extrapolation;
  kinematic.persistence = options.persistence;
  kinematic.window = robot.kinematic_window.value_or(kinematic.window);
  return kinematic;
}

Commissioning commission_robot(LogSource& log, const Robot& robot, const CommissionOptions& options) {
  Commissioning result = commissioned(log, robot, options, {});
  std::optional<Robot> doubted;
  if (holds(result.contradictions, LogContradiction::Kind::timing_open)) {
    doubted = with_open_timing(robot, result.effort_shift_open);
    Commissioning held = commissioned(log, *doubted, options, {});
    if (held.status != Commissioning::Status::empty && !withdrawn(held)) {
      result = std::move(held);
    } else {
      doubted.reset();
    }
  }
  if (const FailedTrial trial = failed_trial(result); !trial.raises.empty()) {
    Commissioning raised = commissioned(log, doubted.value_or(robot), options, trial);
    if (!withdrawn(raised)) {
      result = std::move(raised);
    }
  }
  hold_open_cut(log, doubted.value_or(robot), options, result);
  settle_warrants(result);
  if (options.at_risk != CommissionOptions::AtRisk::nothing) {
    const AtRiskOptions at_risk{.reach = options.at_risk == CommissionOptions::AtRisk::reach,
                                .threads = options.threads};
    std::optional<RiskSet> set;
    two_walks(
        log, options.threads,
        [&](LogSource& walk) {
          learn_pose_at_risk(walk, result, {}, options.kinematic_part ? options.kinematic_part->at_risk : std::nullopt);
        },
        [&](LogSource& walk) { set = declared_risk_set(walk, result, at_risk); });
    learn_at_risk(log, result, at_risk, std::move(set));
  }
  if (result.has_model()) {
    learn_constant_thresholds(log, result.model);
    if (result.model.kinematic) {
      result.kinematic.model->constant = result.model.kinematic->constant;
    }
  }
  return result;
}

}  // namespace wheelwright::commission
