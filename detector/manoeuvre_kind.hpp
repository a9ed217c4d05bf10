// SPDX-License-Identifier: Apache-2.0
/// \file
/// In words, what a robot does during a stretch of a drive.
#pragma once

#include <cstddef>
#include <string_view>

#include <wheelwright/detector/reference_motion.hpp>

namespace wheelwright {

/// What a robot does for a while.
enum class ManoeuvreKind {
  standstill,
  cruising,      ///< straight, or a single axis, at nearly constant speed
  accelerating,  ///< straight, or a single axis
  turning,       ///< forward and yaw motion
  spinning,      ///< on the spot
};

/// In words, e.g. "cruising straight".
[[nodiscard]] std::string_view words(ManoeuvreKind kind);

/// What kind instants [first, last) of `motion` are of, by root mean squares over them: standstill below 3 % of the
/// largest joint speed of the whole motion; of two joints, straight where their difference is below a tenth of their
/// sum, spinning where their sum is below a tenth of their difference; accelerating where the joints' acceleration times
/// the stretch's length is above half their speed.
[[nodiscard]] ManoeuvreKind kind_of(const ReferenceMotion& motion, std::size_t first, std::size_t last);

}  // namespace wheelwright
