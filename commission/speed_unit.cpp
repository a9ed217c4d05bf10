// SPDX-License-Identifier: Apache-2.0
#include "commission/speed_unit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "core/statistics.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kNearUnit = 0.1;           // of the unit: as far from its multiples are decimals that are printed
constexpr double kSparse = 0.5;             // distinct values over rows, above which the column is not coarse
constexpr std::size_t kLeastRounded = 200;  // rows

}  // namespace

double unit_of_speeds(const std::vector<double>& speeds, double top) {
  std::vector<double> sizes;
  for (const double v : speeds) {
    if (v != 0.0) {
      sizes.push_back(std::abs(v));
    }
  }
  const std::size_t rows = sizes.size();
  std::ranges::sort(sizes);
  sizes.erase(std::unique(sizes.begin(), sizes.end(), [&](double a, double b) { return b - a < 1e-6 * top; }),
              sizes.end());
  if (rows < kLeastRounded || sizes.size() < 4 ||
      static_cast<double>(sizes.size()) > kSparse * static_cast<double>(rows)) {
    return 0.0;
  }
  double unit = sizes.front();
  for (std::size_t k = 1; k < sizes.size(); ++k) {
    unit = std::min(unit, sizes[k] - sizes[k - 1]);
  }
  double mn = 0.0, nn = 0.0;
  for (const double m : sizes) {
    const double n = std::round(m / unit);
    if (n < 1.0 || std::abs(m / unit - n) > kNearUnit) {
      return 0.0;
    }
    mn += m * n;
    nn += n * n;
    unit = mn / nn;
  }
  return unit;
}

std::optional<model::SpeedCut> open_cut(LogSource& log, const model::Robot& robot,
                                        const std::vector<std::string>& columns) {
  constexpr std::size_t kRows = 60000;
  constexpr double kTop = 0.99;  // quantile
  if (robot.speed_cut || robot.noise.wheel_speed.value) {
    return std::nullopt;
  }
  const std::vector<std::size_t> at = core::positions_of(log, columns);
  std::vector<std::vector<double>> of_columns(at.size());
  log.rewind();
  for (LogBlock block; of_columns.front().size() < kRows && log.next(block);) {
    for (std::size_t c = 0; c < at.size(); ++c) {
      std::ranges::copy(block.columns[at[c]], std::back_inserter(of_columns[c]));
    }
  }
  log.rewind();
  double unit = 0.0;
  for (const std::vector<double>& speeds : of_columns) {
    std::vector<double> sizes;
    std::ranges::transform(speeds, std::back_inserter(sizes), [](double speed) { return std::abs(speed); });
    const auto rank = static_cast<std::size_t>(kTop * static_cast<double>(sizes.size()));
    const double top = sizes.empty() ? 0.0 : core::order_statistic(std::move(sizes), rank);
    const double found = top > 0.0 ? unit_of_speeds(speeds, top) : 0.0;
    unit = found > kCoarseUnit * top ? std::max(unit, found) : unit;
  }
  return unit > 0.0 ? std::optional(model::SpeedCut{.unit = unit}) : std::nullopt;
}

}  // namespace wheelwright::commission
