// SPDX-License-Identifier: Apache-2.0
/// \file
/// The columns of the log contract, their units and aliases.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

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

}  // namespace wheelwright::logs
