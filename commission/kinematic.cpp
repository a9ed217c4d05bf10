// SPDX-License-Identifier: Apache-2.0
#include "commission/kinematic.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/evidence.hpp"
#include "commission/fit.hpp"
#include "commission/noise_budget.hpp"
#include "commission/pose_origin.hpp"
#include "commission/pose_timing.hpp"
#include "commission/setting_rows.hpp"
#include "commission/speed_unit.hpp"
#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "detector/threshold.hpp"
#include "identify/least_squares.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

using Status = KinematicCommissioning::Status;

constexpr double kOdometryConfidence = 0.95;  // of the statistical intervals
constexpr std::size_t kFewestWindows = 8;
constexpr double kMostlySeen = 0.9;  // share of a parameter's change that a log must show for it to be given a number

// What is settled before a fit.
struct Frame {
  LogSource* log = nullptr;
  filter::OdometryMeasurement measurement;
  double window = 1.0;
  filter::OdometryErrors declared;  // without ē
  std::vector<bool> is_declared;
  Box prior;
  Eigen::VectorXd nominal;
  double rolled = 0.0;  // root mean square of the error of a wheel's turn over a window, rad; 0 where it is not known
  FoldOptions folds;
  identify::ExtrapolationOptions extrapolation;
  std::size_t log_rows = 0;
};

struct OdometryFit {
  identify::LeastSquaresFit squares;
  identify::ResidualSummary residuals;
  std::vector<identify::ExcitationFinding> excitation;
  Eigen::VectorXd plausible;
  Eigen::VectorXd untold;  // per output: the most that directions of noise alone can add within the prior
};

struct BoundedSet {
  FeasibleSet set;
  double raise = 1.0;
};

// What the motion at a pose's time may be elsewhere than the samples about it say. Angles behind mean speeds are taken
// half-way between their times: a·h²/8. Speeds are integrated by the trapezoidal rule: with no more than a limit on the
// acceleration that is wrong by a·h/4 of a speed.
double between_samples(double acceleration, const Survey& survey, MotionKind motion) {
  const double h = survey.largest_step;
  switch (motion) {
    case MotionKind::angle: return 0.0;
    case MotionKind::mean_speed: return acceleration * h * h / 8.0;
    case MotionKind::speed: return acceleration * h / 4.0;
  }
  return 0.0;
}

Frame settle(LogSource& log, const Robot& robot, const filter::OdometryMeasurement& m, const Survey& survey,
             const KinematicCommissionOptions& options) {
  check::that(options.radius_share > 0.0 && options.radius_share < 1.0, "radius share", "a number inside (0, 1)");
  Frame s;
  s.log = &log;
  s.measurement = m;
  s.window = check::positive(options.window, "window");
  s.folds = options.folds;
  s.folds.purge = s.window;
  s.extrapolation = options.extrapolation;
  s.log_rows = survey.rows;
  const double radius = robot.wheel_radius, gain = robot.wheel_radius / robot.track_width;
  std::vector<double> nominal;
  const auto side = [&](double value) {
    nominal.push_back(value);
    s.prior.sides.push_back({(1.0 - options.radius_share) * value, (1.0 + options.radius_share) * value});
  };
  for (int wheel = 0; m.position && wheel < 2; ++wheel) {
    side(radius);
  }
  side(gain);
  side(gain);
  if (m.gyro) {
    nominal.push_back(0.0);
    s.prior.sides.push_back({-options.bias, options.bias});
  }
  s.nominal = Eigen::Map<const Eigen::VectorXd>(nominal.data(), static_cast<Eigen::Index>(nominal.size()));

  Measurement wheels;
  wheels.motion = m.motion;
  wheels.count = m.count;
  wheels.nominal_step = m.nominal_step;
  const auto motion = motion_error(robot, wheels);
  if (motion) {
    s.rolled = *motion / std::sqrt(3.0) * (m.motion == MotionKind::speed ? s.window : std::numbers::sqrt2);
  }
  const bool declared_motion = motion && (m.motion == MotionKind::angle || robot.noise.wheel_speed.value ||
                                          robot.noise.wheel_angle.value || robot.encoder_counts_per_turn);
  const bool heading = declared_motion && robot.noise.heading.value;
  const bool position = heading && robot.noise.position.value;
  // Four times what samples show bounds nothing of use for a rate between samples.
  const bool gyro = declared_motion && m.gyro && robot.noise.gyro.value && robot.limits.contains("acceleration");
  for (const std::string& output : m.outputs()) {
    s.is_declared.push_back(output == "yaw" ? heading : output == "gyro_yaw" ? gyro : position);
  }
  if (heading || gyro) {
    const std::vector<double> limit = acceleration_limit(robot, survey, m.motion, *motion);
    s.declared.acceleration = limit.empty() ? 0.0 : *std::ranges::max_element(limit);
    s.declared.motion = *motion + between_samples(s.declared.acceleration, survey, m.motion);
    s.declared.heading = robot.noise.heading.value.value_or(0.0);
    s.declared.gyro = gyro ? *robot.noise.gyro.value : 0.0;
    s.declared.position = robot.noise.position.value.value_or(0.0);
    s.declared.yaw_gain = (1.0 + options.radius_share) * gain;
  }
  return s;
}

