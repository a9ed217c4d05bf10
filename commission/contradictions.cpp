// SPDX-License-Identifier: Apache-2.0
#include "commission/contradictions.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/commission.hpp"
#include "commission/contradiction_search.hpp"
#include "commission/evidence.hpp"
#include "commission/fit.hpp"
#include "commission/physical.hpp"
#include "commission/premises.hpp"
#include "commission/refined_set.hpp"
#include "commission/setting.hpp"
#include "commission/setting_rows.hpp"
#include "commission/speed_smoothing.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

std::string_view to_string(LogContradiction::Kind kind) {
  switch (kind) {
    case LogContradiction::Kind::effort_constant: return "effort_constant";
    case LogContradiction::Kind::angle_wrapped: return "angle_wrapped";
    case LogContradiction::Kind::stamps_scatter: return "stamps_scatter";
    case LogContradiction::Kind::effort_unrelated: return "effort_unrelated";
    case LogContradiction::Kind::effort_timing: return "effort_timing";
    case LogContradiction::Kind::timing_open: return "timing_open";
    case LogContradiction::Kind::wheels_disagree: return "wheels_disagree";
    case LogContradiction::Kind::wrong_sign: return "wrong_sign";
    case LogContradiction::Kind::dry_friction: return "dry_friction";
    case LogContradiction::Kind::prior_edge: return "prior_edge";
    case LogContradiction::Kind::estimate_outside: return "estimate_outside";
    case LogContradiction::Kind::halves_disagree: return "halves_disagree";
    case LogContradiction::Kind::effort_offset: return "effort_offset";
    case LogContradiction::Kind::friction_shape: return "friction_shape";
    case LogContradiction::Kind::held_out_outside: return "held_out_outside";
  }
  return "";
}

InWords in_words(const Setting& s, std::size_t j) {
  const auto scales = physical_scales(s.robot, s.model);
  const model::Parameter& p = s.model.parameters[j];
  return scales ? InWords{p.physical, p.physical_unit, (*scales)[j].scale, (*scales)[j].offset}
                : InWords{p.name, parameter_unit(s.robot, p)};
}

