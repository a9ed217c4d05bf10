// SPDX-License-Identifier: Apache-2.0
/// \file
/// One line of a CSV log → one clean row: numbers read, defects dropped and counted, segments split, heading unwrapped.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/io/csv_header.hpp>
#include <wheelwright/io/csv_report.hpp>

namespace wheelwright {

/// The cleaning of a log, row by row; the same for whole files and for a live stream.
class CsvRowReader {
 public:
  /// What became of a line.
  enum class Outcome {
    dropped,      ///< a defect; counted
    row,          ///< a row that continues the segment
    new_segment,  ///< a row that begins a segment
  };

  /// `names` are the columns to read, time apart. What is met is counted in `report` where that is not null.
  CsvRowReader(std::vector<std::string> names, LogReport* report);

  /// Begins a file (and with it a segment) with this header. Throws InputError when two of the columns are one field,
  /// or a name is not in the header.
  void begin_file(const CsvHeader& header, std::string path);

  /// Steps longer than `seconds` are gaps.
  void set_longest_step(double seconds) { longest_step_ = seconds; }

  /// Reads one line that has content. A line that is not `terminated` may be cut off: it is then dropped where
  /// otherwise it would be an error. Throws InputError (and keeps the state of before) for text instead of a number, a
  /// wrong number of fields, and a value beyond LogColumn::limit.
  Outcome read(std::string_view line, std::size_t line_number, bool terminated);

  /// Time of the last row, s.
  [[nodiscard]] double t() const { return t_; }
  /// Values of the last row, in the order of `names`.
  [[nodiscard]] const double* values() const { return values_.data() + 1; }

 private:
  enum class Fault { none, empty, not_finite, limit, text };
  struct Defect {
    Fault fault = Fault::none;
    std::size_t field = 0;
    std::string_view text;
  };

  std::size_t read_fields(std::string_view line, Defect& defect);
  const char* read_odd_field(const char* p, const char* end, std::size_t field, double& value, Defect& defect);
  Outcome place_row(std::size_t line_number);
  void unwrap(bool new_segment, std::size_t line_number);
  void count(Occurrences LogReport::*what, std::size_t line_number, std::string_view detail = {});
  [[nodiscard]] std::string at(std::size_t line_number) const;
  [[nodiscard]] std::string describe(const Defect& defect) const;

  std::vector<std::string> names_;
  LogReport* report_;
  double longest_step_ = std::numeric_limits<double>::infinity();

  std::string path_;
  std::vector<std::string> fields_;
  std::vector<int> slots_;      ///< field -> index in values_, or −1
  std::vector<double> limits_;  ///< of each value
  char separator_ = ',';

  std::vector<double> values_;  ///< time, then the columns
  double t_ = 0.0;
  bool fresh_ = true;          ///< the next row begins a segment whatever its time
  std::size_t theta_ = 0;      ///< index of the heading in values_, 0 where there is none
  double theta_before_ = 0.0;  ///< as logged
  double turns_ = 0.0;         ///< whole turns to add
};

}  // namespace wheelwright