filter::OdometryRows make_rows(const Frame& s, const filter::OdometryErrors& errors) {
  return {*s.log, filter::OdometryFilter(s.measurement, s.window, errors)};
}

filter::OdometryErrors with_noise(const Frame& s, const std::vector<OutputNoise>& noise, RowUse use) {
  Eigen::VectorXd estimated = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(noise.size()));
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (noise[i].origin == core::NoiseOrigin::estimated) {
      estimated[static_cast<Eigen::Index>(i)] =
          std::max(use == RowUse::learning ? noise[i].learning : noise[i].bound, std::numeric_limits<double>::min());
    }
  }
  filter::OdometryErrors errors = s.declared;
  errors.estimated = std::move(estimated);
  return errors;
}

Eigen::VectorXd weights_of(const identify::ResidualSummary& residuals) {
  Eigen::VectorXd weights(static_cast<Eigen::Index>(residuals.outputs.size()));
  double size = 0.0;  // of the largest output, in m or rad: one that shows nothing at all has no scale of its own
  for (const identify::OutputResidual& output : residuals.outputs) {
    size = std::max(size, output.torque_rms);
  }
  const double floor = size > 0.0 ? 1e-9 * size : 1.0;
  for (std::size_t i = 0; i < residuals.outputs.size(); ++i) {
    weights[static_cast<Eigen::Index>(i)] = 1.0 / std::max(residuals.outputs[i].rms, floor);
  }
  return weights;
}

// Root mean square of what the errors of the wheels' turns put into each weighted column; elsewhere next to nothing.
Eigen::VectorXd column_noise(const Frame& s, const Eigen::VectorXd& weights, const Eigen::VectorXd& column_rms) {
  Eigen::VectorXd noise = (1e-9 * column_rms).cwiseMax(std::numeric_limits<double>::min());
  const Eigen::Index positions = s.measurement.position ? 2 : 0;
  noise.head(positions).setConstant(0.5 * weights.head(positions).norm() * s.rolled);
  noise.segment(positions, 2).setConstant(weights.tail(weights.size() - positions).norm() * s.rolled);
  return noise;
}

// Directions in which the columns hold noise alone: wheels that turn in a fixed ratio show what that ratio makes of
// their radii, and nothing else. Least squares would be drawn along them by the noise.
struct NoiseDirections {
  Eigen::MatrixXd directions;  // p × k
  Eigen::VectorXd most;        // k: largest share of each within the prior about the nominal values
  Eigen::VectorXd seen;        // p: share of each parameter's own change that the other directions show
};

