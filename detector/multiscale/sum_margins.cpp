// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/sum_margins.hpp"

#include <algorithm>

#include "core/check.hpp"
#include "detector/faults/smallest_certain.hpp"

namespace wheelwright::detector {
namespace {

// The windows that fit between `t` and the end of the segment of `instant`.
std::size_t windows_that_fit(const SumDrive& drive, const ReferenceMotion& motion, std::size_t instant,
                             const std::vector<double>& windows) {
  const auto next = std::ranges::upper_bound(motion.segment_starts, instant);
  const std::size_t end = std::min(drive.instants, next == motion.segment_starts.end() ? motion.instants() : *next);
  const double room = end > instant + 1 ? motion.t[end - 1] - motion.instant[instant] : 0.0;
  return windows_within(windows, room);
}

}  // namespace

std::vector<FaultMargins> margins_at_risk(const SumDrive& drive, const OnlineModel& model,
                                          const ReferenceMotion& motion, std::span<const FaultType> faults,
                                          std::span<const std::size_t> onsets, const SumMarginOptions& options) {
  check::that(model.at_risk.has_value(), "model", "one that was learnt at a stated risk");
  std::vector<FaultMargins> all = sides_of(faults, onsets.size());
  for (FaultMargins& margins : all) {
    for (std::size_t k = 0; k < onsets.size(); ++k) {
      margins.onsets[k].instant = onsets[k];
      margins.onsets[k].t = motion.instant[onsets[k]];
    }
  }
  std::vector<std::size_t> fit;
  for (const std::size_t onset : onsets) {
    fit.push_back(windows_that_fit(drive, motion, onset, options.windows));
  }
  solve_smallest_certain(all, faults,
                         ThresholdRule(Polytope(model.at_risk->facets, model.at_risk->box), model.estimate), options,
                         "margins at the stated risk", fit, [&](std::size_t f, SmallestCertain& smallest) {
                           SumResponse response(faults[f], model, motion, drive);
                           response.walk(onsets, options.windows.back(), [&](const SumResponse::At& at) {
                             const SumLook& look = drive.looks[at.look];
                             smallest.offer(at.onset,
                                            {.since = look.t - motion.instant[onsets[at.onset]],
                                             .once = at.once,
                                             .twice = at.twice,
                                             .gap = look.width + 2.0 * look.radius,
                                             .channel = look.weight},
                                            [&] { return at.row(); });
                           });
                         });
  return all;
}

}  // namespace wheelwright::detector
