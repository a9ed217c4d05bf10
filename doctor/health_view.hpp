// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log as the checks of its health look at it, and the checks.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/doctor/log_health.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// One joint as a log has it.
struct JointView {
  std::string angle_name, speed_name, effort_name;  ///< of the robot's columns
  const std::vector<double>* angle = nullptr;       ///< nullptr where the log has no such column
  const std::vector<double>* speed = nullptr;       ///< likewise
  const std::vector<double>* effort = nullptr;      ///< likewise, of the robot's kind of effort
  std::vector<double> smooth;  ///< speed over ten steps, rad/s or m/s: of angles where there are any, else of speeds
  double top = 0.0;            ///< 99 % quantile of |smooth|

  /// Whether the log has the joint's motion.
  [[nodiscard]] bool has_motion() const { return angle != nullptr || speed != nullptr; }
  /// Name of the motion column that is used: the angle's where there is one.
  [[nodiscard]] const std::string& motion_name() const { return angle != nullptr ? angle_name : speed_name; }
};

/// A log, what robot it is taken for, and how it moves.
struct HealthView {
  const LogTable* log = nullptr;
  Robot robot;  ///< the user's, or one that stands in for it
  bool robot_given = false;
  Model model;
  double step = 0.0;                                          ///< median step, s
  std::vector<std::pair<std::size_t, std::size_t>> segments;  ///< rows [first, last)
  std::vector<JointView> joints;
  std::vector<bool> moving;  ///< per row: a joint is faster than a twentieth of its top speed

  /// Whether a column `name` is there.
  [[nodiscard]] const std::vector<double>* column(const std::string& name) const;
  /// Whether all joints have their motion in one kind of column.
  [[nodiscard]] bool has_motion() const;
  /// Whether all joints have an effort.
  [[nodiscard]] bool has_effort() const;
  /// Whether the effort of `joint` is hardly ever negative although the joint moves backwards too.
  [[nodiscard]] bool one_sided(const JointView& joint) const;
};

/// The view of `log`, which must outlive it. Throws as examine().
[[nodiscard]] HealthView make_view(const LogTable& log, const std::optional<Robot>& robot);

/// Puts the stretches of rows that `flagged` marks into `finding`; marks less than `join` s apart are one stretch.
void set_stretches(LogFinding& finding, const HealthView& view, const std::vector<bool>& flagged, double join);

/// Rates, jitter, what is missing between rows, stamps that are too coarse, length.
void check_time(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Columns that stand still, repeat, are coarse or noisy, or end at a limit; rest.
void check_signals(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings);
/// Directions, speeds, accelerations; what the filtered regressor says of each parameter; effort against motion in time.
/// Returns whether commissioning would get as far as bounds.
bool check_motion(const HealthView& view, std::vector<LogFinding>& findings);
/// Wheel angles against speeds, wheels against pose and gyro: scales, signs, sides.
void check_odometry(const HealthView& view, std::vector<LogFinding>& findings);

/// The unit that a column which is `ratio` times too large is probably in: "deg/s" for 57.3; empty where none fits to a
/// tenth. `rates`: the quantity is an angular speed.
[[nodiscard]] std::string unit_for_ratio(double ratio, bool rates);

}  // namespace wheelwright
