// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/contradictions.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/physical.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/identify/noise_level.hpp>
#include <wheelwright/identify/time_shift.hpp>
#include <wheelwright/identify/variable_projection.hpp>

namespace wheelwright::commission {

std::string_view to_string(LogContradiction::Kind kind) {
  switch (kind) {
    case LogContradiction::Kind::effort_constant: return "effort_constant";
    case LogContradiction::Kind::angle_wrapped: return "angle_wrapped";
    case LogContradiction::Kind::stamps_scatter: return "stamps_scatter";
    case LogContradiction::Kind::effort_unrelated: return "effort_unrelated";
    case LogContradiction::Kind::effort_timing: return "effort_timing";
    case LogContradiction::Kind::wheels_disagree: return "wheels_disagree";
    case LogContradiction::Kind::wrong_sign: return "wrong_sign";
    case LogContradiction::Kind::dry_friction: return "dry_friction";
    case LogContradiction::Kind::prior_edge: return "prior_edge";
    case LogContradiction::Kind::estimate_outside: return "estimate_outside";
    case LogContradiction::Kind::halves_disagree: return "halves_disagree";
    case LogContradiction::Kind::held_out_outside: return "held_out_outside";
  }
  return "";
}

namespace {

using Kind = LogContradiction::Kind;

constexpr double kRiskOfWithdrawal =
    1e-8;                                // two-sided, of Student's t: a model is withdrawn in error once in 10⁸ looks
constexpr double kMaterial = 0.1;        // of the weighted effort: a wrong sign below it is a note
constexpr double kLeastShift = 0.25;     // of a step: interpolation between samples leaves up to a tenth of one
constexpr double kMovesParameter = 2.0;  // standard errors
constexpr double kLowersResidual = 0.99;
constexpr double kMirror = 1.001;          // a true shift is worse than none with its sign turned
constexpr double kUnrelated = 0.05;        // share of an effort's variation that motion must explain of it
constexpr double kManyStepsOff = 0.2;      // of a step: how near half a step a shift must be to be one
constexpr double kMuchRaised = 3.0;        // factor on an estimated noise bound
constexpr double kOwnMotion = 0.2;         // share of a column that is not the others', below which none is told apart
constexpr double kWheelsDiffer = 1.15;     // ratio of the masses that two wheels show: worth a note
constexpr double kWheelsContradict = 1.8;  // the same: a unit, a gear or a sensor is wrong
constexpr double kManyOutside = 0.01;      // of the held-out instants
constexpr std::size_t kFewestHalf = 200;   // instants of a half from which on it is looked at

// Standard errors beyond which a difference is taken for real.
double certain(double freedom) { return core::student_quantile(1.0 - kRiskOfWithdrawal, std::max(freedom, 1.0)); }

// A column of the log over all rows.
struct ColumnRange {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  [[nodiscard]] bool constant() const { return least == most; }
};

std::vector<ColumnRange> ranges_of(LogSource& log, const std::vector<std::string>& columns) {
  std::vector<std::size_t> pick;
  for (const std::string& column : columns) {
    pick.push_back(*log.find(column));
  }
  std::vector<ColumnRange> ranges(columns.size());
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    for (std::size_t c = 0; c < pick.size() && block.rows() > 0; ++c) {
      const auto [least, most] = std::ranges::minmax(block.columns[pick[c]]);
      ranges[c] = {std::min(ranges[c].least, least), std::max(ranges[c].most, most)};
    }
  }
  log.rewind();
  return ranges;
}

void find_constant_efforts(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
  const std::vector<ColumnRange> efforts = ranges_of(log, s.measurement.effort_columns);
  const std::vector<ColumnRange> motions = ranges_of(log, s.measurement.motion_columns);
  for (std::size_t j = 0; j < efforts.size(); ++j) {
    if (efforts[j].constant() && !motions[j].constant()) {
      const std::string& name = s.measurement.effort_columns[j];
      out.push_back({.kind = Kind::effort_constant,
                     .subject = name,
                     .value = efforts[j].least,
                     .sentence = fmt::format("{} is {:.6g} in every row although {} changes: no force is measured",
                                             name, efforts[j].least, s.measurement.motion_columns[j]),
                     .next = "check that the sensor is connected and that the right column is read (--map)"});
    }
  }
}

void find_wrapped_angles(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
  constexpr double kHalfTurn = std::numbers::pi;
  constexpr double kMoves = 0.25;  // of a half turn: at most this much otherwise between two rows
  if (s.measurement.motion != MotionKind::angle) {
    return;
  }
  const std::vector<ColumnRange> ranges = ranges_of(log, s.measurement.motion_columns);
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    const std::string& name = s.measurement.motion_columns[j];
    if (ranges[j].most - ranges[j].least > 2.0 * kHalfTurn * (1.0 + 1e-6)) {
      continue;
    }
    const std::size_t column = *log.find(name);
    double last = std::numeric_limits<double>::quiet_NaN(), least_jump = core::kInfinity, most_move = 0.0;
    std::size_t jumps = 0;
    LogBlock block;
    log.rewind();
    while (log.next(block)) {
      for (const double value : block.columns[column]) {
        const double moved = std::abs(value - last);
        if (moved > kHalfTurn) {
          ++jumps;
          least_jump = std::min(least_jump, moved);
        } else if (moved <= kHalfTurn) {
          most_move = std::max(most_move, moved);
        }
        last = value;
      }
    }
    if (jumps > 0 && most_move < kMoves * kHalfTurn) {
      out.push_back({.kind = Kind::angle_wrapped,
                     .subject = name,
                     .value = least_jump,
                     .limit = kHalfTurn,
                     .sentence = fmt::format("{} stays within one turn and jumps by {:.3g} rad and more between two "
                                             "rows, {} times: it is wrapped",
                                             name, least_jump, jumps),
                     .next = "unwrap the angle (numpy.unwrap) before commissioning; files are unwrapped on reading"});
    }
  }
  log.rewind();
}

