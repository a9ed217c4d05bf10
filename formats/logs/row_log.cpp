// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/row_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/error.hpp"
#include "core/even_clock.hpp"
#include "core/leaps.hpp"
#include "core/limits.hpp"
#include "core/statistics.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {

namespace {

constexpr double turn = 2.0 * std::numbers::pi;

}  // namespace

std::int64_t common_origin(const TimeOrigin& origin, std::int64_t second) {
  constexpr std::int64_t ns = 1'000'000'000, ten_years = 315'576'000;
  if (!origin) {
    return second;
  }
  if (!origin->has_value()) {
    *origin = second * ns;
  }
  const std::int64_t other = origin->value() / ns;
  return std::abs(other - second) < ten_years ? other : second;
}

double WheelAngle::follow(double time, double angle, bool predict) {
  constexpr double slack = 1e-3;
  constexpr double most_change = 100.0;  // rad/s
  constexpr double longest_lead = 10.0;  // times the last step
  const double step = angle - before_, seconds = time - time_;
  keep(time, angle);
  const bool known = predict && std::isfinite(rate_) && seconds <= longest_lead * span_;
  const double expected = known ? rate_ * seconds : 0.0;
  double turns = -std::round(step / turn_);
  if (!wrapped_) {
    const bool jump = known && turns != 0.0 && most_ - least_ <= turn + slack &&
                      std::abs(step + turns * turn_ - expected) < 0.25 * turn_;
    wrapped_ = jump;
    turns = jump ? turns : 0.0;
  } else if (known) {
    const double nearest = std::round((expected - step) / turn_);
    turns = std::abs(step + nearest * turn_ - expected) < 0.25 * turn_ ? nearest : turns;
  }
  jumped_ = turns != 0.0;
  broken_ = known && std::abs(step + turns * turn_ - expected) > std::max(0.5 * turn, most_change * seconds);
  if (broken_ && !wrapped_) {
    learn_range(step, expected);
    turns = wrapped_ ? std::round((expected - step) / turn_) : 0.0;
    jumped_ = wrapped_;
    broken_ = !wrapped_;
  }
  const double moved = std::abs(step + turns * turn_);
  count_ = moved > 1e-9 && !broken_ ? std::min(count_, moved) : count_;
  turns_ += turns;
  if (broken_) {  // where it leads is not known
    rate_ = std::numeric_limits<double>::quiet_NaN();
    span_ = 0.0;
  } else if (longest_lead * seconds >= span_) {
    rate_ = (step + turns * turn_) / seconds;
    span_ = seconds;
  }
  return value();
}

// A second jump of one size, of an angle that never leaves a range as wide.
void WheelAngle::learn_range(double step, double expected) {
  constexpr double slack = 1e-3, exact = 0.05;
  const double jump = std::abs(expected - step), about = 0.5 * std::abs(expected) + slack;
  const bool again = std::abs(jump - jump_) < about && most_ - least_ <= jump + 2.0 * about;
  jump_ = jump;
  if (!again) {
    return;
  }
  const double counts = turn / count_, whole = std::round(counts), turns = std::round(jump / turn);
  for (const double range : {0x1p16, 0x1p32}) {
    if (whole >= 1.0 && std::abs(counts - whole) < exact && std::abs(jump - range * count_) < about) {
      turn_ = range * turn / whole;
      wrapped_ = true;
      return;
    }
  }
  if (turns >= 1.0 && about < 0.1 * turn && std::abs(jump - turns * turn) < about) {
    turn_ = turns * turn;
    wrapped_ = true;
  }
}

double WheelAngle::value() const { return before_ + turns_ * turn_; }

double WheelAngle::begin(double time, double angle) {
  keep(time, angle);
  rate_ = std::numeric_limits<double>::quiet_NaN();
  span_ = 0.0;
  turns_ = 0.0;
  jumped_ = broken_ = false;
  return angle;
}

void WheelAngle::keep(double time, double angle) {
  least_ = std::min(least_, angle);
  most_ = std::max(most_, angle);
  before_ = angle;
  time_ = time;
}

