// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/plant.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

constexpr double longest_runge_kutta_step = 2e-3;  // s
// Gauss-Legendre on [0, 1]: nodes ½ ∓ √15/10, ½; weights 5/18, 4/9, 5/18.
constexpr std::array<double, 3> nodes = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> weights = {5.0 / 18.0, 4.0 / 9.0, 5.0 / 18.0};

// Σ_k z^k / (k + 3)!
double phi3(double z) {
  if (std::abs(z) > 0.5) {
    return ((std::expm1(z) / z - 1.0) / z - 0.5) / z;
  }
  double sum = 1.0;
  for (int k = std::abs(z) < 0.02 ? 8 : 15; k >= 1; --k) {
    sum = 1.0 + sum * z / (k + 3.0);
  }
  return sum / 6.0;
}

}  // namespace

Plant::Plant(const DifferentialDrive& drive, const DriveParameters& parameters, std::vector<Fault> faults)
    : drive_(drive), parameters_(parameters), faults_(std::move(faults)) {
  validate(parameters_);
  validate(faults_, drive_);
  for (const Fault& fault : faults_) {
    const TimeProfile& p = fault.profile;
    const double rise = p.shape == TimeProfile::Shape::step ? 0.0 : p.rise_time;
    for (const double t : {p.onset, p.onset + rise, p.end, p.end + rise}) {
      if (std::isfinite(t)) {
        breaks_.push_back(t);
      }
    }
  }
  std::sort(breaks_.begin(), breaks_.end());
  breaks_.erase(std::unique(breaks_.begin(), breaks_.end()), breaks_.end());
  reset({}, 0.0);
}

void Plant::reset(const DriveState& state, double t) {
  state_ = state;
  t_ = t;
  enter_interval();
}

void Plant::set_time(double t) {
  t_ = t;
  const bool inside =
      (interval_ == 0 || t_ >= breaks_[interval_ - 1]) && (interval_ == breaks_.size() || t_ < breaks_[interval_]);
  if (!inside) {
    enter_interval();
  }
}

void Plant::enter_interval() {
  interval_ = static_cast<std::size_t>(std::upper_bound(breaks_.begin(), breaks_.end(), t_) - breaks_.begin());
  double middle = 0.0;
  if (!breaks_.empty()) {
    const double first = interval_ == 0 ? breaks_.front() - 2.0 : breaks_[interval_ - 1];
    const double last = interval_ == breaks_.size() ? breaks_.back() + 2.0 : breaks_[interval_];
    middle = 0.5 * (first + last);
  }
  fault_ = fault_state(faults_, middle);
  moving_ = !fault_.radius_rate.isZero(0.0) || !fault_.slip_rate.isZero(0.0) || fault_.matched_rate != 0.0 ||
            fault_.unmatched_rate != 0.0;
  exact_ = !moving_ && fault_.slip.isZero(0.0) && fault_.matched == 0.0 && fault_.unmatched == 0.0 &&
           parameters_.viscous_x == parameters_.viscous_y;
}

Eigen::Vector2d Plant::wheel_speed() const { return wheel_speed(state_, moving_ ? fault_state(faults_, t_) : fault_); }

Eigen::Vector2d Plant::wheel_speed(const DriveState& state, const FaultState& fault) const {
  const double c = std::cos(state.pose[2]), s = std::sin(state.pose[2]);
  const double rolling = state.forward_speed - (c * fault.slip[0] + s * fault.slip[1] + fault.matched);
  const double turning = 0.5 * drive_.track_width * (state.yaw_rate - fault.slip[2]);
  return {(rolling + turning) / (drive_.wheel_radius + fault.radius[0]),
          (rolling - turning) / (drive_.wheel_radius + fault.radius[1])};
}

Plant::Derivative Plant::derivative(const DriveState& state, const FaultState& fault,
                                    const Eigen::Vector2d& torque) const {
  const double c = std::cos(state.pose[2]), s = std::sin(state.pose[2]);
  const double across = -s * fault.slip[0] + c * fault.slip[1] - fault.unmatched;
  const double x_rate = state.forward_speed * c - across * s, y_rate = state.forward_speed * s + across * c;
  const double right = torque[0] / (drive_.wheel_radius + fault.radius[0]);
  const double left = torque[1] / (drive_.wheel_radius + fault.radius[1]);
  const double friction = c * parameters_.viscous_x * x_rate + s * parameters_.viscous_y * y_rate;
  return {
      state.yaw_rate * across + (right + left - friction) / parameters_.mass,
      (0.5 * drive_.track_width * (right - left) - parameters_.viscous_yaw * state.yaw_rate) / parameters_.yaw_inertia,
      {x_rate, y_rate, state.yaw_rate},
      wheel_speed(state, fault)};
}

