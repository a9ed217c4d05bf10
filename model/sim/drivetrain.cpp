// SPDX-License-Identifier: Apache-2.0
#include "model/sim/drivetrain.hpp"

#include <algorithm>
#include <cmath>

#include "model/effect_law.hpp"

namespace wheelwright::sim {
namespace {

constexpr double longest_piece = 0.5e-3;  // s
constexpr double motor_share = 0.01;      // of the inertia that a wheel carries

}  // namespace

Drivetrain::Drivetrain(const Robot& robot, const model::DriveParameters& parameters, bool fine) {
  const auto value = [&](const char* effect, const char* parameter) {
    return model::effect_value(robot, effect, parameter);
  };
  if (model::has_effect(robot, "saturation")) {
    limit_ = value("saturation", "tau_max");
  }
  deadzone_ = value("torque_deadzone", "b");
  const double g = value("torque_gain_asymmetric", "g");
  gain_ = {1.0 + g, 1.0 - g};
  sag_time_ = value("battery_sag", "k");
  sag_load_ = value("battery_sag", "R_b");
  delay_ = value("delay", "T_d");
  lag_ = value("actuator_lag", "T");
  play_ = value("backlash", "gap");
  motor_inertia_ = motor_share * 0.5 * parameters.mass * robot.wheel_radius * robot.wheel_radius;
  active_ = fine || std::isfinite(limit_) || deadzone_ > 0.0 || g != 0.0 || sag_time_ != 0.0 || sag_load_ != 0.0 ||
            delay_ > 0.0 || lag_ > 0.0 || play_ > 0.0;
}

void Drivetrain::reset() {
  history_.clear();
  output_.setZero();
  position_.setZero();
  relative_.setZero();
}

Eigen::Vector2d Drivetrain::instantaneous(const Eigen::Vector2d& command, double t) const {
  Eigen::Vector2d torque = command;
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double size = std::min(std::abs(command[j]), limit_);
    torque[j] = gain_[j] * std::copysign(std::max(size - deadzone_, 0.0), command[j]);
  }
  return torque * std::max(0.0, 1.0 - sag_time_ * t - sag_load_ * torque.lpNorm<1>());
}

Eigen::Vector2d Drivetrain::value(const Piece& piece, double t) {
  return piece.first + (t - piece.from) / (piece.to - piece.from) * (piece.last - piece.first);
}

// y at the end of a step on which lag·ẏ + y = u and u is linear.
Eigen::Vector2d Drivetrain::lagged(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h) {
  if (lag_ <= 0.0) {
    return output_ = last;
  }
  const Eigen::Vector2d ramp = lag_ / h * (last - first);  // y follows a ramp by so much
  return output_ = last - ramp + std::exp(-h / lag_) * (output_ - first + ramp);
}

Eigen::Vector2d Drivetrain::through_play(const Eigen::Vector2d& torque, double h) {
  Eigen::Vector2d passed = torque;
  for (Eigen::Index j = 0; j < 2 && play_ > 0.0; ++j) {
    const double contact = torque[j] > 0.0 ? play_ : 0.0;
    if (position_[j] == contact) {
      continue;
    }
    passed[j] = 0.0;
    relative_[j] += h * torque[j] / motor_inertia_;
    position_[j] = std::clamp(position_[j] + h * relative_[j], 0.0, play_);
    if (position_[j] == 0.0 || position_[j] == play_) {
      relative_[j] = 0.0;
    }
  }
  return passed;
}

void Drivetrain::advance(Plant& plant, const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h,
                         const std::function<void()>& watch) {
  if (!active_) {
    plant.advance(first, last, h);
    return;
  }
  const double start = plant.time(), end = start + h;
  if (history_.empty()) {
    history_.push_back({start - delay_ - 1.0, start, Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()});
  }
  history_.push_back({history_.back().to, end, first, last});
  while (history_.front().to <= start - delay_) {
    history_.pop_front();
  }
  double t = start;
  std::size_t at = 0;
  while (t < end) {
    while (at + 1 < history_.size() && history_[at].to + delay_ <= t) {
      ++at;
    }
    const Piece& piece = history_[at];
    const double until = at + 1 < history_.size() ? std::min(piece.to + delay_, end) : end;
    const int steps = std::max(1, static_cast<int>(std::ceil((until - t) / longest_piece)));
    const double step = (until - t) / steps;
    for (int i = 0; i < steps; ++i) {
      const double from = t + i * step, to = i + 1 == steps ? until : from + step;
      const Eigen::Vector2d begin = instantaneous(value(piece, from - delay_), from);
      const Eigen::Vector2d finish = instantaneous(value(piece, to - delay_), to);
      const Eigen::Vector2d before = lag_ > 0.0 ? output_ : begin, after = lagged(begin, finish, to - from);
      if (play_ > 0.0) {
        const Eigen::Vector2d passed = through_play(0.5 * (before + after), to - from);
        plant.advance(passed, passed, to - from);
      } else {
        plant.advance(before, after, to - from);
      }
      if (watch) {
        watch();
      }
    }
    t = until;
  }
}

void WheelMemory::record(const Plant& plant) {
  samples_.push_back({plant.time(), plant.state().wheel_angle, plant.wheel_speed()});
  while (samples_.size() > 2 && samples_[1].t < plant.time() - span_) {
    samples_.pop_front();
  }
}

WheelMemory::Wheels WheelMemory::at(double t) const {
  const auto after = std::ranges::lower_bound(samples_, t, {}, &Wheels::t);
  if (after == samples_.begin()) {
    return samples_.front();
  }
  if (after == samples_.end()) {
    return samples_.back();
  }
  const Wheels &a = *(after - 1), &b = *after;
  const double part = (t - a.t) / (b.t - a.t);
  return {t, a.angle + part * (b.angle - a.angle), a.speed + part * (b.speed - a.speed)};
}

}  // namespace wheelwright::sim
