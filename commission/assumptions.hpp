// SPDX-License-Identifier: Apache-2.0
/// \file
/// The assumptions that a commissioned model stands on, and what its log says of each (docs/assumptions.md).
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/core/warrant.hpp>

namespace wheelwright {

struct Commissioning;

/// What a log says of an assumption.
enum class AssumptionVerdict {
  holds,       ///< the test found nothing against it
  not_tested,  ///< no test, or the log does not decide: it is taken as given
  fails,       ///< the log contradicts it: nothing is called guaranteed
};

/// "holds", "not tested" or "fails".
[[nodiscard]] std::string_view verdict_word(AssumptionVerdict verdict);

/// Something that is taken as given.
struct Assumption {
  std::string id{};           ///< as in docs/assumptions.md, e.g. "effort_hold"
  std::string statement{};    ///< what is taken as given of this robot, one sentence
  std::string declared_by{};  ///< key of the robot file; empty where there is none
  std::string test{};         ///< how the log is tested for it; empty where it is not
  AssumptionVerdict verdict = AssumptionVerdict::not_tested;
  std::string detail{};  ///< what the test found, in numbers; may be empty

  friend bool operator==(const Assumption&, const Assumption&) = default;
};

/// The assumptions that `result` stands on with the verdicts of its log, those of the rows first. The one place where a
/// test sets a verdict.
[[nodiscard]] std::vector<Assumption> assumptions_of(const Commissioning& result);

/// Fills in Commissioning::assumptions (and those of its model), and the warrant of every number: that of the noise it
/// stands on; extrapolated where an assumption fails. Where only that of driving to come fails, intervals of parameters
/// stay what they are.
void settle_warrants(Commissioning& result);

/// Of the parameters' intervals; that of the model, which thresholds share, where there are none.
[[nodiscard]] Warrant interval_warrant(const Commissioning& result);

}  // namespace wheelwright
