// SPDX-License-Identifier: Apache-2.0
/// \file
/// Comparison of the claims of the library on a case with the truth.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "tests/guarantee/scene.hpp"

namespace wheelwright::guarantee {

/// Outcome for the faults of one kind.
struct FaultTally {
  std::size_t certain = 0;   ///< tried, of a size and in a time that margins call certain
  std::size_t missed = 0;    ///< of them, without an alarm in that time
  std::size_t isolated = 0;  ///< alarms that were looked into
  std::size_t excluded = 0;  ///< of them, where the true fault, its size or its time was excluded
};

/// Outcome of a case.
struct Verdict {
  /// How commissioning ended.
  enum class End {
    guaranteed,  ///< a model that stands on the declared bounds
    intervals,   ///< a model whose intervals stand on them, and thresholds do not
    learnt,      ///< a model that stands on bounds estimated from the log: no guarantee is given
    empty,       ///< "no parameters explain the log", or it contradicts what its bounds stand on
    refused,     ///< no model, for another reason
  };
  End end = End::refused;
  std::string message;                 ///< of the library
  std::string failing;                 ///< assumptions that its tests say no to, by id, one space between
  std::string outside;                 ///< parameters whose true value is not in [lower, upper]
  bool facet_cuts = false;             ///< a facet of the set leaves the truth out
  double width = 0.0;                  ///< upper − lower of the mass (axis: inertia) over the true value
  double oracle = 0.0;                 ///< the same for exact rows with the sensors' worst case only; 0: not sought
  std::size_t rows = 0;                ///< learnt from
  std::size_t watched = 0;             ///< samples of the second drive
  std::size_t decisions = 0;           ///< of them, decided on
  std::size_t alarms = 0;              ///< decisions with a fault that is none
  std::size_t events = 0;              ///< alarms that follow a decision without
  double first_alarm = -1.0;           ///< s
  std::array<FaultTally, 3> faults{};  ///< by Breakdown::Kind
  double commission_seconds = 0.0;
  double watch_seconds = 0.0;

  [[nodiscard]] std::size_t missed() const { return faults[0].missed + faults[1].missed + faults[2].missed; }
  [[nodiscard]] std::size_t excluded() const { return faults[0].excluded + faults[1].excluded + faults[2].excluded; }
  [[nodiscard]] bool truth_outside() const { return !outside.empty() || facet_cuts; }
  /// A broken promise: the truth is cut off, a healthy robot alarms, or a log that keeps to its assumptions is called
  /// impossible. `kept`: whether the log keeps to its assumptions. Where it does not, only a guaranteed set without the
  /// truth counts: a model that does not fit its log may be called impossible, and alarms tell of the same thing.
  [[nodiscard]] bool violation(bool kept) const {
    if (end == End::intervals) {
      return truth_outside();
    }
    return end == End::guaranteed ? truth_outside() || ((alarms > 0 || missed() > 0 || excluded() > 0) && kept)
                                  : end == End::empty && kept;
  }
};

[[nodiscard]] const char* name(Verdict::End end);

struct JudgeOptions {
  bool oracle = false;  ///< also find Verdict::oracle
  bool faults = false;  ///< also drive with faults that margins call certain, and look into their alarms
};

[[nodiscard]] Verdict judge(const Case& c, const JudgeOptions& options = {});

}  // namespace wheelwright::guarantee
