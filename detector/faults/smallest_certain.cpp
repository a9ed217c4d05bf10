// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/smallest_certain.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/check.hpp"
#include "core/for_all.hpp"
#include "detector/faults/fault_margin.hpp"

namespace wheelwright::detector {
namespace {

using core::kInfinity;

// The smallest size > 0 at which |once κ + twice κ²| reaches `gap`, about.
double about(double once, double twice, double gap) {
  const double sign = once < 0.0 ? -1.0 : 1.0, root = once * once + 4.0 * sign * twice * gap;
  return root >= 0.0 && (once != 0.0 || root > 0.0) ? 2.0 * gap / (std::abs(once) + std::sqrt(root)) : kInfinity;
}

bool has_side(const FaultType& fault, double side) {
  return (side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0;
}

// The parts of `all` (sides_of(faults)) that are each fault's.
std::vector<std::span<FaultMargins>> by_fault(std::vector<FaultMargins>& all, std::span<const FaultType> faults) {
  std::vector<std::span<FaultMargins>> parts;
  std::size_t first = 0;
  for (const FaultType& fault : faults) {
    const std::size_t count = (has_side(fault, 1.0) ? 1 : 0) + (has_side(fault, -1.0) ? 1 : 0);
    parts.emplace_back(all.data() + first, count);
    first += count;
  }
  return parts;
}

}  // namespace

std::vector<FaultMargins> sides_of(std::span<const FaultType> faults, std::size_t onsets) {
  std::vector<FaultMargins> all;
  for (const FaultType& fault : faults) {
    for (const double side : {1.0, -1.0}) {
      if (has_side(fault, side)) {
        all.push_back({fault, side, std::vector<OnsetMargin>(onsets)});
      }
    }
  }
  return all;
}

std::size_t windows_within(const std::vector<double>& windows, double room) {
  return static_cast<std::size_t>(std::ranges::upper_bound(windows, room) - windows.begin());
}

SmallestCertain::SmallestCertain(std::span<FaultMargins> sides, const std::vector<double>& windows)
    : sides_(sides),
      windows_(windows),
      best_(sides.empty() ? 0 : sides.front().onsets.size() * sides.size() * windows.size()) {}

void SmallestCertain::offer(std::size_t onset, const SumSighting& sighting, const std::function<SumRow()>& row) {
  const auto window = static_cast<std::size_t>(std::ranges::lower_bound(windows_, sighting.since) - windows_.begin());
  if (window == windows_.size()) {
    return;
  }
  std::optional<SumRow> asked;
  for (std::size_t s = 0; s < sides_.size(); ++s) {
    Candidate& own = best(onset, s, window);
    if (own.size < kInfinity &&
        (std::abs(sighting.once) + std::abs(sighting.twice) * own.size) * own.size < sighting.gap) {
      continue;  // about() would be larger
    }
    const double size = about(sides_[s].side * sighting.once, sighting.twice, sighting.gap);
    if (size < own.size) {
      asked = asked ? asked : std::optional(row());
      own = {size, sighting.channel, *asked};
    }
  }
}

void SmallestCertain::solve(FaultMargin& margin, std::span<const std::size_t> fit) {
  for (std::size_t s = 0; s < sides_.size(); ++s) {
    FaultMargins& margins = sides_[s];
    const FaultType& fault = margins.fault;
    const double largest = std::abs(fault.kappa(margins.side * margins.largest()));
    for (std::size_t k = 0; k < margins.onsets.size(); ++k) {
      double smallest = kInfinity;
      for (std::size_t w = 0; w < fit[k]; ++w) {
        const Candidate& own = best(k, s, w);
        const double limit = std::min(smallest * (1.0 - 1e-9), largest);
        if (own.size < limit && fault.whole) {
          smallest = margin.certain(own.row.row(), largest, margins.side, own.channel) ? largest : smallest;
        } else if (own.size < limit) {
          smallest = margin.smallest_certain(own.row.row(), limit, margins.side, own.channel).value_or(smallest);
        }
        margins.onsets[k].certain.push_back(smallest < kInfinity ? std::abs(fault.magnitude(margins.side * smallest))
                                                                 : kInfinity);
      }
    }
  }
}

void solve_smallest_certain(std::vector<FaultMargins>& margins, std::span<const FaultType> faults,
                            const ThresholdRule& rule, const SumMarginOptions& options, std::string_view stage,
                            std::span<const std::size_t> fit,
                            const std::function<void(std::size_t fault, SmallestCertain&)>& look) {
  check::that(!options.windows.empty() && options.windows.front() > 0.0 && std::ranges::is_sorted(options.windows),
              "windows", "positive lengths in ascending order");
  const std::vector<std::span<FaultMargins>> sides = by_fault(margins, faults);
  core::for_all(
      faults.size(), options.threads,
      [&](std::size_t f) {
        SmallestCertain smallest(sides[f], options.windows);
        look(f, smallest);
        FaultMargin margin(rule);
        smallest.solve(margin, fit);
      },
      [&](std::size_t begun) {
        if (options.progress) {
          options.progress(stage, static_cast<double>(begun) / static_cast<double>(faults.size()));
        }
      });
}

}  // namespace wheelwright::detector
