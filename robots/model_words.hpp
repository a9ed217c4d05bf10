// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words of enumerations in model.json.
#pragma once

#include <wheelwright/core/warrant.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>

namespace wheelwright::robots {

inline constexpr files::Words<core::Warrant, 3> kWarrantWords{
    {{core::Warrant::guaranteed, core::warrant_word(core::Warrant::guaranteed)},
     {core::Warrant::extrapolated, core::warrant_word(core::Warrant::extrapolated)},
     {core::Warrant::statistical, core::warrant_word(core::Warrant::statistical)}}};
inline constexpr files::Words<core::AssumptionVerdict, 3> kVerdictWords{
    {{core::AssumptionVerdict::holds, "holds"},
     {core::AssumptionVerdict::not_tested, "not_tested"},
     {core::AssumptionVerdict::fails, "fails"}}};
inline constexpr files::Words<core::NoiseOrigin, 2> kNoiseOriginWords{
    {{core::NoiseOrigin::declared, "declared"}, {core::NoiseOrigin::estimated, "estimated"}}};
inline constexpr files::Words<filter::NoiseMode, 2> kNoiseModeWords{
    {{filter::NoiseMode::worst_case, "worst_case"}, {filter::NoiseMode::statistical, "statistical"}}};
inline constexpr files::Words<MotionKind, 3> kMotionWords{
    {{MotionKind::angle, "angle"}, {MotionKind::mean_speed, "mean_speed"}, {MotionKind::speed, "speed"}}};
inline constexpr files::Words<Hold, 2> kHoldWords{
    {{Hold::zero_order, "zero_order"}, {Hold::first_order, "first_order"}}};

}  // namespace wheelwright::robots
