// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/margins.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/for_all.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/detector/lasting.hpp>

namespace wheelwright {
namespace {

// The instants at which faults set in: settled ones, evenly in time, that leave room for a window.
std::vector<std::size_t> choose_onsets(const ReferenceMotion& motion, const MarginOptions& options) {
  std::vector<std::size_t> onsets;
  const auto settled = static_cast<double>(std::count(motion.settled.begin(), motion.settled.end(), true));
  if (settled == 0.0) {
    return onsets;
  }
  const double step =
      std::max(options.onset_step, settled * median_step(motion.t) / static_cast<double>(options.most_onsets));
  double next = -kInfinity;
  for (std::size_t k = 0; k < motion.instants(); ++k) {
    const bool begins = std::binary_search(motion.segment_starts.begin(), motion.segment_starts.end(), k);
    next = begins ? -kInfinity : next;
    const auto after = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), k);
    const std::size_t last = (after == motion.segment_starts.end() ? motion.instants() : *after) - 1;
    const bool room = k + 2 <= last && motion.t[last] - motion.instant[k] > options.windows.front();
    if (motion.settled[k] && room && motion.t[k] >= next) {
      onsets.push_back(k);
      next = motion.t[k] + step;
    }
  }
  return onsets;
}

// What the robot does when a fault sets in at each of `onsets`: the same for every fault.
std::vector<ManoeuvreKind> kinds_of(const ReferenceMotion& motion, const std::vector<std::size_t>& onsets,
                                    const MarginOptions& options) {
  const double length = std::min(options.kind_window, options.windows.back());
  std::vector<ManoeuvreKind> kinds;
  for (const std::size_t onset : onsets) {
    const auto after = std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), onset);
    const std::size_t end = after == motion.segment_starts.end() ? motion.instants() : *after;
    std::size_t last = onset + 1;
    while (last + 1 < end && motion.t[last + 1] - motion.instant[onset] <= length) {
      ++last;
    }
    kinds.push_back(kind_of(motion, onset, last + 1));
  }
  return kinds;
}

// The smallest certain size of one channel since the onset, under a rule "k of the last n".
class ChannelBest {
 public:
  ChannelBest(Persistence persistence, double largest, bool whole)
      : persistence_(persistence), lasting_(persistence), largest_(largest), whole_(whole) {}

  [[nodiscard]] double best() const { return best_; }

  void add(FaultMargin& margin, const FaultRow& row, double side, std::size_t channel) {
    if (whole_ && best_ < kInfinity) {
      return;
    }
    if (persistence_.n == 1) {
      // Only a row that shows a smaller size for certain is worth a search.
      const double limit = best_ < kInfinity ? best_ * (1.0 - 1e-9) : largest_;
      best_ = smallest(margin, row, limit, side, channel).value_or(best_);
      return;
    }
    best_ = std::min(best_, lasting_.add(smallest(margin, row, largest_, side, channel).value_or(kInfinity)));
  }

 private:
  [[nodiscard]] std::optional<double> smallest(FaultMargin& margin, const FaultRow& row, double limit, double side,
                                               std::size_t channel) const {
    if (!whole_) {
      return margin.smallest_certain(row, limit, side, channel);
    }
    return margin.certain(row, largest_, side, channel) ? std::optional(largest_) : std::nullopt;
  }

  Persistence persistence_;
  Lasting lasting_;
  double largest_;
  bool whole_;
  double best_ = kInfinity;
};

