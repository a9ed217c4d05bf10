// SPDX-License-Identifier: Apache-2.0
/// \file
/// The result of a detection in plain sentences.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/words/time_axis.hpp>

namespace wheelwright::words {

/// One short sentence; `kinematic_events` are those of the kinematic residual. Text, not HTML.
[[nodiscard]] std::string detect_verdict(const Detection& detection, std::size_t kinematic_events);

/// The residuals that were checked; where there are events: the first and the clearest one, how much of the driving
/// contradicts the fault-free model, what this means, and the faults of the catalogue that remain possible for the
/// first event. Text, not HTML.
[[nodiscard]] std::vector<std::string> detect_words(const Detection& detection, const OnlineModel& model,
                                                    const std::vector<detector::Isolation>& isolations,
                                                    const TimeAxis& axis);

}  // namespace wheelwright::words
