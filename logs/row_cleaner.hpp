// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rows of numbers → clean rows of a log, whatever the format: defects dropped and counted, segments split, heading and
/// wheel angles unwrapped.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/csv_report.hpp>

namespace wheelwright {

/// What became of a row.
enum class RowOutcome {
  dropped,      ///< a defect; counted
  row,          ///< continues the segment
  new_segment,  ///< begins a segment
};

/// The cleaning of a log, row by row. A row is its time and the values of `names`.
class RowCleaner {
 public:
  /// `names` are the columns, time apart. What is met is counted in `report` where that is not null.
  RowCleaner(const std::vector<std::string>& names, LogReport* report);

  /// Begins a file, and with it a segment. `place` and the number of a row are how messages name it ("log.csv:").
  void begin_file(std::string place);

  /// Steps longer than `seconds` are gaps.
  void set_longest_step(double seconds) { longest_step_ = seconds; }

  /// |value| above this cannot be meant, for time and each column.
  [[nodiscard]] const std::vector<double>& limits() const { return limits_; }

  /// Decides by its time what a row is whose values are finite and within limits(), and unwraps its angles in place: the
  /// heading wherever it jumps by more than π, a wheel angle (phi_r, phi_l) where it jumps by nearly a turn and cannot but
  /// be wrapped: all its values so far lie within one turn, and every other step (three at least), and this one with the
  /// turn taken away, is below π/2.
  RowOutcome place(std::span<double> row, std::size_t number);

  /// The same for any row: one that has a value which is not finite is dropped. Throws InputError, naming the column,
  /// for a value beyond its limit.
  RowOutcome clean(std::span<double> row, std::size_t number);

  /// Time of the last row that was not dropped, s.
  [[nodiscard]] double t() const { return t_; }

  /// Counts a row that is lost (or a segment that begins: LogReport::resets, gaps) for the reason `what`.
  void count(Occurrences LogReport::*what, std::size_t number, std::string_view detail = {});

  /// Place of row `number`, for messages.
  [[nodiscard]] std::string at(std::size_t number) const;

  /// What is expected of column `index` (0: time), for messages.
  [[nodiscard]] std::string expectation(std::size_t index) const;

 private:
  // A wheel angle, which may be wrapped or not.
  struct WheelAngle {
    std::size_t index = 0;
    double before = 0.0;  // as logged
    double turns = 0.0;   // to add
    double least = std::numeric_limits<double>::infinity(), most = -least;
    double largest_step = 0.0;  // that is not a wrap
    std::size_t steps = 0;      // that are none
  };

  void unwrap(double& theta, bool new_segment, std::size_t number);
  void unwrap(WheelAngle& wheel, double& angle, bool new_segment, std::size_t number);

  std::vector<std::string> names_;  ///< time, then the columns
  std::vector<double> limits_;
  LogReport* report_;
  double longest_step_ = std::numeric_limits<double>::infinity();
  std::string place_;
  double t_ = 0.0;
  bool fresh_ = true;          ///< the next row begins a segment whatever its time
  std::size_t theta_ = 0;      ///< index of the heading, 0 where there is none
  double theta_before_ = 0.0;  ///< as logged
  double turns_ = 0.0;         ///< whole turns to add
  std::vector<WheelAngle> wheels_;
};

}  // namespace wheelwright
