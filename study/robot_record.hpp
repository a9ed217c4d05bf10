// SPDX-License-Identifier: Apache-2.0
/// \file
/// Record of one robot of a fleet (numbers and sentences, no logs and no sets), and the table of a fleet by parameter.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/core/warrant.hpp>

namespace wheelwright::study {

/// Status of a robot's commissioning.
enum class RobotStatus {
  commissioned,  ///< every parameter shows
  partial,       ///< a model came out; the bounds of some parameters are the prior's
  contradicted,  ///< no parameters explain the log within the declared noise
  nothing,       ///< no parameter shows: no model
  unreadable,    ///< the log or the robot file cannot be used: the message says why
};

/// One parameter of one log. Where the effort's constants are known it is the physical quantity as a robot file's
/// `prior` counts it, θ_L,j / per_physical (under voltage, viscous terms with the braking of the back-EMF in them);
/// else θ_L,j itself. Bounds are rounded outward.
struct RecordedParameter {
  std::string name;  ///< physical name, name of θ_L,j, or "kinematic." and the name of a kinematic parameter
  std::string unit;
  bool is_prior_key = false;               ///< `name` is a key of a robot file's `prior`
  std::optional<double> estimate{};        ///< nothing where the log does not show the parameter
  std::optional<double> standard_error{};  ///< of the estimate, where it is finite
  std::optional<double> freedom{};  ///< degrees of freedom of the standard error; nothing where it is taken as exact
  double lower = 0.0;               ///< of the bounds, in the sense of `warrant`
  double upper = 0.0;
  bool lower_is_prior = false;  ///< the log does not tighten this side
  bool upper_is_prior = false;
  Interval prior{};  ///< in which the bounds were sought; [lower, upper] where that is not known
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of lower and upper

  friend bool operator==(const RecordedParameter&, const RecordedParameter&) = default;
};

/// The threshold of one output, on driving that was held out.
struct RecordedOutput {
  std::string name;
  std::string unit;
  double median_width = 0.0;     ///< of u − l, unit of the output
  std::size_t instants = 0;      ///< held out
  std::size_t false_alarms = 0;  ///< of these, outside

  friend bool operator==(const RecordedOutput&, const RecordedOutput&) = default;
};

/// A log, or several taken together, commissioned by itself.
struct LogRecord {
  std::string log;    ///< as the list names it
  double when = 0.0;  ///< days; a plain order where RobotRecord::dated is false
  RobotStatus status = RobotStatus::unreadable;
  std::string message;  ///< one sentence for people
  double seconds = 0.0;
  std::size_t rows = 0;
  std::vector<RecordedParameter> parameters{};

  friend bool operator==(const LogRecord&, const LogRecord&) = default;
};

/// A later log: looked at by the detector of the commissioned model, and commissioned anew to see what moved.
struct CheckRecord {
  LogRecord log;
  bool checked = false;           ///< there was a model, and the detector could walk the log
  std::string not_checked;        ///< why it was not; else empty
  std::size_t events = 0;         ///< alarms of both residuals
  std::optional<double> first{};  ///< time of the first alarm, s of the log
  std::size_t instants = 0;       ///< decisions of the torque residual
  double outside_share = 0.0;     ///< largest share of instants outside over its outputs

  friend bool operator==(const CheckRecord&, const CheckRecord&) = default;
};

/// A robot's entry in the fleet.
struct RobotRecord {
  std::string robot;
  bool dated = false;  ///< `when` of its logs are dates (days since 1970-01-01) or days; else their order
  LogRecord commissioning;
  std::vector<RecordedOutput> outputs{};
  std::optional<double> smallest_radius_change{};  ///< share of the wheel radius certainly seen held out; nothing where
                                                   ///< none up to 41 % (an effort scaled by 2) is, or for no wheels
  std::vector<CheckRecord> checks{};               ///< in order of time
  std::vector<std::string> notes{};
  std::vector<std::string> findings{};  ///< what is wrong with the robot's entry (a duplicate, a missing file)

  friend bool operator==(const RobotRecord&, const RobotRecord&) = default;
};

/// One robot's value of a parameter.
struct FleetEntry {
  std::size_t robot = 0;        ///< index into FleetTable::robots
  double estimate = 0.0;        ///< NaN where the log does not show it
  double standard_error = 0.0;  ///< NaN where there is none
  double freedom = 0.0;         ///< of the standard error; infinite where it is taken as exact
  double lower = 0.0;           ///< bounds
  double upper = 0.0;
  Interval prior{};  ///< in which they were sought
};

/// One parameter over the fleet.
struct FleetColumn {
  std::string name;
  std::string unit;
  bool is_prior_key = false;
  std::vector<FleetEntry> entries{};  ///< ascending robots
  core::Warrant warrant =
      core::Warrant::extrapolated;  ///< the weakest of all logs' bounds of it, those of checks included
};

/// Robots in the order in which they were added.
struct FleetTable {
  std::vector<std::string> robots{};
  std::vector<RobotStatus> status{};
  std::vector<FleetColumn> columns{};
};

/// Index of the column `name` with `unit`; a new one where there is none.
[[nodiscard]] std::size_t column_of(FleetTable& table, const RecordedParameter& parameter);

/// Appends the robot of `record` with the parameters of its commissioning.
void add(FleetTable& table, const RobotRecord& record);

}  // namespace wheelwright::study
