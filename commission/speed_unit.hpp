// SPDX-License-Identifier: Apache-2.0
/// \file
/// Unit of speeds that a driver rounds or cuts off.
#pragma once

#include <vector>

namespace wheelwright::commission {

/// Of the top speed: speeds in whole multiples of a finer unit are as good as exact.
inline constexpr double kCoarseUnit = 0.002;

/// The unit (in that of `speeds`) of which all of `speeds` are whole multiples, to a tenth of it, from the smallest
/// upwards; 0 where there is none, where values are too many to be coarse, or rows too few (200 that are not 0).
/// `top`: a top speed, by a millionth of which values differ at least.
[[nodiscard]] double unit_of_speeds(const std::vector<double>& speeds, double top);

}  // namespace wheelwright::commission