RowCleaner::RowCleaner(const std::vector<std::string>& names, LogReport* report) : names_{"t"}, report_(report) {
  names_.insert(names_.end(), names.begin(), names.end());
  for (const std::string& name : names_) {
    const LogColumn* column = find_log_column(name);
    limits_.push_back(column != nullptr ? column->limit : std::numeric_limits<double>::max());
    if (name == "theta") {
      theta_ = limits_.size() - 1;
    } else if (name == "phi_r" || name == "phi_l") {
      wheels_.emplace_back(limits_.size() - 1, WheelAngle());
    }
  }
}

void RowCleaner::begin_file(std::string place) {
  place_ = std::move(place);
  fresh_ = true;
  for (auto& [index, wheel] : wheels_) {
    wheel = {};
  }
}

RowOutcome RowCleaner::place(std::span<double> row, std::size_t number) {
  const double t = row[0];
  bool starts = fresh_;
  if (!fresh_) {
    const double step = t - t_;
    if (step == 0.0) {
      count(&LogReport::duplicates, number);
      return RowOutcome::dropped;
    }
    if (step < 0.0) {
      count(&LogReport::resets, number);
      starts = true;
    } else if (step > longest_step_) {
      count(&LogReport::gaps, number);
      starts = true;
    }
  }
  for (auto wheel = wheels_.begin(); !starts && wheel != wheels_.end(); ++wheel) {
    wheel->second.follow(t, row[wheel->first]);
    if (wheel->second.broken()) {
      count(&LogReport::jumps, number, names_[wheel->first]);
      starts = true;
    }
  }
  t_ = t;
  fresh_ = false;
  if (report_ != nullptr) {
    ++report_->rows_read;
    ++report_->rows;
  }
  if (theta_ != 0) {
    unwrap(row[theta_], starts, number);
  }
  for (auto& [index, wheel] : wheels_) {
    row[index] = starts ? wheel.begin(t, row[index]) : wheel.value();
    if (wheel.jumped() && report_ != nullptr && report_->angle_wraps.count++ == 0) {
      report_->angle_wraps.first = at(number) + ", column " + names_[index];
    }
  }
  return starts ? RowOutcome::new_segment : RowOutcome::row;
}

RowOutcome RowCleaner::clean(std::span<double> row, std::size_t number) {
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!std::isfinite(row[k])) {
      count(&LogReport::not_finite, number, names_[k]);
      return RowOutcome::dropped;
    }
  }
  for (std::size_t k = 0; k < row.size(); ++k) {
    if (!(std::abs(row[k]) <= limits_[k])) {
      throw InputError(fmt::format("{}: column {}: '{}': {}", at(number), names_[k], row[k], expectation(k)));
    }
  }
  return place(row, number);
}

void RowCleaner::unwrap(double& theta, bool new_segment, std::size_t number) {
  if (new_segment) {
    turns_ = 0.0;
  } else if (std::abs(theta - theta_before_) > std::numbers::pi) {
    turns_ -= std::round((theta - theta_before_) / turn);
    if (report_ != nullptr && report_->wraps.count++ == 0) {
      report_->wraps.first = at(number);
    }
  }
  theta_before_ = theta;
  theta += turns_ * turn;
}

void RowCleaner::count(Occurrences LogReport::*what, std::size_t number, std::string_view detail) {
  if (report_ == nullptr) {
    return;
  }
  Occurrences& met = report_->*what;
  if (met.count++ == 0) {
    met.first = at(number) + (detail.empty() ? "" : fmt::format(", column {}", detail));
  }
  const bool row_lost = what != &LogReport::resets && what != &LogReport::gaps && what != &LogReport::jumps;
  report_->rows_read += row_lost ? 1 : 0;
}

std::string RowCleaner::at(std::size_t number) const { return fmt::format("{}{}", place_, number); }

std::string RowCleaner::expectation(std::size_t index) const {
  const LogColumn* column = find_log_column(names_[index]);
  return column == nullptr ? "expected a finite number"
                           : fmt::format("expected {} in {}, of magnitude at most {:g}", column->meaning, column->unit,
                                         column->limit);
}

