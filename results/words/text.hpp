// SPDX-License-Identifier: Apache-2.0
/// \file
/// Numbers, names and times of a log as a reader wants them. Everything returns UTF-8 text that is not yet escaped,
/// escape() apart.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/words.hpp"

namespace wheelwright::words {

/// `text` with & < > " ' as character references: fit for HTML text and quoted attributes. Control characters other
/// than tab and line feed become U+FFFD.
[[nodiscard]] std::string escape(std::string_view text);

/// The same, and what stands between two backticks becomes <code>.
[[nodiscard]] std::string escape_with_code(std::string_view text);

/// An identifier as words: "yaw_inertia" → "yaw inertia".
[[nodiscard]] std::string spaced(std::string_view identifier);

/// `x` with `digits` significant digits, trailing zeros kept: "21.3", "−0.0210", "1.20·10⁻⁷"; "–" where not finite.
[[nodiscard]] std::string number(double x, int digits = 3);

/// `x` with `decimals` decimals; "–" where not finite.
[[nodiscard]] std::string decimal(double x, int decimals);

/// An integer in groups of three digits: "12 345".
[[nodiscard]] std::string count(std::size_t n);

/// "no events", "1 event", "2 events": the plural is `noun` with s.
[[nodiscard]] std::string plural(std::size_t n, std::string_view noun);

/// `unit` behind a number: nothing for "1".
[[nodiscard]] std::string unit_of(const std::string& unit);

/// A share as a percentage: 0.0414 → "4.14 %".
[[nodiscard]] std::string percent(double share, int digits = 3);

/// `text` followed by a unit, if there is one.
[[nodiscard]] std::string with_unit(std::string text, std::string_view unit);

/// The ends of an interval of bounds in decimals that show its width to two digits, rounded outward: what is printed
/// contains [lower, upper]. "–" for an end that is not finite.
[[nodiscard]] std::pair<std::string, std::string> outward(double lower, double upper);

/// `x` with as many decimals as outward(lower, upper) shows, three significant digits at least; as number() where that
/// interval has no width.
[[nodiscard]] std::string beside(double x, double lower, double upper);

/// Columns that a terminal shows of UTF-8 `text`: a dash is one column and three bytes.
[[nodiscard]] inline std::size_t text_width(std::string_view text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

/// UTF-8 `text` filled with blanks to `width` columns, one blank at least where it is longer.
[[nodiscard]] inline std::string padded(std::string text, std::size_t width) {
  const std::size_t columns = text_width(text);
  text.append(columns < width ? width - columns : 1, ' ');
  return text;
}

/// Times of a page. They count from an origin where the log's clock is an epoch, so that digits are left for the
/// driving. Where the log's time goes back (several runs in one log), its runs are laid end to end: a moment then no
/// longer has one place on the axis.
class TimeAxis {
 public:
  /// The axis for the times `t` (s) of a whole log, or of what is known of it: origin 0 unless the first one is beyond
  /// ±10⁶ s.
  explicit TimeAxis(const std::vector<double>& t = {});

  /// s, subtracted from every time that is shown.
  [[nodiscard]] double origin() const { return origin_; }
  /// True if the log's time goes back somewhere.
  [[nodiscard]] bool repeats() const { return offsets_.size() > 1; }
  /// Seconds since the origin.
  [[nodiscard]] double shown(double t) const { return t - origin_; }
  /// "12.345 s".
  [[nodiscard]] std::string text(double t) const;
  /// Places on the axis of the times `t` of one walk over the log; never decreasing.
  [[nodiscard]] std::vector<double> lay(const std::vector<double>& t) const;

 private:
  double origin_ = 0.0;
  std::vector<double> offsets_;  // of each run, s
};

}  // namespace wheelwright::words