OnsetMargin margin_at(const ReferenceMotion& motion, const FaultMargins& margins, std::size_t onset, FaultRows& rows,
                      FaultMargin& margin, const MarginOptions& options) {
  const FaultType& fault = margins.fault;
  const std::size_t n = rows.outputs();
  const double largest = std::abs(fault.kappa(margins.side * margins.largest()));
  OnsetMargin result;
  result.instant = onset;
  result.t = motion.instant[onset];
  result.by_channel.resize(n);
  std::vector<ChannelBest> channels(n, ChannelBest(options.persistence, largest, fault.whole));
  double hidden = largest, window_hidden = largest;
  std::size_t window = 0;
  const auto size_of = [&](double kappa) {
    return kappa < kInfinity ? std::abs(fault.magnitude(margins.side * kappa)) : kInfinity;
  };
  const auto close_windows = [&](double since) {
    for (; window < options.windows.size() && since > options.windows[window]; ++window) {
      double best = kInfinity;
      for (std::size_t i = 0; i < n; ++i) {
        result.by_channel[i].push_back(size_of(channels[i].best()));
        best = std::min(best, result.by_channel[i].back());
      }
      result.certain.push_back(best);
      window_hidden = hidden;
    }
  };
  const bool exact = rows.exact();
  rows.begin(onset);
  while (window < options.windows.size() && rows.next()) {
    const std::size_t k = rows.instant();
    const double since = motion.t[k] - result.t;
    close_windows(since);
    if (window == options.windows.size()) {
      break;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const FaultRow row = rows.row(i);
      if (!exact) {
        hidden = 0.0;
        continue;
      }
      channels[i].add(margin, row, margins.side, i);
      if (!fault.whole) {
        hidden = margin.largest_hidden(row, hidden, margins.side, options.noise_share, i);
      } else if (hidden > 0.0 && margin.possible(row, largest, margins.side, options.noise_share, i)) {
        hidden = 0.0;
      }
    }
  }
  result.hidden = size_of(window_hidden);
  return result;
}

}  // namespace

MarginSummary summarise(const FaultMargins& margins, std::size_t window, std::optional<ManoeuvreKind> kind,
                        std::optional<std::size_t> channel) {
  std::vector<double> sizes;
  for (const OnsetMargin& onset : margins.onsets) {
    if (onset.certain.size() > window && (!kind || onset.kind == *kind)) {
      sizes.push_back(channel ? onset.by_channel.at(*channel)[window] : onset.certain[window]);
    }
  }
  MarginSummary summary;
  summary.onsets = sizes.size();
  summary.best = summary.most = summary.median = summary.worst = kInfinity;
  if (!sizes.empty()) {
    std::sort(sizes.begin(), sizes.end());
    summary.certain =
        static_cast<std::size_t>(std::count_if(sizes.begin(), sizes.end(), [](double x) { return x < kInfinity; }));
    summary.best = sizes.front();
    summary.most = summary.certain > 0 ? sizes[summary.certain - 1] : kInfinity;
    summary.median = sizes[sizes.size() / 2];
    summary.worst = sizes.back();
  }
  return summary;
}

std::vector<FaultMargins> margins_along(const ReferenceMotion& motion, const std::vector<FaultType>& faults,
                                        const ThresholdRule& rule, const FaultRowsFactory& rows,
                                        const MarginOptions& options) {
  check::that(!options.windows.empty() && options.windows.front() > 0.0 &&
                  std::is_sorted(options.windows.begin(), options.windows.end()),
              "windows", "positive lengths in ascending order");
  check::positive(options.onset_step, "onset step");
  check::that(options.noise_share >= 0.0 && options.noise_share <= 1.0, "noise share", "a number from 0 to 1");
  const std::vector<std::size_t> onsets = choose_onsets(motion, options);
  check::that(!onsets.empty(), "drive", "a stretch in which the filter has settled and that is longer than a window");
  const std::vector<ManoeuvreKind> kinds = kinds_of(motion, onsets, options);
  std::vector<FaultMargins> all;
  for (const FaultType& fault : faults) {
    for (const double side : {1.0, -1.0}) {
      if ((side > 0.0 ? fault.range.upper : -fault.range.lower) > 0.0) {
        all.push_back({fault, side, std::vector<OnsetMargin>(onsets.size())});
      }
    }
  }
  for_all(
      all.size(), options.threads,
      [&](std::size_t i) {
        FaultMargins& each = all[i];
        const std::unique_ptr<FaultRows> source = rows(each.fault);
        FaultMargin margin(rule);
        for (std::size_t k = 0; k < onsets.size(); ++k) {
          each.onsets[k] = margin_at(motion, each, onsets[k], *source, margin, options);
          each.onsets[k].kind = kinds[k];
        }
      },
      [&](std::size_t begun) {
        if (options.progress) {
          options.progress("margins of faults", static_cast<double>(begun) / static_cast<double>(all.size()));
        }
      });
  return all;
}

}  // namespace wheelwright
