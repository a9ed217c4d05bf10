// SPDX-License-Identifier: Apache-2.0
/// \file
/// Warrants (guaranteed, extrapolated, statistical) and the assumptions behind them: the basis of a published number.
#pragma once

#include <string>
#include <string_view>

namespace wheelwright::core {

/// Kind of promise of a bound, a threshold or a margin. Results name it per number, and these words are used in no
/// other sense.
enum class Warrant {
  /// Declared bounds of the sensors, and assumptions of which no test failed (docs/methods/assumptions.md).
  guaranteed,
  extrapolated,  ///< noise bounds learnt from a log, or an assumption that the log contradicts
  statistical,   ///< declared noise that is also independent from sample to sample, at a stated confidence
};

/// "guaranteed", "extrapolated" or "statistical".
[[nodiscard]] constexpr std::string_view warrant_word(Warrant warrant) {
  return warrant == Warrant::guaranteed    ? "guaranteed"
         : warrant == Warrant::statistical ? "statistical"
                                           : "extrapolated";
}

/// Meaning of the word, one sentence for people.
[[nodiscard]] constexpr std::string_view warrant_meaning(Warrant warrant) {
  return warrant == Warrant::guaranteed ? "Guaranteed: holds for every noise within the sensors’ declared bounds, "
                                          "while the assumptions listed hold."
         : warrant == Warrant::statistical
             ? "Statistical: holds at the stated confidence, for noise inside its declared bounds that is independent "
               "from sample to sample and of zero mean."
             : "Extrapolated: stands on noise bounds learnt from a log, or on an assumption that the log contradicts; "
               "it holds as far as noise and driving to come are like that log.";
}

/// Errors that a statistical interval of an estimate does not cover, one sentence for people.
[[nodiscard]] constexpr std::string_view statistical_remark() {
  return "± 95 % statistical: scatter only; errors that do not average out, such as a constant offset of the effort "
         "within its bound or an encoder's scale, are not in it.";
}

/// The weaker of two, for a number that rests on both: extrapolated, which has no stated confidence, before statistical
/// before guaranteed.
[[nodiscard]] constexpr Warrant weaker(Warrant a, Warrant b) {
  const auto either = [&](Warrant w) { return a == w || b == w; };
  return either(Warrant::extrapolated)  ? Warrant::extrapolated
         : either(Warrant::statistical) ? Warrant::statistical
                                        : Warrant::guaranteed;
}

/// Where the noise bound ē of an output comes from.
enum class NoiseOrigin {
  declared,   ///< the sensors' declared bounds, propagated through the filter
  estimated,  ///< extrapolated from the residuals of this log (noise_level.hpp), on top of what is declared
};

/// Verdict of a log on an assumption.
enum class AssumptionVerdict {
  holds,       ///< the test found nothing against it
  not_tested,  ///< no test, or the log does not decide: it is taken as given
  fails,       ///< the log contradicts it: nothing is called guaranteed
};

/// "holds", "not tested" or "fails".
[[nodiscard]] constexpr std::string_view verdict_word(AssumptionVerdict verdict) {
  return verdict == AssumptionVerdict::holds ? "holds" : verdict == AssumptionVerdict::fails ? "fails" : "not tested";
}

/// Something that is taken as given.
struct Assumption {
  std::string id{};           ///< as in docs/methods/assumptions.md, e.g. "effort_hold"
  std::string statement{};    ///< what is taken as given of this robot, one sentence
  std::string declared_by{};  ///< key of the robot file; empty where there is none
  std::string test{};         ///< how the log is tested for it; empty where it is not
  AssumptionVerdict verdict = AssumptionVerdict::not_tested;
  std::string detail{};  ///< what the test found, in numbers; may be empty

  friend bool operator==(const Assumption&, const Assumption&) = default;
};

}  // namespace wheelwright::core