void Plant::advance(const Eigen::Vector2d& torque, const Eigen::Vector2d& torque_end, double h) {
  const Eigen::Vector2d slope = (torque_end - torque) / h;
  const double end = t_ + h;
  double done = 0.0;
  while (done < h) {
    const double to_break =
        interval_ < breaks_.size() ? breaks_[interval_] - t_ : std::numeric_limits<double>::infinity();
    const bool cut = to_break < h - done;
    const double piece = cut ? to_break : h - done;
    if (exact_) {
      exact_step(torque + done * slope, slope, piece);
    } else {
      runge_kutta(torque + done * slope, slope, piece);
    }
    done = cut ? done + piece : h;
    t_ = cut ? breaks_[interval_] : end;
    if (interval_ < breaks_.size() && t_ >= breaks_[interval_]) {
      enter_interval();
    }
  }
}

Plant::Response Plant::response(double a, double time) {
  const double z = -a * time;
  const double f3 = phi3(z), f2 = 0.5 + z * f3, f1 = 1.0 + z * f2;
  return {1.0 + z * f1, time * f1, time * time * f2, time * time * time * f3};
}

void Plant::prepare(double h) {
  if (h == prepared_step_) {
    return;
  }
  const double a1 = parameters_.viscous_x / parameters_.mass, a2 = parameters_.viscous_yaw / parameters_.yaw_inertia;
  for (std::size_t i = 0; i < 4; ++i) {
    const double time = i < 3 ? nodes[i] * h : h;
    forward_[i] = response(a1, time);
    yaw_[i] = response(a2, time);
  }
  prepared_step_ = h;
}

void Plant::exact_step(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h) {
  prepare(h);
  const double right = drive_.wheel_radius + fault_.radius[0], left = drive_.wheel_radius + fault_.radius[1];
  const double half_track = 0.5 * drive_.track_width;
  const double f0 = (torque[0] / right + torque[1] / left) / parameters_.mass;
  const double f1 = (slope[0] / right + slope[1] / left) / parameters_.mass;
  const double g0 = half_track * (torque[0] / right - torque[1] / left) / parameters_.yaw_inertia;
  const double g1 = half_track * (slope[0] / right - slope[1] / left) / parameters_.yaw_inertia;
  const double u = state_.forward_speed, w = state_.yaw_rate;

  double dx = 0.0, dy = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double ui = forward_[i].decay * u + forward_[i].i1 * f0 + forward_[i].i2 * f1;
    const double heading = state_.pose[2] + yaw_[i].i1 * w + yaw_[i].i2 * g0 + yaw_[i].i3 * g1;
    dx += weights[i] * ui * std::cos(heading);
    dy += weights[i] * ui * std::sin(heading);
  }
  const Response& fe = forward_[3];
  const Response& ye = yaw_[3];
  const double distance = fe.i1 * u + fe.i2 * f0 + fe.i3 * f1;
  const double turn = ye.i1 * w + ye.i2 * g0 + ye.i3 * g1;
  state_.forward_speed = fe.decay * u + fe.i1 * f0 + fe.i2 * f1;
  state_.yaw_rate = ye.decay * w + ye.i1 * g0 + ye.i2 * g1;
  state_.pose += Eigen::Vector3d(h * dx, h * dy, turn);
  state_.wheel_angle += Eigen::Vector2d((distance + half_track * turn) / right, (distance - half_track * turn) / left);
}

void Plant::runge_kutta(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h) {
  const int steps = std::max(1, static_cast<int>(std::ceil(h / longest_runge_kutta_step)));
  const double step = h / steps;
  const auto moved = [](const DriveState& from, const Derivative& d, double by) {
    return DriveState{from.forward_speed + by * d.forward, from.yaw_rate + by * d.yaw, from.pose + by * d.pose,
                      from.wheel_angle + by * d.angle};
  };
  for (int i = 0; i < steps; ++i) {
    const double s = i * step;
    const auto fault_at = [&](double by) { return moving_ ? fault_state(faults_, t_ + s + by) : fault_; };
    const FaultState middle = fault_at(0.5 * step);
    const Derivative k1 = derivative(state_, fault_at(0.0), torque + s * slope);
    const Derivative k2 = derivative(moved(state_, k1, 0.5 * step), middle, torque + (s + 0.5 * step) * slope);
    const Derivative k3 = derivative(moved(state_, k2, 0.5 * step), middle, torque + (s + 0.5 * step) * slope);
    const Derivative k4 = derivative(moved(state_, k3, step), fault_at(step), torque + (s + step) * slope);
    state_ = moved(state_,
                   {(k1.forward + 2.0 * k2.forward + 2.0 * k3.forward + k4.forward) / 6.0,
                    (k1.yaw + 2.0 * k2.yaw + 2.0 * k3.yaw + k4.yaw) / 6.0,
                    (k1.pose + 2.0 * k2.pose + 2.0 * k3.pose + k4.pose) / 6.0,
                    (k1.angle + 2.0 * k2.angle + 2.0 * k3.angle + k4.angle) / 6.0},
                   step);
  }
}

}  // namespace wheelwright
