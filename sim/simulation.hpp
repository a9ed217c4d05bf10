// SPDX-License-Identifier: Apache-2.0
/// \file
/// Scenarios and their simulation in closed loop, with faults.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/model/faults.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/sim/drivetrain.hpp>
#include <wheelwright/sim/plant.hpp>
#include <wheelwright/sim/trajectory.hpp>

namespace wheelwright::sim {

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