namespace {

using Kind = LogContradiction::Kind;

constexpr double kMaterial = 0.1;          // of the weighted effort: a wrong sign below it is a note
constexpr double kUnrelated = 0.05;        // share of an effort's variation that motion must explain of it
constexpr double kManyStepsOff = 0.2;      // of a step: how near half a step a shift must be to be one
constexpr double kMuchRaised = 3.0;        // factor on an estimated noise bound
constexpr double kOwnMotion = 0.2;         // share of a column that is not the others', below which none is told apart
constexpr double kWheelsDiffer = 1.15;     // ratio of the masses that two wheels show: worth a note
constexpr double kWheelsContradict = 1.8;  // the same: a unit, a gear or a sensor is wrong
constexpr double kManyOutside = 0.01;      // of the held-out instants

// The effort of each joint by itself, on all that the motion offers: what the rows say of it.
struct JointFit {
  double explained = 1.0;    // share of its square
  Eigen::VectorXd estimate;  // of each column
  Eigen::VectorXd own;       // share of each column that the others do not explain
  Eigen::VectorXd error;     // standard errors
  double freedom = 1.0;
};

// Columns of the outputs' rows side by side, those that are zero throughout left out: (output, parameter).
std::vector<std::pair<std::size_t, std::size_t>> side_by_side(const Model& model) {
  std::vector<std::pair<std::size_t, std::size_t>> columns;
  for (std::size_t j = 0; j < model.p(); ++j) {
    for (std::size_t i = 0; i < model.n(); ++i) {
      if (std::ranges::any_of(model.terms, [&](const Term& t) { return t.output == i && t.parameter == j; })) {
        columns.emplace_back(i, j);
      }
    }
  }
  return columns;
}

RegressionBlock joint_rows(const RegressionBlock& block, const Eigen::RowVectorXd& share,
                           const std::vector<std::pair<std::size_t, std::size_t>>& columns) {
  const auto n = static_cast<Eigen::Index>(block.outputs);
  RegressionBlock rows;
  rows.resize(block.instants(), 1, columns.size());
  rows.sample = block.sample;
  rows.t = block.t;
  rows.dY.setZero();
  rows.dy.setZero();
  for (std::size_t k = 0; k < block.instants(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    rows.y[at] = share.dot(block.y.segment(at * n, n));
    for (std::size_t c = 0; c < columns.size(); ++c) {
      rows.Y(at, static_cast<Eigen::Index>(c)) =
          block.Y(at * n + static_cast<Eigen::Index>(columns[c].first), static_cast<Eigen::Index>(columns[c].second));
    }
  }
  return rows;
}

std::vector<JointFit> fit_joints(LogSource& log, const Setting& s) {
  const auto joints = static_cast<std::size_t>(s.model.input.cols());
  if (s.model.input.rows() != s.model.input.cols() || joints < 2 || s.measurement.effort_unsigned) {
    return {};
  }
  const Eigen::MatrixXd shares = core::inverse(s.model.input);
  if (!shares.allFinite()) {
    return {};
  }
  const auto columns = side_by_side(s.model);
  std::vector<identify::LeastSquares> sums(joints, identify::LeastSquares(columns.size()));
  TorqueRows rows = make_rows(log, s, errors_of_fit(s));
  const auto each = [&](auto&& visit) {
    core::for_each_block(rows, [&](const RegressionBlock& block) {
      for (std::size_t j = 0; j < joints; ++j) {
        visit(j, joint_rows(block, shares.row(static_cast<Eigen::Index>(j)), columns));
      }
    });
  };
  each([&](std::size_t j, const RegressionBlock& of_joint) { sums[j].add(of_joint); });
  if (sums.front().instants() < kFewestInstants) {
    return {};
  }
  std::vector<identify::LeastSquaresFit> fits;
  std::vector<identify::ResidualStatistics> statistics;
  for (const identify::LeastSquares& sum : sums) {
    fits.push_back(sum.solve());
    statistics.emplace_back(fits.back().estimate, Eigen::VectorXd::Ones(1));
  }
  each([&](std::size_t j, const RegressionBlock& of_joint) { statistics[j].add(of_joint); });
  std::vector<JointFit> result;
  for (std::size_t j = 0; j < joints; ++j) {
    const identify::LeastSquaresFit& fit = fits[j];
    const identify::ResidualSummary summary = statistics[j].summary(fit.inverse_gram);
    result.push_back({.explained = fit.weighted_tss > 0.0 ? 1.0 - fit.weighted_rss / fit.weighted_tss : 0.0,
                      .estimate = fit.estimate,
                      .own = fit.partial_rms.cwiseQuotient(fit.column_rms),
                      .error = summary.standard_error,
                      .freedom = summary.freedom});
  }
  return result;
}

void find_unrelated_efforts(const Setting& s, const std::vector<JointFit>& joints, std::vector<LogContradiction>& out) {
  for (std::size_t j = 0; j < joints.size(); ++j) {
    const std::string& name = s.measurement.effort_columns[j];
    const bool told = std::ranges::any_of(out, [&](const LogContradiction& c) { return c.subject == name; });
    if (!told && joints[j].explained < kUnrelated) {
      out.push_back(
          {.kind = Kind::effort_unrelated,
           .subject = name,
           .value = joints[j].explained,
           .limit = kUnrelated,
           .sentence = fmt::format("{} does not depend on the motion: all of it together explains {:.2g} % of "
                                   "this effort",
                                   name, 100.0 * std::max(0.0, joints[j].explained)),
           .next = "check that the sensor is connected and that the right column is read (--map)"});
    }
  }
}

// Both wheels of a differential drive carry half of the mass: their efforts must show one and the same.
void find_uneven_efforts(const Setting& s, const std::vector<JointFit>& joints, std::vector<LogContradiction>& out) {
  if (joints.size() != 2 || !model::on_two_wheels(s.robot) || !s.robot.effects.empty()) {
    return;
  }
  const auto columns = side_by_side(s.model);
  const auto mass = std::ranges::find_if(columns, [&](const auto& column) {
    return column.first == 0 && s.model.parameters[column.second].physical == "mass";
  });
  if (mass == columns.end()) {
    return;
  }
  const auto at = static_cast<Eigen::Index>(mass - columns.begin());
  const double right = joints[0].estimate[at], left = joints[1].estimate[at];
  const double least = std::min(right, left), most = std::max(right, left);
  const double error = std::hypot(joints[0].error[at], joints[1].error[at]);
  // On a circle straight motion and turning are one: which of the two a wheel feels is then not told.
  const bool apart = joints[0].own[at] > kOwnMotion && joints[1].own[at] > kOwnMotion;
  if (!apart || !(least > 0.0) || most < kWheelsDiffer * least ||
      most - least < certain(std::min(joints[0].freedom, joints[1].freedom)) * error) {
    return;
  }
  const auto& names = s.measurement.effort_columns;
  const double ratio = most / least;
  out.push_back({.kind = Kind::wheels_disagree,
                 .withdraws = ratio > kWheelsContradict,
                 .subject = right > left ? names[0] : names[1],
                 .value = ratio,
                 .limit = kWheelsContradict,
                 .sentence = fmt::format("by {} the robot has {:.3g} times the mass that it has by {}",
                                         right > left ? names[0] : names[1], ratio, right > left ? names[1] : names[0]),
                 .next = "check unit, gear and torque constant of both efforts; a load far beside the middle does the "
                         "same, and `gap` tells it"});
}

std::string shift_words(const Setting& s, const EffortTiming& timing) {
  const double late = timing.delay;
  const double half = std::abs(std::abs(timing.delay / s.survey.median_step) - 0.5);
  const std::string declare = fmt::format(
      "where the shift is constant and known, declare it, as a range that holds it: `effort: {{delay: [{:.3g}, "
      "{:.3g}]}}` in "
      "the robot file",
      late - 5.0 * timing.standard_error, late + 5.0 * timing.standard_error);
  if (timing.delay < 0.0 && s.measurement.hold == Hold::first_order && half < kManyStepsOff) {
    return "that is half a step: speeds that are differenced backwards, or averaged over two samples, are stamped half "
           "a step late (stamp them in the middle of their interval, or log angles), and efforts that are held "
           "commands want `hold: zero_order`; " +
           declare;
  }
  if (timing.delay > 0.0 && s.measurement.hold == Hold::zero_order && half < kManyStepsOff) {
    return "that is half a step, as with efforts that are measured and not held (`hold: first_order`); " + declare;
  }
  std::string what = "stamp efforts and motion by one clock where they are measured";
  const bool dry = std::ranges::any_of(s.model.parameters, [](const model::Parameter& p) { return p.dry_friction; });
  if (timing.delay < 0.0 && !dry) {
    what += "; dry friction that the model lacks looks like it too, and `gap` tells it";
  }
  return what + "; " + declare;
}

// What a robot file says of the time of its efforts.
std::string effort_declaration(const Robot& robot) {
  std::vector<std::string> keys;
  const auto add = [&](const char* key, const Interval& range) {
    if (range != Interval{}) {
      keys.push_back(fmt::format("{}: [{:g}, {:g}]", key, range.lower, range.upper));
    }
  };
  add("delay", robot.effort_delay);
  add("smoothing", robot.effort_smoothing);
  return fmt::format("`effort: {{{}}}`", fmt::join(keys, ", "));
}

void find_latency(LogSource& log, const Setting& s, const Fit& fit, const std::optional<EffortTiming>& timing,
                  std::vector<LogContradiction>& out) {
  if (s.robot.effort_time_origin == model::EffortTimeOrigin::found) {
    const Interval taken = s.robot.effort_delay, smoothed = s.robot.effort_smoothing;
    const bool late = taken != Interval{}, open = late && smoothed == Interval{} && taken.contains(0.0);
    out.push_back(
        {.kind = Kind::effort_timing,
         .withdraws = false,
         .demotes = true,
         .subject = s.measurement.effort_columns.front(),
         .value = late ? taken.upper : smoothed.upper,
         .limit = 0.0,
         .sentence =
             open ? fmt::format("when the efforts act nobody declares, and the log leaves a delay of {:g} to "
                                "{:g} ms open: it is taken in",
                                1e3 * taken.lower, 1e3 * taken.upper)
                  : fmt::format("the efforts come after the motion, which nobody declares:{}{}",
                                !late ? ""
                                      : fmt::format(" a delay of {:g} to {:g} ms is taken in", 1e3 * taken.lower,
                                                    1e3 * taken.upper),
                                smoothed == Interval{}
                                    ? ""
                                    : fmt::format("{} a low-pass filter of {:g} to {:g} ms is undone",
                                                  late ? ", and" : "", 1e3 * smoothed.lower, 1e3 * smoothed.upper)),
         .next = fmt::format("where that is known, {} in the robot file declares it; {} for narrower bounds",
                             effort_declaration(s.robot),
                             open   ? "`effort: {delay: [0, 0]}`, where efforts and motion have one clock,"
                             : late ? "stamp efforts and motion by one clock"
                                    : "log efforts that are not smoothed")});
  }
  const double step = s.survey.median_step;
  if (!timing || !(is_latency(*timing, step) || (s.noise_complete && may_be_latency(*timing, step)))) {
    return;
  }
  out.push_back(shift_finding(log, s, fit, *timing));
  out.back().withdraws = is_latency(*timing, step);
  out.back().demotes = !out.back().withdraws;
}

void find_wrong_signs(const Setting& s, const Fit& fit, std::vector<LogContradiction>& out) {
  const auto instants = static_cast<double>(std::max<std::size_t>(fit.squares.instants, 1));
  const double effort = std::sqrt(fit.squares.weighted_tss / instants);
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double estimate = fit.estimate[at], error = fit.residuals.standard_error[at];
    if (fit.excitation[j].state != identify::Excitation::identified || s.prior.sides[j].lower < 0.0 ||
        s.measurement.effort_unsigned || !(estimate < -certain(fit.residuals.freedom) * error)) {
      continue;
    }
    const InWords w = in_words(s, j);
    out.push_back({.kind = Kind::wrong_sign,
                   .withdraws = -estimate * fit.squares.column_rms[at] > kMaterial * effort,
                   .subject = s.model.parameters[j].physical,
                   .value = w.value(estimate),
                   .limit = 0.0,
                   .sentence = fmt::format("the log shows a negative {}: {:.4g} ± {:.2g} {}", w.name, w.value(estimate),
                                           2.0 * std::abs(w.scale) * error, w.unit),
                   .next = "check the signs of efforts and motion, right and left, and their clocks; an effect that "
                           "the model lacks (`gap` finds it) may do the same"});
  }
}

// Least squares with dry friction in a model that has none.
void find_dry_friction(LogSource& log, const Setting& s, const Fit& fitted, std::vector<LogContradiction>& out) {
  if (!s.noise_complete || s.measurement.effort_unsigned) {
    return;
  }
  Setting wide = s;
  wide.robot.parameters = model::possible_parameters(s.robot);
  wide.model = model::make_model(wide.robot);
  const auto is_dry = [](const model::Parameter& p) { return p.dry_friction; };
  if (std::ranges::any_of(s.model.parameters, is_dry) || std::ranges::none_of(wide.model.parameters, is_dry)) {
    return;
  }
  const auto at =
      static_cast<Eigen::Index>(std::ranges::find_if(wide.model.parameters, is_dry) - wide.model.parameters.begin());
  TorqueRows rows = make_rows(log, wide, errors_of_fit(wide));
  const Eigen::VectorXd weights = identify::efficient_weights(identify::moments(rows));
  rows.rewind();
  const identify::LeastSquaresFit fit = least_squares(rows, weights);
  identify::ResidualStatistics statistics(fit.estimate, weights);
  core::for_each_block(rows, [&](const RegressionBlock& block) { statistics.add(block); });
  log.rewind();
  const identify::ResidualSummary summary = statistics.summary(fit.inverse_gram);
  const double estimate = fit.estimate[at], error = summary.standard_error[at];
  double limit = certain(summary.freedom) * error;
  if (estimate > limit && !errors_average(log, s, fitted)) {
    Fit widened;
    widened.weights = weights;
    widened.excitation.resize(wide.model.p());
    Box point;
    for (const double theta : fit.estimate) {
      point.sides.push_back({theta, theta});
    }
    limit += explained_by_errors(log, wide, widened, errors_of_fit(wide), point).noise[at];
  }
  if (!(estimate > limit)) {
    return;
  }
  const InWords w = in_words(wide, static_cast<std::size_t>(at));
  out.push_back(
      {.kind = Kind::dry_friction,
       .withdraws = false,
       .demotes = true,
       .subject = "coulomb",
       .value = w.value(estimate),
       .limit = w.value(limit),
       .sentence = fmt::format("the efforts follow the sign of the motion as by dry friction of {:.3g} ± {:.2g} "
                               "{}, which the model does not have",
                               w.value(estimate), 2.0 * std::abs(w.scale) * error, w.unit),
       .next = "give the model `coulomb` (`parameters:` in the robot file)"});
}

// Standard errors by which the estimate of any parameter leaves a set that holds the truth, at a risk of kRiskOfDoubt.
double doubtful(const Commissioning& result) {
  return errors_at(kRiskOfDoubt / static_cast<double>(result.parameters.size()), result.residuals.freedom);
}

// A shift that the log does not exclude, and with which a parameter would be outside its interval.
void find_open_timing(const Commissioning& result, const Setting& s, const EffortTiming& timing,
                      std::vector<LogContradiction>& out) {
  if (s.robot.effort_time_origin == model::EffortTimeOrigin::declared) {
    return;
  }
  LogContradiction found{.kind = Kind::timing_open, .withdraws = false, .demotes = true};
  double most = 0.0;
  for (std::size_t end = 0; end < 2; ++end) {
    for (Eigen::Index j = 0; j < timing.open_change[end].size(); ++j) {
      const ParameterResult& p = result.parameters[static_cast<std::size_t>(j)];
      if (!p.estimate || p.excitation != identify::Excitation::identified || !(p.upper > p.lower)) {
        continue;
      }
      const double from = std::clamp(*p.estimate, p.lower, p.upper), to = from + timing.open_change[end][j];
      const double below = p.lower_is_prior ? 0.0 : p.lower - to, above = p.upper_is_prior ? 0.0 : to - p.upper;
      const double beyond = std::max(below, above) / (p.upper - p.lower);
      if (beyond <= most) {
        continue;
      }
      most = beyond;
      const InWords w = in_words(s, static_cast<std::size_t>(j));
      const double shift = end == 0 ? timing.open.lower : timing.open.upper;
      found.subject = p.parameter.physical;
      found.value = shift;
      found.limit = end == 0 ? timing.allowed.lower : timing.allowed.upper;
      found.sentence = fmt::format(
          "the log does not exclude that the efforts come {:.2g} ms {} the motion: {} would be {:.4g} {} then, outside "
          "[{:.4g}, {:.4g}]",
          1e3 * std::abs(shift), shift > 0.0 ? "after" : "before", w.name, w.value(to), w.unit, w.value(p.lower),
          w.value(p.upper));
    }
  }
  if (most > 0.0) {
    found.next = fmt::format(
        "where the time of the efforts is known, declare it (`effort: {{delay: [0, 0]}}` in the robot file, or the "
        "range that it lies in: the log leaves [{:.2g}, {:.2g}] s open); a drive with faster changes shows it",
        timing.open.lower, timing.open.upper);
    out.push_back(std::move(found));
  }
}

}  // namespace

