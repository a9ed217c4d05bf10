// SPDX-License-Identifier: Apache-2.0
/// \file
/// The table of a log, in blocks: what `logs` hands out and `filter` takes in.
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wheelwright::core {

/// A stretch of consecutive rows of a log. Columns have the names of the log contract (`t` apart), SI units.
struct LogBlock {
  std::size_t first_row = 0;                 ///< number of row 0 of this block within the whole log
  std::vector<double> t;                     ///< time of each row, s; strictly increasing inside a segment
  std::vector<std::vector<double>> columns;  ///< columns[c][row], in the order of LogSource::columns()
  std::vector<std::size_t> segment_starts;   ///< ascending rows of this block (0-based) at which a new segment starts;
                                             ///< row 0 of the first block of a log is always one

  /// Number of rows.
  [[nodiscard]] std::size_t rows() const { return t.size(); }
};

/// A log that can be walked from beginning to end any number of times, block by block, in bounded memory.
/// Rows are clean: all values are finite, times strictly increase inside a segment, and segments are split at gaps and
/// resets.
class LogSource {
 public:
  virtual ~LogSource() = default;
  /// Names of the columns, in the order of LogBlock::columns (time is not among them).
  [[nodiscard]] virtual const std::vector<std::string>& columns() const = 0;
  /// Fills `block` with the next rows and returns true; returns false at the end (block is then empty). Buffers of
  /// `block` are reused.
  virtual bool next(LogBlock& block) = 0;
  /// Goes back to the first row.
  virtual void rewind() = 0;
  /// Median time step over the log, s (0 when the log has fewer than two rows).
  [[nodiscard]] virtual double median_step() const = 0;
  /// A walk over the same rows that begins at the first, for another thread; null where a log can only be walked once
  /// at a time.
  [[nodiscard]] virtual std::unique_ptr<LogSource> another_walk() const { return nullptr; }

  /// Index of column `name`, or nothing.
  [[nodiscard]] std::optional<std::size_t> find(std::string_view name) const;
};

/// A whole log in memory: for short logs, tests and users who bring their own data.
struct LogTable {
  std::vector<std::string> names;            ///< names of the columns, `t` apart
  std::vector<double> t;                     ///< time, s, strictly increasing inside a segment
  std::vector<std::vector<double>> columns;  ///< columns[c][row]
  std::vector<std::size_t> segment_starts;   ///< ascending; empty means one segment

  /// Number of rows.
  [[nodiscard]] std::size_t rows() const { return t.size(); }
  /// The column called `name`, or null.
  [[nodiscard]] const std::vector<double>* find(std::string_view name) const;
  /// The column called `name`. Throws InvalidArgument where there is none.
  [[nodiscard]] const std::vector<double>& column(std::string_view name) const;
  /// The same, to be written.
  [[nodiscard]] std::vector<double>& column(std::string_view name);
};

/// Where columns stand among those of `log`. Throws InvalidArgument where one is not there, `why` behind its name.
[[nodiscard]] std::vector<std::size_t> positions_of(const LogSource& log, const std::vector<std::string>& columns,
                                                    const std::string& why = "");

/// visit(block, k, starts) for every row k of every block of `log`; `starts` where a segment does. The log is rewound
/// before and after.
template <typename Visit>
void for_each_row(LogSource& log, Visit&& visit) {
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const bool starts = segment < block.segment_starts.size() && block.segment_starts[segment] == k;
      segment += starts ? 1 : 0;
      visit(std::as_const(block), k, starts);
    }
  }
  log.rewind();
}

/// A row of a log as filters and detectors take it.
struct LogSample {
  std::size_t row = 0;             ///< its number within the whole log
  double t = 0.0;                  ///< time, s
  std::span<const double> values;  ///< of the columns that were asked for, in that order; valid during the visit
  bool starts = false;             ///< a segment starts here
};

/// visit(LogSample) for every row of `log`, with the values of `columns`. The log is rewound before and after. Throws
/// InvalidArgument where a column is not there, `why` behind its name.
template <typename Visit>
void for_each_sample(LogSource& log, const std::vector<std::string>& columns, Visit&& visit,
                     const std::string& why = "") {
  const std::vector<std::size_t> pick = positions_of(log, columns, why);
  std::vector<double> values(pick.size());
  for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    for (std::size_t c = 0; c < pick.size(); ++c) {
      values[c] = block.columns[pick[c]][k];
    }
    visit(LogSample{block.first_row + k, block.t[k], values, starts});
  });
}

/// Median of the steps of `t` (the steps across segment starts included), s; 0 for fewer than two rows.
[[nodiscard]] double median_step(const std::vector<double>& t);

/// Throws InvalidArgument unless the segments of `table` begin at rows of it, in ascending order, each once. Row 0 may
/// begin one where there are no rows.
void check_segments(const LogTable& table);

/// Rows [first, last) of `table`; a segment that is cut starts anew. Throws InvalidArgument unless
/// first <= last <= rows.
[[nodiscard]] LogTable slice(const LogTable& table, std::size_t first, std::size_t last);

/// A LogSource over a table, which must outlive it.
class TableSource final : public LogSource {
 public:
  /// Throws InvalidArgument when columns differ in length, time does not increase inside a segment, a value is not
  /// finite, or segments do not begin at rows (check_segments()).
  explicit TableSource(const LogTable& table, std::size_t block_rows = 4096);
  [[nodiscard]] const std::vector<std::string>& columns() const override;
  bool next(LogBlock& block) override;
  void rewind() override;
  [[nodiscard]] double median_step() const override;
  [[nodiscard]] std::unique_ptr<LogSource> another_walk() const override;

 private:
  const LogTable* table_;
  std::size_t block_rows_;
  std::size_t position_ = 0;
  double median_step_ = 0.0;
};

/// Reads all of `source` (from its beginning) into a table, or its first `most` rows. The log is rewound.
[[nodiscard]] LogTable read_all(LogSource& source, std::size_t most = static_cast<std::size_t>(-1));

/// A sensor that takes sample k of a segment at φ + k·step, whatever its stamp says. Where the times of a segment begin
/// does not matter to an equation of motion; their rate does.
struct EvenClock {
  double step = 0.0;   ///< s; 0: the stamps are the times of the samples
  double drift = 0.0;  ///< bound of |true step/step − 1|, which changes slowly against a filter's memory

  friend bool operator==(const EvenClock& a, const EvenClock& b) = default;
};

/// A bound on an error of one column of a log, in its unit.
struct ColumnError {
  std::string column;
  double bound = 0.0;
};

}  // namespace wheelwright::core

namespace wheelwright {
using core::EvenClock;
using core::LogBlock;
using core::LogSource;
using core::LogTable;
using core::read_all;
using core::TableSource;
}  // namespace wheelwright