namespace {

constexpr std::size_t steps_ahead = 100001;
constexpr double burst_factor = 3.0;  // median steps that the mean step of bursts is more than

/// The rows of a log that are in memory.
class KeptRows final : public LogSource {
 public:
  KeptRows(std::shared_ptr<const std::vector<LogBlock>> blocks, std::vector<std::string> names, double median_step)
      : blocks_(std::move(blocks)), names_(std::move(names)), median_step_(median_step) {}

  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  bool next(LogBlock& block) override {
    if (position_ == blocks_->size()) {
      block.t.clear();
      block.segment_starts.clear();
      for (std::vector<double>& column : block.columns) {
        column.clear();
      }
      return false;
    }
    block = (*blocks_)[position_++];
    return true;
  }
  void rewind() override { position_ = 0; }
  [[nodiscard]] double median_step() const override { return median_step_; }
  [[nodiscard]] std::unique_ptr<LogSource> another_walk() const override {
    return std::make_unique<KeptRows>(blocks_, names_, median_step_);
  }

 private:
  std::shared_ptr<const std::vector<LogBlock>> blocks_;
  std::vector<std::string> names_;
  double median_step_;
  std::size_t position_ = 0;
};

constexpr double longest_kick =
    0.1 + 1e-6;  ///< s around rows in which an effort leaps, which may be true if it is longer

bool is_effort(std::string_view name) {
  return name == "effort" || std::ranges::any_of(std::array<std::string_view, 3>{"tau_", "current_", "voltage_"},
                                                 [&](std::string_view stem) { return name.starts_with(stem); });
}

bool is_angle(std::string_view name) { return name == "phi_r" || name == "phi_l" || name == "position"; }

/// The share for core::least_leap() of a column that no drive makes leap.
std::optional<double> leap_share(std::string_view name) {
  return name == "omega_r" || name == "omega_l" || name == "velocity" ? std::optional(core::kSpeedLeap)
         : is_angle(name)                                             ? std::optional(core::kAngleLeap)
         : name == "gyro_z"                                           ? std::optional(core::kRateLeap)
         : is_effort(name)                                            ? std::optional(core::kEffortLeap)
                                                                      : std::nullopt;
}

/// A walk without the rows of another in which a column leaps by more than its own of `least`.
class WithoutLeaps final : public RowWalk {
 public:
  WithoutLeaps(std::unique_ptr<RowWalk> walk, std::string path, const std::vector<std::string>& names,
               const std::vector<double>& least, double longest_step, LogReport* report)
      : walk_(std::move(walk)),
        path_(std::move(path)),
        names_(names),
        least_(least),
        longest_step_(longest_step),
        report_(report) {
    for (Row& row : rows_) {
      row.values.resize(names.size());
    }
  }

  bool next(RowOutcome& outcome) override {
    std::rotate(rows_.begin(), rows_.begin() + 1, rows_.end());
    count_ -= std::min<std::size_t>(count_, 1);
    do {
      fill();
    } while (leave_out());
    outcome = rows_[0].starts ? RowOutcome::new_segment : RowOutcome::row;
    return count_ > 0;
  }
  [[nodiscard]] double t() const override { return rows_[0].t; }
  [[nodiscard]] const double* values() const override { return rows_[0].values.data(); }
  void describe(LogFileReport& file) const override { walk_->describe(file); }

 private:
  struct Row {
    double t = 0.0;
    bool starts = false;
    bool jumped = false;  ///< starts, and not for its time: a wheel angle jumps
    std::vector<double> values;
  };

  void fill() {
    RowOutcome outcome{};
    while (!ended_ && count_ < rows_.size()) {
      ended_ = !walk_->next(outcome);
      if (!ended_ && outcome != RowOutcome::dropped) {
        Row& row = rows_[count_++];
        row.t = walk_->t();
        row.starts = outcome == RowOutcome::new_segment;
        const double step = count_ > 1 ? row.t - rows_[count_ - 2].t : 0.0;
        row.jumped = row.starts && step > 0.0 && step <= longest_step_;
        std::copy_n(walk_->values(), row.values.size(), row.values.begin());
      }
    }
  }

