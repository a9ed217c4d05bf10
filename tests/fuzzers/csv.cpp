// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "formats/files/bytes.hpp"
#include "tests/fuzzers/log.hpp"

using namespace wheelwright;

namespace {

/// Numbers of a line as the C library reads them, of whatever stands between separators.
std::vector<double> numbers_of(const std::string& line) {
  std::vector<double> numbers;
  for (const char* p = line.c_str(); *p != '\0'; ++p) {
    if (p == line.c_str() || std::string_view(",;\t \"").find(p[-1]) != std::string_view::npos) {
      char* end = nullptr;
      const double number = std::strtod(p, &end);
      if (end != p) {
        numbers.push_back(number);
      }
    }
  }
  return numbers;
}

/// Whether the file has numbers alone, with points, between commas: what numbers_of() reads as it is meant.
bool is_plain(const std::filesystem::path& path) {
  files::LineReader in(files::open_bytes(path), path.string());
  std::string_view line;
  for (std::size_t rows = 0; in.next(line);) {
    if (!logs::is_csv_content(line)) {
      continue;
    }
    if (line.find_first_of(";\t\":") != std::string_view::npos ||
        (rows == 1 && line.find_first_of("0123456789") == std::string_view::npos)) {
      return false;
    }
    ++rows;
  }
  return true;
}

/// Every row is one of a line, in their order, and the stream's reader has the same.
void require_as_written(const std::filesystem::path& path, const logs::RecordedLog& log, const LogTable& table) {
  const logs::LogFileReport& report = log.report().files.front();
  const bool converted =
      std::ranges::any_of(report.notes, [](const std::string& note) { return note.find(" times ") != note.npos; });
  if (!report.interpolated.empty() || converted || !is_plain(path)) {
    return;
  }
  const bool seconds = report.time_origin == 0.0;
  files::LineReader in(files::open_bytes(path), path.string());
  std::string_view line;
  while (in.next(line) && !logs::is_csv_content(line)) {
  }
  logs::CsvRowParser parser(line, {}, log.median_step());
  fuzz::require(parser.columns() == table.names);
  LogBlock row;
  std::size_t rows = 0;
  std::size_t segments = 0;
  for (std::size_t k = 0; k < table.rows() && in.next(line);) {
    if (!parser.parse(line, row)) {
      continue;
    }
    fuzz::require(!seconds || row.t[0] == table.t[k]);
    segments += row.segment_starts.size();
    std::string text(line);
    std::ranges::replace(text, '\0', '?');
    const std::vector<double> written = numbers_of(text);
    const auto stands = [&](double value) { return std::ranges::find(written, value) != written.end(); };
    fuzz::require(!seconds || stands(row.t[0]));
    for (std::size_t c = 0; c < table.names.size(); ++c) {
      fuzz::require(row.columns[c][0] == table.columns[c][k]);
      const std::string& name = table.names[c];
      fuzz::require(name == "theta" || name == "phi_r" || name == "phi_l" || stands(row.columns[c][0]));
    }
    rows = ++k;
  }
  fuzz::require(rows == table.rows() && (log.median_step() == 0.0 || segments == table.segment_starts.size()));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::read_log(data, size, ".csv", require_as_written);
}
