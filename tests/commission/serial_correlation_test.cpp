// SPDX-License-Identifier: Apache-2.0
// The log's word on errors that are correlated for longer than is declared: not against errors that keep to the
// assumption, whatever their law, and against those that do not.
#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/at_risk/at_risk.hpp"
#include "tests/support/exact_axis.hpp"
#include "tests/support/most_failures.hpp"
#include "tests/support/named_axes.hpp"

namespace wheelwright::commission::serial_correlation_test {
namespace {

using testing_support::ErrorLaw;
using testing_support::ExactAxis;
using testing_support::most_failures;
using testing_support::NamedAxes;
using testing_support::NamedAxis;

// Worlds that keep to what they declare.
std::vector<NamedAxis> worlds() {
  NamedAxes add(30.0);
  add("two_point", [](ExactAxis&) {});
  add("skewed", [](ExactAxis& a) {
    a.law = ErrorLaw::skewed;
    a.deviation = 0.3 * a.bound;
  });
  add("spikes", [](ExactAxis& a) {
    a.law = ErrorLaw::spikes;
    a.deviation = 0.3 * a.bound;
  });
  add("by_speed", [](ExactAxis& a) { a.law = ErrorLaw::by_speed; });
  add("gambler", [](ExactAxis& a) { a.law = ErrorLaw::gambler; });
  add("echo", [](ExactAxis& a) { a.law = ErrorLaw::echo; });
  add("biased", [](ExactAxis& a) { a.bias = 0.1 * a.bound; });
  add("follower", [](ExactAxis& a) {
    a.law = ErrorLaw::follower;
    a.bias = 0.1 * a.bound;
  });
  add("together", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.05;
  });
  add("together_at_uneven_steps", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.05;
    a.jitter = 0.3;
  });
  add("together_for_long", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.5;
    a.seconds = 60.0;
  });
  add("feedback", [](ExactAxis& a) { a.feedback = 30.0; });
  add("slow_clock", [](ExactAxis& a) { a.rate = 20.0; });
  add("coarse", [](ExactAxis& a) { a.count = 2e-3; });
  add("angles_square", [](ExactAxis& a) {
    a.count = 1e-3;
    a.position = testing_support::PositionLaw::square;
  });
  add("quiet", [](ExactAxis& a) {
    a.bound = 0.02;
    a.count = 1e-3;
    a.position = testing_support::PositionLaw::two_point;
  });
  return std::move(add).all();
}

Commissioning learn(const ExactAxis& axis, const Robot& robot, std::uint64_t seed) {
  const LogTable log = drive(axis, seed);
  TableSource source(log);
  return commission_robot(source, robot);
}

// How many of `runs` logs are said to contradict what `robot` declares.
std::size_t told(const ExactAxis& axis, const Robot& robot, std::size_t runs, std::uint64_t first, double test_risk) {
  const Commissioning guaranteed = learn(axis, robot, first);  // its set holds the truth whatever the seed
  EXPECT_TRUE(guaranteed.has_model()) << guaranteed.message;
  if (guaranteed.model.warrant != core::Warrant::guaranteed) {
    return runs;  // the premises tell it already: such errors look like an offset, or like parameters that change
  }
  std::size_t count = 0;
  for (std::size_t k = 1; k <= runs; ++k) {
    const LogTable log = drive(axis, first + k);
    TableSource source(log);
    Commissioning result = guaranteed;
    result.assumptions.clear();
    result.model.at_risk.reset();
    AtRiskOptions options;
    options.test_risk = test_risk;
    learn_at_risk(source, result, options);
    const auto said = std::ranges::find(result.assumptions, kNoiseAverages, &core::Assumption::id);
    EXPECT_NE(said, result.assumptions.end());
    count += said->verdict == core::AssumptionVerdict::fails ? 1 : 0;
  }
  return count;
}

class SerialCorrelation : public ::testing::TestWithParam<NamedAxis> {};

TEST_P(SerialCorrelation, ErrorsThatKeepToTheAssumptionAreRarelySaidNotTo) {
  constexpr std::size_t kRuns = 60;
  constexpr double kRisk = 0.15;
  EXPECT_LE(told(GetParam().axis, robot_of(GetParam().axis), kRuns, 1, kRisk), most_failures(kRuns, kRisk));
}

INSTANTIATE_TEST_SUITE_P(Worlds, SerialCorrelation, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

class SlowSerialCorrelation : public SerialCorrelation {};

TEST_P(SlowSerialCorrelation, ErrorsThatKeepToTheAssumptionAreRarelySaidNotTo) {
  constexpr std::size_t kRuns = 1000;
  const double kRisk = 0.15;
  const std::size_t count = told(GetParam().axis, robot_of(GetParam().axis), kRuns, 1, kRisk);
  std::cout << GetParam().name << ": " << count << " of " << kRuns << " logs are said to contradict, at a risk of "
            << kRisk << '\n';
  EXPECT_LE(count, most_failures(kRuns, kRisk));
}

INSTANTIATE_TEST_SUITE_P(Worlds, SlowSerialCorrelation, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

// Errors that are the same for `ratio` times as long as is declared.
struct Longer {
  double ratio = 1.0, declared = 0.05;  // s
  double seconds = 60.0;
};

std::size_t told(const Longer& longer, std::size_t runs) {
  ExactAxis axis;
  axis.law = ErrorLaw::together;
  axis.correlation = longer.ratio * longer.declared;
  axis.seconds = longer.seconds;
  Robot robot = robot_of(axis);
  robot.noise.effort.correlation = longer.declared;
  return told(axis, robot, runs, 1, AtRiskOptions{}.test_risk);
}

TEST(SerialCorrelationTold, OfErrorsThatAreAlikeForTenTimesAsLong) {
  constexpr std::size_t kRuns = 20;
  for (const Longer& longer : {Longer{.ratio = 10.0}, Longer{.ratio = 30.0}}) {
    EXPECT_GE(told(longer, kRuns), kRuns - 1) << longer.ratio;
  }
}

TEST(SerialCorrelationTold, OfErrorsThatAreAlikeForThreeTimesAsLongByALongLog) {
  constexpr std::size_t kRuns = 5;
  EXPECT_EQ(told({.ratio = 3.0, .declared = 0.3, .seconds = 300.0}, kRuns), kRuns);
}

TEST(SlowSerialCorrelationTold, ByRatioAndLength) {
  constexpr std::size_t kRuns = 100;
  for (const double declared : {0.05, 0.3}) {
    for (const double seconds : {60.0, 300.0}) {
      for (const double ratio : {1.0, 2.0, 3.0, 10.0, 30.0}) {
        const std::size_t count = told({ratio, declared, seconds}, kRuns);
        std::cout << "declared " << declared << " s, " << ratio << " times as long, " << seconds << " s: told by "
                  << count << " of " << kRuns << " logs\n";
        if (ratio == 1.0) {
          EXPECT_LE(count, most_failures(kRuns, AtRiskOptions{}.test_risk));
        } else if (ratio >= 10.0 && ratio * declared * 20.0 <= seconds) {
          EXPECT_GE(count, kRuns - kRuns / 20) << ratio;
        }
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission::serial_correlation_test
