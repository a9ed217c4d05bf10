// SPDX-License-Identifier: Apache-2.0
#include "identify/noise_level.hpp"

#include <cmath>
#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::identify::difference_noise_test {
namespace {

using testing_support::Autoregression;
using testing_support::Random;
using Kind = DifferenceNoise::Kind;

constexpr double kStep = 0.01;
constexpr double kSd = 0.02;

LogTable table_of(std::size_t rows, const std::function<double(double)>& signal) {
  LogTable log;
  log.names = {"x"};
  log.columns.resize(1);
  for (std::size_t k = 0; k < rows; ++k) {
    log.t.push_back(kStep * static_cast<double>(k));
    log.columns[0].push_back(signal(log.t.back()));
  }
  return log;
}

DifferenceNoise noise_of(const LogTable& log) {
  TableSource source(log, 500);
  return difference_noise(source, {"x"}).front();
}

double smooth(double t) { return 3.0 * std::sin(2.0 * t) + 1.0 * std::cos(5.0 * t); }

// Mean and scatter of sd² over 400 logs: unbiased, and as uncertain as it says. The standard error of a variance from
// 400 values is 7 %, and that of the mean is a twentieth of the scatter.
TEST(DifferenceNoise, OfWhiteNoiseOnMotionHasItsStatedStandardError) {
  constexpr int runs = 400;
  double sum = 0.0, squares = 0.0, stated = 0.0;
  int white = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(1000 + static_cast<std::uint64_t>(run));
    const DifferenceNoise n = noise_of(table_of(1000, [&](double t) { return smooth(t) + kSd * random.normal(); }));
    const double relative = n.sd * n.sd / (kSd * kSd);
    sum += relative;
    squares += relative * relative;
    stated = n.relative_sd;
    white += n.kind == Kind::white ? 1 : 0;
    EXPECT_EQ(n.windows, 994U);
  }
  const double mean = sum / runs;
  const double scatter = std::sqrt(squares / runs - mean * mean);
  EXPECT_NEAR(mean, 1.0, 4.0 * stated / std::sqrt(runs));
  EXPECT_NEAR(scatter / stated, 1.0, 4.0 / std::sqrt(2.0 * runs));
  EXPECT_GE(white, runs - 2);
}

// Of noise alone every order is a fair estimate, and the orders agree as closely as their shared windows make them.
TEST(DifferenceNoise, SeesNoiseAtAllOrdersWithoutMotion) {
  Random random(7);
  const DifferenceNoise n = noise_of(table_of(20000, [&](double) { return kSd * random.laplace(); }));
  EXPECT_EQ(n.kind, Kind::white);
  EXPECT_EQ(n.level_from, 1U);
  for (const double sd : n.by_order) {
    EXPECT_NEAR(sd / kSd, 1.0, 0.05);
  }
}

// An AR(1) noise has v_d = σ² Σ_k (−1)^k φ^|k| C(2d, d + k)/C(2d, d).
double autoregressive_share(double phi, int d) {
  const auto binomial = [](int n, int k) {
    return std::round(std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0)));
  };
  double sum = 0.0;
  for (int k = -d; k <= d; ++k) {
    sum += std::pow(-phi, std::abs(k)) * binomial(2 * d, d + k) / binomial(2 * d, d);
  }
  return sum;
}

TEST(DifferenceNoise, OfLowPassedNoiseIsCalledSmoothAndHasItsClosedForm) {
  Autoregression noise(3, 0.9);
  const DifferenceNoise n = noise_of(table_of(20000, [&](double t) { return smooth(t) + kSd * noise.next(); }));
  EXPECT_EQ(n.kind, Kind::smooth);
  EXPECT_EQ(n.level_from, 0U);
  EXPECT_NEAR(n.sd * n.sd / (kSd * kSd), autoregressive_share(0.9, 6),
              4.0 * n.relative_sd * autoregressive_share(0.9, 6));
}

