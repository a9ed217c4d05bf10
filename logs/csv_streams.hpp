// SPDX-License-Identifier: Apache-2.0
/// \file
/// CSV files whose columns were sampled at different rates: tables merged from several recordings, with empty fields.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace wheelwright {

/// Columns that are filled in the same rows.
struct CsvStream {
  std::vector<std::size_t> columns;  ///< indices in the names that were looked at
  std::int64_t median_step = 0;      ///< ns, between the rows in which they are filled
  double filled = 1.0;               ///< share of the rows in which they are
};

/// Finds the streams of a table, row by row. Columns missing in at most a fifth of the rows are one stream (a row in which
/// one of them is missing has a defect); of the others, those that are filled in exactly the same rows are one.
class CsvStreamFinder {
 public:
  explicit CsvStreamFinder(std::vector<std::string> names);
  /// A row: its time (s) and the columns' values, NaN where missing.
  void add(double t, const double* values);
  /// The streams, the one that gives a log its rows first (row_weight). One stream: nothing is sampled apart. Columns that
  /// were never filled are in none.
  [[nodiscard]] std::vector<CsvStream> streams() const;

 private:
  std::vector<std::string> names_;
  std::vector<double> t_;
  std::vector<std::vector<bool>> filled_;  ///< of each column, in each row
};

}  // namespace wheelwright
