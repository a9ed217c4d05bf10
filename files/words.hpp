// SPDX-License-Identifier: Apache-2.0
/// \file
/// Conversion between enumerations and their words in files, and suggestions for misspelt names.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <wheelwright/core/words.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::files {

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

}  // namespace wheelwright::files
