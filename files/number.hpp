// SPDX-License-Identifier: Apache-2.0
/// \file
/// Decimal text ↔ double, correctly rounded and without a locale.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace wheelwright::files {

/// Reads the longest decimal number that starts at `first` (sign, digits, point, exponent; nan and inf in any case) and
/// returns the first character behind it; nullptr where no number starts. The value is the double nearest to the text;
/// text beyond the range of a double gives ±infinity, below it ±0. No blanks are skipped.
const char* parse_number(const char* first, const char* last, double& value);

/// The number that `text` is, surrounding blanks apart; nothing when it is not entirely one number.
[[nodiscard]] std::optional<double> to_number(std::string_view text);

/// Shortest decimal text that reads back as exactly `value`.
[[nodiscard]] std::string number_text(double value);

}  // namespace wheelwright::files
