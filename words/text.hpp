// SPDX-License-Identifier: Apache-2.0
/// \file
/// Numbers and names as a reader wants them. Everything returns UTF-8 text that is not yet escaped, escape() apart.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <wheelwright/core/words.hpp>

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

}  // namespace wheelwright::words