// Takes these directions out of the fit of deviations from the nominal values.
NoiseDirections hold_noise_directions(const Frame& s, const identify::LeastSquares& squares,
                                      const Eigen::VectorXd& noise, identify::LeastSquaresFit& fit) {
  const Eigen::Index p = noise.size();
  const Eigen::MatrixXd factor = squares.factor() / std::sqrt(static_cast<double>(squares.instants()));
  const core::SingularValues svd =
      core::singular_values(factor.topLeftCorner(p, p) * noise.cwiseInverse().asDiagonal());
  const auto kept = static_cast<Eigen::Index>(
      std::ranges::count_if(svd.values, [](double value) { return value >= identify::signal_over_noise; }));
  const Eigen::MatrixXd D = noise.cwiseInverse().asDiagonal() * svd.V;
  const Eigen::MatrixXd shares = svd.V.transpose() * noise.asDiagonal();  // D⁻¹
  NoiseDirections out{D.rightCols(p - kept), Eigen::VectorXd::Zero(p - kept), Eigen::VectorXd::Ones(p)};
  if (kept == p) {
    return out;
  }
  const Eigen::MatrixXd pseudo =
      D.leftCols(kept) * svd.values.head(kept).cwiseInverse().asDiagonal() * svd.U.leftCols(kept).transpose();
  fit.estimate = pseudo * factor.col(p).head(p);
  fit.inverse_gram = pseudo * pseudo.transpose() / static_cast<double>(squares.instants());
  out.seen = (D.leftCols(kept) * shares.topRows(kept)).diagonal();
  Eigen::VectorXd reach(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& side = s.prior.sides[static_cast<std::size_t>(j)];
    reach[j] = std::max(std::abs(side.upper - s.nominal[j]), std::abs(side.lower - s.nominal[j]));
  }
  out.most = shares.bottomRows(p - kept).cwiseAbs() * reach;
  return out;
}

// Per output, the most that `held` can add to a row.
Eigen::VectorXd largest_untold(core::RegressionSource& rows, const NoiseDirections& held) {
  const auto n = static_cast<Eigen::Index>(rows.outputs());
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(n);
  RegressionBlock block;
  rows.rewind();
  while (held.most.size() > 0 && rows.next(block)) {
    const Eigen::VectorXd size = (block.Y * held.directions).cwiseAbs() * held.most;
    for (Eigen::Index r = 0; r < size.size(); ++r) {
      largest[r % n] = std::max(largest[r % n], size[r]);
    }
  }
  return largest;
}

// Least squares, weighted once more by its own residuals; parameters that the log does not show are held at their
// nominal values, which the rows are measured from.
std::optional<OdometryFit> fit_rows(const Frame& s, Part part, double risk) {
  filter::OdometryRows stream = make_rows(s, s.declared);
  FoldedSource rows(stream, part, s.log_rows, s.folds);
  OdometryFit fit;
  NoiseDirections held;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(rows.outputs()));
  for (int pass = 0; pass < 2; ++pass) {
    identify::LeastSquares squares(rows.parameters(), weights);
    core::for_each_block(rows, [&](RegressionBlock& block) {
      block.y -= block.Y * s.nominal;
      squares.add(block);
    });
    if (squares.instants() < kFewestWindows * rows.parameters()) {
      return std::nullopt;
    }
    std::vector<bool> excluded;
    const auto solve = [&] {
      fit.squares = squares.solve(excluded);
      if (s.rolled > 0.0 && excluded.empty()) {
        held = hold_noise_directions(s, squares, column_noise(s, weights, fit.squares.column_rms), fit.squares);
      }
      fit.squares.estimate += s.nominal;
      identify::ResidualStatistics statistics(fit.squares.estimate, weights);
      core::for_each_block(rows, [&](const RegressionBlock& block) { statistics.add(block); });
      fit.residuals = statistics.summary(fit.squares.inverse_gram);
    };
    solve();
    fit.excitation =
        identify::judge_excitation(fit.squares, fit.residuals.standard_error,
                                   core::student_quantile(kOdometryConfidence, std::max(fit.residuals.freedom, 1.0)));
    for (const identify::ExcitationFinding& finding : fit.excitation) {
      excluded.push_back(finding.state == identify::Excitation::not_excited);
    }
    if (held.most.size() == 0 && std::ranges::find(excluded, true) != excluded.end()) {
      solve();
    }
    for (std::size_t j = 0; j < excluded.size() && held.most.size() > 0; ++j) {
      if (held.seen[static_cast<Eigen::Index>(j)] < kMostlySeen) {
        identify::judge_noise_alone(fit.excitation[j]);
      }
    }
    weights = weights_of(fit.residuals);
  }
  fit.untold = largest_untold(rows, held);
  fit.plausible = identify::largest_plausible_error(rows, fit.squares.estimate, fit.residuals, risk);
  return fit;
}

// The shift between pose or gyro and wheels that the beginning of the log tells.
std::optional<PoseTiming> told_timing(const Frame& s, const OdometryFit& fit) {
  constexpr std::size_t kRows = 60000;
  filter::OdometryRows stream = make_rows(s, s.declared);
  const auto timing = pose_timing(first_rows(stream, kRows), fit.squares.estimate, weights_of(fit.residuals),
                                  s.measurement.nominal_step, s.measurement.position ? 2 : 0);
  return timing && timing->told(s.measurement.nominal_step) ? timing : std::nullopt;
}

