// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words of enumerations in model.json.
#pragma once

#include <wheelwright/core/warrant.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>

namespace wheelwright {

inline constexpr Words<Warrant, 3> kWarrantWords{{{Warrant::guaranteed, warrant_word(Warrant::guaranteed)},
                                                  {Warrant::extrapolated, warrant_word(Warrant::extrapolated)},
                                                  {Warrant::statistical, warrant_word(Warrant::statistical)}}};
inline constexpr Words<AssumptionVerdict, 3> kVerdictWords{{{AssumptionVerdict::holds, "holds"},
                                                            {AssumptionVerdict::not_tested, "not_tested"},
                                                            {AssumptionVerdict::fails, "fails"}}};
inline constexpr Words<NoiseOrigin, 2> kNoiseOriginWords{
    {{NoiseOrigin::declared, "declared"}, {NoiseOrigin::estimated, "estimated"}}};
inline constexpr Words<NoiseMode, 2> kNoiseModeWords{
    {{NoiseMode::worst_case, "worst_case"}, {NoiseMode::statistical, "statistical"}}};
inline constexpr Words<MotionKind, 3> kMotionWords{
    {{MotionKind::angle, "angle"}, {MotionKind::mean_speed, "mean_speed"}, {MotionKind::speed, "speed"}}};
inline constexpr Words<Hold, 2> kHoldWords{{{Hold::zero_order, "zero_order"}, {Hold::first_order, "first_order"}}};

}  // namespace wheelwright