  /// Rows behind the first that leap in column `c`; 0 where none do.
  [[nodiscard]] std::size_t leap_of(std::size_t c) const {
    const bool angle = is_angle(names_[c]);
    std::size_t same = std::min<std::size_t>(count_, 1);  // rows of the segment of the first, but for jumps of angles
    while (same < count_ && (!rows_[same].starts || (angle && rows_[same].jumped))) {
      ++same;
    }
    std::array<double, core::kLongestLeap + 2> window{};
    for (std::size_t k = 0; k < same; ++k) {
      window[k] = rows_[k].values[c];
    }
    const std::size_t leap = core::leap_behind(std::span(window).first(same), least_[c]);
    if (leap == 0 || (is_effort(names_[c]) && rows_[leap + 1].t - rows_[0].t > longest_kick)) {
      return 0;
    }
    for (std::size_t k = 1; k <= leap + 1; ++k) {
      if (rows_[k].jumped) {
        return goes_on(leap + 1) ? leap : 0;
      }
    }
    return leap;
  }

  /// Whether all angles of row `k` go on from those of the first row.
  [[nodiscard]] bool goes_on(std::size_t k) const {
    for (std::size_t c = 0; c < names_.size(); ++c) {
      const double step = std::abs(rows_[k].values[c] - rows_[0].values[c]);
      if ((is_angle(names_[c]) && !(step < least_[c])) || (names_[c] == "theta" && !(step < std::numbers::pi))) {
        return false;
      }
    }
    return true;
  }

  /// Takes away the rows behind the first that leap; false where none do.
  bool leave_out() {
    for (std::size_t c = 0; c < names_.size(); ++c) {
      const std::size_t leap = std::isfinite(least_[c]) ? leap_of(c) : 0;
      if (leap > 0) {
        note(&LogReport::leaps, leap, c);
        // The way back of a single row is seen as the rate of the next, which the row behind contradicts.
        const bool echo = leap + 2 < count_ && rows_[leap + 2].jumped && goes_on(leap + 2);
        for (std::size_t k = 1; k <= leap + (echo ? 2 : 1); ++k) {
          if (rows_[k].jumped && report_ != nullptr) {
            report_->jumps.first = --report_->jumps.count > 0 ? report_->jumps.first : std::string();
          }
          rows_[k].starts = rows_[k].starts && !rows_[k].jumped;
          rows_[k].jumped = false;
        }
        if (report_ != nullptr) {
          report_->rows -= leap;
        }
        const auto first = rows_.begin() + 1, after = first + static_cast<std::ptrdiff_t>(leap);
        std::rotate(first, after, rows_.end());
        count_ -= leap;
        if (rows_[1].t - rows_[0].t > longest_step_) {
          rows_[1].starts = true;
          note(&LogReport::gaps, 1, c);
        }
        return true;
      }
    }
    return false;
  }

  void note(Occurrences LogReport::*what, std::size_t times, std::size_t column) {
    if (report_ != nullptr) {
      Occurrences& met = report_->*what;
      met.first =
          met.count > 0 ? met.first : fmt::format("{}, t = {:.6g} s, column {}", path_, rows_[1].t, names_[column]);
      met.count += times;
    }
  }

  std::unique_ptr<RowWalk> walk_;
  std::string path_;
  const std::vector<std::string>& names_;
  const std::vector<double>& least_;
  double longest_step_;
  LogReport* report_;
  std::array<Row, core::kLongestLeap + 2> rows_;  ///< the current one and those behind it
  std::size_t count_ = 0;                         ///< of them
  bool ended_ = false;
};

}  // namespace

double middle_of(std::vector<double>& steps) {
  if (steps.empty()) {
    return 0.0;
  }
  return core::median(std::move(steps));
}

RowLog::RowLog(std::vector<std::unique_ptr<RowFile>> files, RowLogOptions options)
    : files_(std::move(files)), options_(options) {
  check::that(!files_.empty(), "files", "at least one");
  check::that(options_.block_rows > 0, "block_rows", "at least 1");
  for (const std::string& name : files_.front()->columns()) {
    if (std::ranges::all_of(files_, [&](const auto& file) {
          return std::ranges::find(file->columns(), name) != file->columns().end();
        })) {
      names_.push_back(name);
    }
  }
  theta_ = static_cast<std::size_t>(std::ranges::find(names_, "theta") - names_.begin());
  look_ahead();
  kept_ = std::make_shared<std::vector<LogBlock>>();
  survey();
  judge();
  kept_walk_ = another_walk();
}

