// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log recorded in files of whatever format: the columns of the log contract with their units and aliases, and the
/// report of what reading it found and repaired.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"

namespace wheelwright::logs {

/// One column of the contract.
struct LogColumn {
  std::string name;            ///< e.g. "omega_r"
  std::string_view meaning;    ///< e.g. "speed of the right wheel"
  std::string_view unit;       ///< SI
  double limit;                ///< |value| above this cannot be meant in `unit`
  std::string_view spellings;  ///< other names, separated by blanks; '@' stands for r|right (l|left)
};

/// All columns of the contract, time first.
[[nodiscard]] std::span<const LogColumn> log_columns();
/// Their names.
[[nodiscard]] std::vector<std::string> log_column_names();

/// The column of the contract called exactly `name`; nullptr where there is none.
[[nodiscard]] const LogColumn* find_log_column(std::string_view name);

/// The column of the contract that a header's `text` means: its own name or another spelling, letter case ignored,
/// blanks, '-', '.' and '/' read as '_', and a unit in brackets at the end dropped when it is the contract's own
/// ("Time [s]" is `t`; "Time [ms]" is nothing). nullptr where it means none.
[[nodiscard]] const LogColumn* recognise_log_column(std::string_view text);

/// Weight of a column in the choice of the stream whose samples become the rows of a log: the stream with the largest
/// sum. Efforts go before motion, motion before the rest.
[[nodiscard]] int row_weight(std::string_view name);

/// `text` in lower case, blanks, '-', '.' and '/' as single '_', none at the ends.
[[nodiscard]] std::string plain_name(std::string_view text);

/// The sides that `name` of a joint tells: "r", "l" or nothing.
[[nodiscard]] std::string side_of_joint(const std::string& name);

/// Whether a joint's name (plain_name()) says that it is a wheel, in one of the languages of side_of_joint().
[[nodiscard]] bool names_wheel(const std::string& plain);

/// Count of a defect, and the place of the first one.
struct Occurrences {
  std::size_t count = 0;
  std::string first;  ///< "file:line" of the first, with column and value where they say more; empty when count is 0
};

/// A column whose values were interpolated between the samples of another clock.
struct Interpolation {
  std::string column;
  std::string topic;   ///< which has the samples
  double error = 0.0;  ///< largest interpolation error (StreamAligner::error), unit of the column
};

/// One file of a log.
struct LogFileReport {
  std::string path;                  ///< as it was given
  std::string format = "csv";        ///< "csv", "mcap", "sqlite3" or "hdf5"
  std::string packing;               ///< "plain", "gzip" or "zstd" (of MCAP: of its chunks)
  std::uint64_t bytes = 0;           ///< size on disk
  std::string hash;                  ///< "xxh64:…" of the bytes on disk (Xxh64::text)
  std::vector<std::string> header;   ///< all columns that the file has, as it writes them
  std::vector<std::string> ignored;  ///< those of them that are not used
  std::size_t rows = 0;              ///< rows handed on
  std::size_t segments = 0;          ///< segments that begin in this file
  double seconds = 0.0;              ///< sum over the segments of last time − first time, s
  double time_origin = 0.0;          ///< s, of the file's own clock: what its times are counted from
  std::string time_zone;             ///< "UTC" where time_origin counts from 1970 there; empty where it is not told
  std::string time_remedy;           ///< the argument that makes s of its times where they look like another unit
  std::vector<Interpolation> interpolated;
  std::vector<std::string> notes;  ///< what else was decided or lost, one sentence each
  /// Why the recording is of no differential drive, one sentence each; empty where nothing says so.
  std::vector<std::string> contradictions = {};
};

/// The moment `t` (s of log time) by the clock of `file`, "2026-11-29 08:40:00.123 UTC"; empty where its times are not
/// counted from a date.
[[nodiscard]] std::string clock_time(const LogFileReport& file, double t);

/// A whole log.
struct LogReport {
  std::vector<LogFileReport> files;
  std::size_t rows = 0;       ///< rows handed on
  std::size_t rows_read = 0;  ///< rows met; rows_read − rows = empty + not_finite + uncovered + duplicates +
                              ///< truncated + leaps
  std::size_t segments = 0;
  double seconds = 0.0;      ///< sum of the files' seconds, s
  double median_step = 0.0;  ///< median of at most the first 100 001 time steps > 0, s
  Occurrences empty;         ///< rows dropped: a used field is empty (or NA, null, none)
  Occurrences not_finite;    ///< rows dropped: a used field is NaN or infinite
  Occurrences uncovered;     ///< rows dropped: another topic has no samples around their time
  Occurrences duplicates;    ///< rows dropped: the same time as the row before
  Occurrences leaps;         ///< rows left out: a speed, rate or angle leaps away and back (core::least_leap)
  Occurrences truncated;     ///< last lines dropped that are cut off in the middle (at most one a file)
  Occurrences resets;        ///< segments begun because time went backwards
  Occurrences gaps;          ///< segments begun because a step is more than 5 × the median step
  Occurrences jumps;         ///< segments begun because a wheel angle took a step that no wheel turns
  Occurrences wraps;         ///< jumps of `theta` by more than π that were unwrapped (no row is lost)
  Occurrences angle_wraps;   ///< jumps of a wheel angle by a turn that were unwrapped (no row is lost)

  /// True if no row was dropped.
  [[nodiscard]] bool clean() const { return rows == rows_read; }
};

/// The interpolation errors of all columns of all files.
[[nodiscard]] std::vector<core::ColumnError> interpolation_errors(const LogReport& report);

/// The repairs of `report` in words, one sentence each, with count and first place; empty where there were none.
[[nodiscard]] std::vector<std::string> sentences(const LogReport& report);

/// A log read from files, which says what reading found.
class RecordedLog : public LogSource {
 public:
  /// What the first reading found and repaired.
  [[nodiscard]] virtual const LogReport& report() const = 0;
};

/// Throws InputError, naming each missing column, `file`, what the file has and the nearest name, unless `source` has
/// all of `names`. A name may list alternatives of which one suffices: "omega_r|phi_r". `header` is what the file has
/// as written; where it is empty, the columns of `source` are named.
void require_columns(const LogSource& source, const std::vector<std::string>& names, std::string_view file,
                     const std::vector<std::string>& header = {});

/// The same for a log that knows its files.
void require_columns(const RecordedLog& log, const std::vector<std::string>& names);

}  // namespace wheelwright::logs
