// SPDX-License-Identifier: Apache-2.0
/// \file
/// How likely what a diagnosis says is, by what became of others like it.
#pragma once

#include "gap/diagnosis.hpp"

namespace wheelwright::gap {

/// What became of diagnoses like this one: with its verdict, and one or several causes named first. The counts are
/// those of `tests/campaigns/calibrate_gap.py` (docs/methods/gap.md has the worlds, and the same table judged on
/// others).
[[nodiscard]] TrackRecord track_record(const Diagnosis& diagnosis);

/// Gives `diagnosis` its record, and its causes and credible sets their probabilities: of the first set, of the others
/// together in equal shares, and of none of these, as the record has them, by the mean of Jeffreys' posterior (half a
/// log more for each outcome).
void rate(Diagnosis& diagnosis);

}  // namespace wheelwright::gap