std::unique_ptr<RowWalk> RowLog::open(std::size_t file, LogReport* report) {
  auto walk = files_[file]->open(names_, longest_step(), report);
  if (least_leaps_.empty()) {
    return walk;
  }
  return std::make_unique<WithoutLeaps>(std::move(walk), files_[file]->path(), names_, least_leaps_, longest_step(),
                                        report);
}

/// Median of the steps > 0 and the smallest leaps of the first rows, from a reading that counts nothing.
void RowLog::look_ahead() {
  std::vector<double> times, steps;
  std::vector<core::RowRange> segments;
  std::vector<std::vector<double>> values(options_.leaps ? 0 : names_.size());
  std::size_t rows = 0;
  for (std::size_t k = 0; k < files_.size() && steps.size() < steps_ahead; ++k) {
    const auto walk = open(k, nullptr);
    RowOutcome outcome{};
    double before = 0.0;
    while (steps.size() < steps_ahead && walk->next(outcome)) {
      if (outcome == RowOutcome::dropped) {
        continue;
      }
      if (outcome == RowOutcome::row) {
        steps.push_back(walk->t() - before);
      } else {
        segments.emplace_back(rows, rows);
      }
      times.push_back(before = walk->t());
      segments.back().second = ++rows;
      for (std::size_t c = 0; c < values.size(); ++c) {
        values[c].push_back(walk->values()[c]);
      }
    }
  }
  report_.median_step = usual_step_ = middle_of(steps);
  if (const double mean = core::step_of_bursts(times); mean > burst_factor * usual_step_) {
    usual_step_ = mean;
  }
  std::vector<double> least;
  for (std::size_t c = 0; c < values.size(); ++c) {
    const auto share = leap_share(names_[c]);
    least.push_back(share ? core::least_leap(values[c], segments, *share) : std::numeric_limits<double>::infinity());
  }
  least_leaps_ = std::move(least);
}

void RowLog::survey() {
  for (std::size_t k = 0; k < files_.size(); ++k) {
    const std::size_t rows_before = report_.rows;
    report_.files.emplace_back();
    const auto walk = open(k, &report_);
    LogFileReport& file = report_.files.back();
    RowOutcome outcome{};
    double start = 0.0, last = 0.0;
    while (walk->next(outcome)) {
      if (outcome == RowOutcome::new_segment) {
        ++file.segments;
        file.seconds += last - start;
        start = walk->t();
      }
      if (outcome != RowOutcome::dropped) {
        last = walk->t();
        keep(*walk, outcome == RowOutcome::new_segment);
      }
    }
    file.path = files_[k]->path();
    walk->describe(file);
    file.rows = report_.rows - rows_before;
    file.seconds += last - start;
    report_.segments += file.segments;
    report_.seconds += file.seconds;
  }
}

double RowLog::value(const RowWalk& walk, std::size_t column) const {
  return walk.values()[column] + (column == theta_ ? options_.heading_offset : 0.0);
}

void RowLog::keep(const RowWalk& walk, bool starts) {
  if (!kept_) {
    return;
  }
  const std::size_t limit = options_.block_rows, width = names_.size();
  if (kept_->empty() || kept_->back().rows() == limit) {
    const std::size_t rows = kept_->size() * limit;
    if ((rows + limit) * (width + 1) > options_.kept_bytes / sizeof(double)) {
      kept_.reset();
      return;
    }
    kept_->emplace_back().first_row = rows;
    kept_->back().columns.resize(width);
  }
  LogBlock& block = kept_->back();
  if (starts) {
    block.segment_starts.push_back(block.rows());
  }
  block.t.push_back(walk.t());
  for (std::size_t c = 0; c < width; ++c) {
    block.columns[c].push_back(value(walk, c));
  }
}

