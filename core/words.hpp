// SPDX-License-Identifier: Apache-2.0
/// \file
/// Names and sentences as text.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace wheelwright::core {

/// Whether `c` is one of 0 to 9.
[[nodiscard]] constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// "a, b, c", or with `between` in place of ", ".
[[nodiscard]] std::string listed(const std::vector<std::string>& words, std::string_view between = ", ");

/// "a, b and c".
[[nodiscard]] std::string enumerated(const std::vector<std::string>& words);

/// The text with a capital letter in front, where it begins with one of a to z.
[[nodiscard]] std::string capital(std::string text);

/// Puts `to` in the place of every `from`.
void replace_all(std::string& text, std::string_view from, std::string_view to);

/// Whether `a` comes before `b` where digits count as the number they make: log_2 before log_10.
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

}  // namespace wheelwright::core
