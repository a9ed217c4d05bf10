// SPDX-License-Identifier: Apache-2.0
/// \file
/// A scenario as a log, made while it is read.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/log.hpp>
#include <wheelwright/sim/drivetrain.hpp>
#include <wheelwright/sim/plant.hpp>
#include <wheelwright/sim/scenario.hpp>

namespace wheelwright {

/// The log of a scenario, block by block in bounded memory; the same scenario gives the same log each time it is
/// walked, whatever the size of the blocks. Noise is drawn without the standard library's distributions; what is left to the
/// machine is the last digit of its sine, cosine and exponential.
///
/// With Hold::zero_order a row's effort acts from its stamp to the next one, and with Hold::first_order efforts are
/// linear between stamps, in the simulated world too: a noise-free log of Sampling::instant satisfies the model exactly. The
/// feedback uses true angles and pose, so sensors do not change the motion.
///
/// Effects of the scenario's robot act in the simulated world (drive_effects.hpp, drivetrain.hpp); the log has the commanded
/// efforts. With `sensor_time_offset` wheel angles and speeds are those of dt before, and `encoder_scale` multiplies them.
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

}  // namespace wheelwright