void RowLog::judge() const {
  constexpr std::size_t fewest_duplicates = 20;
  constexpr std::size_t fewest_resets = 10;
  constexpr double most_resets = 0.1;  // of the rows
  const std::string in_order =
      "; where t is the first column of a table, (head -n 1 LOG; tail -n +2 LOG | sort -g) > sorted.csv sorts it";
  const std::string where = files_[0]->path() + (files_.size() > 1 ? " and the other files" : "");
  if (report_.duplicates.count > fewest_duplicates && 3 * report_.duplicates.count > 2 * report_.rows_read) {
    throw InputError(fmt::format(
        "{}: {} of {} rows have the time of the row before: expected times with more decimals, as fine as the rows "
        "follow each other (first at {})",
        where, report_.duplicates.count, report_.rows_read, report_.duplicates.first));
  }
  if (report_.rows < std::max<std::size_t>(options_.min_rows, 1)) {
    std::string message = fmt::format("{}: {} usable rows of {}: expected at least {}", where, report_.rows,
                                      report_.rows_read, options_.min_rows);
    for (const std::string& sentence : sentences(report_)) {
      message += "; " + sentence;
    }
    throw InputError(message);
  }
  if (report_.rows > 1 && !(report_.median_step > 0.0) && report_.resets.count > 0) {
    throw InputError(where + ": column t never increases: expected times in seconds, one row after the other" +
                     in_order);
  }
  if (report_.resets.count >= fewest_resets &&
      static_cast<double>(report_.resets.count) > most_resets * static_cast<double>(report_.rows)) {
    throw InputError(
        fmt::format("{}: time goes back in {} of {} rows (first at {}): expected rows in the order of their "
                    "times{}",
                    where, report_.resets.count, report_.rows, report_.resets.first, in_order));
  }
}

double RowLog::longest_step() const {
  return usual_step_ > 0.0 ? gap_factor * usual_step_ : std::numeric_limits<double>::infinity();
}

std::unique_ptr<LogSource> RowLog::another_walk() const {
  return kept_ ? std::make_unique<KeptRows>(kept_, names_, report_.median_step) : nullptr;
}

void RowLog::rewind() {
  if (kept_walk_) {
    kept_walk_->rewind();
    return;
  }
  file_ = 0;
  first_row_ = 0;
  walk_.reset();
}

bool RowLog::next(LogBlock& block) {
  if (kept_walk_) {
    return kept_walk_->next(block);
  }
  const std::size_t limit = options_.block_rows;
  const std::size_t width = names_.size();
  block.first_row = first_row_;
  block.segment_starts.clear();
  block.t.resize(limit);
  block.columns.resize(width);
  for (auto& column : block.columns) {
    column.resize(limit);
  }
  std::size_t count = 0;
  RowOutcome outcome{};
  while (count < limit && file_ < files_.size()) {
    if (!walk_) {
      walk_ = open(file_, nullptr);
    }
    if (!walk_->next(outcome)) {
      walk_.reset();
      ++file_;
      continue;
    }
    if (outcome == RowOutcome::dropped) {
      continue;
    }
    if (outcome == RowOutcome::new_segment) {
      block.segment_starts.push_back(count);
    }
    block.t[count] = walk_->t();
    for (std::size_t c = 0; c < width; ++c) {
      block.columns[c][count] = value(*walk_, c);
    }
    ++count;
  }
  block.t.resize(count);
  for (auto& column : block.columns) {
    column.resize(count);
  }
  first_row_ += count;
  return count > 0;
}

namespace {

constexpr double unseen = 9.0 / 8.0;

}  // namespace

std::int64_t longest_gap_of(std::int64_t median_step) {
  return static_cast<std::int64_t>(
      std::min(gap_factor * static_cast<double>(median_step), static_cast<double>(farthest_time)));
}

StreamAligner::StreamAligner(std::size_t width, std::vector<AlignedStream> streams, std::int64_t patience)
    : patience_(patience), newest_(std::numeric_limits<std::int64_t>::min()), error_(width, 0.0) {
  check::that(!streams.empty(), "streams", "at least one");
  std::vector<bool> taken(width, false);
  for (AlignedStream& layout : streams) {
    check::that(layout.columns.size() == layout.angle.size(), "stream", "one mark of an angle for each column");
    for (const std::size_t column : layout.columns) {
      check::that(column < width && !taken[column], "stream", "columns of the row, each in one stream");
      taken[column] = true;
    }
    streams_.push_back({std::move(layout), {}, {}, 0});
  }
}

