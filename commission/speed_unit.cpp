// SPDX-License-Identifier: Apache-2.0
#include "commission/speed_unit.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace wheelwright::commission {
namespace {

constexpr double kNearUnit = 0.1;           // of the unit: as far from its multiples are decimals that are printed
constexpr double kSparse = 0.2;             // distinct values over rows, above which the column is not coarse
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

}  // namespace wheelwright::commission
