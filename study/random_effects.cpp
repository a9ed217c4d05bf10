// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/random_effects.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {
namespace {

constexpr double kHuber = 1.5;

// Moments of ψ at the standard normal distribution.
struct HuberMoments {
  double inside = std::erf(kHuber / std::numbers::sqrt2);  // P(|Z| < kHuber) = E ψ'
  double second = 0.0;                                     // E ψ²
  double freedom = 0.0;                                    // of the scale, for each member

  HuberMoments() {
    const double density = std::exp(-0.5 * kHuber * kHuber) / std::sqrt(2.0 * std::numbers::pi);
    const double tails = 1.0 - inside;
    const double z2 = inside - 2.0 * kHuber * density;                      // E[Z²; |Z| < kHuber]
    const double z4 = 3.0 * z2 - 2.0 * kHuber * kHuber * kHuber * density;  // E[Z⁴; |Z| < kHuber]
    second = z2 + kHuber * kHuber * tails;
    const double fourth = z4 + kHuber * kHuber * kHuber * kHuber * tails;
    const double variance = (fourth - second * second) / (4.0 * z2 * z2);  // of log scale, times n
    freedom = 0.5 / variance;
  }
};

class Fit {
 public:
  Fit(std::span<const double> values, std::span<const double> errors, std::size_t without) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i == without) {
        continue;
      }
      x_.push_back(check::finite(values[i], "value"));
      const double s = check::non_negative(errors[i], "standard error");
      variance_.push_back(s * s);
    }
    check::that(x_.size() >= 2, "values", "at least two");
    const auto [low, high] = std::minmax_element(x_.begin(), x_.end());
    range_ = *high - *low;
    const double size = std::max(std::abs(*low), std::abs(*high));
    floor_ = std::max(1e-24 * size * size, std::numeric_limits<double>::min());
    centre_ = median(x_);
  }

  RandomEffects solve() {
    const double n = static_cast<double>(x_.size());
    const double wanted = (n - 1.0) / n * moments_.second;
    double low = 0.0, high = range_ / std::sqrt(wanted);
    if (excess(0.0, wanted) <= 0.0) {
      high = 0.0;
    }
    for (int k = 0; k < 60 && high - low > 1e-7 * high; ++k) {
      const double middle = 0.5 * (low + high);
      (excess(middle, wanted) > 0.0 ? low : high) = middle;
    }
    const double tau = 0.5 * (low + high);
    (void)excess(tau, wanted);
    double weight = 0.0;
    for (const double v : variance_) {
      weight += 1.0 / (v + tau * tau + floor_);
    }
    return {.members = x_.size(),
            .centre = centre_,
            .centre_error = std::sqrt(moments_.second / weight) / moments_.inside,
            .spread = tau,
            .freedom = moments_.freedom * (n - 1.0)};
  }

 private:
  // Mean ψ² − wanted at the spread `tau`, with the centre that belongs to it: reweighted means from the last one.
  double excess(double tau, double wanted) {
    const double between = tau * tau + floor_;
    for (int k = 0; k < 50; ++k) {
      double sum = 0.0, weight = 0.0;
      for (std::size_t i = 0; i < x_.size(); ++i) {
        const double v = variance_[i] + between;
        const double d = std::abs(x_[i] - centre_);
        const double w = (d * d <= kHuber * kHuber * v ? 1.0 : kHuber * std::sqrt(v) / d) / v;
        sum += w * (x_[i] - centre_);
        weight += w;
      }
      const double step = sum / weight;
      centre_ += step;
      if (step * step * weight < 1e-16) {
        break;
      }
    }
    double total = 0.0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double d = x_[i] - centre_;
      total += std::min(d * d / (variance_[i] + between), kHuber * kHuber);
    }
    return total / static_cast<double>(x_.size()) - wanted;
  }

  HuberMoments moments_;
  std::vector<double> x_, variance_;
  double range_ = 0.0, floor_ = 0.0, centre_ = 0.0;
};

}  // namespace

RandomEffects fit_random_effects(std::span<const double> values, std::span<const double> errors, std::size_t without) {
  check::that(values.size() == errors.size(), "errors", "as many as values");
  return Fit(values, errors, without).solve();
}

}  // namespace wheelwright