// A robot whose wheels slip in every turn (skid steer) is far from its geometry: sides of the prior box that least
// squares leaves are moved outward until they hold it, with the same share to spare. Returns the names of these
// parameters.
std::vector<std::string> widen(Frame& s, const OdometryFit& fit, double share) {
  std::vector<std::string> widened;
  const auto names = s.measurement.parameters();
  for (std::size_t j = 0; j < names.size(); ++j) {
    const double value = fit.squares.estimate[static_cast<Eigen::Index>(j)];
    const bool certain = fit.excitation[j].state == identify::Excitation::identified && value > 0.0;
    if (certain && names[j] != "gyro_bias" && !s.prior.sides[j].contains(value)) {
      Interval& side = s.prior.sides[j];
      side = {std::min(side.lower, (1.0 - share) * value), std::max(side.upper, (1.0 + share) * value)};
      widened.push_back(names[j]);
      if (names[j].starts_with("yaw_gain")) {
        s.declared.yaw_gain = std::max(s.declared.yaw_gain, side.upper);
      }
    }
  }
  return widened;
}

std::vector<OutputNoise> output_noise(const Frame& s, const OdometryFit& fit) {
  std::vector<OutputNoise> noise(s.is_declared.size());
  for (std::size_t i = 0; i < noise.size(); ++i) {
    if (s.is_declared[i]) {
      noise[i].origin = core::NoiseOrigin::declared;
    } else {
      const auto at = static_cast<Eigen::Index>(i);
      noise[i] = estimated_noise(fit.residuals.outputs[i], fit.residuals.instants, fit.plausible[at], s.extrapolation);
      noise[i].learning += fit.untold[at];
      noise[i].bound += fit.untold[at];
    }
  }
  return noise;
}

FeasibleSet set_of(const Frame& s, Part part, const std::vector<OutputNoise>& noise) {
  filter::OdometryRows stream = make_rows(s, with_noise(s, noise, RowUse::learning));
  FoldedSource rows(stream, part, s.log_rows, s.folds);
  return feasible_set(rows, s.prior);
}

// The feasible set; bounds that are too small for the prior box are raised, where all are estimated.
BoundedSet bounded_set(const Frame& s, Part part, const OdometryFit& fit, std::vector<OutputNoise>& noise) {
  BoundedSet result{set_of(s, part, noise)};
  const bool all_estimated = std::ranges::count(noise, core::NoiseOrigin::estimated, &OutputNoise::origin) ==
                             static_cast<std::ptrdiff_t>(noise.size());
  if (result.set.status == FeasibleSet::Status::nonempty || !all_estimated) {
    return result;
  }
  filter::OdometryRows bare = make_rows(s, {});
  FoldedSource bare_rows(bare, part, s.log_rows, s.folds);
  result.raise =
      raise_until_explained(noise, bare_rows, s.prior, {fit.squares.estimate, fit.residuals, s.extrapolation.risk},
                            [&](const std::vector<OutputNoise>& more) {
                              return set_of(s, part, more).status == FeasibleSet::Status::nonempty;
                            });
  result.set = set_of(s, part, noise);
  return result;
}

// A declared bound differs from row to row: the largest is told.
void tell_declared(const Frame& s, const Eigen::VectorXd& theta, std::vector<OutputNoise>& noise) {
  filter::OdometryRows rows = make_rows(s, s.declared);
  const auto n = static_cast<Eigen::Index>(noise.size());
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      OutputNoise& o = noise[static_cast<std::size_t>(r % n)];
      if (o.origin == core::NoiseOrigin::declared) {
        o.bound = std::max(o.bound, block.dy[r] + block.dY.row(r).dot(theta.cwiseAbs()));
        o.learning = o.bound;
      }
    }
  });
}