// A sample against the line through its neighbours, drawn over the stamps and over row numbers. Of angles: the speed of
// a motor that follows its controller at once may well be a function of the controller's cycle.
void find_scattered_stamps(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
  constexpr double kEven = 0.02;     // relative: steps that differ by less are even
  constexpr double kSmoother = 0.5;  // rms over row numbers over that over stamps
  if (s.measurement.motion != MotionKind::angle) {
    return;
  }
  std::vector<std::size_t> pick;
  for (const std::string& column : s.measurement.motion_columns) {
    pick.push_back(*log.find(column));
  }
  const double longest = s.measurement.longest_step();
  std::vector<double> before(pick.size()), middle(pick.size());
  double t_before = 0.0, t_middle = 0.0, by_stamp = 0.0, by_row = 0.0;
  std::size_t known = 0, looked = 0;
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const double t = block.t[k];
      const bool starts =
          std::ranges::binary_search(block.segment_starts, k) || (known > 0 && longest > 0.0 && t - t_middle > longest);
      known = starts ? 0 : known;
      if (known >= 2) {
        const double a = t_middle - t_before, b = t - t_middle;
        if (std::abs(a - b) > kEven * (a + b)) {
          ++looked;
          for (std::size_t c = 0; c < pick.size(); ++c) {
            const double value = block.columns[pick[c]][k];
            const double stamp = middle[c] - (before[c] * b + value * a) / (a + b);
            const double row = middle[c] - 0.5 * (before[c] + value);
            by_stamp += stamp * stamp;
            by_row += row * row;
          }
        }
      }
      for (std::size_t c = 0; c < pick.size(); ++c) {
        before[c] = middle[c];
        middle[c] = block.columns[pick[c]][k];
      }
      t_before = t_middle;
      t_middle = t;
      ++known;
    }
  }
  log.rewind();
  const double ratio = by_stamp > 0.0 ? std::sqrt(by_row / by_stamp) : 1.0;
  if (looked >= kFewestHalf && ratio < kSmoother) {
    out.push_back(
        {.kind = Kind::stamps_scatter,
         .subject = "t",
         .value = ratio,
         .limit = kSmoother,
         .sentence = fmt::format("the motion is {:.2g} times as rough over the stamps as over the row numbers: "
                                 "the samples are even, their stamps scatter",
                                 1.0 / std::max(ratio, std::numeric_limits<double>::min())),
         .next = "stamp samples where they are taken, or number them: times that go up by the cycle's length"});
  }
}

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
  RegressionBlock block;
  const auto each = [&](auto&& visit) {
    rows.rewind();
    while (rows.next(block)) {
      for (std::size_t j = 0; j < joints; ++j) {
        visit(j, joint_rows(block, shares.row(static_cast<Eigen::Index>(j)), columns));
      }
    }
  };
  each([&](std::size_t j, const RegressionBlock& of_joint) { sums[j].add(of_joint); });
  if (sums.front().instants() < kFewestHalf) {
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

// The rows of `model` shifted by `shift`, weighted: θ, its residual, and what a further shift adds beyond θ. Nothing
// outside of the shifts that the model is searched for.
struct Shifted {
  Eigen::VectorXd theta, residual, more;
};

std::optional<Shifted> at_shift(const identify::TimeShiftedRows& model, double shift, const Eigen::VectorXd& weights) {
  identify::SeparableValues at;
  if (!model.evaluate(Eigen::VectorXd::Constant(1, shift), true, at)) {
    return std::nullopt;
  }
  Eigen::VectorXd y = model.response();
  for (Eigen::Index r = 0; r < y.size(); ++r) {
    const double w = weights[r % weights.size()];
    at.columns.row(r) *= w;
    at.columns_by[0].row(r) *= w;
    y[r] *= w;
  }
  const auto qr = at.columns.colPivHouseholderQr();
  Shifted out{.theta = qr.solve(y), .residual = {}, .more = {}};
  out.residual = y - at.columns * out.theta;
  out.more = at.columns_by[0] * out.theta;
  out.more -= at.columns * qr.solve(out.more);
  return out;
}

// The score of a further shift at `from`, in standard errors that the residual at `to` gives it.
double score_of(const Shifted& from, const Shifted& to, Eigen::Index outputs) {
  identify::BlockSums scores(1);
  for (Eigen::Index k = 0; k < from.more.size(); k += outputs) {
    scores.add(Eigen::VectorXd::Constant(1, from.more.segment(k, outputs).dot(to.residual.segment(k, outputs))));
  }
  const double variance = identify::long_run_covariance(scores).matrix(0, 0);
  return variance > 0.0 ? from.more.dot(from.residual) / std::sqrt(variance) : 0.0;
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
    return "that is half a step: speeds that are differenced backwards are stamped half a step late (stamp them in the "
           "middle of their interval, or log angles), and efforts that are held commands want `hold: zero_order`; " +
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

void find_latency(const Setting& s, const std::optional<EffortTiming>& timing, std::vector<LogContradiction>& out) {
  if (!timing || !is_latency(*timing, s.survey.median_step)) {
    return;
  }
  out.push_back(
      {.kind = Kind::effort_timing,
       .subject = s.measurement.effort_columns.front(),
       .value = timing->delay,
       .limit = kLeastShift * s.survey.median_step,
       .sentence = fmt::format("the efforts come {:.3g} ± {:.1g} ms {} the motion, {:.2g} steps of the log{}",
                               1e3 * std::abs(timing->delay), 2e3 * timing->standard_error,
                               timing->delay > 0.0 ? "after" : "before", std::abs(timing->delay) / s.survey.median_step,
                               timing->allowed.lower == 0.0 && timing->allowed.upper == 0.0
                                   ? ""
                                   : fmt::format(", where {:.3g} to {:.3g} ms are allowed", 1e3 * timing->allowed.lower,
                                                 1e3 * timing->allowed.upper)),
       .next = shift_words(s, *timing)});
}

// A parameter as people know it: name, value and unit.
struct InWords {
  std::string name, unit;
  double scale = 1.0, offset = 0.0;
  [[nodiscard]] double value(double theta) const { return scale * theta - offset; }
};

InWords in_words(const Setting& s, std::size_t j) {
  const auto scales = physical_scales(s.robot, s.model);
  const model::Parameter& p = s.model.parameters[j];
  return scales ? InWords{p.physical, p.physical_unit, (*scales)[j].scale, (*scales)[j].offset}
                : InWords{p.name, parameter_unit(s.robot, p)};
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
void find_dry_friction(LogSource& log, const Setting& s, std::vector<LogContradiction>& out) {
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
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    statistics.add(block);
  }
  log.rewind();
  const identify::ResidualSummary summary = statistics.summary(fit.inverse_gram);
  const double estimate = fit.estimate[at], error = summary.standard_error[at];
  if (!(estimate > certain(summary.freedom) * error)) {
    return;
  }
  const InWords w = in_words(wide, static_cast<std::size_t>(at));
  out.push_back(
      {.kind = Kind::dry_friction,
       .withdraws = false,
       .demotes = true,
       .subject = "coulomb",
       .value = w.value(estimate),
       .limit = w.value(certain(summary.freedom) * error),
       .sentence = fmt::format("the efforts follow the sign of the motion as by dry friction of {:.3g} ± {:.2g} "
                               "{}, which the model does not have",
                               w.value(estimate), 2.0 * std::abs(w.scale) * error, w.unit),
       .next = "give the model `coulomb` (`parameters:` in the robot file)"});
}

// Least squares on each half of the log's rows.
void find_uneven_halves(LogSource& log, const Setting& s, const Fit& fit, std::vector<LogContradiction>& out) {
  const Eigen::VectorXd& bias = fit.choice.predicted_bias;  // of least squares, which depends on the driving
  if (fit.choice.candidates.empty() || fit.choice.in_doubt || bias.size() == 0 || !bias.allFinite()) {
    return;
  }
  const double biased = 2.0 * bias.cwiseAbs().maxCoeff();  // standard errors that two halves may differ by
  const std::size_t middle = s.survey.rows / 2;
  TorqueRows rows = make_rows(log, s, errors_of_fit(s));
  RegressionBlock block;
  const auto each = [&](auto&& visit) {
    rows.rewind();
    while (rows.next(block)) {
      const auto from = std::ranges::lower_bound(block.sample, middle) - block.sample.begin();
      visit(std::size_t{0}, std::size_t{0}, static_cast<std::size_t>(from));
      visit(std::size_t{1}, static_cast<std::size_t>(from), block.instants());
    }
  };
  std::vector<identify::LeastSquares> sums(2, identify::LeastSquares(s.model.p(), fit.weights));
  each([&](std::size_t half, std::size_t first, std::size_t last) { sums[half].add(block, first, last); });
  if (std::min(sums[0].instants(), sums[1].instants()) < kFewestHalf) {
    return;
  }
  std::vector<bool> excluded;
  for (const identify::ExcitationFinding& finding : fit.excitation) {
    excluded.push_back(finding.state == identify::Excitation::not_excited);
  }
  std::vector<identify::LeastSquaresFit> fits;
  std::vector<identify::ResidualStatistics> statistics;
  for (const identify::LeastSquares& sum : sums) {
    fits.push_back(sum.solve(excluded));
    statistics.emplace_back(fits.back().estimate, fit.weights);
  }
  each([&](std::size_t half, std::size_t first, std::size_t last) { statistics[half].add(block, first, last); });
  std::vector<identify::ResidualSummary> residuals;
  std::vector<std::vector<identify::ExcitationFinding>> excitation;
  for (std::size_t half = 0; half < 2; ++half) {
    residuals.push_back(statistics[half].summary(fits[half].inverse_gram));
    excitation.push_back(
        identify::judge_excitation(fits[half], residuals[half].standard_error,
                                   core::student_quantile(0.95, std::max(residuals[half].freedom, 1.0))));
  }
  for (std::size_t j = 0; j < s.model.p(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double a = fits[0].estimate[at], b = fits[1].estimate[at];
    const double error = std::hypot(residuals[0].standard_error[at], residuals[1].standard_error[at]);
    const bool shown = !excluded[j] && excitation[0][j].state != identify::Excitation::not_excited &&
                       excitation[1][j].state != identify::Excitation::not_excited;
    const double sure = (certain(std::min(residuals[0].freedom, residuals[1].freedom)) + biased) * error;
    if (!shown || !(std::abs(a - b) > sure)) {
      continue;
    }
    const InWords w = in_words(s, j);
    const double half_a = 2.0 * std::abs(w.scale) * residuals[0].standard_error[at];
    const double half_b = 2.0 * std::abs(w.scale) * residuals[1].standard_error[at];
    out.push_back({.kind = Kind::halves_disagree,
                   .withdraws = false,
                   .subject = s.model.parameters[j].physical,
                   .value = std::abs(a - b),
                   .limit = sure,
                   .sentence = fmt::format("the first half of the log gives {} {:.4g} ± {:.2g} {}, the second {:.4g} ± "
                                           "{:.2g} {}",
                                           w.name, w.value(a), half_a, w.unit, w.value(b), half_b, w.unit),
                   .next = "the robot changed on the way (load, temperature, a fault), or the model lacks an effect: "
                           "commission the halves by themselves, or let `gap` look at the log"});
  }
}

}  // namespace

std::optional<EffortTiming> effort_timing(LogSource& log, const Setting& s, const Fit& fit, double longest,
                                          std::size_t most_rows) {
  if (s.measurement.effort_unsigned) {
    return std::nullopt;
  }
  Setting as_logged = s;  // a declared delay is compared with what is found, not taken away before
  as_logged.measurement.delay = {0.0, 0.0};
  TorqueRows stream = make_rows(log, as_logged, errors_of_fit(s));
  RegressionBlock rows = first_rows(stream, most_rows);
  log.rewind();
  rows.dY.setZero();
  rows.dy.setZero();
  if (rows.instants() < kFewestHalf) {
    return std::nullopt;
  }
  try {
    const identify::TimeShiftedRows model(rows, identify::TimeEffect::delay, -longest, longest);
    identify::VariableProjectionOptions options = model.options();
    options.weights = fit.weights;
    const identify::SeparableFit found = identify::variable_projection(model, options);
    constexpr double kInside = 0.97;  // of the range that is searched: its end is no answer
    if (found.end != identify::SearchEnd::converged || found.state[0] != identify::ShapeState::identified ||
        std::abs(found.shape[0]) > kInside * longest) {
      return std::nullopt;
    }
    EffortTiming timing{.delay = found.shape[0], .standard_error = found.standard_error[0], .freedom = found.freedom};
    timing.allowed = s.measurement.delay;
    const bool held = s.measurement.hold == Hold::zero_order;
    const bool ranged = timing.allowed.lower != 0.0 || timing.allowed.upper != 0.0;
    // As the rows' own hull: a value may come into force up to a step before its stamp; a measured one lies between
    // two.
    if (s.declared.between_samples && (ranged || (held && s.measurement.changes == model::EffortChanges::between))) {
      timing.allowed.upper += s.survey.median_step;
      timing.allowed.lower -= held ? 0.0 : s.survey.median_step;
    }
    const double nearest = std::clamp(timing.delay, timing.allowed.lower, timing.allowed.upper);
    const auto taken = at_shift(model, nearest, fit.weights), shifted = at_shift(model, timing.delay, fit.weights),
               mirrored = at_shift(model, 2.0 * nearest - timing.delay, fit.weights);
    if (!taken || !shifted) {
      return std::nullopt;  // what is allowed lies outside of what is searched
    }
    const double without = taken->residual.norm();
    timing.residual_ratio = without > 0.0 ? std::sqrt(found.weighted_rss) / without : 1.0;
    timing.mirror_ratio = without > 0.0 && mirrored ? mirrored->residual.norm() / without : 1.0;
    timing.score = score_of(*taken, *shifted, static_cast<Eigen::Index>(s.model.n()));
    const Eigen::VectorXd moved = (found.linear - taken->theta).cwiseAbs();
    for (std::size_t j = 0; j < s.model.p(); ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      const double error = fit.residuals.standard_error[at];
      if (fit.excitation[j].state == identify::Excitation::identified && error > 0.0) {
        timing.moved = std::max(timing.moved, moved[at] / error);
      }
    }
    return timing;
  } catch (const InvalidArgument&) {
    return std::nullopt;  // segments shorter than the longest shift
  }
}

bool is_latency(const EffortTiming& timing, double step) {
  const double shift = timing.beyond(), score = timing.delay < timing.allowed.lower ? -timing.score : timing.score;
  return shift > kLeastShift * step && shift > certain(timing.freedom) * timing.standard_error &&
         score > certain(timing.freedom) && timing.mirror_ratio > kMirror &&
         (timing.residual_ratio < kLowersResidual || timing.moved > kMovesParameter);
}

SignalFindings contradictions_in_log(LogSource& log, const Setting& s, const Fit& fit) {
  SignalFindings findings;
  std::vector<LogContradiction>& found = findings.contradictions;
  find_wrapped_angles(log, s, found);
  find_scattered_stamps(log, s, found);
  find_constant_efforts(log, s, found);
  const std::vector<JointFit> joints = fit_joints(log, s);
  find_unrelated_efforts(s, joints, found);
  if (found.empty()) {  // nothing else is worth a word beside a dead sensor
    findings.timing = effort_timing(log, s, fit);
    find_latency(s, findings.timing, found);
    find_wrong_signs(s, fit, found);
    find_dry_friction(log, s, found);
    find_uneven_efforts(s, joints, found);
    find_uneven_halves(log, s, fit, found);
  }
  log.rewind();
  return findings;
}

std::vector<LogContradiction> contradictions_in_result(const Commissioning& result, const Setting& s, double raised) {
  std::vector<LogContradiction> found;
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

bool is_weighed(const LogContradiction& c) {
  return c.kind == Kind::effort_timing ||
         (c.withdraws && (c.kind == Kind::wrong_sign || c.kind == Kind::estimate_outside));
}

}  // namespace

bool wants_weighing(const Commissioning& result, const Setting& s) {
  return s.noise_complete && std::ranges::any_of(result.contradictions, is_weighed);
}

void weigh_contradictions(Commissioning& result, const Setting& s, const Fit& fit,
                          const std::optional<EffortTiming>& timing, const Explained& explained) {
  const auto weigh = [](LogContradiction& c, double size, double chance, double doubt, double noise) {
    c.withdraws = size > chance + doubt + noise;
    c.demotes = !c.withdraws && size > chance + doubt;
  };
  const auto p = static_cast<Eigen::Index>(s.model.p());
  for (LogContradiction& c : result.contradictions) {
    if (!is_weighed(c)) {
      continue;
    }
    if (c.kind == Kind::effort_timing) {
      if (timing) {
        const double chance =
            std::max(certain(timing->freedom) * timing->standard_error, kLeastShift * s.survey.median_step);
        weigh(c, timing->beyond(), chance, explained.in_doubt[p], explained.noise[p]);
      }
    } else if (const auto reach = reach_of(c, result, fit)) {
      const auto at = static_cast<Eigen::Index>(reach->parameter);
      weigh(c, reach->size, certain(result.residuals.freedom) * *result.parameters[reach->parameter].standard_error,
            explained.in_doubt[at], explained.noise[at]);
    }
  }
  std::erase_if(result.contradictions,
                [](const LogContradiction& c) { return c.kind == Kind::effort_timing && !c.withdraws && !c.demotes; });
}

void weigh_efforts(LogSource& log, const Setting& s, const filter::SignalErrors& errors, const Box& box,
                   std::vector<LogContradiction>& contradictions) {
  const auto of_efforts = [](const LogContradiction& c) {
    return c.kind == Kind::effort_unrelated || (c.kind == Kind::wheels_disagree && c.withdraws);
  };
  if (!s.noise_complete || std::ranges::none_of(contradictions, of_efforts)) {
    return;
  }
  Eigen::VectorXd largest(static_cast<Eigen::Index>(box.sides.size()));
  for (std::size_t j = 0; j < box.sides.size(); ++j) {
    largest[static_cast<Eigen::Index>(j)] = core::magnitude(box.sides[j]);
  }
  double effort = 0.0, error = 0.0;
  TorqueRows rows = make_rows(log, s, errors);
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    effort += block.y.squaredNorm();
    error += (block.dY * largest + block.dy).squaredNorm();
  }
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
