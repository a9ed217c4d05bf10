// SPDX-License-Identifier: Apache-2.0
/// \file
/// Unit of speeds that a driver rounds or cuts off.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Of the top speed: speeds in whole multiples of a finer unit are as good as exact.
inline constexpr double kCoarseUnit = 0.002;

/// The unit (in that of `speeds`) of which all of `speeds` are whole multiples, to a tenth of it, from the smallest
/// upwards; 0 where there is none, where values are too many to be coarse, or rows too few (200 that are not 0).
/// `top`: a top speed, by a millionth of which values differ at least.
[[nodiscard]] double unit_of_speeds(const std::vector<double>& speeds, double top);

/// Where the speeds in `columns` of `log` are whole multiples of a unit that matters (kCoarseUnit), and neither the
/// robot file nor what was found says whether they were rounded or cut off: the latter. Reads the first 60,000 rows.
[[nodiscard]] std::optional<model::SpeedCut> open_cut(LogSource& log, const model::Robot& robot,
                                                      const std::vector<std::string>& columns);

}  // namespace wheelwright::commission
