// SPDX-License-Identifier: Apache-2.0
/// \file
/// Filtered rows of a log as a stream of blocks: torque and odometry.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/core/regression.hpp>
#include <wheelwright/filter/odometry_filter.hpp>
#include <wheelwright/filter/regressor_filter.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// Walks a log through a RegressorFilter; the filter restarts at every segment of the log, so nothing is filtered across
/// a gap. The log must outlive the stream and is rewound by it.
class RegressionStream final : public RegressionSource {
 public:
  /// Throws InvalidArgument when `log` lacks a column of the filter's measurement.
  RegressionStream(LogSource& log, RegressorFilter filter);
  [[nodiscard]] std::size_t outputs() const override { return filter_.model().n(); }
  [[nodiscard]] std::size_t parameters() const override { return filter_.model().p(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;
  [[nodiscard]] const RegressorFilter& filter() const { return filter_; }

 private:
  LogSource* log_;
  RegressorFilter filter_;
  std::vector<std::size_t> pick_;
  std::vector<double> sample_;
  LogBlock scratch_;
};

/// What `log` has for a kinematic residual of `robot`; nothing where the robot is no differential drive, or the log has
/// neither the columns theta (with x and y or without) nor gyro_z. Angles are used where the log has them, else speeds in
/// the way that `torque` (how the torque residual reads the log) found them. A pose is taken as held where it stays
/// exactly the same over a fifth or more of the steps in which a wheel moves. Walks the log once where it has a pose.
[[nodiscard]] std::optional<OdometryMeasurement> find_odometry(LogSource& log, const Robot& robot, const Model& model,
                                                               const Measurement& torque);

/// Walks a log through an OdometryFilter, which restarts at every segment. The log must outlive the stream and is
/// rewound by it.
class OdometryStream final : public RegressionSource {
 public:
  /// Throws InvalidArgument when `log` lacks a column of the filter's measurement.
  OdometryStream(LogSource& log, OdometryFilter filter);
  [[nodiscard]] std::size_t outputs() const override { return n_; }
  [[nodiscard]] std::size_t parameters() const override { return p_; }
  bool next(RegressionBlock& block) override;
  void rewind() override;
  /// Time at which the window of each instant of the block last handed out begins, s; it ends at RegressionBlock::t.
  [[nodiscard]] const std::vector<double>& window_starts() const { return starts_; }
  [[nodiscard]] const OdometryFilter& filter() const { return filter_; }

 private:
  LogSource* log_;
  OdometryFilter filter_;
  std::size_t n_, p_;
  std::vector<std::size_t> pick_;
  std::vector<double> sample_, starts_;
  LogBlock scratch_;
};

}  // namespace wheelwright
