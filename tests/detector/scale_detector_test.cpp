// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/scale_detector.hpp>

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <boost/math/quadrature/gauss_kronrod.hpp>

namespace wheelwright::detector::scale_detector_test {
namespace {

// ln of the mixture of exp(λS − λ²V/2): half over a Gaussian of variance 1/V0 that is cut off at ±Λ, half at ±Λ.
double log_mixture(double S, double V, double V0, double reach) {
  const double most = reach / std::sqrt(V0);
  const auto gauss = [&](double lambda) { return std::exp(-0.5 * V0 * lambda * lambda); };
  using Quadrature = boost::math::quadrature::gauss_kronrod<double, 61>;
  const double mass = Quadrature::integrate(gauss, -most, most, 15, 1e-12);
  const double peak = std::min(S / (V + V0), most);
  const double shift = peak * S - 0.5 * peak * peak * (V + V0);
  const double inside = Quadrature::integrate(
      [&](double lambda) { return std::exp(lambda * S - 0.5 * lambda * lambda * (V + V0) - shift); }, -most, most, 15,
      1e-12);
  const double at = most * S - 0.5 * most * most * V;
  const double top = std::max(shift, at);
  return top + std::log(0.5 * inside / mass * std::exp(shift - top) +
                        0.25 * (std::exp(at - top) + std::exp(-2.0 * most * S + at - top)));
}

// A supermartingale of mean 1 exceeds e^L with probability e^−L at most: a sum at the radius makes it exceed that.
TEST(AveragedRadius, IsWhereTheMixtureReachesTheRisk) {
  for (const double L : {3.0, 10.0, 25.0, 40.0}) {
    for (const double ratio : {1e-3, 0.1, 1.0, 5.0, 50.0, 1e4}) {
      for (const double reach : {0.5, 2.0, 4.0, 12.0}) {
        const double V0 = 0.7, V = ratio * V0;
        const double radius = averaged_radius(V, V0, L, reach);
        EXPECT_GE(log_mixture(radius, V, V0, reach), L - 1e-9) << L << ' ' << ratio << ' ' << reach;
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::detector::scale_detector_test
