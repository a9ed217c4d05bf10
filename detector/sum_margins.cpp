// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/sum_margins.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/for_all.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright::detector {
namespace {

using core::kInfinity;

// The look that promises most between two windows.
struct Candidate {
  double size = kInfinity;  // about: for the estimate, reading errors left out
  std::size_t weight = 0;
  SumRow row;
};

// The smallest size > 0 at which |once κ + twice κ²| reaches `gap`, about.
double about(double once, double twice, double gap) {
  const double sign = once < 0.0 ? -1.0 : 1.0, root = once * once + 4.0 * sign * twice * gap;
  return root >= 0.0 && (once != 0.0 || root > 0.0) ? 2.0 * gap / (std::abs(once) + std::sqrt(root)) : kInfinity;
}

// The windows that fit between `t` and the end of the segment of `instant`.
std::size_t windows_that_fit(const SumDrive& drive, const ReferenceMotion& motion, std::size_t instant,
                             const std::vector<double>& windows) {
  const auto next = std::ranges::upper_bound(motion.segment_starts, instant);
  const std::size_t end = std::min(drive.instants, next == motion.segment_starts.end() ? motion.instants() : *next);
  const double room = end > instant + 1 ? motion.t[end - 1] - motion.instant[instant] : 0.0;
  return static_cast<std::size_t>(std::ranges::upper_bound(windows, room) - windows.begin());
}

}  // namespace

std::vector<FaultMargins> margins_at_risk(const SumDrive& drive, const OnlineModel& model,
                                          const ReferenceMotion& motion, std::span<const FaultType> faults,
                                          std::span<const std::size_t> onsets, const SumMarginOptions& options) {
  check::that(!options.windows.empty() && options.windows.front() > 0.0 && std::ranges::is_sorted(options.windows),
              "windows", "positive lengths in ascending order");
  check::that(model.at_risk.has_value(), "model", "one that was learnt at a stated risk");
  std::vector<FaultMargins> all;
  std::vector<std::pair<std::size_t, std::size_t>> sides;  // of each fault: the first of `all`, and how many
  for (const FaultType& fault : faults) {
    sides.emplace_back(all.size(), 0);
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        all.push_back({fault, side, std::vector<OnsetMargin>(onsets.size())});
        ++sides.back().second;
      }
    }
  }
  const ThresholdRule rule(Polytope(model.at_risk->facets, model.at_risk->box), model.estimate);
  core::for_all(
      faults.size(), options.threads,
      [&](std::size_t f) {
        const std::size_t first = sides[f].first, count = sides[f].second;
        const std::size_t windows = options.windows.size();
        std::vector<Candidate> best(onsets.size() * count * windows);
        SumResponse response(faults[f], model, motion, drive);
        response.walk(onsets, options.windows.back(), [&](const SumResponse::At& at) {
          const SumLook& look = drive.looks[at.look];
          const double since = look.t - motion.instant[onsets[at.onset]];
          const auto window =
              static_cast<std::size_t>(std::ranges::lower_bound(options.windows, since) - options.windows.begin());
          if (window == windows) {
            return;
          }
          std::optional<SumRow> row;
          for (std::size_t s = 0; s < count; ++s) {
            const double gap = look.width + 2.0 * look.radius;
            Candidate& own = best[(at.onset * count + s) * windows + window];
            if (own.size < kInfinity && (std::abs(at.once) + std::abs(at.twice) * own.size) * own.size < gap) {
              continue;  // about() would be larger
            }
            const double size = about(all[first + s].side * at.once, at.twice, gap);
            if (size < own.size) {
              row = row ? row : std::optional(at.row());
              own = {size, look.weight, *row};
            }
          }
        });
        FaultMargin margin(rule);
        for (std::size_t s = 0; s < count; ++s) {
          FaultMargins& margins = all[first + s];
          const FaultType& fault = margins.fault;
          const double largest = std::abs(fault.kappa(margins.side * margins.largest()));
          for (std::size_t k = 0; k < onsets.size(); ++k) {
            OnsetMargin& onset = margins.onsets[k];
            onset.instant = onsets[k];
            onset.t = motion.instant[onsets[k]];
            double smallest = kInfinity;
            const std::size_t fit = windows_that_fit(drive, motion, onsets[k], options.windows);
            for (std::size_t w = 0; w < fit; ++w) {
              const Candidate& own = best[(k * count + s) * windows + w];
              const double limit = std::min(smallest * (1.0 - 1e-9), largest);
              if (own.size < limit && fault.whole) {
                smallest = margin.certain(own.row.row(), largest, margins.side, own.weight) ? largest : smallest;
              } else if (own.size < limit) {
                smallest = margin.smallest_certain(own.row.row(), limit, margins.side, own.weight).value_or(smallest);
              }
              onset.certain.push_back(smallest < kInfinity ? std::abs(fault.magnitude(margins.side * smallest))
                                                           : kInfinity);
            }
          }
        }
      },
      [&](std::size_t begun) {
        if (options.progress) {
          options.progress("margins at the stated risk",
                           static_cast<double>(begun) / static_cast<double>(faults.size()));
        }
      });
  return all;
}

}  // namespace wheelwright::detector
