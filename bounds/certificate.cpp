// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/certificate.hpp>

namespace wheelwright {
namespace {

Interval point(double x) { return {x, x}; }

}  // namespace

double certified_upper_bound(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box) {
  double bound = 0.0;
  for (const WeightedRow& weighted : rows) {
    if (weighted.multiplier > 0.0) {
      bound = round_up(bound + round_up(weighted.multiplier * weighted.row.b));
    }
  }
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    Interval rest = point(a[j]);
    for (const WeightedRow& weighted : rows) {
      const double coefficient = weighted.row.a[static_cast<Eigen::Index>(j)];
      if (weighted.multiplier > 0.0 && coefficient != 0.0) {
        rest = rest - point(weighted.multiplier) * point(coefficient);
      }
    }
    if (rest.lower != 0.0 || rest.upper != 0.0) {
      bound = round_up(bound + (rest * box.sides[j]).upper);
    }
  }
  return bound;
}

bool proves_empty(std::span<const WeightedRow> rows, const Box& box) {
  const std::vector<double> zero(box.dimension(), 0.0);
  return certified_upper_bound(zero, rows, box) < 0.0;
}

}  // namespace wheelwright
