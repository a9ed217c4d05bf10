// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log made of files that hand out clean rows: what all formats have in common.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include <wheelwright/logs/recorded_log.hpp>
#include <wheelwright/logs/row_cleaner.hpp>

namespace wheelwright {

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

/// How RowLog hands out rows.
struct RowLogOptions {
  std::size_t block_rows = 4096;  ///< rows of a block, at least 1
  std::size_t min_rows = 20;      ///< usable rows that a log must have
};

/// A log over files, each of which begins a new segment. Memory does not grow with them.
class RowLog : public RecordedLog {
 public:
  /// Reads all of `files` once: the median step, the hashes, and everything that report() says. columns() are those that
  /// all files have, in the order of the first. Throws InputError as the files do, for time that never increases, and for
  /// fewer than `min_rows` usable rows; InvalidArgument when there are no files or `block_rows` is 0.
  RowLog(std::vector<std::unique_ptr<RowFile>> files, RowLogOptions options);

  [[nodiscard]] const std::vector<std::string>& columns() const override { return names_; }
  bool next(LogBlock& block) override;
  void rewind() override;
  [[nodiscard]] double median_step() const override { return report_.median_step; }
  [[nodiscard]] const LogReport& report() const override { return report_; }

 private:
  [[nodiscard]] std::unique_ptr<RowWalk> open(std::size_t file, LogReport* report);
  void find_median_step();
  void survey();
  void judge() const;
  [[nodiscard]] double longest_step() const;

  std::vector<std::unique_ptr<RowFile>> files_;
  std::vector<std::string> names_;
  RowLogOptions options_;
  LogReport report_;
  std::size_t file_ = 0;
  std::unique_ptr<RowWalk> walk_;
  std::size_t first_row_ = 0;
};

/// Median of `steps` (reordered by it); 0 where there are none.
[[nodiscard]] double middle_of(std::vector<double>& steps);

/// A step of more than this times the median step is a gap.
inline constexpr double gap_factor = 5.0;

}  // namespace wheelwright