LogContradiction shift_finding(LogSource& log, const Setting& s, const Fit& fit, const EffortTiming& timing) {
  LogContradiction found{
      .kind = Kind::effort_timing, .value = timing.delay, .limit = kLeastShift * s.survey.median_step};
  if (const auto smoothing = smoothing_behind(log, s, fit, timing)) {
    found.subject = s.measurement.motion_columns.front();
    found.sentence = late_speeds(*smoothing);
    found.next = way_out(*smoothing);
    return found;
  }
  found.subject = s.measurement.effort_columns.front();
  found.sentence =
      fmt::format("the efforts come {:.3g} ± {:.1g} ms {} the motion, {:.2g} steps of the log{}",
                  1e3 * std::abs(timing.delay), 2e3 * timing.standard_error, timing.delay > 0.0 ? "after" : "before",
                  std::abs(timing.delay) / s.survey.median_step,
                  timing.allowed == Interval{} ? ""
                                               : fmt::format(", where {:.3g} to {:.3g} ms are allowed",
                                                             1e3 * timing.allowed.lower, 1e3 * timing.allowed.upper));
  found.next = shift_words(s, timing);
  return found;
}

std::vector<LogContradiction> contradictions_of_efforts(LogSource& log, const Setting& s) {
  std::vector<LogContradiction> found;
  const std::vector<JointFit> joints = fit_joints(log, s);
  find_unrelated_efforts(s, joints, found);
  find_uneven_efforts(s, joints, found);
  log.rewind();
  return found;
}

