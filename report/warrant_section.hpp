// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the numbers of a page stand on: a badge, and the table of assumptions.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/commission/assumptions.hpp>

namespace wheelwright::report {

/// The word as a badge, of another colour for each. HTML.
[[nodiscard]] std::string warrant_badge(Warrant warrant);

/// The badge and what the word means, as a paragraph. HTML.
[[nodiscard]] std::string warrant_note(Warrant warrant);

/// The assumptions with their verdicts, those that fail first, as a table; empty for none. HTML.
[[nodiscard]] std::string assumptions_section(const std::vector<Assumption>& assumptions);

}  // namespace wheelwright::report
