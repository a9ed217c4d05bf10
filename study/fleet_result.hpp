// SPDX-License-Identifier: Apache-2.0
/// \file
/// Result of a fleet: gathered record by record, evaluated once all are there.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <wheelwright/study/drift.hpp>
#include <wheelwright/study/pooled_prior.hpp>
#include <wheelwright/study/population.hpp>
#include <wheelwright/study/robot_record.hpp>

namespace wheelwright::study {

/// Something to look at in one robot's entry: a log that failed, a contradiction, an alarm.
struct FleetFinding {
  std::size_t robot = 0;
  std::string log{};  ///< as the list names it; empty for the entry itself
  std::string text{};
};

/// A log in which a robot's detector raised alarms.
struct FleetAlarm {
  std::size_t robot = 0;
  std::string log{};
  std::size_t events = 0;
  double first = 0.0;  ///< s of the log
  double outside_share = 0.0;
};

/// A quantity over the robots that have it.
struct FleetSpread {
  std::string name;
  std::string unit;
  std::vector<double> values{};   ///< in the order of robots
  std::size_t largest_robot = 0;  ///< of the largest value
  double largest = -std::numeric_limits<double>::infinity();

  /// The value below which `share` of them lie (nearest rank); NaN where there are none.
  [[nodiscard]] double quantile(double share) const;
};

/// Options of judge_fleet().
struct FleetOptions {
  PopulationOptions population{};
  PooledPriorOptions prior{};
  double drift_level = 0.05;  ///< probability that any robot of a fleet that does not drift is said to
};

/// A fleet. Memory grows by the robots' names, six numbers a parameter, and the findings: 10⁶ robots with a later log
/// each take about 2 GiB.
struct FleetResult {
  FleetTable table{};
  std::vector<std::size_t> by_status = std::vector<std::size_t>(5, 0);  ///< robots with each RobotStatus
  std::size_t logs = 0;                                                 ///< looked at
  std::size_t checked = 0;                                              ///< of these, by a detector
  double seconds = 0.0;                                                 ///< of driving
  std::vector<FleetFinding> failed{};  ///< unreadable, contradicted, nothing shown; checks that failed; entries
  std::vector<FleetAlarm> alarms{};
  std::vector<FleetSpread> widths{};                                            ///< of thresholds, by output
  FleetSpread smallest{"smallest certain change of the wheel radius", "", {}};  ///< as a share
  std::vector<ParameterDrift> drift{};  ///< of all robots and parameters with two logs; judged: worst first
  double drift_level = 0.05;
  Population population{};
  PooledPrior prior{};

  /// Robots with this status.
  [[nodiscard]] std::size_t count(RobotStatus status) const { return by_status[static_cast<std::size_t>(status)]; }
  /// Number of different robots that are outside, that drift, and that drift for certain.
  [[nodiscard]] std::size_t robots_outside() const;
  [[nodiscard]] std::size_t robots_drifting() const;
  [[nodiscard]] std::size_t robots_drifting_for_certain() const;
  [[nodiscard]] std::size_t robots_alarmed() const;
  /// True if no robot is outside, drifts, raised an alarm, was contradicted or could not be examined.
  [[nodiscard]] bool well() const;
};

/// Appends a robot. The order in which records come is the order of everything that is listed.
void take(FleetResult& fleet, const RobotRecord& record);

/// Judges the fleet: population, drift, pooled prior. To be called once, when all records were taken. Throws
/// InvalidArgument as describe_population() and pooled_prior() do.
void judge_fleet(FleetResult& fleet, const FleetOptions& options = {});

/// The fleet in sentences for people, most important first: "487 of 500 robots were commissioned", …
[[nodiscard]] std::vector<std::string> sentences(const FleetResult& fleet);

}  // namespace wheelwright::study
