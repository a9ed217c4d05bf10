// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detectability along a drive at a stated risk: the smallest faults that the detector over scales is certain to see.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "detector/faults/margins.hpp"

namespace wheelwright::detector {

struct OnlineModel;
struct SumDrive;

/// Options of margins_at_risk().
struct SumMarginOptions {
  std::vector<double> windows = {0.05, 0.1, 0.2, 0.3, 0.5, 0.7,  1.0,
                                 1.5,  2.0, 3.0, 5.0, 7.0, 10.0, 20.0};  ///< s, ascending
  std::size_t threads = 1;                                               ///< the result does not depend on it
  std::function<void(std::string_view stage, double share)> progress{};
};

/// Margins of `faults`, both sides where their range has two, for a fault that sets in at each of `onsets` (instants of
/// `motion`, ascending): OnsetMargin::certain is the smallest magnitude from which on every size moves some sum out of
/// what a healthy robot's can be within the window, whatever θ in the set at the stated risk and whatever the errors:
/// certain, but for SumDrive::miss. Of each window the look that promises most is solved exactly (FaultMargin), so that
/// another look might allow for a slightly smaller size. OnsetMargin::hidden and by_channel are left empty. A fault
/// whose rows are no polynomials of its size has no certain size.
[[nodiscard]] std::vector<FaultMargins> margins_at_risk(const SumDrive& drive, const OnlineModel& model,
                                                        const ReferenceMotion& motion,
                                                        std::span<const FaultType> faults,
                                                        std::span<const std::size_t> onsets,
                                                        const SumMarginOptions& options = {});

}  // namespace wheelwright::detector
