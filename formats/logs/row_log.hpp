// SPDX-License-Identifier: Apache-2.0
/// \file
/// Cleaning of the rows of a log, for all formats: defects dropped and counted, segments split, heading and wheel
/// angles unwrapped; streams of samples with clocks of their own brought to the times of the first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {

/// Origin of the times of all files of a log, ns: set by the first that has a wall clock.
using TimeOrigin = std::shared_ptr<std::optional<std::int64_t>>;

/// The s from which times are counted that begin at `second`: those of `origin` where it is set and less than ten years
/// away, else `second`, which sets an origin that is not. `origin` may be null.
[[nodiscard]] std::int64_t common_origin(const TimeOrigin& origin, std::int64_t second);

/// Outcome of a row.
enum class RowOutcome {
  dropped,      ///< a defect; counted
  row,          ///< continues the segment
  new_segment,  ///< begins a segment
};

/// A wheel angle that may be wrapped, made continuous. It counts as wrapped from the first jump on that nothing else
/// explains: by more than half a turn, while all values so far lie within one turn, and with the turn taken away within
/// a quarter of a turn of where the last step leads. From then on every step is the one that is closest to the
/// last, per second, or the shortest where none of them is within a quarter of a turn of it. The same for the range of
/// a counter, some turns or 2^16 or 2^32 counts of which a whole number make a turn, from its second jump on. Of
/// rows that were sent together only the first leads anywhere: a tenth of the time of the step before is too little.
class WheelAngle {
 public:
  /// `angle` (rad) at `time` (s), later than the last one, with the turns that were undone. `predict` is false where so
  /// much time has passed that the last step says nothing of this one.
  double follow(double time, double angle, bool predict = true);
  /// The same where what came before says nothing: no turns are added.
  double begin(double time, double angle);
  /// Whether a turn was undone by the last call of follow().
  [[nodiscard]] bool jumped() const { return jumped_; }
  /// Whether the last call of follow() took a step that no wheel turns: more than half a turn, and 100 rad/s for each
  /// second, away from where the one before leads. The angle was set back, or is wrapped at something else than a turn.
  [[nodiscard]] bool broken() const { return broken_; }
  /// What the last call returned.
  [[nodiscard]] double value() const;
  /// Time of the last value, s; NaN before the first.
  [[nodiscard]] double time() const { return time_; }

 private:
  void keep(double time, double angle);
  void learn_range(double step, double expected);

  double time_ = std::numeric_limits<double>::quiet_NaN();
  double before_ = 0.0;                                     // as logged
  double turns_ = 0.0;                                      // to add
  double turn_ = 2.0 * std::numbers::pi;                    // rad, by which it wraps
  double jump_ = 0.0;                                       // rad, the last one that no wheel turns
  double count_ = std::numeric_limits<double>::infinity();  // rad, the smallest step
  double least_ = std::numeric_limits<double>::infinity(), most_ = -least_;
  double rate_ = std::numeric_limits<double>::quiet_NaN();  // of the last step, rad/s
  double span_ = 0.0;                                       // of it, s
  bool wrapped_ = false, jumped_ = false, broken_ = false;
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

  /// Decides by its time what a row is whose values are finite and within limits(), and unwraps its angles in place:
  /// the heading wherever it jumps by more than π, a wheel angle (phi_r, phi_l) as WheelAngle does. One that is broken
  /// begins a segment.
  RowOutcome place(std::span<double> row, std::size_t number);

  /// The same for any row: one that has a value which is not finite is dropped. Throws InputError, naming the column,
  /// for a value beyond its limit.
  RowOutcome clean(std::span<double> row, std::size_t number);

  /// Time of the last row that was not dropped, s.
  [[nodiscard]] double t() const { return t_; }

  /// Counts a row that is lost (or a segment that begins: LogReport::resets, gaps, jumps) for the reason `what`.
  void count(Occurrences LogReport::*what, std::size_t number, std::string_view detail = {});

  /// Place of row `number`, for messages.
  [[nodiscard]] std::string at(std::size_t number) const;

