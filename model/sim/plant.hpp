// SPDX-License-Identifier: Apache-2.0
/// \file
/// The simulated plant and its sensors' noise.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "model/differential_drive.hpp"
#include "model/effect_law.hpp"
#include "model/faults.hpp"
#include "model/robot.hpp"
#include "model/sim/scenario.hpp"

namespace wheelwright::sim {

/// One stream of noise. Draws are made of mt19937_64 by own transforms, so they do not depend on the standard library.
class Noise {
 public:
  /// `stream` separates the sensors of one seed: switching one on leaves the noise of the others as it was. Throws
  /// InvalidArgument unless `bound` is finite and >= 0.
  Noise(std::uint64_t seed, std::uint64_t stream, double bound, NoiseShape shape = NoiseShape::uniform);

  /// A number in [−1, 1] of the stream's shape. Two seeds or streams are unrelated.
  [[nodiscard]] double unit();

  /// `exact` with noise added: the result differs from `exact` by `bound` at most. With bound 0 it is `exact`, and
  /// nothing is drawn.
  [[nodiscard]] double measure(double exact);

 private:
  [[nodiscard]] double uniform();

  std::mt19937_64 generator_;
  double bound_;
  NoiseShape shape_;
};

/// The numbers of a robot's effects that act between the wheel torques and the body: those of the terms
/// (effect_law.hpp, with the same signs), and load_friction, friction_drift, wheel_out_of_round and
/// longitudinal_slip. An effect without a formula here acts by the terms of its law.
struct DriveEffects {
  /// None.
  DriveEffects() = default;
  /// Those of `robot` (mid-points of intervals). Throws InvalidArgument where an effect without a formula here has
  /// terms of acceleration.
  explicit DriveEffects(const Robot& robot);

  bool forces = false;                                  ///< whether there is anything besides geometry
  Eigen::Vector2d radius = Eigen::Vector2d::Zero();     ///< what the wheels' radii have beyond the nominal one, m
  double track = 0.0;                                   ///< what the track width has beyond the nominal one, m
  Eigen::Vector2d coulomb = Eigen::Vector2d::Zero();    ///< N·m
  Eigen::Vector2d bias = Eigen::Vector2d::Zero();       ///< N·m
  Eigen::Vector2d round_cos = Eigen::Vector2d::Zero();  ///< of cos φ, N·m
  Eigen::Vector2d round_sin = Eigen::Vector2d::Zero();  ///< of sin φ, N·m
  double stribeck = 0.0, stribeck_speed = 1.0;          ///< N·m, rad/s
  double viscous = 0.0;                                 ///< of viscous_asymmetric, N·m·s/rad
  double drag = 0.0, drag_yaw = 0.0;                    ///< N·s²/m, N·m²·s²/rad²
  double com_longitudinal = 0.0, com_lateral = 0.0;     ///< m
  Eigen::Vector2d gravity = Eigen::Vector2d::Zero();    ///< [g_x, g_y], m/s²
  double caster = 0.0, caster_arm = 1.0;                ///< N·m, m
  double scrub = 0.0;                                   ///< N·m²
  double load = 0.0;                                    ///< –
  double drift = 0.0, drift_time = 1.0;                 ///< –, s
  double stiffness = 0.0;                               ///< N; 0: no slip

