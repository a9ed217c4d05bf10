// SPDX-License-Identifier: Apache-2.0
/// \file
/// Result of a fleet: gathered record by record, evaluated once all are there; drift of parameters from log to log.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "study/population.hpp"

namespace wheelwright::study {

/// A parameter as one log shows it.
struct DriftPoint {
  double when = 0.0;            ///< days, or the order
  double estimate = 0.0;        ///< NaN where the log does not show it
  double standard_error = 0.0;  ///< NaN where there is none
  double lower = 0.0;           ///< bounds
  double upper = 0.0;
  double freedom = std::numeric_limits<double>::infinity();  ///< of the standard error
};

/// One parameter of one robot over its logs.
struct ParameterDrift {
  std::size_t robot = 0;
  std::size_t column = 0;
  bool dated = false;    ///< times are days; else the order of the logs
  std::size_t logs = 0;  ///< with bounds
  double first = 0.0;    ///< `when` of the first and last log
  double last = 0.0;
  double certain = 0.0;  ///< least change between the two logs whose intervals of bounds are furthest apart, with its
                         ///< sign; 0 where all intervals meet
  double certain_from = 0.0;  ///< `when` of these two, the earlier first
  double certain_to = 0.0;
  bool has_trend = false;    ///< at least two logs with estimates, at different times
  double slope = 0.0;        ///< per week where dated, else per log
  double slope_error = 0.0;  ///< standard error of the slope
  double lower = 0.0;        ///< 95 % interval of the slope
  double upper = 0.0;
  double chi_square = 0.0;                                       ///< Σ w (x − line)², w = 1/s²
  double freedom = 0.0;                                          ///< of chi_square: logs with estimates − 2
  double chi_mean = 0.0;                                         ///< Σ w (x − weighted mean)²
  double own_freedom = std::numeric_limits<double>::infinity();  ///< of slope_error, from those of the standard errors
  double p = 1.0;                                                ///< of a slope of 0, two-sided
  double adjusted_p = 1.0;                                       ///< Holm over robots and parameters

  /// True if the robot drifts: for certain, or by a trend that is unlikely to be chance.
  [[nodiscard]] bool drifts(double level) const { return certain != 0.0 || (has_trend && adjusted_p <= level); }
};

/// The line through `points` (ascending times) by weighted least squares with weights 1/s², and the certain change.
/// Points without a usable estimate take part in the latter only. slope_error is that of the weights alone: √(1/Σ w (t
/// − t̄)²); p and the interval are not filled in. Nothing for fewer than two points.
[[nodiscard]] std::optional<ParameterDrift> drift_through(std::span<const DriftPoint> points, bool dated);

/// drift_through() of every parameter of `record` that two of its logs bound, with the columns of `table` (new ones are
/// made where a check alone has one) and the number of the robot in it.
[[nodiscard]] std::vector<ParameterDrift> drift_of(const RobotRecord& record, std::size_t robot, FleetTable& table);

/// Fills in p, adjusted_p and interval, the fleet taken together, and sorts: certain changes first, then small adjusted
/// p.
///
/// A log's own standard error does not know of floor, payload and temperature, which differ from log to log. How much
/// they add is learnt from the whole fleet: φ of each parameter, at least 1, multiplies the squared slope errors
/// (`birge1932`). It is the median over its robots of χ² over the median of its law: where robots have three logs or
/// more, χ² is chi_square; where all have two and there are at least 10, it is chi_mean, so that a change which most
/// robots share counts as the difference between logs and not as drift. Fewer robots with two logs teach nothing: φ =
/// 1, and trends rest on the standard errors alone.
///
/// The slope over its error is compared with Student's t of ν degrees of freedom, 1/ν = 1/own_freedom + 1/(0.37 Σ
/// freedom of the χ²), what a median is worth.
///
/// The certain change assumes nothing but the noise bounds of the two logs.
void judge_drift(std::vector<ParameterDrift>& drift);

/// True if some robot of `drift` has three logs, so that repeats are known apart from drift.
[[nodiscard]] bool repeats_known(std::span<const ParameterDrift> drift);

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
