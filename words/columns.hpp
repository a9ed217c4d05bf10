// SPDX-License-Identifier: Apache-2.0
/// \file
/// Columns of tables for a terminal.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>

namespace wheelwright::words {

/// UTF-8 `text` filled with blanks to `width` columns, one blank at least where it is longer. Columns count what is
/// seen: a dash is one column and three bytes.
[[nodiscard]] inline std::string padded(std::string text, std::size_t width) {
  const auto columns = static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
  text.append(columns < width ? width - columns : 1, ' ');
  return text;
}

}  // namespace wheelwright::words
