// SPDX-License-Identifier: Apache-2.0
/// \file
/// The header line of a CSV file: separator, columns, and which of them are wanted.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wheelwright {

/// What to read from a CSV log.
struct CsvOptions {
  /// Contract name (or a name in `extra`) -> column of the file, for headers that no spelling covers
  /// (`--map name=column`). It goes before everything else.
  std::map<std::string, std::string> map;
  /// Further columns to read under their own names; a file that lacks one is an error.
  std::vector<std::string> extra;
  /// Where given, only these contract columns are read (and those in `map` and `extra`), as far as the files have them;
  /// otherwise every contract column that all files have. A defect in a column that is not read does no harm.
  std::optional<std::vector<std::string>> only;
  std::size_t block_rows = 4096;  ///< rows of a block, at least 1
  std::size_t min_rows = 20;      ///< usable rows that a log must have
};

/// A header, understood.
struct CsvHeader {
  char separator = ',';
  std::vector<std::string> fields;           ///< the columns as written, quotes and surrounding blanks removed
  std::map<std::string, std::size_t> found;  ///< wanted name (`t` among them) -> field
};

/// Splits `line` at `separator`; quotes around a field are removed ("" inside them is one quote), and blanks around it.
[[nodiscard]] std::vector<std::string> split_fields(std::string_view line, char separator);

/// Reads the header `line`. `place` is "file:line" for messages. Throws InputError when it is binary or all numbers, a
/// name of `map` or `extra` is not there, two fields mean the same column, or there is no time.
[[nodiscard]] CsvHeader read_csv_header(std::string_view line, const CsvOptions& options, const std::string& place);

/// Whether `line` is neither blank nor a comment (#).
[[nodiscard]] bool is_csv_content(std::string_view line);

}  // namespace wheelwright