  /// What is expected of column `index` (0: time), for messages.
  [[nodiscard]] std::string expectation(std::size_t index) const;

 private:
  void unwrap(double& theta, bool new_segment, std::size_t number);

  std::vector<std::string> names_;  ///< time, then the columns
  std::vector<double> limits_;
  LogReport* report_;
  double longest_step_ = std::numeric_limits<double>::infinity();
  std::string place_;
  double t_ = 0.0;
  bool fresh_ = true;                                       ///< the next row begins a segment whatever its time
  std::size_t theta_ = 0;                                   ///< index of the heading, 0 where there is none
  double theta_before_ = 0.0;                               ///< as logged
  double turns_ = 0.0;                                      ///< whole turns to add
  std::vector<std::pair<std::size_t, WheelAngle>> wheels_;  ///< by index
};

/// One walk through the rows of one file.
class RowWalk {
 public:
  virtual ~RowWalk() = default;
  /// Reads the next row and says in `outcome` what became of it; false at the end. Throws InputError for what cannot be
  /// read.
  virtual bool next(RowOutcome& outcome) = 0;
  /// Time of the last row that was not dropped, s.
  [[nodiscard]] virtual double t() const = 0;
  /// Values of the last row, in the order of the log's columns, where it was not dropped.
  [[nodiscard]] virtual const double* values() const = 0;
  /// After the end: fills in how the file is packed, its size and hash, what was lost.
  virtual void describe(LogFileReport& file) const = 0;
};

/// One file of a log.
class RowFile {
 public:
  virtual ~RowFile() = default;
  /// As the user gave it.
  [[nodiscard]] virtual std::string path() const = 0;
  /// The columns that it has, time apart.
  [[nodiscard]] virtual const std::vector<std::string>& columns() const = 0;
  /// Begins to read `names` (some of columns()), which outlive the walk. Steps longer than `longest_step` s are gaps;
  /// `report`, where it is not null, gets the counts, and then the file's hash is wanted.
  [[nodiscard]] virtual std::unique_ptr<RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                                      LogReport* report) = 0;
};

/// Options of RowLog.
struct RowLogOptions {
  std::size_t block_rows = 4096;  ///< rows of a block, at least 1
  std::size_t min_rows = 20;      ///< usable rows that a log must have
  /// Rows are kept in memory where they need no more than this; those of a longer log are read anew by every walk.
  std::size_t kept_bytes = std::size_t{1} << 28;
  double heading_offset = 0.0;  ///< rad, added to `theta`
  /// Whether rows are handed on in which a speed, rate or angle leaps by more than core::least_leap() of the first
  /// 100 001 rows; else they are left out and counted.
  bool leaps = true;
};

/// A log over files, each of which begins a new segment. Memory does not grow with them beyond
/// `RowLogOptions::kept_bytes`.
class RowLog : public RecordedLog {
 public:
  /// Reads all of `files` once: the median step, the hashes, and everything that report() says. columns() are those
  /// that all files have, in the order of the first. Throws InputError as the files do, for time that never increases,
  /// and for fewer than `min_rows` usable rows; InvalidArgument when there are no files or `block_rows` is 0.
  RowLog(std::vector<std::unique_ptr<RowFile>> files, RowLogOptions options);

  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  bool next(LogBlock& block) override;
  void rewind() override;
  [[nodiscard]] double median_step() const override { return report_.median_step; }
  [[nodiscard]] const LogReport& report() const override { return report_; }
  /// Null for a log whose rows are not kept. Outlives this one.
  [[nodiscard]] std::unique_ptr<LogSource> another_walk() const override;

 private:
  [[nodiscard]] std::unique_ptr<RowWalk> open(std::size_t file, LogReport* report);
  void look_ahead();
  void survey();
  void keep(const RowWalk& walk, bool starts);
  [[nodiscard]] double value(const RowWalk& walk, std::size_t column) const;
  void judge() const;
  [[nodiscard]] double longest_step() const;

