// SPDX-License-Identifier: Apache-2.0
// The set that follows the data: it is the feasible set without drift, and never loses a parameter that drifts as stated.
#include <cmath>

#include <gtest/gtest.h>

#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/bounds/tracker.hpp>
#include <wheelwright/core/error.hpp>

#include "bounds/exact.hpp"
#include "bounds/rows.hpp"

namespace wheelwright::tracker_test {
namespace {

using testing_rows::cube;
using testing_rows::Random;
using testing_rows::Rows;

constexpr double kNoise = 0.1;

/// Rows every 0.01 s of parameters that are at theta(t).
template <class Theta>
Rows driven(std::uint64_t seed, std::size_t p, std::size_t count, const Theta& theta) {
  Random random(seed);
  Rows rows(p);
  for (std::size_t k = 0; k < count; ++k) {
    const std::vector<double> Y = random.vector(p), now = theta(0.01 * static_cast<double>(k));
    double y = kNoise * random.symmetric();
    for (std::size_t j = 0; j < p; ++j) {
      y += Y[j] * now[j];
    }
    rows.add(Y, y, std::max(kNoise, exact::noise_of(Y, now, y)));
  }
  return rows;
}

std::vector<double> still(double) { return {0.3, -0.7, 0.5}; }

TEST(Tracker, WithoutDriftIsTheFeasibleSetHoweverTheRowsCome) {
  const Rows rows = driven(1, 3, 400, still);
  RegressionTable table = rows.table();
  const Box expected = feasible_set(table, cube(3, 10.0)).hull;
  for (const std::size_t step : {1, 37, 400}) {
    FeasibleSetTracker tracker(cube(3, 10.0));
    for (std::size_t k = 0; k < 400; k += step) {
      ASSERT_TRUE(tracker.add(rows.block(k, std::min<std::size_t>(400, k + step))));
    }
    for (std::size_t j = 0; j < 3; ++j) {
      const Interval &side = tracker.set().hull().sides[j], &exact = expected.sides[j];
      EXPECT_NEAR(side.lower, exact.lower, 1e-9 * exact.width()) << step;
      EXPECT_NEAR(side.upper, exact.upper, 1e-9 * exact.width()) << step;
    }
    EXPECT_DOUBLE_EQ(tracker.time(), 3.99);
  }
}

TEST(Tracker, NeverLosesAParameterThatDriftsAsStated) {
  const std::vector<double> drift{0.05, 0.0, 0.2};
  // As fast as stated, in turns in either direction.
  const auto theta = [&](double t) {
    const double swing = std::abs(std::fmod(t, 2.0) - 1.0);  // slope ±1
    return std::vector<double>{0.3 + drift[0] * swing, -0.7, 0.5 - drift[2] * swing};
  };
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Rows rows = driven(seed, 3, 1000, theta);
    FeasibleSetTracker tracker(cube(3, 10.0), {.drift = drift, .polytope = {}});
    for (std::size_t k = 0; k < 1000; k += 25) {
      ASSERT_TRUE(tracker.add(rows.block(k, k + 25))) << seed << ' ' << k;
      ASSERT_TRUE(tracker.set().contains(theta(tracker.time()))) << seed << ' ' << k;
      ASSERT_TRUE(tracker.at(tracker.time() + 0.4).contains(theta(tracker.time() + 0.4)));
    }
    // Old rows are forgotten: the set is about as large as a short memory makes it, and few rows are held.
    EXPECT_LT(tracker.set().hull().sides[2].width(), 0.4);
    EXPECT_LT(tracker.rows(), 100u);
  }
}

TEST(Tracker, ForgetsEverythingInTheEnd) {
  FeasibleSetTracker tracker(cube(3, 10.0), {.drift = {0.1, 0.1, 0.1}, .polytope = {}});
  ASSERT_TRUE(tracker.add(driven(2, 3, 200, still).block(0, 200)));
  EXPECT_LT(tracker.set().hull().sides[0].width(), 1.0);
  EXPECT_EQ(tracker.at(1e4).hull(), cube(3, 10.0));
}

TEST(Tracker, SaysWhatContradictsWhatItKnewAndKeepsIt) {
  const auto jump = [](double t) { return std::vector<double>{t < 2.0 ? 0.3 : 1.5, -0.7, 0.5}; };
  const Rows rows = driven(3, 3, 400, jump);
  FeasibleSetTracker tracker(cube(3, 10.0), {.drift = {0.01, 0.01, 0.01}, .polytope = {}});
  ASSERT_TRUE(tracker.add(rows.block(0, 200)));
  const double before = tracker.set().hull().sides[0].width();
  EXPECT_FALSE(tracker.add(rows.block(200, 300)));
  ASSERT_FALSE(tracker.contradiction().empty());
  bool late = false;
  for (const WeightedRow& row : tracker.contradiction()) {
    late = late || row.row.origin.sample >= 200;
  }
  EXPECT_TRUE(late);
  EXPECT_DOUBLE_EQ(tracker.time(), 2.99);
  EXPECT_TRUE(tracker.set().contains(still(0.0)));
  EXPECT_GT(tracker.set().hull().sides[0].width(), before);
}

TEST(Tracker, MisuseIsRefused) {
  EXPECT_THROW(FeasibleSetTracker(cube(3, 1.0), {.drift = {0.1, -0.1, 0.0}, .polytope = {}}), InvalidArgument);
  EXPECT_THROW(FeasibleSetTracker(cube(3, 1.0), {.drift = {0.1}, .polytope = {}}), InvalidArgument);
  FeasibleSetTracker tracker(cube(3, 10.0));
  const Rows rows = driven(4, 3, 20, still);
  ASSERT_TRUE(tracker.add(rows.block(10, 20)));
  EXPECT_THROW(tracker.add(rows.block(0, 10)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(tracker.at(0.0)), InvalidArgument);
  RegressionBlock wrong = rows.block(10, 20);
  wrong.y[3] = std::nan("");
  wrong.t.assign(10, 1.0);
  EXPECT_THROW(tracker.add(wrong), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::tracker_test
