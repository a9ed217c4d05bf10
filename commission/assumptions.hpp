// SPDX-License-Identifier: Apache-2.0
/// \file
/// The assumptions of a commissioned model, and the verdict of its log on each (docs/methods/assumptions.md).
#pragma once

#include <vector>

#include "core/warrant.hpp"

namespace wheelwright::commission {

struct Commissioning;

/// The assumptions of `result` with the verdicts of its log, those of the rows first. The one place where a test sets a
/// verdict.
[[nodiscard]] std::vector<core::Assumption> assumptions_of(const Commissioning& result);

/// Fills in Commissioning::assumptions (and those of its model), and the warrant of every number: that of the noise it
/// stands on; extrapolated where an assumption fails. Where only that of driving to come fails, intervals of parameters
/// stay what they are.
void settle_warrants(Commissioning& result);

/// Of the parameters' intervals; that of the model, which thresholds share, where there are none.
[[nodiscard]] core::Warrant interval_warrant(const Commissioning& result);

}  // namespace wheelwright::commission
