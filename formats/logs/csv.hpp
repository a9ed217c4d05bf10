// SPDX-License-Identifier: Apache-2.0
/// \file
/// CSV logs: read in bounded memory and cleaned on the way, or row by row from a live stream; written.
///
/// A file has a header line with the names of its columns in any order (see recorded_log.hpp for the spellings that are
/// known), then one row a line; a second line may have the columns' units, and a line "sep=;" may stand before both.
/// Separators , ; or tab; decimal points, or commas where none of both is meant to separate; LF or CRLF; blank lines
/// and lines that begin with # are skipped; UTF-8 or UTF-16, gzip or zstd, told apart by the first bytes. Times are s,
/// or dates, times of the day or durations (wall_clock.hpp), or whole counts since 1970. Fields that are not used may
/// hold anything.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "formats/logs/csv_format.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs {

/// A log in one or several CSV files.
class CsvLog final : public RowLog {
 public:
  /// Reads all of `paths` once, as RowLog does; columns() are those that all files have, in the order of the first.
  /// What is repaired and counted, and what is not:
  /// - a row with an empty, NaN or infinite used field, or with the time of the row before, is dropped;
  /// - columns that more than a fifth of a file's first rows lack were sampled apart (csv.hpp): they are brought to
  ///   the times of the other rows as topics of a bag are (row_log.hpp), and the report says so;
  /// - time that goes backwards, and a step of more than 5 × the median step, begin a new segment;
  /// - `theta` is unwrapped inside a segment, so that no step exceeds π;
  /// - a last line without line end that is cut off is dropped;
  /// - text in a used field, a wrong number of fields, and values beyond LogColumn::limit throw.
  /// Throws InputError, naming file, line, column, value and what was expected, for those, for files that open_bytes or
  /// read_csv_header reject, for time that never increases, and for fewer than `min_rows` usable rows. The median step
  /// is that of at most the first 100 001. Throws InvalidArgument when `paths` is empty or `block_rows` is 0.
  explicit CsvLog(const std::vector<std::filesystem::path>& paths, const CsvOptions& options = {});
};

/// One file of such a log; `origin` is that of all its files. Throws InputError as CsvLog does for its header.
[[nodiscard]] std::unique_ptr<RowFile> csv_file(const std::filesystem::path& path, const CsvOptions& options,
                                                const TimeOrigin& origin);

/// The same cleaning for rows that come one at a time (standard input of `detect --follow`).
class CsvRowParser {
 public:
  /// `header` is the header line, `name` stands for the stream in messages. `median_step` (s) is what gaps are judged
  /// by; with 0 it is the median of the first 101 steps, of as many as there are (at least 20) before that, and until
  /// then nothing is called a gap. Throws InputError as read_csv_header does.
  explicit CsvRowParser(std::string_view header, const CsvOptions& options = {}, double median_step = 0.0,
                        std::string name = "standard input");
  ~CsvRowParser();
  CsvRowParser(CsvRowParser&&) noexcept;
  CsvRowParser& operator=(CsvRowParser&&) noexcept;

  /// Columns of the rows, time apart.
  [[nodiscard]] const std::vector<std::string>& columns() const;
  /// Reads the next line (its line end may be there or not). Returns true with the row in `block`; false when the line
  /// is blank, a comment, or dropped (see report()). Throws InputError as CsvLog does; the parser can go on after that.
  bool parse(std::string_view line, LogBlock& block);
  /// What was met so far; LogReport::files is empty.
  [[nodiscard]] const LogReport& report() const;
  /// Begins the counts of report() anew: what was dropped, split and unwrapped from here on.
  void begin_counts();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Writes `table` with the header t, names...; numbers are the shortest that read back exactly. Packed with gzip or
/// zstd when the name ends in .gz or .zst. The file appears whole or not at all. Segments are not marked: a reader
/// finds those that begin at a gap or a reset. Throws InvalidArgument when the columns differ in length, a value is not
/// finite or a name is not fit for a header; InputError when the file cannot be written.
void write_csv(const std::filesystem::path& path, const LogTable& table);

/// Columns that are filled in the same rows.
struct CsvStream {
  std::vector<std::size_t> columns;  ///< indices in the names that were looked at
  std::int64_t median_step = 0;      ///< ns, between the rows in which they are filled
  double filled = 1.0;               ///< share of the rows in which they are
};

/// Finds the streams of a table, row by row. Columns missing in at most a fifth of the rows are one stream (a row in
/// which one of them is missing has a defect); of the others, those that are filled in exactly the same rows are one.
class CsvStreamFinder {
 public:
  explicit CsvStreamFinder(std::vector<std::string> names);
  /// A row: its time (s) and the columns' values, NaN where missing.
  void add(double t, const double* values);
  /// The streams, the one that gives a log its rows first (row_weight). One stream: nothing is sampled apart. Columns
  /// that were never filled are in none.
  [[nodiscard]] std::vector<CsvStream> streams() const;

 private:
  std::vector<std::string> names_;
  std::vector<double> t_;
  std::vector<std::vector<bool>> filled_;  ///< of each column, in each row
};

}  // namespace wheelwright::logs

namespace wheelwright {
using logs::CsvLog;
}  // namespace wheelwright