void StreamAligner::push(std::size_t stream, std::int64_t time, std::span<const double> values) {
  Stream& own = streams_[stream];
  check::that(values.size() == own.layout.columns.size(), "values", "one for each column of the stream");
  check::that(-farthest_time < time && time < farthest_time, "time", "a time within 146 years");
  if (stream > 0 && !own.samples.empty() && time <= own.samples.back().time) {
    ++own.stale;
    return;
  }
  Sample sample;
  if (!own.spare.empty()) {
    sample = std::move(own.spare.back());
    own.spare.pop_back();
  }
  sample.time = time;
  sample.values.assign(values.begin(), values.end());
  if (stream > 0 && !own.samples.empty()) {
    const std::vector<double>& before = own.samples.back().values;
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (own.layout.angle[k] && std::isfinite(before[k])) {
        sample.values[k] -= turn * std::round((sample.values[k] - before[k]) / turn);
      }
    }
  }
  own.samples.push_back(std::move(sample));
  newest_ = std::max(newest_, time);
}

void StreamAligner::finish() { finished_ = true; }

bool StreamAligner::ready(std::int64_t time) const {
  return finished_ || newest_ - time > patience_ ||
         std::all_of(streams_.begin() + 1, streams_.end(), [&](const Stream& stream) {
           return !stream.samples.empty() && stream.samples.back().time >= time;
         });
}

bool StreamAligner::pop(std::int64_t& time, std::span<double> row) {
  Stream& first = streams_.front();
  if (first.samples.empty() || !ready(first.samples.front().time)) {
    return false;
  }
  Sample& sample = first.samples.front();
  time = sample.time;
  std::fill(row.begin(), row.end(), core::kNan);
  for (std::size_t k = 0; k < sample.values.size(); ++k) {
    row[first.layout.columns[k]] = sample.values[k];
  }
  first.spare.push_back(std::move(sample));
  first.samples.pop_front();
  for (std::size_t s = 1; s < streams_.size(); ++s) {
    interpolate(streams_[s], time, row);
  }
  return true;
}

void StreamAligner::interpolate(Stream& stream, std::int64_t time, std::span<double> row) {
  // Two samples before the time are enough: one to interpolate from and one to see how the signal bends.
  while (stream.samples.size() > 2 && stream.samples[2].time <= time) {
    stream.spare.push_back(std::move(stream.samples.front()));
    stream.samples.pop_front();
  }
  const auto& samples = stream.samples;
  std::size_t right = 0;
  while (right < samples.size() && samples[right].time < time) {
    ++right;
  }
  if (right == samples.size()) {
    return;
  }
  const Sample& after = samples[right];
  const bool exact = after.time == time;
  if (!exact && (right == 0 || after.time - samples[right - 1].time > stream.layout.longest_gap)) {
    return;
  }
  for (std::size_t k = 0; k < after.values.size(); ++k) {
    const std::size_t column = stream.layout.columns[k];
    if (exact) {
      row[column] = after.values[k];
      continue;
    }
    const Sample& before = samples[right - 1];
    const double h = static_cast<double>(after.time - before.time);
    const double share = static_cast<double>(time - before.time) / h;
    const double slope = (after.values[k] - before.values[k]) / h;
    row[column] = before.values[k] + share * (after.values[k] - before.values[k]);
    double bend = 0.0;
    const auto widen = [&](double other_slope, std::int64_t span) {
      const double second = 2.0 * std::abs(other_slope - slope) / static_cast<double>(span);
      bend = std::isfinite(second) ? std::max(bend, second) : bend;
    };
    if (right >= 2) {
      const Sample& far = samples[right - 2];
      widen((before.values[k] - far.values[k]) / static_cast<double>(before.time - far.time), after.time - far.time);
    }
    if (right + 1 < samples.size()) {
      const Sample& far = samples[right + 1];
      widen((far.values[k] - after.values[k]) / static_cast<double>(far.time - after.time), far.time - before.time);
    }
    const double late = std::abs(slope) * static_cast<double>(stream.layout.time_error);
    error_[column] = std::max(error_[column], unseen * 0.5 * share * (1.0 - share) * h * h * bend + late);
  }
}

}  // namespace wheelwright::logs
