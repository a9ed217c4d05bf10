// SPDX-License-Identifier: Apache-2.0
/// \file
/// "Did you mean …?" for misspelt names.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace wheelwright {

/// The one of `candidates` nearest to `name` in Damerau-Levenshtein distance (restricted, letter case ignored); empty
/// when none is within a third of the longer name's length.
[[nodiscard]] std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates);

/// "; did you mean 'x'?", or nothing.
[[nodiscard]] std::string did_you_mean(std::string_view name, const std::vector<std::string>& candidates);

/// `text` between quotes, fit for a message: control characters and bytes that are not ASCII shown as '?', cut after 40
/// characters.
[[nodiscard]] std::string shown(std::string_view text);

/// "a, b, c".
[[nodiscard]] std::string listed(const std::vector<std::string>& names);

}  // namespace wheelwright
