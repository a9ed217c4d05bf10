// SPDX-License-Identifier: Apache-2.0
/// \file
/// The clock of a sensor that samples evenly while its stamps scatter: the times of its samples, recovered row by row.
#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"

namespace wheelwright::core {

/// Times of samples by an EvenClock, from stamps as they come, on line as from a file.
///
/// The phase is the running mean of the stamps. A stamp within 0.3 steps of the place next to the last one belongs
/// there. Where it does not, rows are kept until later ones tell: n rows on n free places have come late (they queued);
/// two rows beside each other, both near their places, tell that rows were lost before them. Rows of which that leaves
/// open on which places they are begin a segment, as does the row after them. Where 32 rows tell nothing (8 at the
/// beginning of a segment), each of them begins a segment, and the clock begins anew.
class EvenTimes {
 public:
  /// Throws InvalidArgument unless the step is > 0 and the drift inside [0, 0.1).
  explicit EvenTimes(const EvenClock& clock);

  /// Time of a row.
  struct Place {
    double t = 0.0;       ///< s; increases from row to row of a segment
    bool starts = false;  ///< a segment starts here
    double off = 0.0;     ///< the stamp's distance from its place, of a step; 0 for the first row of a segment
  };

  /// Takes the stamp of the next row; `starts` where the log begins a segment.
  void take(double stamp, bool starts);
  /// No row comes after: those that are kept begin segments.
  void finish();
  /// The oldest row whose place is known, each once.
  std::optional<Place> next();
  /// Forgets all rows.
  void restart();

 private:
  [[nodiscard]] double place_of(double stamp) const { return (stamp - anchor_) / clock_.step - phase_; }
  void begin(double stamp);
  void settle();
  void put(double stamp, double index, bool starts);
  void give_up();

  EvenClock clock_;
  double anchor_ = 0.0;  // s, of place 0
  double phase_ = 0.0;   // steps: mean distance of the stamps from their places
  double index_ = 0.0;   // of the last row
  double last_ = 0.0;    // s, the last time that was given
  std::size_t seen_ = 0;
  std::vector<double> kept_;  // stamps whose places are not known yet
  std::deque<Place> places_;
};

/// A log whose rows are timed by an EvenClock.
class EvenSource final : public LogSource {
 public:
  /// Throws as EvenTimes; InvalidArgument for no `log`.
  EvenSource(std::shared_ptr<LogSource> log, const EvenClock& clock);
  [[nodiscard]] const std::vector<std::string>& columns() const override { return log_->columns(); }
  bool next(LogBlock& block) override;
  void rewind() override;
  [[nodiscard]] double median_step() const override { return clock_.step; }
  [[nodiscard]] std::unique_ptr<LogSource> another_walk() const override;

 private:
  std::shared_ptr<LogSource> log_;
  EvenClock clock_;
  EvenTimes times_;
  LogBlock read_;                         // the last block of `log_`
  std::deque<std::vector<double>> rows_;  // whose times are not known yet
  std::size_t first_row_ = 0;
  bool ended_ = false;
};

/// The mean step of times `t` whatever bursts they come in, s: the median over stretches of 30 rows; 0 for fewer than
/// 200.
[[nodiscard]] double step_of_bursts(const std::vector<double>& t);

/// `table` with its times by `clock`. Throws as EvenTimes.
[[nodiscard]] LogTable read_evenly(const LogTable& table, const EvenClock& clock);

}  // namespace wheelwright::core
