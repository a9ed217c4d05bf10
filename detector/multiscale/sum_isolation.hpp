// SPDX-License-Identifier: Apache-2.0
/// \file
/// Fault isolation by sums over all scales, at the stated risk.
#pragma once

#include <cstddef>

#include "detector/faults/isolation.hpp"

namespace wheelwright::detector {

struct OnlineModel;
struct SumDrive;

/// Options of narrow_by_sums().
struct SumIsolationOptions {
  double after = 5.0;        ///< s after the alarm, in which sums are looked at
  std::size_t looks = 5;     ///< at each sum, evenly in time
  double onset_step = 0.05;  ///< s: onsets between two that are tried are taken to lie between, or as far outside
  double resolution = 0.02;  ///< ends of sizes' intervals are sought to this, relative
  std::size_t threads = 1;   ///< the result does not depend on it
};

/// Adds to what is consistent in `isolation` what sums leave of it (FaultFinding::at_risk): a step of size κ that set
/// in within its interval of onsets explains a look at a sum where, for some θ of the set at the stated risk,
///
///     |Σ w torque − (y + κ g1 + κ² g2) θ − κ c| <= radius + κ (doubt + …)
///
/// (sum_response.hpp). Sizes and onsets that leave a look without such a θ are excluded; a fault of which nothing is
/// left is. Each look may have a θ of its own, so that more may be left than the data allow, never less. **A true
/// step is excluded with no more probability than the looks' own:** ScaleDetectorOptions::false_alarms for all looks
/// at all sums in a second, and RiskModel::risk for the set. What a sum does for an onset between two that are tried is
/// bounded by twice their difference: argued, and held in every run, but not proved. Faults whose onset may lie before
/// the window, bumps, and readings that stand still are not asked.
///
/// `drive` is of the log itself (SumDriveOptions::any_log false), or that piece of it which `motion` is of.
void narrow_by_sums(Isolation& isolation, const SumDrive& drive, const OnlineModel& model,
                    const ReferenceMotion& motion, double alarm, const SumIsolationOptions& options = {});

}  // namespace wheelwright::detector
