// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulation of a scenario in closed loop: the reference trajectories of the paper and the controller that follows
/// them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "model/differential_drive.hpp"
#include "model/robot.hpp"
#include "model/sim/drivetrain.hpp"
#include "model/sim/plant.hpp"
#include "model/sim/scenario.hpp"

namespace wheelwright::sim {

/// Reference speeds at one instant.
struct ReferenceSpeed {
  Eigen::Vector2d speed = Eigen::Vector2d::Zero();         ///< v_d, m/s, rad/s
  Eigen::Vector2d acceleration = Eigen::Vector2d::Zero();  ///< v̇_d, m/s², rad/s²
};

/// v_d and v̇_d at time `t` (s, >= 0).
[[nodiscard]] ReferenceSpeed reference_speed(const Trajectory& trajectory, double t);

/// The pose [x, y, θ] (m, m, rad) of the reference robot one step `h` (s) after `pose` at time `t`: the arc of the
/// twist at the middle of the step, exact for constant speeds, else with an error of O(h³) a step.
[[nodiscard]] Eigen::Vector3d advance_reference(const Trajectory& trajectory, const Eigen::Vector3d& pose, double t,
                                                double h);

/// Tracks a reference pose. The kinematic law is Samson's (1993, nonlinear form of Kanayama et al. 1990), which also
/// holds in reverse:
///   v_c = v_d cos θ_e + k_x x_e,   ω_c = ω_d + k_y v_d (sin θ_e / θ_e) y_e + k_θ θ_e
/// and the torque follows from the nominal model,
///   [1 1; ℓ −ℓ]τ = r (M̂ (v̇_d + k_p e + k_i ∫e) + F̂ v_c),  e = v_c − v.
/// With M̂, F̂ of the robot and no fault the tracking error tends to 0 as the period does.
class TrackingController {
 public:
  /// `nominal` is what the controller believes of the robot; `torque_limit` (N·m) saturates each wheel where given.
  TrackingController(const DifferentialDrive& drive, const model::DriveParameters& nominal,
                     const ControllerGains& gains, std::optional<double> torque_limit);

  /// What the controller asks for.
  struct Command {
    Eigen::Vector2d speed = Eigen::Vector2d::Zero();   ///< [v_c, ω_c], m/s, rad/s
    Eigen::Vector2d torque = Eigen::Vector2d::Zero();  ///< [τ_R, τ_L], N·m
  };

  /// The command for measured `pose` [x, y, θ] and speeds `v`, to be held for `h` seconds.
  [[nodiscard]] Command step(const Eigen::Vector3d& reference_pose, const ReferenceSpeed& reference,
                             const Eigen::Vector3d& pose, const Eigen::Vector2d& v, double h);

  /// Forgets the integral.
  void reset() { integral_.setZero(); }

 private:
  DifferentialDrive drive_;
  model::DriveParameters nominal_;
  ControllerGains gains_;
  std::optional<double> torque_limit_;
  Eigen::Vector2d integral_ = Eigen::Vector2d::Zero();
};

/// Geometry of the scenario's robot.
[[nodiscard]] DifferentialDrive drive_of(const Robot& robot);

/// Parameters that the controller assumes: the robot's nominal values where they are given, else the truth.
[[nodiscard]] model::DriveParameters nominal_parameters(const Scenario& scenario);

/// θ_L of the scenario's truth in the order of `model.parameters`, units of θ_L; in the model's own lever-arm
/// convention (with ℓ = D inertia and friction of yaw come out doubled); those of effects are the mid-points of the
/// robot's. Throws InvalidArgument when the model has a parameter that a differential drive does not, or has one
/// viscous_linear while the truth is anisotropic.
[[nodiscard]] Eigen::VectorXd true_parameters(const Scenario& scenario, const Model& model);

/// The log of a scenario, block by block in bounded memory; the same scenario gives the same log each time it is
/// walked, whatever the size of the blocks. Noise is drawn without the standard library's distributions; what is left
/// to the machine is the last digit of its sine, cosine and exponential.
///
/// With Hold::zero_order a row's effort acts from its stamp to the next one, and with Hold::first_order efforts are
/// linear between stamps, in the simulated world too: a noise-free log of Sampling::instant satisfies the model
/// exactly. The feedback uses true angles and pose, so sensors do not change the motion.
///
/// Effects of the scenario's robot act in the simulated world (plant.hpp, drivetrain.hpp); the log has the commanded
/// efforts. With `sensor_time_offset` wheel angles and speeds are those of dt before, and `encoder_scale` multiplies
/// them.
class Simulation final : public LogSource {
 public:
  /// Throws InvalidArgument when `scenario` does not pass its `validate`, or `block_rows` is 0.
  explicit Simulation(Scenario scenario, std::size_t block_rows = 4096);

  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  bool next(LogBlock& block) override;
  void rewind() override;
  /// The sampling period 1/rate, s (0 for fewer than two rows).
  [[nodiscard]] double median_step() const override;
  /// The scenario that is simulated, its seed included.
  [[nodiscard]] const Scenario& scenario() const { return scenario_; }
  /// The true motion at the end of the rows that were handed out.
  [[nodiscard]] const Plant& plant() const { return plant_; }
  /// The pose [x, y, θ] of the reference at the same time, m, m, rad.
  [[nodiscard]] const Eigen::Vector3d& reference_pose() const { return reference_; }

 private:
  // Everything that a row is made of, before the sensors.
  struct Row {
    double t = 0.0;
    Eigen::Vector2d angle, speed, torque, command;
    Eigen::Vector3d pose;
  };
  void make_names();
  void make_sensors();
  // What the encoders show now.
  [[nodiscard]] WheelMemory::Wheels sensed() const;
  void advance(const Eigen::Vector2d& first, const Eigen::Vector2d& last, double h);
  // Drives one period and returns its row.
  Row drive();
  void write(const Row& row, std::size_t at, LogBlock& block);
  [[nodiscard]] double stamp(std::uint64_t k);
  [[nodiscard]] bool in_gap(double t);
  [[nodiscard]] double quantised(double angle) const;

  Scenario scenario_;
  std::size_t block_rows_;
  std::vector<std::string> names_;
  DifferentialDrive drive_;
  double late_;  // s
  Eigen::Vector2d encoder_scale_;
  Plant plant_;
  Drivetrain drivetrain_;
  WheelMemory memory_;
  TrackingController controller_;
  std::uint64_t periods_ = 0;
  double effort_per_torque_ = 1.0;
  double angle_step_ = 0.0;

  std::uint64_t k_ = 0;
  std::size_t rows_ = 0;
  std::size_t gap_ = 0;
  bool segment_starts_ = true;
  double t_ = 0.0;
  Eigen::Vector3d reference_ = Eigen::Vector3d::Zero();
  Eigen::Vector2d torque_ = Eigen::Vector2d::Zero();
  std::vector<Noise> noise_;
};

/// The whole log of `scenario` in memory.
[[nodiscard]] LogTable simulate(const Scenario& scenario);

}  // namespace wheelwright::sim

namespace wheelwright {
using sim::Simulation;
}  // namespace wheelwright
