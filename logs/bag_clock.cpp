// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_clock.hpp>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <utility>

#include <fmt/format.h>

namespace wheelwright {
namespace {

constexpr std::int64_t second = 1'000'000'000;

std::int64_t quantile_of(std::vector<std::int64_t> values, double share) {
  if (values.empty()) {
    return 0;
  }
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// Median of stamp − time of recording, ns.
std::int64_t offset_of(const TopicTimes& times) {
  std::vector<std::int64_t> offsets;
  for (std::size_t k = 0; k < times.stamps.size(); ++k) {
    offsets.push_back(times.stamps[k].value_or(0) - times.log_times[k]);
  }
  return quantile_of(std::move(offsets), 0.5);
}

double in_seconds(std::int64_t ns) { return static_cast<double>(ns) / static_cast<double>(second); }

}  // namespace

BagClocks bag_clocks(const std::vector<TopicTimes>& topics) {
  BagClocks result;
  std::int64_t first_offset = 0;
  for (const TopicTimes& times : topics) {
    TopicClock clock;
    std::vector<std::optional<std::int64_t>> stamps = times.stamps;
    clock.zero_is_time = stamps.size() > 1 && !stamps[0] && stamps[1] && *stamps[1] < 60 * second;
    if (clock.zero_is_time) {
      stamps[0] = 0;
    }
    clock.stamped = !stamps.empty() && std::ranges::all_of(stamps, [](const auto& stamp) { return stamp.has_value(); });
    std::vector<std::int64_t> steps;
    for (std::size_t k = 1; k < times.log_times.size(); ++k) {
      const std::int64_t step =
          clock.stamped ? *stamps[k] - *stamps[k - 1] : times.log_times[k] - times.log_times[k - 1];
      if (step > 0) {
        steps.push_back(step);
      }
    }
    clock.median_step = quantile_of(steps, 0.5);
    if (!clock.stamped) {
      for (std::int64_t& step : steps) {
        step = std::abs(step - clock.median_step);
      }
      clock.jitter = quantile_of(std::move(steps), 0.99);
      result.notes.push_back(fmt::format(
          "{}: its messages have no time stamp of their own, so the time of recording is used; it jitters by "
          "{:.3g} s, which the noise bounds should allow for",
          times.topic, in_seconds(clock.jitter)));
    }
    const std::int64_t offset = clock.stamped ? offset_of(times) : 0;
    if (result.clocks.empty()) {
      first_offset = offset;
    } else if (!clock.stamped) {
      clock.shift = first_offset;
    } else if (std::abs(offset - first_offset) > second) {
      clock.shift = first_offset - offset;
      result.notes.push_back(fmt::format(
          "{}: its time stamps are of another clock than those of {} ({:.6g} s apart); they were shifted so that both "
          "lie alike to the times of recording, which is as good as the transport is even",
          times.topic, topics.front().topic, in_seconds(offset - first_offset)));
    }
    result.clocks.push_back(clock);
  }
  return result;
}

}  // namespace wheelwright
