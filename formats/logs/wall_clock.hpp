// SPDX-License-Identifier: Apache-2.0
/// \file
/// Times as people and programs write them: dates, times of the day, durations; moments as text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace wheelwright::logs {

/// A moment, or a duration.
struct Moment {
  std::int64_t ns = 0;        ///< since 1970-01-01 00:00, or since wherever it is counted from
  bool since_1970 = false;    ///< it has a date
  bool utc = false;           ///< it says its offset from UTC; otherwise it is of a zone that is not told
  bool day_or_month = false;  ///< day and month of the date could change places: the day was taken to stand first
};

/// Reads "2026-11-29 08:40:00.123456" (with T, a comma for the point, Z, UTC or an offset behind it), "29.11.2026
/// 08:40:00,1", "29/11/2026 08:40:00", "11/29/2026 8:40:00.1 AM", "29-Nov-2026 08:40:00.1", "20261129T084000", a time
/// of the day "08:40:00.1", a duration "0 days 00:00:00.01" or "0.01 sec". Digits behind the ninth of a second are left
/// out. Nothing for anything else, also for a time without its seconds.
[[nodiscard]] std::optional<Moment> parse_moment(std::string_view text);

/// Whether `seconds` since 1970 lie between 2000 and 2100: what no clock counts that begins elsewhere.
[[nodiscard]] bool is_since_1970(double seconds);

/// "2026-11-29 08:40:00.123" of `second` since 1970 and `beyond` s more, rounded to ms; `zone` behind a blank where it
/// is not empty.
[[nodiscard]] std::string moment_text(std::int64_t second, double beyond, std::string_view zone);

}  // namespace wheelwright::logs
