// SPDX-License-Identifier: Apache-2.0
/// \file
/// Scenarios and their simulation in closed loop, with faults: reference trajectories of the paper and the controller
/// that follows them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "core/log.hpp"
#include "model/differential_drive.hpp"
#include "model/faults.hpp"
#include "model/robot.hpp"
#include "model/sim/drivetrain.hpp"
#include "model/sim/plant.hpp"

namespace wheelwright::sim {

/// Speeds over time, linear between the rows; at rest before the first row and after the last one.
struct SpeedTable {
  std::vector<double> t;               ///< s, increasing
  std::vector<Eigen::Vector2d> speed;  ///< [v1, v2] at these times, m/s, rad/s
};

/// Motion of the reference robot. Speeds start from 0 over one second, and are continuously differentiable; those of a
/// table are as the table says.
struct Trajectory {
  enum class Kind {
    straight,       ///< v1 = speed·(0.6 + 0.4 sin), no turning
    circle,         ///< constant speed and yaw rate
    figure_eight,   ///< constant speed, heading swinging by 2.405 rad (the first zero of J0, so that it closes)
    multi_sine,     ///< both speeds of three sines, reversals included
    spin,           ///< turning on the spot, to and fro
    stops,          ///< drives in curves, and stands still half of the time
    commissioning,  ///< straight, figure eight, multi-sine, spin, and driving in curves, one period each, with stops
    table,          ///< the speeds of `table`
  };
  Kind kind = Kind::commissioning;
  double speed = 0.5;     ///< largest |v1|, m/s
  double yaw_rate = 0.8;  ///< largest |v2|, rad/s; the figure eight's own is 2.405·2π/period
  double period = 10.0;   ///< s
  SpeedTable table = {};  ///< of Kind::table
};

/// Throws InvalidArgument, naming the field, unless speed and yaw rate are >= 0, the period is > 0 and, for
/// Kind::table, the table has two rows or more of finite numbers with increasing times.
void validate(const Trajectory& trajectory);

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

/// Gains of the tracking controller.
struct ControllerGains {
  double along = 1.0;     ///< of the error along the heading, 1/s
  double across = 4.0;    ///< of the error across it, rad/m² (times v_d sinc θ_e)
  double heading = 2.0;   ///< of the heading error, 1/s
  double speed = 8.0;     ///< of the speed error, 1/s
  double integral = 8.0;  ///< of its integral, 1/s²
};

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

/// Meaning of a row of the log.
enum class Sampling {
  instant,   ///< everything at the time stamp: speeds are samples of the speed
  interval,  ///< a sampling interval, stamped at its middle: speeds are angle differences over it (encoder differences
             ///< where the encoder is quantised), efforts its mean; angles and pose are those of the stamp
};

/// Logged signals and their errors. Bounds are |error| <= bound; 0 means exact.
struct Sensors {
  Sampling sampling = Sampling::instant;
  NoiseShape noise = NoiseShape::uniform;
  double wheel_speed = 0.0;                       ///< bound, rad/s
  double wheel_angle = 0.0;                       ///< bound before quantisation, rad
  double effort = 0.0;                            ///< bound, unit of the effort
  double position = 0.0;                          ///< bound on x and y, m
  double heading = 0.0;                           ///< bound, rad
  std::optional<double> encoder_counts_per_turn;  ///< rounds wheel angles to the nearest count
  bool angles = true;                             ///< columns phi_r, phi_l
  bool speeds = true;                             ///< columns omega_r, omega_l
  bool pose = true;                               ///< columns x, y, theta
  bool commands = true;                           ///< columns command_r, command_l
};

/// A simulated drive of a differential-drive robot.
struct Scenario {
  Robot robot;  ///< geometry, effort (torque, or current with the motor's constants), hold; `nominal` is
                ///< what the controller believes, where it is given
  model::DriveParameters parameters;  ///< the truth, physical (ℓ = D/2)
  Trajectory trajectory;
  ControllerGains controller;
  std::optional<double> torque_limit;                            ///< saturation of each wheel, N·m
  Eigen::Vector3d initial_pose = Eigen::Vector3d::Zero();        ///< of the reference, m, m, rad
  Eigen::Vector3d initial_pose_error = Eigen::Vector3d::Zero();  ///< robot minus reference, m, m, rad
  std::vector<model::Fault> faults;
  Sensors sensors;
  double duration = 60.0;      ///< s
  double rate = 100.0;         ///< samples and control periods per second, Hz
  double time_jitter = 0.0;    ///< largest shift of a sample as a share of the period, in [0, 0.5)
  std::vector<Interval> gaps;  ///< times [lower, upper) in which nothing is logged, s; longer than 6 periods each
  std::uint64_t seed = 1;
};

/// Throws InvalidArgument, naming the field, unless everything in `scenario` makes sense together.
void validate(const Scenario& scenario);

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
using sim::Scenario;
using sim::Simulation;
}  // namespace wheelwright
