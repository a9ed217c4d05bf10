// SPDX-License-Identifier: Apache-2.0
/// \file
/// Drivetrain between the commanded torque, which is logged, and the torque that drives the simulated wheels.
#pragma once

#include <deque>
#include <functional>
#include <limits>

#include <Eigen/Core>

#include "model/robot.hpp"
#include "model/sim/plant.hpp"

namespace wheelwright::sim {

/// The actuators of a simulated robot. In this order: `saturation`, `torque_deadzone`, `torque_gain_asymmetric`,
/// `battery_sag` (τ (1 − k t − R_b Σ|τ|), not below 0), `delay`, `actuator_lag` (exact), `backlash` (after a reversal
/// no torque reaches the wheel until the motor, of 1 % of the wheel's share of the mass, has crossed the play). Before
/// the start there was no torque. The plant is moved in pieces of at most ½ ms, on which the torque is linear, or at
/// once where there is nothing to do.
class Drivetrain {
 public:
  /// `parameters` are those of the plant. `fine` asks for pieces of ½ ms even where there is nothing to do.
  Drivetrain(const Robot& robot, const model::DriveParameters& parameters, bool fine);

  /// Forgets all torques.
  void reset();

  /// Moves `plant` on by `h` (s) with the commanded torques going linearly from `first` to `last` (N·m); `watch`, where
  /// there is one, is called after each piece.
  void advance(Plant& plant, const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h,
               const std::function<void()>& watch = {});

 private:
  struct Piece {
    double from, to;
    Eigen::Vector2d first, last;
  };
  [[nodiscard]] Eigen::Vector2d instantaneous(const Eigen::Vector2d& command, double t) const;
  [[nodiscard]] static Eigen::Vector2d value(const Piece& piece, double t);
  [[nodiscard]] Eigen::Vector2d lagged(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h);
  [[nodiscard]] Eigen::Vector2d through_play(const Eigen::Vector2d& torque, double h);

  bool active_ = false;
  double limit_ = std::numeric_limits<double>::infinity();  // N·m
  double deadzone_ = 0.0;                                   // N·m
  Eigen::Vector2d gain_ = Eigen::Vector2d::Ones();
  double sag_time_ = 0.0, sag_load_ = 0.0;  // 1/s, 1/(N·m)
  double delay_ = 0.0, lag_ = 0.0;          // s
  double play_ = 0.0;                       // rad
  double motor_inertia_ = 0.0;              // kg·m²

  std::deque<Piece> history_;
  Eigen::Vector2d output_ = Eigen::Vector2d::Zero();    // of the lag
  Eigen::Vector2d position_ = Eigen::Vector2d::Zero();  // in the play, [0, gap]
  Eigen::Vector2d relative_ = Eigen::Vector2d::Zero();  // speed in the play, rad/s
};

/// The recent motion of the wheels: what a sensor that is late shows.
class WheelMemory {
 public:
  /// Keeps the last `span` seconds.
  explicit WheelMemory(double span = 0.0) : span_(span) {}
  /// Forgets everything.
  void reset() { samples_.clear(); }
  /// Takes the motion of `plant` now.
  void record(const Plant& plant);

  /// Angles and speeds of the wheels.
  struct Wheels {
    double t = 0.0;
    Eigen::Vector2d angle = Eigen::Vector2d::Zero();  ///< rad
    Eigen::Vector2d speed = Eigen::Vector2d::Zero();  ///< rad/s
  };
  /// The motion at time `t` (s), linear between what was taken; the first one before that.
  [[nodiscard]] Wheels at(double t) const;

 private:
  double span_;
  std::deque<Wheels> samples_;
};

}  // namespace wheelwright::sim
