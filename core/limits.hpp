// SPDX-License-Identifier: Apache-2.0
/// \file
/// The limits of double by short names, and the sign of a number.
#pragma once

#include <limits>

namespace wheelwright::core {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();    ///< from 1 to the next double
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();  ///< no bound, or never
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();      ///< no value
inline constexpr double kTiny = std::numeric_limits<double>::min();           ///< smallest normal double

/// −1, 0 or 1: the side of 0 on which `x` lies; 0 where it is no number.
[[nodiscard]] constexpr double sign(double x) { return static_cast<double>(x > 0.0) - static_cast<double>(x < 0.0); }

}  // namespace wheelwright::core