// What is called white all the same is off by no more than `hidden` says.
TEST(DifferenceNoise, HidesNoMoreCorrelationThanItSays) {
  int white = 0;
  for (const double phi : {0.02, 0.05, 0.1, 0.2, 0.3}) {
    Autoregression noise(5, phi);
    const DifferenceNoise n = noise_of(table_of(5000, [&](double t) { return smooth(t) + kSd * noise.next(); }));
    if (n.kind == Kind::white) {
      ++white;
      EXPECT_LE(std::abs(n.sd * n.sd / (kSd * kSd) - 1.0), n.hidden + 4.0 * n.relative_sd) << phi;
    }
  }
  EXPECT_GE(white, 1);
}

TEST(DifferenceNoise, OfDifferencedAnglesIsRough) {
  constexpr double count = 2.0 * 3.14159265358979 / 4096.0;
  double before = 0.0;
  const DifferenceNoise n = noise_of(table_of(8000, [&](double t) {
    const double angle = count * std::round((1.5 * (1.0 - std::cos(2.0 * t)) + 5.0 * t) / count);
    const double speed = (angle - before) / kStep;
    before = angle;
    return speed;
  }));
  EXPECT_EQ(n.kind, Kind::rough);
  // Two angles' errors of variance count²/12 a speed: far more of it in high orders, at most twice in the limit.
  const double sd = count / kStep / std::sqrt(6.0);
  EXPECT_GT(n.sd, 1.2 * sd);
  EXPECT_LT(n.sd, std::sqrt(2.0) * sd);
}

// A decimal is an error of variance q²/12, white where the signal crosses several in a step.
TEST(DifferenceNoise, OfRoundingToDecimalsIsTheUniformDistributions) {
  const DifferenceNoise n = noise_of(table_of(20000, [](double t) { return 0.001 * std::round(smooth(t) / 0.001); }));
  EXPECT_EQ(n.kind, Kind::white);
  EXPECT_NEAR(n.sd / (0.001 / std::sqrt(12.0)), 1.0, 0.05);
}

TEST(DifferenceNoise, OfMotionTooFastForTheSamplingIsCalledSmooth) {
  Random random(11);
  const DifferenceNoise n =
      noise_of(table_of(4000, [&](double t) { return std::sin(80.0 * t) + 0.001 * random.normal(); }));
  EXPECT_EQ(n.kind, Kind::smooth);
  EXPECT_GT(n.sd, 0.001);
}

TEST(DifferenceNoise, IsNothingForExactSignals) {
  EXPECT_EQ(noise_of(table_of(1000, [](double t) { return 2.0 + 3.0 * t; })).kind, Kind::none);
  EXPECT_EQ(noise_of(table_of(1000, [](double) { return 0.0; })).kind, Kind::none);
}

// Steps that are torn out, made uneven or split off: no window reaches across, so a jump there is not seen.
TEST(DifferenceNoise, LooksAtEvenWindowsOfOneSegmentOnly) {
  Random random(13);
  LogTable log = table_of(3000, [&](double) { return kSd * random.normal(); });
  log.segment_starts = {0, 1000};
  for (std::size_t k = 1000; k < 3000; ++k) {
    log.columns[0][k] += 5.0;
  }
  for (std::size_t k = 2000; k < 3000; ++k) {
    log.t[k] += 0.5 * kStep;
    log.columns[0][k] += 5.0;
  }
  const DifferenceNoise n = noise_of(log);
  EXPECT_EQ(n.windows, 3000U - 3U * 6U);
  EXPECT_EQ(n.kind, Kind::white);
  EXPECT_NEAR(n.sd * n.sd / (kSd * kSd), 1.0, 4.0 * n.relative_sd);
}

TEST(DifferenceNoise, AsksForEnoughRowsAndKnownColumns) {
  const LogTable log = table_of(55, [](double t) { return std::fmod(37.0 * t, 1.0); });
  EXPECT_EQ(noise_of(log).kind, Kind::too_short);
  TableSource source(log);
  EXPECT_THROW(static_cast<void>(difference_noise(source, {"y"})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::identify::difference_noise_test
