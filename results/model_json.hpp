// SPDX-License-Identifier: Apache-2.0
/// \file
/// Warrants and assumptions in JSON files.
#pragma once

#include <vector>

#include <wheelwright/commission/assumptions.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright {

/// The word of the member `warrant` of `place`; `absent` where there is none, as in files from before there was one.
/// Throws InputError where it is no such word.
[[nodiscard]] Warrant warrant_at(const JsonPlace& place, Warrant absent);

/// The list as results have it under `assumptions`.
[[nodiscard]] Json assumptions_json(const std::vector<Assumption>& assumptions);

/// The list at the member `assumptions` of `place`; empty where there is none. Throws InputError, naming the key, where
/// it is no such list.
[[nodiscard]] std::vector<Assumption> assumptions_at(const JsonPlace& place);

}  // namespace wheelwright