std::vector<KinematicParameter> parameters_of(const Frame& s, const OdometryFit& fit, const Box& hull) {
  const auto names = s.measurement.parameters(), units = s.measurement.parameter_units();
  std::vector<KinematicParameter> all;
  for (std::size_t j = 0; j < names.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    KinematicParameter p;
    p.name = names[j];
    p.unit = units[j];
    p.excitation = fit.excitation[j].state;
    p.reason = fit.excitation[j].reason;
    if (p.excitation != identify::Excitation::not_excited) {
      p.estimate = fit.squares.estimate[at];
      p.standard_error = fit.residuals.standard_error[at];
    }
    p.lower = hull.sides[j].lower;
    p.upper = hull.sides[j].upper;
    p.nominal = s.nominal[at];
    all.push_back(std::move(p));
  }
  return all;
}

std::string message_of(const Frame& s, const KinematicCommissioning& r, const std::optional<PoseTiming>& shift) {
  if (r.status == Status::nothing) {
    return "no kinematic residual: no wheel radii and track width within the prior explain the pose";
  }
  std::string text = fmt::format("wheel odometry is compared with {} over windows of {:.3g} s",
                                 s.measurement.position  ? "the pose"
                                 : s.measurement.heading ? "the heading"
                                                         : "the gyro",
                                 s.window);
  const auto estimated = std::ranges::count(r.noise, core::NoiseOrigin::estimated, &OutputNoise::origin);
  if (shift) {
    text += fmt::format(
        "; by the declared noise it comes {:.2g} ± {:.1g} s {} them (95 %; speeds stamped at the end of their "
        "interval, clocks that differ and wheels that slip with the acceleration look like that), so the bounds are "
        "extrapolated from the residuals of this log",
        std::abs(shift->delay), 2.0 * shift->standard_error, shift->delay > 0.0 ? "after" : "before");
  } else if (r.declared_too_small) {
    text +=
        "; no wheel radii explain the pose within the declared noise (wheels that slip in turns, a pose beside the "
        "axle or late would do that), so the bounds are extrapolated from the residuals of this log";
  } else if (estimated == 0) {
    text += "; the bounds stand on the declared noise";
  } else if (estimated == static_cast<std::ptrdiff_t>(r.noise.size())) {
    text += "; the bounds are extrapolated from the residuals of this log";
  } else {
    text += "; the bounds stand on the declared noise, those of the other outputs are extrapolated from the residuals";
  }
  if (!r.far_from_nominal.empty()) {
    text += fmt::format("; {} {} far from the geometry in the robot file, as with wheels that slip in every turn",
                        fmt::join(r.far_from_nominal, ", "), r.far_from_nominal.size() == 1 ? "is" : "are");
  }
  if (s.measurement.held_pose) {
    text += "; the pose comes at a lower rate than the wheels, and only new ones count";
  }
  std::string missing;
  for (const KinematicParameter& p : r.parameters) {
    if (p.excitation == identify::Excitation::not_excited) {
      missing += (missing.empty() ? "" : ", ") + p.name;
    }
  }
  return missing.empty() ? text : text + "; the log says nothing about " + missing + ": drive straight and in curves";
}

void validate_held_out(const Frame& s, KinematicCommissioning& result) {
  const auto fit = fit_rows(s, Part::training, s.extrapolation.risk);
  if (!fit) {
    return;
  }
  std::vector<OutputNoise> noise = output_noise(s, *fit);
  const FeasibleSet set = bounded_set(s, Part::training, *fit, noise).set;
  if (set.status != FeasibleSet::Status::nonempty) {
    return;
  }
  filter::OdometryRows unseen = make_rows(s, with_noise(s, noise, RowUse::driving));
  FoldedSource held_out(unseen, Part::held_out, s.log_rows, s.folds);
  result.validation = validate_on(
      held_out,
      detector::ThresholdRule(*set.polytope, best_guess(fit->squares.estimate, fit->excitation, *set.polytope)));
}

// `result` holds, beside its own, the intervals of `other`.
void join_intervals(KinematicCommissioning& result, const KinematicCommissioning& other, double unit) {
  for (std::size_t j = 0; j < std::min(result.parameters.size(), other.parameters.size()); ++j) {
    KinematicParameter& p = result.parameters[j];
    p.lower = std::min(p.lower, other.parameters[j].lower);
    p.upper = std::max(p.upper, other.parameters[j].upper);
  }
  result.message += fmt::format(
      "; speeds are in whole multiples of {:.4g} rad/s, rounded or cut off, which `speed_cut` in the robot file says: "
      "the intervals hold both",
      unit);
}

