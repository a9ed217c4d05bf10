// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/sim/plant.hpp"

namespace wheelwright::sim::noise_test {
namespace {

TEST(Noise, NeverExceedsItsBoundInAMillionDraws) {
  for (const NoiseShape shape : {NoiseShape::uniform, NoiseShape::truncated_gaussian, NoiseShape::two_point}) {
    Noise noise(7, 0, 0.02, shape);
    double largest = 0.0;
    for (int i = 0; i < 1000000; ++i) {
      const double exact = 1e-3 * i - 300.0;
      largest = std::max(largest, std::abs(noise.measure(exact) - exact));
    }
    EXPECT_LE(largest, 0.02);
    EXPECT_GT(largest, 0.0199);
  }
}

TEST(Noise, NeverExceedsItsBoundWhereRoundingIsCoarse) {
  Noise noise(7, 0, 1e-10);
  const double exact = 1e6;  // its last digit is worth 1.2e-10
  for (int i = 0; i < 100000; ++i) {
    EXPECT_LE(std::abs(noise.measure(exact) - exact), 1e-10);
  }
}

TEST(Noise, HasTheMomentsOfItsShape) {
  constexpr int n = 1000000;
  // Variance of the unit Gaussian cut at ±3, over 9: (1 − 6 φ(3)/(2 Φ(3) − 1))/9.
  const double density = std::exp(-4.5) / std::sqrt(2.0 * 3.14159265358979323846);
  const double gaussian = (1.0 - 6.0 * density / std::erf(3.0 / std::sqrt(2.0))) / 9.0;
  for (const auto& [shape, variance] :
       {std::pair{NoiseShape::uniform, 1.0 / 3.0}, std::pair{NoiseShape::truncated_gaussian, gaussian},
        std::pair{NoiseShape::two_point, 1.0}}) {
    Noise noise(3, 1, 1.0, shape);
    double sum = 0.0, squares = 0.0, product = 0.0, last = 0.0;
    for (int i = 0; i < n; ++i) {
      const double x = noise.unit();
      sum += x;
      squares += x * x;
      product += x * last;
      last = x;
    }
    // Five standard deviations of each statistic.
    EXPECT_LT(std::abs(sum / n), 5.0 * std::sqrt(variance / n));
    EXPECT_LT(std::abs(squares / n - variance), 5.0 * std::sqrt(2.0 * variance * variance / n));
    EXPECT_LT(std::abs(product / n), 5.0 * variance / std::sqrt(n));
  }
}

TEST(Noise, SeedsAndStreamsAreUnrelatedAndReproducible) {
  Noise a(5, 0, 1.0), same(5, 0, 1.0), seed(6, 0, 1.0), stream(5, 1, 1.0);
  double with_seed = 0.0, with_stream = 0.0;
  for (int i = 0; i < 10000; ++i) {
    const double x = a.unit();
    EXPECT_EQ(x, same.unit());
    with_seed += x * seed.unit();
    with_stream += x * stream.unit();
  }
  EXPECT_LT(std::abs(with_seed / 10000), 5.0 / 3.0 / 100.0);
  EXPECT_LT(std::abs(with_stream / 10000), 5.0 / 3.0 / 100.0);
}

TEST(Noise, WithoutABoundTheMeasurementIsExact) {
  Noise noise(5, 0, 0.0);
  EXPECT_EQ(noise.measure(1.23456), 1.23456);
  EXPECT_THROW(Noise(5, 0, -1.0), InvalidArgument);
  EXPECT_THROW(Noise(5, 0, std::nan("")), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::sim::noise_test
