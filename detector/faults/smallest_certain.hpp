// SPDX-License-Identifier: Apache-2.0
/// \file
/// The smallest certain sizes of one fault among the looks at sums after its onsets.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/limits.hpp"
#include "detector/faults/fault_margin.hpp"
#include "detector/faults/margins.hpp"
#include "detector/multiscale/sum_margins.hpp"
#include "detector/multiscale/sum_response.hpp"

namespace wheelwright::detector {

/// `faults`, both sides where their range has two, a fault's sides one after the other, with room for `onsets`.
[[nodiscard]] std::vector<FaultMargins> sides_of(std::span<const FaultType> faults, std::size_t onsets);

/// How many of `windows` (ascending) are no longer than `room`.
[[nodiscard]] std::size_t windows_within(const std::vector<double>& windows, double room);

/// What one look shows of a fault of size κ, about.
struct SumSighting {
  double since = 0.0;       ///< s, from the onset to the look
  double once = 0.0;        ///< what κ moves the look's value by, at the estimate, per κ ...
  double twice = 0.0;       ///< ... and per κ²
  double gap = 0.0;         ///< that it has to move by: the set's width and twice the radius
  std::size_t channel = 0;  ///< of the sum, for ThresholdRule
};

/// Of each onset and window the look that promises most is kept and solved exactly.
class SmallestCertain {
 public:
  /// `sides` are the fault's; they, and `windows` (s, ascending), are kept by reference.
  SmallestCertain(std::span<FaultMargins> sides, const std::vector<double>& windows);

  /// A look after onset number `onset`; `row` is asked for where it promises more than those before.
  void offer(std::size_t onset, const SumSighting& sighting, const std::function<SumRow()>& row);
  /// Writes OnsetMargin::certain of every side and onset, `fit` (per onset) of which windows fit.
  void solve(FaultMargin& margin, std::span<const std::size_t> fit);

 private:
  struct Candidate {
    double size = core::kInfinity;  // about: for the estimate, errors of reading left out
    std::size_t channel = 0;
    SumRow row;
  };

  [[nodiscard]] Candidate& best(std::size_t onset, std::size_t side, std::size_t window) {
    return best_[(onset * sides_.size() + side) * windows_.size() + window];
  }

  std::span<FaultMargins> sides_;
  const std::vector<double>& windows_;
  std::vector<Candidate> best_;
};

/// Solves all of `margins` (sides_of(faults)) over the set of `rule`, fault by fault: `look` offers what number `fault`
/// shows, `fit` says per onset how many of SumMarginOptions::windows fit. `stage` is for its progress.
void solve_smallest_certain(std::vector<FaultMargins>& margins, std::span<const FaultType> faults,
                            const ThresholdRule& rule, const SumMarginOptions& options, std::string_view stage,
                            std::span<const std::size_t> fit,
                            const std::function<void(std::size_t fault, SmallestCertain&)>& look);

}  // namespace wheelwright::detector
