// SPDX-License-Identifier: Apache-2.0
// Oracle: inverse dynamics of prescribed smooth motions, written from the physics of each effect and not from the
// catalogue's columns. With the true coefficient the column must take the residual away.
#include "gap/effects/effect.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap::catalogue_test {
namespace {

constexpr double kR = 0.1, kD = 0.4, kL = 0.2, kM = 20.0, kI = 0.8, kF1 = 5.0, kF3 = 0.6, kH = 0.005, kBeta = 10.0;

double sign(double x) { return static_cast<double>(x > 0.0) - static_cast<double>(x < 0.0); }

// ω_j(t), a sum of sines.
double wheel(int j, double t) {
  return j == 0 ? 4.0 * std::sin(0.7 * t) + 2.5 * std::sin(2.1 * t + 0.4) + 0.8 * std::sin(4.9 * t + 1.0)
                : 4.4 * std::sin(0.62 * t + 0.2) + 2.2 * std::sin(1.7 * t + 2.0) + 0.9 * std::sin(4.3 * t + 0.3);
}

// What differs from the base model; everything else follows.
struct World {
  double radius_r = kR, radius_l = kR, track = kD;
  double friction_on_body = 0.0;  // share of the viscous friction; in the joints the rest
  std::function<double(double t, double v1, double v2, double heading)> force = [](auto...) { return 0.0; };
  std::function<double(double t, double v1, double v2, double a1, double a2)> moment = [](auto...) { return 0.0; };
  std::function<double(double t, double v1, double v2, double a1, double a2)> inertial_force = [](auto...) {
    return 0.0;
  };
  std::function<double(int j, double t, double w, double acceleration, double torque)> at_wheel =
      [](int, double, double, double, double torque) { return torque; };  // command for what the wheel passes on
};

struct Instant {
  double v1, v2, right, left;
};

double derivative(const std::function<double(double)>& f, double t) {
  return (f(t - 2e-4) - 8.0 * f(t - 1e-4) + 8.0 * f(t + 1e-4) - f(t + 2e-4)) / 12e-4;
}

Instant instant(const World& world, double t, double heading) {
  const auto v1_at = [&](double s) { return 0.5 * (world.radius_r * wheel(0, s) + world.radius_l * wheel(1, s)); };
  const auto v2_at = [&](double s) {
    return (world.radius_r * wheel(0, s) - world.radius_l * wheel(1, s)) / world.track;
  };
  const double v1 = v1_at(t), v2 = v2_at(t), a1 = derivative(v1_at, t), a2 = derivative(v2_at, t);
  const double body = world.friction_on_body, joints = 1.0 - body;
  const double force =
      kM * a1 + body * kF1 * v1 + world.force(t, v1, v2, heading) + world.inertial_force(t, v1, v2, a1, a2);
  const double moment = kI * a2 + body * kF3 * v2 + world.moment(t, v1, v2, a1, a2);
  // Friction in the joints goes with their speeds.
  const double drag = joints * 0.25 * kR * kR * kF1 * (wheel(0, t) + wheel(1, t));
  const double turn = joints * kR * kR * kF3 * (wheel(0, t) - wheel(1, t)) / (kD * kD);
  const double right = world.radius_r * (0.5 * force + moment / world.track) + drag + turn;
  const double left = world.radius_l * (0.5 * force - moment / world.track) + drag - turn;
  const auto turned = [&](int j) { return derivative([j](double s) { return wheel(j, s); }, t); };
  return {v1, v2, world.at_wheel(0, t, wheel(0, t), turned(0), right),
          world.at_wheel(1, t, wheel(1, t), turned(1), left)};
}

Robot robot() {
  Robot robot;
  robot.wheel_radius = kR;
  robot.track_width = kD;
  return robot;
}

// `torque_ahead`: the log holds the torque of this much later; `speed_late`: the speeds of this much earlier.
Drive drive_of(const World& world, double torque_ahead = 0.0, double speed_late = 0.0, double encoder_right = 1.0) {
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.resize(7);
  double x = 0.0, y = 0.0, heading = 0.3;
  for (int k = 0; k < 6000; ++k) {
    const double t = kH * k;
    const Instant late = instant(world, t + torque_ahead, heading);
    const std::vector<double> row{
        wheel(0, t - speed_late) / encoder_right, wheel(1, t - speed_late), late.right, late.left, x, y, heading};
    log.t.push_back(t);
    for (std::size_t c = 0; c < row.size(); ++c) {
      log.columns[c].push_back(row[c]);
    }
    for (int i = 0; i < 5; ++i) {  // middle rule
      const double dt = kH / 5.0, s = t + (i + 0.5) * dt;
      const double v1 = 0.5 * (world.radius_r * wheel(0, s) + world.radius_l * wheel(1, s));
      const double v2 = (world.radius_r * wheel(0, s) - world.radius_l * wheel(1, s)) / world.track;
      x += dt * v1 * std::cos(heading + 0.5 * dt * v2);
      y += dt * v1 * std::sin(heading + 0.5 * dt * v2);
      heading += dt * v2;
    }
  }
  Measurement measurement;
  measurement.motion_columns = {"omega_r", "omega_l"};
  measurement.effort_columns = {"tau_r", "tau_l"};
  measurement.heading_column = "theta";
  Drive drive = make_drive(log, robot(), measurement);
  predict_efforts(drive, kR * Eigen::Vector4d(kM, kI, kF1, kF3));
  return drive;
}

// The filtered residual of the base model with its true parameters, both outputs below one another, settled rows.
Eigen::VectorXd stacked(const Drive& drive, const std::vector<Eigen::VectorXd>& outputs) {
  const auto skip = static_cast<Eigen::Index>(10.0 / kBeta / kH);
  const Eigen::Index n = drive.rows() - skip;
  Eigen::VectorXd all(2 * n);
  all << outputs[0].tail(n), outputs[1].tail(n) / kL;
  return all;
}

Eigen::VectorXd residual(const Drive& drive) {
  std::vector<Eigen::VectorXd> outputs = filtered_outputs(drive, kBeta);
  const auto rows = filtered_regressor(drive, kBeta);
  for (std::size_t p = 0; p < rows.size(); ++p) {
    for (std::size_t i = 0; i < 2; ++i) {
      if (rows[p][i].size() > 0) {
        outputs[i] -= drive.theta[static_cast<Eigen::Index>(p)] * rows[p][i];
      }
    }
  }
  return stacked(drive, outputs);
}

Eigen::VectorXd effort_of(const Drive& drive, const Column& column) {
  std::vector<Eigen::VectorXd> outputs(2, Eigen::VectorXd::Zero(drive.rows()));
  for (std::size_t i = 0; i < 2; ++i) {
    if (i < column.effort.size() && column.effort[i].size() > 0) {
      outputs[i] += filtered(drive, kBeta, column.effort[i]);
    }
    if (i < column.effort_rate.size() && column.effort_rate[i].size() > 0) {
      outputs[i] += filtered_rate(drive, kBeta, column.effort_rate[i]);
    }
  }
  return stacked(drive, outputs);
}

Effect effect(const std::string& name) {
  for (const Effect& candidate : effect_catalogue()) {
    if (candidate.name == name) {
      return candidate;
    }
  }
  throw InvalidArgument(name);
}

struct Case {
  std::string name;
  Drive drive;
  std::vector<double> shape;
  std::vector<double> coefficients;
  double left;  // share of the residual that may stay: of second order in the effect, or what smoothing a corner costs
};

void expect_explained(const Case& c) {
  SCOPED_TRACE(c.name);
  const Effect e = effect(c.name);
  validate(e);
  ASSERT_TRUE(applicability(e, c.drive).applies);
  const std::vector<Column> columns = e.columns(c.drive, c.shape);
  ASSERT_EQ(columns.size(), std::max<std::size_t>(1, e.parameters.size()));
  const Eigen::VectorXd before = residual(c.drive);
  Eigen::VectorXd after = before;
  const Windows windows = make_windows(c.drive);
  const Increments gap = pose_gap(c.drive, windows);
  Eigen::VectorXd forward = gap.forward, yaw = gap.yaw;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const double factor = e.unit_coefficient ? 1.0 : c.coefficients[k];
    after -= factor * effort_of(c.drive, columns[k]);
    const Increments seen = increments_of(c.drive, windows, columns[k]);
    forward -= seen.forward.size() > 0 ? Eigen::VectorXd(factor * seen.forward) : Eigen::VectorXd::Zero(forward.size());
    yaw -= seen.yaw.size() > 0 ? Eigen::VectorXd(factor * seen.yaw) : Eigen::VectorXd::Zero(yaw.size());
  }
  EXPECT_GT(before.norm(), 0.01 * stacked(c.drive, filtered_outputs(c.drive, kBeta)).norm());
  EXPECT_LE(after.norm(), c.left * before.norm());
  EXPECT_LE(forward.norm(), c.left * gap.forward.norm() + 1e-3 * std::sqrt(static_cast<double>(forward.size())));
  EXPECT_LE(yaw.norm(), c.left * gap.yaw.norm() + 1e-3 * std::sqrt(static_cast<double>(yaw.size())));
}

