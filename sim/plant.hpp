// SPDX-License-Identifier: Apache-2.0
/// \file
/// The robot of (4) and (13) with faults, integrated under piecewise linear torque.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/model/differential_drive.hpp>
#include <wheelwright/model/faults.hpp>
#include <wheelwright/sim/drive_effects.hpp>

namespace wheelwright {

/// Where the robot is and how it moves. The speeds are the true ones of the body, u = ẋ cosθ + ẏ sinθ and θ̇, which
/// stay continuous when a fault sets in; what the encoders see jumps.
struct DriveState {
  double forward_speed = 0.0;                             ///< u, m/s
  double yaw_rate = 0.0;                                  ///< θ̇, rad/s
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();         ///< [x, y, θ], m, m, rad
  Eigen::Vector2d wheel_angle = Eigen::Vector2d::Zero();  ///< [φ_R, φ_L], rad
};

/// The plant. (13) in terms of the body speeds is Newton's law, with d the part of δ across the heading (to the left):
///   m u̇ = τ_R/(r+δ1R) + τ_L/(r+δ1L) + m θ̇ d − [SᵀF_d q̇]₁,   I θ̈ = ½D (τ_R/(r+δ1R) − τ_L/(r+δ1L)) − f3 θ̇.
/// The lever arm is the physical D/2 whatever the convention of the model.
///
/// Where friction is isotropic, radii are constant and nothing slips the speeds and wheel angles follow in closed form,
/// and the position by three-point Gauss quadrature of the closed form; elsewhere by classical Runge-Kutta steps of at
/// most 2 ms that end where a fault begins, ends or changes its course; with effects (drive_effects.hpp) of at most
/// ¼ ms. Forces of effects come beside those above: the wheel torques less what is lost at the wheels, the forces on the
/// body, and with the centre of mass b beside the axis m (u̇ − b θ̈) and I θ̈ − m b u̇ on the left.
class Plant {
 public:
  /// Throws InvalidArgument when parameters or faults do not pass their `validate`.
  Plant(const DifferentialDrive& drive, const DriveParameters& parameters, std::vector<Fault> faults,
        const DriveEffects& effects = {});

  /// Sets the state and the time (s) it holds at.
  void reset(const DriveState& state, double t);

  /// Moves on by `h` (s), with the wheel torques going linearly from `torque` to `torque_end` (N·m).
  void advance(const Eigen::Vector2d& torque, const Eigen::Vector2d& torque_end, double h);

  /// Calls the current time `t` (s): undoes the rounding that adds up over many steps.
  void set_time(double t);

  /// Current state.
  [[nodiscard]] const DriveState& state() const { return state_; }
  /// Current time, s.
  [[nodiscard]] double time() const { return t_; }
  /// [ω_R, ω_L] now, rad/s: what the encoders see.
  [[nodiscard]] Eigen::Vector2d wheel_speed() const;
  /// v of (5) now, from the wheel speeds with the nominal radius, m/s, rad/s.
  [[nodiscard]] Eigen::Vector2d encoder_speed() const { return drive_.body_speed(wheel_speed()); }

 private:
  // ∫-coefficients of ẏ = −a y + c0 + c1 s after a time: y = decay·y0 + i1·c0 + i2·c1, ∫y = i1·y0 + i2·c0 + i3·c1.
  struct Response {
    double decay, i1, i2, i3;
  };
  struct Derivative {
    double forward, yaw;
    Eigen::Vector3d pose;
    Eigen::Vector2d angle;
  };
  [[nodiscard]] static Response response(double a, double time);
  [[nodiscard]] FaultState fault_at(double t) const;
  [[nodiscard]] Eigen::Vector2d wheel_speed(const DriveState& state, const FaultState& fault,
                                            const Eigen::Vector2d& torque) const;
  [[nodiscard]] Derivative derivative(const DriveState& state, const FaultState& fault, const Eigen::Vector2d& torque,
                                      double t) const;
  void prepare(double h);
  void exact_step(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h);
  void runge_kutta(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h);
  void enter_interval();

  DifferentialDrive drive_;
  DriveParameters parameters_;
  std::vector<Fault> faults_;
  DriveEffects effects_;
  DryThreshold threshold_;
  double half_track_ = 0.0;     // with the effects' track width
  std::vector<double> breaks_;  // times at which a fault changes its course, ascending
  std::size_t interval_ = 0;    // breaks_[interval_ − 1] <= t_ < breaks_[interval_]
  bool moving_ = false;         // whether a fault changes with time inside the interval
  bool exact_ = true;           // whether the interval has the closed form
  FaultState fault_;            // of the interval where nothing moves

  DriveState state_;
  double t_ = 0.0;
  Eigen::Vector2d torque_ = Eigen::Vector2d::Zero();  // at t_

  double prepared_step_ = -1.0;
  std::array<Response, 4> forward_{}, yaw_{};  // at the three Gauss nodes and at the end of the step
};

}  // namespace wheelwright
