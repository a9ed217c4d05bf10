// SPDX-License-Identifier: Apache-2.0
/// \file
/// Isolation of the faults behind the events of a detection.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "core/log.hpp"
#include "detector/events.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/learnt_model.hpp"
#include "detector/multiscale/sum_isolation.hpp"

namespace wheelwright::commission {

/// Options of isolate_events().
struct EventIsolationOptions {
  detector::IsolationOptions isolation{};
  detector::SumIsolationOptions sums{};  ///< where the model says something at a stated risk
  std::size_t most_events = 8;           ///< the first ones; the others are left alone
  std::vector<std::string> only{};       ///< faults that are asked about, by their names; empty: all
};

/// How long before the window of an isolation rows have to begin, s.
[[nodiscard]] double isolation_memory(const OnlineModel& model);

/// Isolates `events` of either residual, which came of walking `log` with `model`, against the catalogue of its robot,
/// by both residuals where the log has the columns of both: a fault must explain what each shows about the alarm, and
/// what each does not show (odometry_isolation.hpp). Walks the log once and holds the rows around these events. One
/// result for each of them. Where the model says something at a stated risk, sums over all scales are asked, too
/// (narrow_by_sums()): the log is walked once more for each event of which a fault that is left has an onset.
[[nodiscard]] std::vector<detector::Isolation> isolate_events(LogSource& log, const OnlineModel& model,
                                                              std::span<const detector::Event> events,
                                                              const EventIsolationOptions& options = {});

/// The same of the first EventIsolationOptions::most_events of `detection`.
[[nodiscard]] std::vector<detector::Isolation> isolate_events(LogSource& log, const OnlineModel& model,
                                                              const Detection& detection,
                                                              const EventIsolationOptions& options = {});

/// A size in words, outward to three digits of the larger end: " by 3.1 to 5.2 %".
[[nodiscard]] std::string size_words(const Interval& magnitude, const FaultType& fault);

/// A finding that is consistent, for people: "the right wheel's radius changes by 3.1 to 5.2 %, since 12.40 to
/// 12.62 s, if it was a step that stays". That condition is said of every fault whose size may grow.
[[nodiscard]] std::string sentence(const detector::FaultFinding& finding);

/// All findings in a sentence: "consistent with: …; …. Excluded: …. Not examined: …", or that nothing in the catalogue
/// explains the data.
[[nodiscard]] std::string sentence(const detector::Isolation& isolation);

/// For people, of a fault whose size is known to be something: "whatever its course by 8.1 to 9.9 % on average over the
/// 1.00 s before 31.20 s; if it only grew by 8.4 to 12.1 % at 40.00 s"; empty where nothing is known of it.
[[nodiscard]] std::string sentence(const detector::SizeOverTime& size);

}  // namespace wheelwright::commission
