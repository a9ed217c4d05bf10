// SPDX-License-Identifier: Apache-2.0
// Angles of few counts a step at high rates, all rows and with rows lost at random, of an axis that is solved in closed
// form: the noise of the counts is no shift of the efforts, and losses are no reason for other parameters.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ostream>
#include <random>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/contradictions.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "tests/support/exact_axis.hpp"
#include "tests/support/lost_rows.hpp"

namespace wheelwright::commission::coarse_counts_test {
namespace {

using testing_support::ErrorLaw;
using testing_support::ExactAxis;

struct Case {
  double rate, count;  // Hz, m
  double lost;         // share of the rows
  bool declared;
};
void PrintTo(const Case& c, std::ostream* out) {
  *out << fmt::format("{:g} Hz, {:g} mm, {:g} % lost, {}", c.rate, 1e3 * c.count, 100.0 * c.lost,
                      c.declared ? "declared" : "estimated");
}

ExactAxis axis(const Case& c) {
  ExactAxis a{.rate = c.rate, .seconds = 20.0, .bound = 0.2, .count = c.count};
  a.law = ErrorLaw::uniform;
  return a;
}

LogTable log_of(const Case& c, std::uint64_t seed) {
  const LogTable whole = drive(axis(c), seed);
  std::mt19937_64 random(seed + 1000);
  return testing_support::without_rows(
      whole, [&](std::size_t k) { return k > 0 && std::ldexp(static_cast<double>(random() >> 11), -53) < c.lost; });
}

Robot robot_of(const Case& c) {
  Robot robot = testing_support::robot_of(axis(c));
  if (!c.declared) {
    robot.noise = {};
  }
  return robot;
}

class CoarseCounts : public ::testing::TestWithParam<Case> {};

// A quarter of a step is what a latency is from on (is_latency).
TEST_P(CoarseCounts, AreNoShiftOfTheEfforts) {
  const Case& c = GetParam();
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    const LogTable table = log_of(c, seed);
    TableSource log(table);
    const Setting s = settle(log, robot_of(c), {});
    const Fit fit = fit_log(log, s, Part::everything, 1e-3);
    const auto timing = effort_timing(log, s, fit);
    ASSERT_TRUE(timing.has_value());
    EXPECT_LE(std::abs(timing->delay), 0.25 / c.rate + 3.0 * timing->standard_error) << seed;
    EXPECT_FALSE(is_latency(*timing, 1.0 / c.rate)) << timing->delay;
  }
}

TEST_P(CoarseCounts, LeaveTheMassToBeFound) {
  const Case& c = GetParam();
  for (std::uint64_t seed = 11; seed <= 12; ++seed) {
    const LogTable table = log_of(c, seed);
    TableSource log(table);
    const Commissioning result = commission_robot(log, robot_of(c));
    ASSERT_TRUE(result.has_model()) << result.message;
    const ParameterResult& mass = result.parameters.front();
    ASSERT_TRUE(mass.estimate.has_value());
    EXPECT_NEAR(*mass.estimate, axis(c).mass, 0.05 * axis(c).mass) << seed;
    EXPECT_LE(mass.lower, axis(c).mass) << seed;
    EXPECT_GE(mass.upper, axis(c).mass) << seed;
  }
}

INSTANTIATE_TEST_SUITE_P(Axis, CoarseCounts,
                         ::testing::Values(Case{200.0, 5e-4, 0.0, false}, Case{200.0, 2e-3, 0.06, true},
                                           Case{200.0, 2e-3, 0.06, false}, Case{500.0, 1e-3, 0.0, true},
                                           Case{500.0, 1e-3, 0.0, false}, Case{500.0, 1e-3, 0.03, true},
                                           Case{500.0, 1e-3, 0.03, false}));

}  // namespace
}  // namespace wheelwright::commission::coarse_counts_test