SignalFindings contradictions_in_log(LogSource& log, const Setting& s, const Fit& fit) {
  SignalFindings findings;
  std::vector<LogContradiction>& found = findings.contradictions;
  find_raw_contradictions(log, s, found);
  const std::vector<JointFit> joints = fit_joints(log, s);
  find_unrelated_efforts(s, joints, found);
  if (found.empty()) {  // nothing else is worth a word beside a dead sensor
    findings.timing = effort_timing(log, s, fit);
    find_latency(log, s, fit, findings.timing, found);
    find_wrong_signs(s, fit, found);
    find_dry_friction(log, s, fit, found);
    find_uneven_efforts(s, joints, found);
    findings.premises = test_premises(log, s, fit, found);
  }
  log.rewind();
  return findings;
}

std::vector<LogContradiction> contradictions_in_result(const Commissioning& result, const Setting& s,
                                                       const std::optional<EffortTiming>& timing, double raised) {
  std::vector<LogContradiction> found;
  if (timing) {
    find_open_timing(result, s, *timing, found);
  }
  const double t = core::student_quantile(0.95, std::max(result.residuals.freedom, 1.0));
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const ParameterResult& p = result.parameters[j];
    const Interval& prior = s.prior.sides[j];
    const InWords w = in_words(s, j);
    if (raised > kMuchRaised && p.estimate && !prior.contains(*p.estimate)) {
      found.push_back({.kind = Kind::prior_edge,
                       .subject = p.parameter.physical,
                       .value = raised,
                       .limit = kMuchRaised,
                       .sentence = fmt::format(
                           "{} is {:.4g} {} by least squares, outside its prior [{:.4g}, {:.4g}]{}; within it the "
                           "noise would have to be {:.3g} times as large",
                           w.name, w.value(*p.estimate), w.unit, w.value(prior.lower), w.value(prior.upper),
                           s.prior_declared[j] ? "" : ", the tool's own wide default", raised),
                       .next = fmt::format(
                           "check units and signs; where they are right, give the robot's own bounds: `prior: {{{}: "
                           "[…, …]}}` in the robot file",
                           p.parameter.physical)});
    }
    if (!p.estimate || p.estimate_inside || !p.standard_error) {
      continue;
    }
    const double gap = *p.estimate < p.lower ? p.lower - *p.estimate : *p.estimate - p.upper;
    const double reach = t * *p.standard_error;
    const bool far = gap > certain(result.residuals.freedom) * *p.standard_error && gap > 0.5 * (p.upper - p.lower);
    found.push_back(
        {.kind = Kind::estimate_outside,
         .withdraws = far && s.noise_complete,
         .demotes = s.noise_complete && gap > doubtful(result) * *p.standard_error,
         .subject = p.parameter.physical,
         .value = *p.estimate,
         .limit = *p.estimate < p.lower ? p.lower : p.upper,
         .sentence = fmt::format("the best guess of {}, {:.5g} ± {:.2g} {}, lies outside [{:.5g}, {:.5g}]{}", w.name,
                                 w.value(*p.estimate), std::abs(w.scale) * reach, w.unit, w.value(p.lower),
                                 w.value(p.upper), gap > reach ? " with its whole 95 % interval" : ""),
         .next = gap > reach ? "one of the assumptions behind them does not hold: look for an offset of an effort, for "
                               "clocks, and let `gap` look for an effect that the model lacks"
                             : "take the interval, not the guess"});
  }
  for (std::size_t i = 0; i < result.validation.size(); ++i) {
    const OutputValidation& v = result.validation[i];
    if (v.outside == 0) {
      continue;
    }
    const double share = static_cast<double>(v.outside) / static_cast<double>(v.instants);
    found.push_back(
        {.kind = Kind::held_out_outside,
         .withdraws = s.noise_complete || share > kManyOutside,
         .subject = s.model.outputs[i],
         .value = share,
         .limit = s.noise_complete ? 0.0 : kManyOutside,
         .sentence = fmt::format("{} of {} instants that were held out ({:.2g} %) leave the thresholds of the "
                                 "{} channel",
                                 v.outside, v.instants, 100.0 * share, s.model.outputs[i]),
         .next = "the log is not of one healthy robot in one kind of driving: look at these moments, drive "
                 "longer, or declare the sensors' noise"});
  }
  return found;
}

