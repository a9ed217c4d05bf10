// SPDX-License-Identifier: Apache-2.0
/// \file
/// Numbers and enumerations as words in files: decimal text ↔ double, correctly rounded and without a locale; names ↔
/// enumerations, and suggestions for misspelt ones.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/words.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::files {

/// Reads the longest decimal number that starts at `first` (sign, digits, point, exponent; nan and inf in any case) and
/// returns the first character behind it; nullptr where no number starts. The value is the double nearest to the text;
/// text beyond the range of a double gives ±infinity, below it ±0. No blanks are skipped.
const char* parse_number(const char* first, const char* last, double& value);

/// The number that `text` is, surrounding blanks apart; nothing when it is not entirely one number.
[[nodiscard]] std::optional<double> to_number(std::string_view text);

/// Shortest decimal text that reads back as exactly `value`.
[[nodiscard]] std::string number_text(double value);

/// A table of words, one for each value.
template <typename Value, std::size_t n>
using Words = std::array<std::pair<Value, std::string_view>, n>;

/// The word for `value`, which must be in the table.
template <typename Value, std::size_t n>
[[nodiscard]] std::string word_of(const Words<Value, n>& words, Value value) {
  for (const auto& [v, word] : words) {
    if (v == value) {
      return std::string(word);
    }
  }
  return {};
}

/// The value of the word at `place`. Throws InputError, listing the words, where it is none of them.
template <typename Value, std::size_t n>
[[nodiscard]] Value value_of(const Words<Value, n>& words, const JsonPlace& place) {
  const std::string text = place.text();
  std::string known;
  for (const auto& [value, word] : words) {
    if (word == text) {
      return value;
    }
    known += (known.empty() ? "" : ", ") + std::string(word);
  }
  place.fail("one of " + known);
}

/// The one of `candidates` nearest to `name` in Damerau-Levenshtein distance (restricted, letter case ignored); empty
/// when none is within a third of the longer name's length.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// "; did you mean 'x'?", or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

/// `text` between quotes, fit for a message: control characters and bytes that are not ASCII shown as '?', cut after 40
/// characters.
[[nodiscard]] std::string shown(std::string_view text);

/// `text` fit for a terminal, whatever files, names and arguments are in it: control characters but line ends and tabs,
/// those that turn the direction of writing, and bytes that are no UTF-8 are "\\x1B". The rest is as it was.
[[nodiscard]] std::string printable(std::string_view text);

/// printable() without line ends and tabs, which are "\\x0A" and "\\x09": names from files, where a line holds one.
[[nodiscard]] std::string one_line(std::string_view text);

/// Whether there is a character in `text` that printable() would not show as it is, bytes that are no UTF-8 apart.
[[nodiscard]] bool has_commands(std::string_view text);

/// `json`, which is JSON in UTF-8, with such characters of its texts as "\\u009b": fit for a terminal.
[[nodiscard]] std::string printable_json(std::string_view json);

/// `text` with U+FFFD in place of each byte that is no UTF-8.
[[nodiscard]] std::string valid_utf8(std::string_view text);

/// True if `text` is UTF-8 (Unicode 15, table 3-7).
[[nodiscard]] bool is_utf8(std::string_view text);

}  // namespace wheelwright::files
