// SPDX-License-Identifier: Apache-2.0
/// \file
/// The clocks of a bag's topics: which time a message has, and how the clocks lie to each other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace wheelwright {

/// What the first messages of a topic tell of its clock.
struct TopicTimes {
  std::string topic;
  std::vector<std::int64_t> log_times;              ///< ns, when each was recorded
  std::vector<std::optional<std::int64_t>> stamps;  ///< ns, of its header; nothing where it has none
};

/// The time of a topic's messages: its stamp or the time it was recorded, plus `shift`.
struct TopicClock {
  bool stamped = false;          ///< whether the header's stamp is used: where every message has one
  bool zero_is_time = false;     ///< whether a stamp of zero is one (of a clock that begins there), not a missing one
  std::int64_t shift = 0;        ///< ns, to the clock of the first topic
  std::int64_t median_step = 0;  ///< ns
  std::int64_t jitter = 0;       ///< ns; of a time of recording: 99 % of its steps are as close to the median step
};

/// The clocks of `topics`, of which the first gives the rows their times, and what was decided, in words:
/// - the header's stamp goes before the time of recording; zero counts as a stamp in the first message of a topic whose
///   second stamp is within a minute of it;
/// - stamps of a topic that lie, in the median and against their times of recording, within 1 s of those of the first
///   topic are taken as the same clock; others are shifted by the difference of these medians;
/// - a topic without stamps has its times of recording, shifted by that median of the first topic where it has stamps.
struct BagClocks {
  std::vector<TopicClock> clocks;
  std::vector<std::string> notes;
};
[[nodiscard]] BagClocks bag_clocks(const std::vector<TopicTimes>& topics);

}  // namespace wheelwright
