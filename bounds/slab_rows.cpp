// SPDX-License-Identifier: Apache-2.0
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {
namespace {

/// Rounding error of fl(x + y), exactly (Knuth's TwoSum).
double sum_error(double x, double y, double sum) {
  const double back = sum - x;
  return (x - (sum - back)) + (y - back);
}

double add_up(double x, double y) {
  const double sum = x + y;
  return sum_error(x, y, sum) > 0.0 ? core::round_up(sum) : sum;
}

double add_down(double x, double y) { return -add_up(-x, -y); }

Interval quotient(Interval x, Interval positive) {
  const double a = x.lower / positive.lower, b = x.lower / positive.upper;
  const double c = x.upper / positive.lower, d = x.upper / positive.upper;
  return {core::round_down(std::min({a, b, c, d})), core::round_up(std::max({a, b, c, d}))};
}

}  // namespace

SlabRows::SlabRows(const Box& prior) {
  check_finite(prior, "prior box");
  for (const Interval& side : prior.sides) {
    const bool open = side.lower < 0.0 && side.upper > 0.0;
    open_.push_back(open);
    sign_.push_back(side.lower >= 0.0 ? 1.0 : -1.0);
    magnitude_.push_back(core::magnitude(side));
    if (open) {
      const Interval l{side.lower, side.lower}, u{side.upper, side.upper};
      slope_.push_back(quotient(u + l, u - l));
      intercept_.push_back(quotient(Interval{-2.0, -2.0} * u * l, u - l));
    } else {
      slope_.push_back({sign_.back(), sign_.back()});
      intercept_.push_back({0.0, 0.0});
    }
  }
}

void SlabRows::half_spaces(const RegressionBlock& block, Eigen::Index row, HalfSpace& upper, HalfSpace& lower) const {
  const std::size_t p = open_.size();
  const auto n = static_cast<Eigen::Index>(block.outputs);
  const auto instant = static_cast<std::size_t>(row / n);
  const RowOrigin origin{false,      0, block.sample[instant], block.t[instant], static_cast<std::size_t>(row % n),
                         Side::upper};
  const auto first = row * static_cast<Eigen::Index>(p);
  half_spaces({block.Y.data() + first, p}, {block.dY.data() + first, p}, block.y[row], block.dy[row], origin, upper,
              lower);
}

void SlabRows::half_spaces(std::span<const double> Y, std::span<const double> dY, double y, double dy,
                           const RowOrigin& origin, HalfSpace& upper, HalfSpace& lower) const {
  const auto p = static_cast<Eigen::Index>(open_.size());
  upper.origin = origin;
  upper.origin.side = Side::upper;
  lower.origin = origin;
  lower.origin.side = Side::lower;
  upper.a.resize(p);
  lower.a.resize(p);
  upper.b = add_up(y, dy);
  lower.b = add_up(-y, dy);
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto k = static_cast<std::size_t>(j);
    if (dY[k] == 0.0) {
      upper.a[j] = Y[k];
      lower.a[j] = -Y[k];
    } else if (!open_[k]) {
      // A coefficient is rounded against the sign of θ_j, which makes its half-space larger.
      upper.a[j] = sign_[k] > 0.0 ? add_down(Y[k], -dY[k]) : add_up(Y[k], dY[k]);
      lower.a[j] = sign_[k] > 0.0 ? add_down(-Y[k], -dY[k]) : add_up(-Y[k], dY[k]);
    } else {
      const Interval noise{dY[k], dY[k]};
      const Interval shift = noise * slope_[k];
      const double room = (noise * intercept_[k]).upper;
      const auto place = [&](double at, HalfSpace& half_space) {
        const Interval coefficient = Interval{at, at} - shift;
        half_space.a[j] = coefficient.centre();
        half_space.b = add_up(half_space.b, room);
        half_space.b = add_up(half_space.b, core::round_up(coefficient.width() * magnitude_[k]));
      };
      place(Y[k], upper);
      place(-Y[k], lower);
    }
  }
}

}  // namespace wheelwright::bounds
