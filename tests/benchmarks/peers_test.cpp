// SPDX-License-Identifier: Apache-2.0
// The detectors that the study of peers compares with are what they are called.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/benchmarks/peers/confidence_threshold.hpp"
#include "tests/benchmarks/peers/cusum.hpp"
#include "tests/benchmarks/peers/innovations.hpp"
#include "tests/support/exact_axis.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::peers {
namespace {

using testing_support::AxisMotion;
using testing_support::Random;

// Mean number of samples to an alarm at S > `limit` when z has the mean `shift`.
double run_length(double shift, double limit, int runs, std::uint64_t seed) {
  Random random(seed);
  Cusum cusum({1.0, 0.0}, {2.0, 1.0}, 0.5);
  Observation now;
  now.valid = true;
  double total = 0.0;
  for (int run = 0; run < runs; ++run) {
    std::array<double, kOutputs> values{};
    cusum.restart();
    while (values[0] <= limit) {
      now.residual = {1.0 + 2.0 * (shift + random.normal()), 0.0};
      cusum.step(now, values);
      total += 1.0;
    }
  }
  return total / runs;
}

// Siegmund's approximation (1985) for k = 1/2, one side.
double siegmund(double shift, double limit) {
  const double b = limit + 1.166, d = shift - 0.5;
  return (std::exp(-2.0 * d * b) + 2.0 * d * b - 1.0) / (2.0 * d * d);
}

TEST(Cusum, RunLengthsAreSiegmunds) {
  // Both sides alarm without a shift: the rates add.
  EXPECT_NEAR(run_length(0.0, 4.0, 4000, 1), 0.5 * siegmund(0.0, 4.0), 0.08 * 168.0);
  EXPECT_NEAR(run_length(1.0, 4.0, 4000, 2), siegmund(1.0, 4.0), 0.05 * 8.4);
  EXPECT_NEAR(run_length(-1.0, 4.0, 4000, 3), siegmund(1.0, 4.0), 0.05 * 8.4);
}

TEST(Innovations, HaveTwoDegreesOfFreedomASampleOnHealthyData) {
  constexpr double m = 3.0, f = 1.5, h = 0.01, effort_sd = 0.2, position_sd = 1e-4;
  const AxisModel model{m, f, effort_sd * effort_sd, position_sd * position_sd};
  constexpr std::size_t window = 10;
  Innovations single({model, model}, Hold::zero_order, 1), windowed({model, model}, Hold::zero_order, window);
  Random random(4);
  std::array<AxisMotion, kOutputs> axes;
  Observation now;
  double sum = 0.0, window_sum = 0.0, tail = 0.0, product = 0.0, before = 0.0;
  constexpr int count = 100'000;
  for (int k = -200; k < count; ++k) {
    now.t += h;
    now.valid = k >= 0;
    for (std::size_t i = 0; i < kOutputs; ++i) {
      const double u = std::sin(0.7 * now.t + static_cast<double>(i));
      now.position[i] = axes[i].position + position_sd * random.normal();
      now.effort[i] = u + effort_sd * random.normal();
      axes[i].advance(m, f, u, h);
    }
    double value = 0.0, over_window = 0.0;
    single.step(now, {&value, 1});
    windowed.step(now, {&over_window, 1});
    sum += value;
    window_sum += over_window;
    tail += value > 5.991 ? 1.0 : 0.0;  // 95 % of χ²(2)
    product += (value - 2.0) * (before - 2.0);
    before = value;
  }
  // Standard errors 2/√count, √(2·2·window)·√window/√count, √(0.05·0.95/count), 4/√count.
  EXPECT_NEAR(sum / count, 2.0, 0.04);
  EXPECT_NEAR(window_sum / count, 2.0 * window, 0.4);
  EXPECT_NEAR(tail / count, 0.05, 0.004);
  EXPECT_NEAR(product / count, 0.0, 0.06);
}

TEST(Innovations, VanishForAnExactLogWithLinearEfforts) {
  constexpr double m = 3.0, f = 1.5, h = 0.02;
  AxisFilter filter({m, f, 1e-4, 1e-12}, Hold::first_order);
  AxisMotion axis;
  for (int k = 0; k < 500; ++k) {
    const double t = h * k, u = k % 2 == 0 ? 1.0 : -0.5, next = k % 2 == 0 ? -0.5 : 1.0;
    const AxisFilter::Innovation now = filter.step(t, axis.position, u);
    EXPECT_LT(now.normalised, 1e-3) << k;
    constexpr int parts = 2000;
    for (int part = 0; part < parts; ++part) {
      axis.advance(m, f, u + (next - u) * (part + 0.5) / parts, h / parts);
    }
  }
}

TEST(ConfidenceThreshold, IsTheStandardErrorOfAPrediction) {
  ConfidenceThreshold threshold((Eigen::MatrixXd(2, 2) << 1.0, 0.5, 0.5, 4.0).finished(), {2.0, 7.0});
  filter::FilteredRow row;
  row.Y = (core::RowMatrix(2, 2) << 1.0, 2.0, 3.0, 0.0).finished();
  Observation now;
  now.valid = true;
  now.row = &row;
  now.residual = {-10.0, 8.0};
  std::array<double, kOutputs> values{};
  threshold.step(now, values);
  EXPECT_DOUBLE_EQ(values[0], 10.0 / std::sqrt(1.0 + 2.0 + 16.0 + 2.0));
  EXPECT_DOUBLE_EQ(values[1], 2.0);
}

}  // namespace
}  // namespace wheelwright::peers
