// SPDX-License-Identifier: Apache-2.0
#include "detector/threshold.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::detector {

ThresholdRule::ThresholdRule(Polytope set, Eigen::VectorXd estimate, ParameterSetKind kind)
    : set_(std::move(set)),
      estimate_(std::move(estimate)),
      kind_(kind),
      direction_(set_.dimension()),
      opposite_(set_.dimension()) {
  check::that(static_cast<std::size_t>(estimate_.size()) == set_.dimension(), "estimate",
              "one value for each parameter");
  check::that(estimate_.allFinite(), "estimate", "finite values");
  for (std::size_t j = 0; j < set_.dimension(); ++j) {
    const Interval& side = set_.hull().sides[j];
    parameters_.push_back({estimate_[static_cast<Eigen::Index>(j)], core::magnitude(side),
                           side.lower >= 0.0   ? 1.0
                           : side.upper <= 0.0 ? -1.0
                                               : 0.0,
                           side});
  }
  if (kind_ == ParameterSetKind::polytope) {
    table_ = bounds::SupportTable::make(set_, {.slots = kSlots});
    if (!table_) {
      walk_.emplace(set_, bounds::SupportWalkOptions{.slots = kSlots});
    }
  }
}

template <typename Take>
ThresholdRule::Beside ThresholdRule::beside(std::span<const double> y, std::span<const double> dy_regressor,
                                            double dy_output, Take&& take) const noexcept {
  const std::size_t p = parameters_.size();
  double extra = dy_output;
  double predicted = 0.0;
  double magnitude = dy_output;
  double reach = 0.0;
  for (std::size_t j = 0; j < p; ++j) {
    const Parameter& theta = parameters_[j];
    const double error = dy_regressor[j];
    const double term = y[j] * theta.estimate;
    predicted += term;
    magnitude += std::abs(term);
    reach += (std::abs(y[j]) + error) * theta.largest;
    if (error > 0.0 && theta.sign == 0.0) {
      extra += error * theta.largest;
    }
    const double shift = theta.sign * error;
    take(j, y[j] + shift, -y[j] + shift);
  }
  // Sums of p + 3 terms, and as many in the residual that is compared with the result: Higham 2002, section 3.1. The
  // rounding of the direction itself is covered by the terms Δ|θ|. |h(±y + Δ)| <= Σ (|y_j| + Δ_j) max|θ_j|: measured
  // with the box, so that the same margin is added whichever set is used.
  magnitude += extra + 2.0 * reach;
  const double rounding = 4.0 * static_cast<double>(p + 4) * std::numeric_limits<double>::epsilon() * magnitude;
  return {predicted, extra, rounding};
}

ThresholdRule::Beside ThresholdRule::beside(std::span<const double> y, std::span<const double> dy_regressor,
                                            double dy_output) const noexcept {
  double *const up = direction_.data(), *const down = opposite_.data();
  return beside(y, dy_regressor, dy_output, [&](std::size_t j, double above, double below) {
    up[j] = above;
    down[j] = below;
  });
}

// support() of the hull for both directions, as they come.
Threshold ThresholdRule::of_hull(std::span<const double> y, std::span<const double> dy_regressor,
                                 double dy_output) const noexcept {
  struct Support {
    double sum = 0.0, magnitude = 0.0;
    bool zero = true;
    void take(double a, const Interval& side) {
      const double term = std::max(a * side.lower, a * side.upper);
      sum += term;
      magnitude += std::abs(term);
      zero = zero && a == 0.0;
    }
    [[nodiscard]] double value(std::size_t p) const {
      return magnitude == 0.0 && zero ? 0.0 : Box::outward(sum, magnitude, p);
    }
  } up, down;
  const Beside by = beside(y, dy_regressor, dy_output, [&](std::size_t j, double above, double below) {
    up.take(above, parameters_[j].side);
    down.take(below, parameters_[j].side);
  });
  const std::size_t p = parameters_.size();
  return {-down.value(p) - by.predicted - by.extra - by.rounding, up.value(p) - by.predicted + by.extra + by.rounding};
}

Threshold ThresholdRule::at(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                            std::size_t channel) const noexcept {
  if (kind_ == ParameterSetKind::box) {
    return of_hull(y, dy_regressor, dy_output);
  }
  const Beside by = beside(y, dy_regressor, dy_output);
  const double above = support(direction_, 2 * channel);
  const double below = support(opposite_, 2 * channel + 1);
  return {-below - by.predicted - by.extra - by.rounding, above - by.predicted + by.extra + by.rounding};
}

double ThresholdRule::upper(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                            std::size_t channel) const noexcept {
  const Beside by = beside(y, dy_regressor, dy_output);
  return support(direction_, 2 * channel) - by.predicted + by.extra + by.rounding;
}

double ThresholdRule::lower(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                            std::size_t channel) const noexcept {
  const Beside by = beside(y, dy_regressor, dy_output);
  return -support(opposite_, 2 * channel + 1) - by.predicted - by.extra - by.rounding;
}

Interval ThresholdRule::prediction(std::span<const double> y, std::size_t channel) const noexcept {
  const double below = smallest(y, channel);
  return {below, largest(y, channel)};
}

double ThresholdRule::largest(std::span<const double> y, std::size_t channel) const noexcept {
  return support(y, 2 * channel);
}

double ThresholdRule::smallest(std::span<const double> y, std::size_t channel) const noexcept {
  std::transform(y.begin(), y.end(), opposite_.begin(), [](double v) { return -v; });
  return -support(opposite_, 2 * channel + 1);
}

}  // namespace wheelwright::detector
