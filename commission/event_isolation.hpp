// SPDX-License-Identifier: Apache-2.0
/// \file
/// The events of a log, each with the faults that its data leave possible.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/trace.hpp>
#include <wheelwright/detector/isolation.hpp>

namespace wheelwright {

/// Options of isolate_events().
struct EventIsolationOptions {
  IsolationOptions isolation{};
  std::size_t most_events = 8;  ///< the first ones; the others are left alone
};

/// Isolates the first events of `detection`, which came of walking `log` with the torque residual of `model`, against the
/// catalogue of its robot. Walks the log once and holds the rows around these events. One result for each of them.
[[nodiscard]] std::vector<Isolation> isolate_events(LogSource& log, const CommissionedModel& model,
                                                    const Detection& detection,
                                                    const EventIsolationOptions& options = {});

/// A finding that is consistent, for people: "the right wheel's radius changes by the share 3.1 to 5.2 % since 12.4 to
/// 12.6 s".
[[nodiscard]] std::string sentence(const FaultFinding& finding);

/// All findings in a sentence: "consistent with: …; …. Excluded: …. Not examined: …", or that nothing in the catalogue
/// explains the data.
[[nodiscard]] std::string sentence(const Isolation& isolation);

}  // namespace wheelwright
