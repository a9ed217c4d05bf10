// SPDX-License-Identifier: Apache-2.0
/// \file
/// The assumptions of a commissioned model, and the verdict of its log on each (docs/methods/assumptions.md).
#pragma once

#include <string>
#include <vector>

#include "core/warrant.hpp"

namespace wheelwright::commission {

struct Commissioning;

/// Assumption::id of the one that is about driving to come alone: where it fails, intervals of parameters stand.
inline constexpr const char* kMotionInDriving = "motion_in_driving";

/// The assumptions of `result` with the verdicts of its log, those of the rows first. The one place where a test sets a
/// verdict.
[[nodiscard]] std::vector<core::Assumption> assumptions_of(const Commissioning& result);

/// Fills in Commissioning::assumptions by assumptions_of(), and the warrants by apply_verdicts().
void settle_warrants(Commissioning& result);

/// Takes the verdicts of Commissioning::assumptions into the model, and into the warrant of every number: that of the
/// noise it stands on; extrapolated where an assumption fails. Where only that of driving to come fails, intervals of
/// parameters stay what they are.
void apply_verdicts(Commissioning& result);

/// Errors that do not average out as declared (`detail`: what showed it) may as well be friction of another shape,
/// parameters that change, or another geometry: all of these fail, and apply_verdicts().
void withdraw_what_averages_would_hide(Commissioning& result, const std::string& detail);

/// Of the parameters' intervals; that of the model, which thresholds share, where there are none.
[[nodiscard]] core::Warrant interval_warrant(const Commissioning& result);

}  // namespace wheelwright::commission