TEST(Catalogue, PerfectDataLeaveNothing) {
  const Drive drive = drive_of({});
  const double torque = stacked(drive, filtered_outputs(drive, kBeta)).norm();
  EXPECT_LE(residual(drive).norm(), 1e-5 * torque);
  const Increments gap = pose_gap(drive, make_windows(drive));
  EXPECT_LE(gap.forward.cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LE(gap.lateral.cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LE(gap.yaw.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(Catalogue, FrictionIsExplainedByItsColumn) {
  const auto friction = [](const auto& torque_of_wheel) {
    World world;
    world.at_wheel = [torque_of_wheel](int j, double, double w, double, double torque) {
      return torque + torque_of_wheel(j, w, torque);
    };
    return drive_of(world);
  };
  expect_explained({"coulomb", friction([](int, double w, double) { return 0.3 * sign(w); }), {}, {0.3}, 0.05});
  expect_explained({"coulomb_asymmetric",
                    friction([](int j, double w, double) { return (j == 0 ? 0.3 : 0.1) * sign(w); }),
                    {},
                    {0.3, 0.1},
                    0.05});
  expect_explained({"stribeck",
                    friction([](int, double w, double) { return 0.4 * std::exp(-w * w) * sign(w); }),
                    {1.0},
                    {0.4},
                    0.15});
  expect_explained({"viscous",
                    friction([](int, double w, double) { return 0.05 * w; }),
                    {},
                    {2.0 * 0.05 / (kR * kR), 0.5 * 0.05 * kD * kD / (kR * kR)},
                    1e-3});
  expect_explained({"viscous_asymmetric",
                    friction([](int j, double w, double) { return j == 1 ? 0.05 * w : 0.0; }),
                    {1.0},
                    {0.05},
                    1e-2});
  expect_explained({"load_friction",
                    friction([](int, double w, double t) { return 0.2 * std::abs(t) * sign(w); }),
                    {},
                    {0.2},
                    0.25});  // the column is made of the command, 1.2 times what is passed on
  expect_explained(
      {"torque_deadzone", friction([](int, double, double t) { return 0.2 * sign(t); }), {0.01}, {0.2}, 0.08});
}

TEST(Catalogue, ForcesAndMassesAreExplainedByTheirColumns) {
  World drag;
  drag.force = [](double, double v, double, double) { return 6.0 * v * std::abs(v); };
  drag.moment = [](double, double, double w, double, double) { return 0.5 * w * std::abs(w); };
  expect_explained({"quadratic_drag", drive_of(drag), {}, {6.0 * kR, 0.5 * kR}, 0.01});
  World scrub;
  scrub.moment = [](double, double, double w, double, double) { return 1.5 * sign(w); };
  expect_explained({"lateral_scrub", drive_of(scrub), {0.005}, {1.5 * kR}, 0.08});
  World caster;
  caster.force = [](double, double v, double w, double) { return 4.0 * v / std::hypot(v, 0.3 * w); };
  caster.moment = [](double, double v, double w, double, double) { return 4.0 * 0.09 * w / std::hypot(v, 0.3 * w); };
  expect_explained({"caster_drag", drive_of(caster), {0.3, 1e-3}, {4.0 * kR}, 0.1});
  World slope;
  slope.force = [](double, double, double, double heading) { return kM * 9.80665 * 0.02 * std::cos(heading - 0.8); };
  expect_explained(
      {"slope", drive_of(slope), {}, {9.80665 * 0.02 * std::cos(0.8), 9.80665 * 0.02 * std::sin(0.8)}, 0.01});
  World ahead;  // the inertia about the axle is the base model's
  ahead.inertial_force = [](double, double, double w, double, double) { return -kM * 0.1 * w * w; };
  ahead.moment = [](double, double v, double w, double, double) { return kM * 0.1 * v * w; };
  expect_explained({"com_longitudinal", drive_of(ahead), {}, {0.1, 0.0}, 0.02});
  World beside;
  beside.inertial_force = [](double, double, double, double, double turn) { return -kM * 0.05 * turn; };
  beside.moment = [](double, double, double, double along, double) { return -kM * 0.05 * along; };
  expect_explained({"com_lateral", drive_of(beside), {}, {0.05, 0.0}, 1e-3});
  World load;
  load.inertial_force = [](double, double, double, double along, double) { return 3.0 * along; };
  load.moment = [](double, double, double, double, double turn) { return 0.1 * turn; };
  expect_explained({"payload", drive_of(load), {}, {3.0, 0.1}, 1e-3});
  World rotor;
  rotor.at_wheel = [](int, double, double, double a, double torque) { return torque + 0.02 * a; };
  expect_explained({"armature", drive_of(rotor), {}, {0.02}, 1e-3});
}

TEST(Catalogue, ActuatorsAreExplainedByTheirColumns) {
  World gain;
  gain.at_wheel = [](int j, double, double, double, double torque) { return j == 0 ? torque / 0.9 : torque; };
  expect_explained({"torque_gain_asymmetric", drive_of(gain), {0.0}, {1.0 / 0.9 - 1.0}, 0.02});
  World all;
  all.at_wheel = [](int, double, double, double, double torque) { return torque / 1.1; };
  expect_explained({"torque_gain", drive_of(all), {}, {1.0 / 1.1 - 1.0}, 0.02});
  World bias;
  bias.at_wheel = [](int j, double, double, double, double torque) { return torque + (j == 0 ? 0.1 : -0.2); };
  expect_explained({"torque_bias", drive_of(bias), {}, {0.1, -0.2}, 1e-3});
  expect_explained({"delay", drive_of({}, 0.04), {0.04}, {}, 0.01});
  expect_explained({"sensor_time_offset", drive_of({}, 0.0, 0.03), {0.03}, {}, 0.01});
  expect_explained({"sensor_time_offset", drive_of({}, 0.0, -0.03), {-0.03}, {}, 0.01});
}

// y through the lag: u = y + T y' with y the base torque, by differences of the drive's own exact torques.
TEST(Catalogue, LagIsExplainedByItsColumn) {
  Drive drive = drive_of({});
  const double T = 0.05;
  for (JointSignals& joint : drive.joints) {
    const Eigen::VectorXd y = joint.effort;
    for (Eigen::Index k = 2; k + 2 < y.size(); ++k) {
      joint.effort[k] = y[k] + T * (y[k - 2] - 8.0 * y[k - 1] + 8.0 * y[k + 1] - y[k + 2]) / (12.0 * kH);
    }
  }
  expect_explained({"actuator_lag", drive, {T}, {}, 0.01});
}

TEST(Catalogue, GeometryIsExplainedInTorqueAndPoseWhereverTheFrictionIs) {
  for (const double body : {0.0, 0.5, 1.0}) {
    SCOPED_TRACE(body);
    World large{.friction_on_body = body};
    large.radius_r = 1.01 * kR;
    expect_explained({"wheel_radius_asymmetric", drive_of(large), {0.0, body}, {0.01, 0.0}, 0.03});
    World both{.friction_on_body = body};
    both.radius_r = both.radius_l = 0.98 * kR;
    expect_explained({"wheel_radius", drive_of(both), {body}, {-0.02, 0.0}, 0.03});
    World wide{.friction_on_body = body};
    wide.track = 1.02 * kD;
    expect_explained({"track_width", drive_of(wide), {body}, {0.02 / 1.02, 0.0}, 0.04});
    expect_explained({"encoder_scale", drive_of({.friction_on_body = body}, 0.0, 0.0, 1.02), {0.0}, {0.02}, 0.04});
  }
}

TEST(Catalogue, EveryEffectGivesAsManyColumnsAsParametersOnItsWholeGrid) {
  const Drive drive = drive_of({});
  for (const Effect& e : effect_catalogue()) {
    validate(e);
    for (const std::vector<double>& shape : shape_grid(e, drive)) {
      const std::vector<Column> columns = e.columns(drive, shape);
      EXPECT_EQ(columns.size(), e.unit_coefficient ? 1 : e.parameters.size()) << e.name;
      for (const Column& column : columns) {
        EXPECT_TRUE(effort_of(drive, column).allFinite()) << e.name;
      }
    }
  }
}

// Two makers of the same column: the catalogue's own, and the terms of the law on the smooth motion.
TEST(Catalogue, ColumnsOfALawAreThoseOfTheCatalogue) {
  const Drive drive = drive_of({});
  std::size_t compared = 0;
  for (const Effect& by_law : effects_by_law(drive.model, {})) {
    const Effect own = effect(by_law.name);
    EXPECT_EQ(by_law.noun, catalogue_noun(by_law.name));
    // Other shapes (a side, a softness), and what comes beside.
    if (own.parameters.size() != by_law.parameters.size() || own.shapes.size() != by_law.shapes.size() ||
        !applicability(own, drive).applies) {
      continue;
    }
    const std::vector<double> shape = shape_grid(own, drive).back();
    const auto columns = own.columns(drive, shape), others = by_law.columns(drive, shape);
    ASSERT_EQ(columns.size(), others.size()) << by_law.name;
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const Eigen::VectorXd a = effort_of(drive, columns[k]), b = effort_of(drive, others[k]);
      EXPECT_LT((a - b).norm(), 0.02 * a.norm()) << by_law.name << " " << by_law.parameters[k].name;
      ++compared;
    }
  }
  EXPECT_GE(compared, 8U);
}

TEST(Catalogue, EveryEffectHasANoun) {
  for (const Effect& e : effect_catalogue()) {
    EXPECT_FALSE(catalogue_noun(e.name).empty()) << e.name;
  }
  EXPECT_EQ(catalogue_noun("no_such_effect"), "");
}

TEST(Catalogue, SingleAxisHasItsOwnEffects) {
  Robot axis;
  axis.model = "single_axis";
  LogTable log;
  log.names = {"velocity", "effort"};
  log.columns.resize(2);
  for (int k = 0; k < 400; ++k) {
    log.t.push_back(0.01 * k);
    log.columns[0].push_back(std::sin(0.05 * k));
    log.columns[1].push_back(std::cos(0.05 * k));
  }
  Measurement measurement;
  measurement.motion_columns = {"velocity"};
  measurement.effort_columns = {"effort"};
  Drive drive = make_drive(log, axis, measurement);
  predict_efforts(drive, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(drive.model.p())));
  for (const Effect& e : effect_catalogue(drive.model)) {
    ASSERT_TRUE(applicability(e, drive).applies) << e.name;
    EXPECT_EQ(e.columns(drive, shape_grid(e, drive).front()).size(), std::max<std::size_t>(1, e.parameters.size()))
        << e.name;
  }
}

}  // namespace
}  // namespace wheelwright::gap::catalogue_test