  /// An effect that has terms in its law and no formula here.
  struct ByTerms {
    Model terms;                    ///< the law's, alone
    std::vector<double> sizes;      ///< of their parameters
    std::vector<bool> times_mass;   ///< whether a size is per kg of the simulated robot
    Eigen::Matrix2d wheel_torques;  ///< what they ask for at the outputs, as torques of the wheels
  };
  std::vector<ByTerms> by_terms;
};

/// Where dry friction goes over from one sign to the other: sgn x is x/x0 for |x| < x0. Dry friction that would stop a
/// wheel within a step makes the integration stiff; x0 = 2·step·(slope of the speed per unit of friction) bounds its
/// eigenvalue by ½ per step and source, inside the region in which Runge-Kutta is stable. A robot that stands creeps at
/// x0·τ/c at most (about 10⁻³ rad/s at the wheels) instead of sticking, and a reversal is passed in about a
/// millisecond.
struct DryThreshold {
  double wheel = 0.0;       ///< rad/s
  double yaw = 0.0;         ///< rad/s
  double caster = 0.0;      ///< m/s
  double per_torque = 0.0;  ///< of effects by their terms, rad/s per N·m that they ask for
};
[[nodiscard]] DryThreshold dry_threshold(const DriveEffects& effects, const DifferentialDrive& drive,
                                         const model::DriveParameters& parameters, double step);

/// Losses between the wheel torques and the body.
struct EffectLoad {
  Eigen::Vector2d torque = Eigen::Vector2d::Zero();  ///< at the wheels, N·m
  double force = 0.0;                                ///< along the heading, N
  double moment = 0.0;                               ///< about the vertical, N·m
};

/// The state that effects look at.
struct EffectState {
  double t = 0.0;                                         ///< s
  double speed = 0.0, yaw_rate = 0.0, heading = 0.0;      ///< of the body, m/s, rad/s, rad
  Eigen::Vector2d wheel_speed = Eigen::Vector2d::Zero();  ///< rad/s
  Eigen::Vector2d wheel_angle = Eigen::Vector2d::Zero();  ///< rad
  Eigen::Vector2d torque = Eigen::Vector2d::Zero();       ///< N·m
};

/// The load at one instant; forces of inertia (com_lateral) apart.
[[nodiscard]] EffectLoad effect_load(const DriveEffects& effects, const DifferentialDrive& drive,
                                     const model::DriveParameters& parameters, const DryThreshold& threshold,
                                     const EffectState& state);

/// Slip of the wheels as a share of their speeds, force/stiffness, at most a fifth, for the wheel forces `force` (N).
[[nodiscard]] Eigen::Vector2d slip_share(const DriveEffects& effects, const Eigen::Vector2d& force,
                                         const Eigen::Vector2d& rim_speed);

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
/// most 2 ms that end where a fault begins, ends or changes its course; with effects (plant.hpp) of at most
/// ¼ ms. Forces of effects come beside those above: the wheel torques less what is lost at the wheels, the forces on
/// the body, and with the centre of mass b beside the axis m (u̇ − b θ̈) and I θ̈ − m b u̇ on the left.
class Plant {
 public:
  /// Throws InvalidArgument when parameters or faults do not pass their `validate`.
  Plant(const DifferentialDrive& drive, const model::DriveParameters& parameters, std::vector<model::Fault> faults,
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
  [[nodiscard]] model::FaultState fault_at(double t) const;
  [[nodiscard]] Eigen::Vector2d wheel_speed(const DriveState& state, const model::FaultState& fault,
                                            const Eigen::Vector2d& torque) const;
  [[nodiscard]] Derivative derivative(const DriveState& state, const model::FaultState& fault,
                                      const Eigen::Vector2d& torque, double t) const;
  void prepare(double h);
  void exact_step(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h);
  void runge_kutta(const Eigen::Vector2d& torque, const Eigen::Vector2d& slope, double h);
  void enter_interval();

  DifferentialDrive drive_;
  model::DriveParameters parameters_;
  std::vector<model::Fault> faults_;
  DriveEffects effects_;
  DryThreshold threshold_;
  double half_track_ = 0.0;     // with the effects' track width
  std::vector<double> breaks_;  // times at which a fault changes its course, ascending
  std::size_t interval_ = 0;    // breaks_[interval_ − 1] <= t_ < breaks_[interval_]
  bool moving_ = false;         // whether a fault changes with time inside the interval
  bool exact_ = true;           // whether the interval has the closed form
  model::FaultState fault_;     // of the interval where nothing moves

  DriveState state_;
  double t_ = 0.0;
  Eigen::Vector2d torque_ = Eigen::Vector2d::Zero();  // at t_

  double prepared_step_ = -1.0;
  std::array<Response, 4> forward_{}, yaw_{};  // at the three Gauss nodes and at the end of the step
};

}  // namespace wheelwright::sim
