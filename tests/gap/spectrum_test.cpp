// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>
#include <random>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/where.hpp"

namespace wheelwright::gap::spectrum_test {
namespace {

TEST(GapSpectrum, OfASineIsItsMeanSquareAtItsFrequency) {
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(12001, 0.0, 120.0);
  const Eigen::VectorXd y = 3.0 * (2.0 * std::numbers::pi * 1.3 * t.array()).sin();
  const Spectrum s = spectrum(t, y);
  // Cells of 0.02 s take a factor sinc²(1.3·0.02) = 0.998.
  EXPECT_NEAR(s.power(1.05, 1.55), 4.5, 0.02);
  EXPECT_LT(s.power(2.0, 10.0), 1e-3);
}

TEST(GapSpectrum, OfWhiteNoiseIsFlat) {
  std::mt19937_64 generator(2);
  std::normal_distribution<double> normal;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(40001, 0.0, 2000.0);  // h = 0.05: density 2h = 0.1
  Eigen::VectorXd y(t.size());
  for (double& x : y) {
    x = normal(generator);
  }
  const Spectrum s = spectrum(t, y);
  // 399 half-overlapping windows, 100 bins: the mean is known to about 1 %.
  EXPECT_NEAR(s.density.mean(), 0.1, 0.004);
  EXPECT_NEAR(s.power(1.0, 3.0), 0.2, 0.01);
}

TEST(GapSpectrum, AGapInTheLogTakesNothingFromNoise) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Eigen::VectorXd t(20000), y(20000);
  for (Eigen::Index k = 0; k < t.size(); ++k) {
    t[k] = 0.05 * static_cast<double>(k) + 3.0 * std::floor(static_cast<double>(k) / 400.0);  // 3 s missing in every 23
    y[k] = normal(generator);
  }
  EXPECT_NEAR(spectrum(t, y).density.mean(), 0.1, 0.004);
}

TEST(GapSpectrum, AClockThatJumpsByDecadesCostsNoMemory) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal;
  Eigen::VectorXd steady(20000), jumps(20000), y(20000);
  for (Eigen::Index k = 0; k < y.size(); ++k) {
    steady[k] = 0.05 * static_cast<double>(k);
    jumps[k] = steady[k] + (k < 10000 ? 0.0 : 1.7e9);
    y[k] = normal(generator);
  }
  const Spectrum s = spectrum(jumps, y);
  EXPECT_NEAR(s.density.mean(), 0.1, 0.004);
  EXPECT_NEAR(static_cast<double>(s.windows), static_cast<double>(spectrum(steady, y).windows), 4.0);
}

TEST(GapSpectrum, DensityOfFilteredNoiseIntegratesToItsVariance) {
  double sum = 0.0;
  const double df = 1e-3;
  for (double f = 0.5 * df; f < 200.0; f += df) {
    sum += df * filtered_noise_density(7.0, 0.3, f);
  }
  EXPECT_NEAR(sum, 0.09, 1e-6);
}

TEST(GapSpectrum, TooShortALogHasNone) {
  EXPECT_EQ(spectrum(Eigen::VectorXd::LinSpaced(5, 0.0, 1.0), Eigen::VectorXd::Zero(5)).frequency.size(), 0);
  EXPECT_THROW((void)spectrum(Eigen::VectorXd::Zero(5), Eigen::VectorXd::Zero(4)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::gap::spectrum_test