  std::vector<std::unique_ptr<RowFile>> files_;
  std::vector<std::string> names_;
  std::size_t theta_ = 0;  ///< index of the heading, the number of names where there is none
  RowLogOptions options_;
  std::vector<double> least_leaps_;  ///< by column; empty where no row is left out
  double usual_step_ = 0.0;          ///< s, of which a gap is many: the median, or of bursts the mean over many rows
  LogReport report_;
  std::size_t file_ = 0;
  std::unique_ptr<RowWalk> walk_;
  std::size_t first_row_ = 0;
  std::shared_ptr<std::vector<LogBlock>> kept_;  ///< all rows, or null
  std::unique_ptr<LogSource> kept_walk_;
};

/// Median of `steps` (reordered by it); 0 where there are none.
[[nodiscard]] double middle_of(std::vector<double>& steps);

/// A step of more than this times the median step is a gap.
inline constexpr double gap_factor = 5.0;

/// Times in ns that samples have are below this, either way: 146 years. So differences of two are numbers, too.
inline constexpr std::int64_t farthest_time = std::int64_t{1} << 62;

/// The longest gap of a stream whose median step is `median_step`, both in ns.
[[nodiscard]] std::int64_t longest_gap_of(std::int64_t median_step);

/// One stream: which columns of a row it gives.
struct AlignedStream {
  std::vector<std::size_t> columns;  ///< of the row, one for each value of a sample
  std::vector<bool> angle;           ///< whether that value is an angle in turns of 2π, to be unwrapped (rad)
  std::int64_t longest_gap = 0;      ///< ns; between samples further apart nothing is interpolated
  std::int64_t time_error = 0;       ///< ns; by which times of samples may be wrong
};

/// Rows at the times of stream 0; values of the others are interpolated linearly between their neighbouring samples.
///
/// Between samples h apart, linear interpolation at the share a of the way is off by at most a (1 − a) h²/2 max|x''|.
/// error() is the largest such bound over all rows, with |x''| from the second divided differences at both ends of the
/// step, times 9/8, plus the slope times `time_error`. For a sine of period P the bend in the middle of a step exceeds
/// what the differences at its ends show by 2/((1 + cos u) cos u), u = πh/P, which is 1.125 at eight samples a period:
/// the bound holds for signals as slow as that, or slower. Noise of the samples is in it (it makes the bound wider, by
/// at most 9/16 of the noise's own bound).
class StreamAligner {
 public:
  /// `width` is the number of columns of a row. A row is handed out when every other stream has come past its time, has
  /// ended, or lies more than `patience` ns behind. Throws InvalidArgument where there is no stream or columns overlap.
  StreamAligner(std::size_t width, std::vector<AlignedStream> streams, std::int64_t patience = 2'000'000'000);

  /// A sample of `stream` at `time` (ns). Of other streams than the first, samples that are not later than the one
  /// before are left out (stale()). Throws InvalidArgument for another number of values, and unless |time| is below
  /// farthest_time.
  void push(std::size_t stream, std::int64_t time, std::span<const double> values);

  /// No more samples come.
  void finish();

  /// The next row in the order of stream 0: `time` in ns, `row` its columns; those of a stream that has no samples
  /// around this time are NaN. False when no row is ready.
  bool pop(std::int64_t& time, std::span<double> row);

  /// Largest interpolation error so far of each column, in its unit.
  [[nodiscard]] const std::vector<double>& error() const { return error_; }
  /// Samples left out of `stream`.
  [[nodiscard]] std::size_t stale(std::size_t stream) const { return streams_[stream].stale; }

 private:
  struct Sample {
    std::int64_t time = 0;
    std::vector<double> values;
  };
  struct Stream {
    AlignedStream layout;
    std::deque<Sample> samples;
    std::vector<Sample> spare;
    std::size_t stale = 0;
  };

  [[nodiscard]] bool ready(std::int64_t time) const;
  void interpolate(Stream& stream, std::int64_t time, std::span<double> row);

  std::vector<Stream> streams_;
  std::int64_t patience_;
  std::int64_t newest_;
  bool finished_ = false;
  std::vector<double> error_;
};

}  // namespace wheelwright::logs