KinematicCommissioning commissioned_as(LogSource& log, const Robot& robot,
                                       const std::optional<filter::OdometryMeasurement>& measurement,
                                       const Survey& survey, const KinematicCommissionOptions& options) {
  KinematicCommissioning result;
  if (!measurement) {
    result.message = model::on_two_wheels(robot)
                         ? "no kinematic residual: the log has neither a pose (x, y, theta) nor gyro_z, so that slip "
                           "across the heading cannot be seen"
                         : "no kinematic residual: the robot is no differential drive";
    return result;
  }
  if (options.window < 2.0 * measurement->nominal_step) {
    result.status = Status::nothing;
    result.message = fmt::format("no kinematic residual: its window of {:.3g} s is shorter than two steps of the log",
                                 options.window);
    return result;
  }
  filter::OdometryMeasurement independent = *measurement;
  const PoseOrigin origin = pose_origin(log, independent, options.window, robot);
  independent.heading = independent.heading && !origin.heading_repeats;
  independent.position = independent.position && !origin.position_repeats;
  if (!independent.heading && !independent.gyro) {
    result.message = "no kinematic residual: " + origin.sentence;
    return result;
  }
  Frame s = settle(log, robot, independent, survey, options);
  result.prior = s.prior;
  const auto fit = fit_rows(s, Part::everything, s.extrapolation.risk);
  if (!fit) {
    result.status = Status::nothing;
    result.message = fmt::format("no kinematic residual: too few windows of {:.3g} s in the log", s.window);
    return result;
  }
  result.far_from_nominal = widen(s, *fit, options.radius_share);
  result.prior = s.prior;
  const bool any_declared = std::ranges::find(s.is_declared, true) != s.is_declared.end();
  const std::optional<PoseTiming> shift = any_declared ? told_timing(s, *fit) : std::nullopt;
  if (shift) {
    result.delay = shift->delay;
  }
  BoundedSet bounded;
  if (!shift) {
    result.noise = output_noise(s, *fit);
    bounded = bounded_set(s, Part::everything, *fit, result.noise);
  }
  if (shift || (any_declared && bounded.set.status == FeasibleSet::Status::empty)) {
    result.declared_too_small = true;
    s.declared = {};
    s.is_declared.assign(s.is_declared.size(), false);
    result.noise = output_noise(s, *fit);
    bounded = bounded_set(s, Part::everything, *fit, result.noise);
  }
  result.raise = bounded.raise;
  result.rows = bounded.set.rows;
  result.parameters = parameters_of(s, *fit, bounded.set.hull);
  result.lower = bounded.set.lower;
  result.upper = bounded.set.upper;
  if (bounded.set.status == FeasibleSet::Status::empty) {
    result.status = Status::nothing;
    result.message = message_of(s, result, shift);
    return result;
  }
  const bool partial = std::ranges::any_of(
      result.parameters, [](const KinematicParameter& p) { return p.excitation == identify::Excitation::not_excited; });
  result.status = partial ? Status::partial : Status::done;
  const Polytope& set = *bounded.set.polytope;
  result.model = detector::KinematicModel{{.estimate = best_guess(fit->squares.estimate, fit->excitation, set),
                                           .facets = set.facets(),
                                           .box = bounded.set.hull,
                                           .persistence = options.persistence},
                                          s.measurement,
                                          s.window,
                                          with_noise(s, result.noise, RowUse::driving)};
  tell_declared(s, result.model->estimate, result.noise);
  validate_held_out(s, result);
  result.message = message_of(s, result, shift) + (origin.sentence.empty() ? "" : "; " + origin.sentence);
  log.rewind();
  return result;
}

}  // namespace

KinematicCommissioning commission_kinematics(LogSource& log, const Robot& robot,
                                             const std::optional<filter::OdometryMeasurement>& measurement,
                                             const Survey& survey, const KinematicCommissionOptions& options) {
  KinematicCommissioning result = commissioned_as(log, robot, measurement, survey, options);
  if (!result.model) {
    return result;
  }
  if (const auto cut =
          measurement->motion == MotionKind::speed ? open_cut(log, robot, measurement->motion_columns) : std::nullopt) {
    filter::OdometryMeasurement as_cut = *measurement;
    as_cut.cut = cut;
    join_intervals(result, commissioned_as(log, robot, as_cut, survey, options), cut->unit);
  }
  return result;
}

}  // namespace wheelwright::commission