namespace {

// How far least squares, of which the explanations are, goes beyond what a finding is about; and for which parameter.
struct Reach {
  std::size_t parameter = 0;
  double size = 0.0;
};

std::optional<Reach> reach_of(const LogContradiction& c, const Commissioning& result, const Fit& fit) {
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const ParameterResult& p = result.parameters[j];
    if (p.parameter.physical == c.subject && p.standard_error) {
      const double estimate = fit.squares.estimate[static_cast<Eigen::Index>(j)];
      return Reach{j, c.kind == Kind::wrong_sign ? -estimate : std::max(p.lower - estimate, estimate - p.upper)};
    }
  }
  return std::nullopt;
}

// A shift that was found, and not one that was taken in, which has no limit.
bool is_shift(const LogContradiction& c) { return c.kind == Kind::effort_timing && c.limit > 0.0; }

bool is_weighed(const LogContradiction& c) {
  return is_shift(c) || (c.withdraws && c.kind == Kind::wrong_sign) ||
         ((c.withdraws || c.demotes) && c.kind == Kind::estimate_outside);
}

}  // namespace

bool wants_weighing(const Commissioning& result, const Setting& s) {
  return s.noise_complete && std::ranges::any_of(result.contradictions, is_weighed);
}

void weigh_contradictions(Commissioning& result, const Setting& s, const Fit& fit,
                          const std::optional<EffortTiming>& timing, const Explained& explained, bool errors_average) {
  for (LogContradiction& c : result.contradictions) {
    if (!is_weighed(c)) {
      continue;
    }
    if (is_shift(c)) {
      const ShiftWeight weight =
          timing ? weigh_shift(*timing, explained, s.survey.median_step) : ShiftWeight::explained;
      c.withdraws = weight == ShiftWeight::told;
      c.demotes = weight == ShiftWeight::doubted;
    } else if (const auto reach = reach_of(c, result, fit)) {
      const auto at = static_cast<Eigen::Index>(reach->parameter);
      const double error = *result.parameters[reach->parameter].standard_error, doubt = explained.in_doubt[at];
      c.withdraws =
          c.withdraws && reach->size > certain(result.residuals.freedom) * error + doubt + explained.noise[at];
      c.demotes = !c.withdraws && errors_average && reach->size > doubtful(result) * error + doubt;
    }
  }
  std::erase_if(result.contradictions,
                [](const LogContradiction& c) { return is_shift(c) && !c.withdraws && !c.demotes; });
}

