// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/trajectory.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <wheelwright/core/check.hpp>

namespace wheelwright::sim {
namespace {

using std::numbers::pi;
constexpr double first_zero_of_j0 = 2.404825557695773;
constexpr double soft_start = 1.0;  // s

// A function of time and its derivative.
struct Signal {
  double value = 0.0;
  double rate = 0.0;
};

Signal operator*(Signal a, Signal b) { return {a.value * b.value, a.rate * b.value + a.value * b.rate}; }
Signal operator*(double a, Signal b) { return {a * b.value, a * b.rate}; }
Signal operator+(Signal a, Signal b) { return {a.value + b.value, a.rate + b.rate}; }

Signal sine(double w, double t, double phase = 0.0) { return {std::sin(w * t + phase), w * std::cos(w * t + phase)}; }

// 0 → 1 over `length`, 3s² − 2s³.
Signal smooth_step(double t, double length) {
  if (t <= 0.0) {
    return {0.0, 0.0};
  }
  if (t >= length) {
    return {1.0, 0.0};
  }
  const double s = t / length;
  return {s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / length};
}

// max(0, sin)²: half of the period at rest.
Signal go_and_stop(double w, double t) {
  const Signal s = sine(w, t);
  return s.value > 0.0 ? s * s : Signal{};
}

struct Pair {
  Signal v1, v2;
};

Pair steady(const Trajectory& r, Trajectory::Kind kind, double t) {
  const double w = 2.0 * pi / r.period;
  const Signal one{1.0, 0.0};
  switch (kind) {
    case Trajectory::Kind::straight: return {r.speed * (0.6 * one + 0.4 * sine(w, t)), {}};
    case Trajectory::Kind::circle: return {r.speed * one, r.yaw_rate * one};
    case Trajectory::Kind::figure_eight: return {r.speed * one, first_zero_of_j0 * w * sine(w, t, pi / 2.0)};
    case Trajectory::Kind::multi_sine:
      return {r.speed * (0.5 * sine(w, t) + 0.3 * sine(2.7 * w, t) + 0.2 * sine(5.9 * w, t)),
              r.yaw_rate * (0.5 * sine(1.3 * w, t) + 0.3 * sine(3.1 * w, t) + 0.2 * sine(6.7 * w, t))};
    case Trajectory::Kind::spin: return {{}, r.yaw_rate * (0.7 * sine(w, t) + 0.3 * sine(3.3 * w, t))};
    case Trajectory::Kind::stops: {
      const Signal go = go_and_stop(w, t);
      return {r.speed * go, r.yaw_rate * (go * sine(0.43 * w, t))};
    }
    case Trajectory::Kind::commissioning:
    case Trajectory::Kind::table: break;
  }
  // One stage after the other, each from standstill to standstill.
  constexpr std::array stages = {Trajectory::Kind::straight, Trajectory::Kind::figure_eight,
                                 Trajectory::Kind::multi_sine, Trajectory::Kind::spin, Trajectory::Kind::stops};
  const double number = std::floor(t / r.period);
  const double local = t - number * r.period;
  Pair pair = steady(r, stages[static_cast<std::size_t>(std::fmod(number, static_cast<double>(stages.size())))], local);
  const double ramp = 0.15 * r.period;
  const Signal end = smooth_step(local - (r.period - ramp), ramp);
  const Signal window = smooth_step(local, ramp) * Signal{1.0 - end.value, -end.rate};
  return {window * pair.v1, window * pair.v2};
}

ReferenceSpeed looked_up(const SpeedTable& table, double t) {
  const auto next = std::upper_bound(table.t.begin(), table.t.end(), t);
  if (next == table.t.begin() || next == table.t.end()) {
    const bool at_end = next == table.t.end() && !table.t.empty() && t == table.t.back();
    return {at_end ? table.speed.back() : Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  }
  const auto k = static_cast<std::size_t>(next - table.t.begin());
  const double length = table.t[k] - table.t[k - 1];
  const Eigen::Vector2d slope = (table.speed[k] - table.speed[k - 1]) / length;
  return {table.speed[k - 1] + (t - table.t[k - 1]) * slope, slope};
}

}  // namespace

void validate(const Trajectory& trajectory) {
  check::non_negative(trajectory.speed, "trajectory.speed");
  check::non_negative(trajectory.yaw_rate, "trajectory.yaw_rate");
  check::positive(trajectory.period, "trajectory.period");
  if (trajectory.kind != Trajectory::Kind::table) {
    return;
  }
  const SpeedTable& table = trajectory.table;
  check::that(table.t.size() >= 2 && table.speed.size() == table.t.size(), "trajectory.table",
              "two rows or more, each with a time and two speeds");
  for (std::size_t k = 0; k < table.t.size(); ++k) {
    check::that(std::isfinite(table.t[k]) && table.speed[k].allFinite(), "trajectory.table", "finite numbers");
    check::that(k == 0 || table.t[k] > table.t[k - 1], "trajectory.table", "increasing times");
  }
}

ReferenceSpeed reference_speed(const Trajectory& trajectory, double t) {
  if (trajectory.kind == Trajectory::Kind::table) {
    return looked_up(trajectory.table, t);
  }
  const Pair pair = steady(trajectory, trajectory.kind, t);
  const Signal start = smooth_step(t, soft_start);
  const Signal v1 = start * pair.v1, v2 = start * pair.v2;
  return {{v1.value, v2.value}, {v1.rate, v2.rate}};
}

Eigen::Vector3d advance_reference(const Trajectory& trajectory, const Eigen::Vector3d& pose, double t, double h) {
  const Eigen::Vector2d twist = reference_speed(trajectory, t + 0.5 * h).speed;
  const double half_turn = 0.5 * h * twist[1];
  const double chord =
      h * twist[0] * (std::abs(half_turn) < 1e-4 ? 1.0 - half_turn * half_turn / 6.0 : std::sin(half_turn) / half_turn);
  return {pose[0] + chord * std::cos(pose[2] + half_turn), pose[1] + chord * std::sin(pose[2] + half_turn),
          pose[2] + 2.0 * half_turn};
}

TrackingController::TrackingController(const DifferentialDrive& drive, const model::DriveParameters& nominal,
                                       const ControllerGains& gains, std::optional<double> torque_limit)
    : drive_(drive), nominal_(nominal), gains_(gains), torque_limit_(torque_limit) {}

TrackingController::Command TrackingController::step(const Eigen::Vector3d& reference_pose,
                                                     const ReferenceSpeed& reference, const Eigen::Vector3d& pose,
                                                     const Eigen::Vector2d& v, double h) {
  const double c = std::cos(pose[2]), s = std::sin(pose[2]);
  const Eigen::Vector3d world = reference_pose - pose;
  const double x = c * world[0] + s * world[1], y = -s * world[0] + c * world[1], turn = world[2];
  const double sinc = std::abs(turn) < 1e-4 ? 1.0 - turn * turn / 6.0 : std::sin(turn) / turn;

  Command command;
  command.speed = {reference.speed[0] * std::cos(turn) + gains_.along * x,
                   reference.speed[1] + gains_.across * reference.speed[0] * sinc * y + gains_.heading * turn};

  const Eigen::Vector2d error = command.speed - v;
  const Eigen::Vector2d acceleration = reference.acceleration + gains_.speed * error + gains_.integral * integral_;
  const double along_x = c * c;
  const double viscous = nominal_.viscous_x * along_x + nominal_.viscous_y * (1.0 - along_x);
  const double force = nominal_.mass * acceleration[0] + viscous * command.speed[0];
  const double moment = nominal_.yaw_inertia * acceleration[1] + nominal_.viscous_yaw * command.speed[1];
  const double half_sum = 0.5 * drive_.wheel_radius * force;
  const double half_difference = 0.5 * drive_.wheel_radius * moment / drive_.lever_arm();
  command.torque = {half_sum + half_difference, half_sum - half_difference};

  const bool saturated = torque_limit_ && command.torque.cwiseAbs().maxCoeff() > *torque_limit_;
  if (saturated) {
    command.torque = command.torque.cwiseMin(*torque_limit_).cwiseMax(-*torque_limit_);
  } else {
    integral_ += h * error;  // held while saturated, so that it does not wind up
  }
  return command;
}

}  // namespace wheelwright::sim
