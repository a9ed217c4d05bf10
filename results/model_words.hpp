// SPDX-License-Identifier: Apache-2.0
/// \file
/// The words of model.json.
#pragma once

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/files/words.hpp>

namespace wheelwright {

inline constexpr Words<Commissioning::Status, 5> kStatusWords{{{Commissioning::Status::done, "done"},
                                                               {Commissioning::Status::partial, "partial"},
                                                               {Commissioning::Status::empty, "empty"},
                                                               {Commissioning::Status::nothing, "nothing"},
                                                               {Commissioning::Status::contradicted, "contradicted"}}};
inline constexpr Words<Excitation, 3> kExcitationWords{{{Excitation::identified, "identified"},
                                                        {Excitation::indistinct, "indistinct"},
                                                        {Excitation::not_excited, "not_excited"}}};
inline constexpr Words<NoiseOrigin, 2> kNoiseOriginWords{
    {{NoiseOrigin::declared, "declared"}, {NoiseOrigin::estimated, "estimated"}}};
inline constexpr Words<NoiseMode, 2> kNoiseModeWords{
    {{NoiseMode::worst_case, "worst_case"}, {NoiseMode::statistical, "statistical"}}};
inline constexpr Words<MotionKind, 3> kMotionWords{
    {{MotionKind::angle, "angle"}, {MotionKind::mean_speed, "mean_speed"}, {MotionKind::speed, "speed"}}};
inline constexpr Words<Hold, 2> kHoldWords{{{Hold::zero_order, "zero_order"}, {Hold::first_order, "first_order"}}};
inline constexpr Words<Side, 2> kSideWords{{{Side::upper, "upper"}, {Side::lower, "lower"}}};

}  // namespace wheelwright
