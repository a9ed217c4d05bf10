// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sensor readings of a drive, and the filtered signals of the nominal model.
#pragma once

#include <Eigen/Core>

#include "core/log.hpp"
#include "tests/world/world.hpp"

namespace wheelwright::reality {

/// The log of `record` as the sensors of `robot` write it: wheel speeds as differences of encoder counts, noise on
/// torque and pose, the heading wrapped, values rounded to what the sensors resolve.
[[nodiscard]] LogTable sense(const RobotDesign& robot, const Record& record, Random random);

/// How a robot's computer writes its log: what ordinary ones have beside noise.
struct Logger {
  double jitter = 0.0;        ///< of time stamps, largest, as a share of the period (< 0.5)
  double lost = 0.0;          ///< share of the rows that are missing
  double burst = 1.0;         ///< mean number of rows lost at once
  std::size_t smoothing = 1;  ///< speeds are means over so many rows up to this one
};

/// One in four smooths its speeds over two to four rows; the others do not.
[[nodiscard]] Logger draw_logger(Random& random);

/// `log`, whose rows are `period` (s) apart, as `logger` writes it. The first and the last row stay.
[[nodiscard]] LogTable write_down(const Logger& logger, const LogTable& log, double period, Random random);

/// One additional torque and one additional speed: s and d = τ_R − τ_L in N m, m/s, rad/s, an entry per row.
struct Column {
  Eigen::VectorXd s, d, v1, v2;
};

/// The signals of a drive by the wheels, with the radius and track of the data sheet. d is τ_R − τ_L.
struct Signals {
  double period = 0.01;
  Eigen::VectorXd t, s, d, v1, v2, a1, a2;
  std::array<Eigen::VectorXd, 2> angle, speed, acceleration, torque;
  Eigen::VectorXd x, y, heading;

  [[nodiscard]] Eigen::Index rows() const { return t.size(); }
};

/// Without noise. Accelerations are exact means over the interval.
[[nodiscard]] Signals signals_of(const RobotDesign& robot, const Record& record);

/// Of a log; accelerations are central differences.
[[nodiscard]] Signals signals_of(const RobotDesign& robot, const LogTable& log);

/// Twice a first-order low-pass with rate `beta` (1/s) and unit gain, from rest.
[[nodiscard]] Eigen::VectorXd low_pass(const Eigen::VectorXd& u, double period, double beta);

}  // namespace wheelwright::reality