ShiftWeight weigh_shift(const EffortTiming& timing, const Explained& explained, double step) {
  constexpr double kMuchExplained = 0.75;  // of the residual: more is left where errors merely look like a shift
  const Eigen::Index last = explained.noise.size() - 1;
  const auto beyond = [&](double errors) {
    return timing.beyond() - std::max(errors * timing.standard_error, kLeastShift * step);
  };
  if (const double by = beyond(certain(timing.freedom)) - explained.in_doubt[last];
      is_latency(timing, step) && by > 0.0) {
    return by > explained.noise[last] || timing.residual_ratio < kMuchExplained ? ShiftWeight::told
                                                                                : ShiftWeight::doubted;
  }
  const double by = beyond(errors_at(kRiskOfDoubt, timing.freedom));
  const bool doubted = by > explained.shift_by_chance || (by > 0.0 && timing.residual_ratio < kMuchExplained);
  return may_be_latency(timing, step) && doubted ? ShiftWeight::doubted : ShiftWeight::explained;
}

bool halves_are_explained(LogSource& log, const Robot& robot) {
  constexpr double kUnusedRisk = 1e-3;
  log.rewind();
  const LogTable table = core::read_all(log);
  log.rewind();
  const std::size_t middle = table.rows() / 2;
  return std::ranges::all_of(std::array{std::size_t{0}, middle}, [&](std::size_t first) {
    const LogTable rows = core::slice(table, first, first + middle);
    TableSource half(rows);
    try {
      const Setting s = settle(half, robot);
      return within_declared(half, s, fit_log(half, s, Part::everything, kUnusedRisk), std::nullopt).a_set;
    } catch (const Error&) {
      return false;  // too short, or without motion
    }
  });
}

