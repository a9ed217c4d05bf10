// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log of any format: what is read of it is clean, counted, and the same by a second way.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>

#include "core/log.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/log_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

namespace wheelwright::fuzz {

/// Whether both have the same rows, to the last bit.
inline bool same(const LogTable& a, const LogTable& b) {
  return a.names == b.names && a.t == b.t && a.columns == b.columns && a.segment_starts == b.segment_starts;
}

/// What `log` says of itself holds for `table`, which was read of it. TableSource throws what is no InputError where a
/// value is not finite or time stands.
inline void require_clean(const logs::RecordedLog& log, const LogTable& table) {
  const core::TableSource checked(table);
  const logs::LogReport& report = log.report();
  require(report.rows == table.rows() && report.segments == table.segment_starts.size());
  require(report.rows_read == report.rows + report.empty.count + report.not_finite.count + report.uncovered.count +
                                  report.duplicates.count + report.truncated.count);
  require(report.segments == report.files.size() + report.resets.count + report.gaps.count + report.jumps.count);
  require(std::isfinite(report.seconds) && report.seconds >= 0.0 && std::isfinite(report.median_step));
}

/// A log that is clean needs no repair: written as CSV and read again it has the same rows and segments. (A heading
/// whose jump of π was taken away may be left with one of π and a rounding.)
inline void require_same_again(const logs::RecordedLog& log, const LogTable& table) {
  const auto path = on_disk("", ".again.csv");
  logs::write_csv(path, table);
  logs::LogOptions options;
  options.min_rows = 1;
  const auto again = logs::open_log({path}, options);
  const LogTable read = read_all(*again);
  require(again->report().clean() && read.names == table.names && read.t == table.t &&
          read.segment_starts == table.segment_starts);
  require(log.report().wraps.count + log.report().angle_wraps.count > 0 || same(read, table));
}

/// Reads the log at `path`, made of `size` bytes, and hands it with all that it has to `also`.
template <typename Also>
int read_log(const std::filesystem::path& path, std::size_t size, const Also& also) {
  logs::LogOptions options;
  options.min_rows = 1;
  options.block_rows = 7;
  std::unique_ptr<logs::RecordedLog> log;
  LogTable table;
  clean([&] {
    log = logs::open_log({path}, options);
    table = read_all(*log);
  });
  if (table.rows() > 0 && size <= kMostPromised) {
    promised([&] {
      require_clean(*log, table);
      require(same(read_all(*log), table));
      require_same_again(*log, table);
      also(path, *log, table);
    });
  }
  return 0;
}

/// The same without anything more to ask.
inline int read_log(const std::filesystem::path& path, std::size_t size) {
  return read_log(path, size, [](const auto&, const auto&, const auto&) {});
}

/// The same of bytes, in a file with that ending.
template <typename Also>
int read_log(const std::uint8_t* data, std::size_t size, const std::string& ending, const Also& also) {
  return read_log(on_disk(text_of(data, size), ending), size, also);
}

inline int read_log(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  return read_log(on_disk(text_of(data, size), ending), size);
}

}  // namespace wheelwright::fuzz