WithinDeclared within_declared(LogSource& log, const Setting& s, const Fit& fit,
                               const std::optional<EffortTiming>& timing) {
  const RefinedSet found = refined_set(log, s, Part::everything, s.declared, 0);
  WithinDeclared verdict{.a_set = found.result.set.status == FeasibleSet::Status::nonempty};
  if (verdict.a_set && timing && may_be_latency(*timing, s.survey.median_step)) {
    filter::SignalErrors errors = s.declared;
    errors.motion = found.learning;
    const Explained explained = explained_by_errors(log, s, fit, errors, found.result.set.hull);
    verdict.shift = weigh_shift(*timing, explained, s.survey.median_step);
  }
  log.rewind();
  return verdict;
}

void weigh_efforts(LogSource& log, const Setting& s, const filter::SignalErrors& errors, const Box& box,
                   std::vector<LogContradiction>& contradictions) {
  const auto of_efforts = [](const LogContradiction& c) {
    return c.kind == Kind::effort_unrelated || (c.kind == Kind::wheels_disagree && c.withdraws);
  };
  if (!s.noise_complete || std::ranges::none_of(contradictions, of_efforts)) {
    return;
  }
  const Eigen::VectorXd largest = box.magnitudes();
  double effort = 0.0, error = 0.0;
  TorqueRows rows = make_rows(log, s, errors);
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    effort += block.y.squaredNorm();
    error += (block.dY * largest + block.dy).squaredNorm();
  });
  log.rewind();
  const double share = effort > 0.0 ? std::sqrt(error / effort) : core::kInfinity;
  for (LogContradiction& c : contradictions) {
    // Errors of this share can make (1 − share)/(1 + share) of equal masses.
    if (c.kind == Kind::wheels_disagree && share >= (c.value - 1.0) / (c.value + 1.0)) {
      c.demotes = c.demotes || c.withdraws;
      c.withdraws = false;
    }
  }
  if (share >= 1.0) {
    std::erase_if(contradictions, [](const LogContradiction& c) { return c.kind == Kind::effort_unrelated; });
  }
}

}  // namespace wheelwright::commission
