// SPDX-License-Identifier: Apache-2.0
// The set and the detector at a stated risk, on an axis solved in closed form under the worst laws of errors that the
// assumptions allow. Risks are large here, so that a few hundred runs would show a promise that is broken; the campaign
// (SlowAtRisk) has the runs that the promise is stated for.
#include "commission/at_risk/at_risk.hpp"

#include <cmath>
#include <iostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/noise_budget.hpp"
#include "detector/detector.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/online_model.hpp"
#include "tests/support/exact_axis.hpp"
#include "tests/support/most_failures.hpp"
#include "tests/support/named_axes.hpp"

namespace wheelwright::commission::risk_set_test {
namespace {

using testing_support::ErrorLaw;
using testing_support::ExactAxis;
using testing_support::most_failures;
using testing_support::NamedAxes;
using testing_support::NamedAxis;

Commissioning learn(const ExactAxis& axis, std::uint64_t seed) {
  const LogTable log = drive(axis, seed);
  TableSource source(log);
  return commission_robot(source, robot_of(axis));
}

// How often the true parameters are outside the set at a risk of 1e-2, and the median width relative to the guaranteed.
struct Coverage {
  std::size_t sets = 0, outside = 0;
  double ratio = 0.0;
};

Coverage coverage(const ExactAxis& axis, std::size_t runs, std::uint64_t first) {
  Coverage result;
  std::vector<double> ratios;
  // The guaranteed set of one log serves them all: it holds the truth whatever the seed.
  const Commissioning model = learn(axis, first);
  EXPECT_TRUE(model.has_model()) << model.message;
  const auto classes = error_classes(model.model.robot, model.model.measurement);
  EXPECT_TRUE(classes.has_value());
  for (std::size_t k = 0; k < runs; ++k) {
    const LogTable log = drive(axis, first + 1 + k);
    TableSource source(log);
    RiskSetOptions options;
    options.risk = 1e-2;
    const RiskSet set = risk_set(source, model.model.model, model.model.measurement, model.row_errors, *classes,
                                 *model.feasible.polytope, options);
    ++result.sets;
    const std::vector<double> truth{axis.mass, axis.viscous};
    if (!set.set || !set.set->contains(truth)) {
      ++result.outside;
      continue;
    }
    const Interval wide = model.feasible.hull.sides[0], narrow = set.set->hull().sides[0];
    ratios.push_back((narrow.upper - narrow.lower) / (wide.upper - wide.lower));
  }
  std::ranges::sort(ratios);
  result.ratio = ratios.empty() ? 1.0 : ratios[ratios.size() / 2];
  return result;
}

std::vector<NamedAxis> worlds() {
  NamedAxes add(30.0);
  add("two_point", [](ExactAxis&) {});
  add("uniform", [](ExactAxis& a) { a.law = ErrorLaw::uniform; });
  add("uniform_declared", [](ExactAxis& a) {
    a.law = ErrorLaw::uniform;
    a.deviation = a.bound / std::sqrt(3.0);
  });
  add("spikes", [](ExactAxis& a) {
    a.law = ErrorLaw::spikes;
    a.deviation = 0.3 * a.bound;
  });
  add("skewed", [](ExactAxis& a) {
    a.law = ErrorLaw::skewed;
    a.deviation = 0.3 * a.bound;
  });
  add("skewed_rarely", [](ExactAxis& a) {
    a.law = ErrorLaw::skewed;
    a.deviation = 0.05 * a.bound;
  });
  add("biased", [](ExactAxis& a) { a.bias = 0.1 * a.bound; });
  add("by_speed", [](ExactAxis& a) { a.law = ErrorLaw::by_speed; });
  add("gambler", [](ExactAxis& a) { a.law = ErrorLaw::gambler; });
  add("together", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.05;
    a.bound = 1.0;
  });
  add("feedback", [](ExactAxis& a) { a.feedback = 30.0; });
  add("uneven_steps", [](ExactAxis& a) { a.jitter = 0.3; });
  add("slow_clock", [](ExactAxis& a) { a.rate = 20.0; });
  add("coarse", [](ExactAxis& a) { a.count = 2e-3; });
  add("angles_two_point", [](ExactAxis& a) {
    a.count = 1e-3;
    a.position = testing_support::PositionLaw::two_point;
  });
  add("angles_square", [](ExactAxis& a) {
    a.count = 1e-3;
    a.position = testing_support::PositionLaw::square;
  });
  add("barely_apart", [](ExactAxis& a) {
    a.law = ErrorLaw::together;
    a.correlation = 0.02;
    a.bound = 1.0;
    a.deviation = 1.0;
  });
  return std::move(add).all();
}

class AtRisk : public ::testing::TestWithParam<NamedAxis> {};

TEST_P(AtRisk, TheSetHoldsTheTruthAsOftenAsItSays) {
  constexpr std::size_t kRuns = 120;
  const Coverage c = coverage(GetParam().axis, kRuns, 1);
  EXPECT_LE(c.outside, most_failures(kRuns, 1e-2));
  EXPECT_LT(c.ratio, 1.0);
  RecordProperty("outside", static_cast<int>(c.outside));
  RecordProperty("ratio", std::to_string(c.ratio));
}

// Runs with a false alarm, of `runs` in which `per_run` are to be expected at most.
std::size_t runs_with_alarm(const ExactAxis& axis, const OnlineModel& model, std::size_t runs, double per_run) {
  std::size_t alarms = 0;
  for (std::size_t k = 0; k < runs; ++k) {
    const LogTable log = drive(axis, 100 + k);
    detector::ScaleDetector detector(model, {.false_alarms = per_run / axis.seconds});
    bool alarm = false;
    for (std::size_t i = 0; i < log.rows(); ++i) {
      const double sample[2] = {log.columns[0][i], log.columns[1][i]};
      alarm = (detector.step(log.t[i], sample) && detector.alarm()) || alarm;
    }
    alarms += alarm ? 1 : 0;
  }
  return alarms;
}

TEST_P(AtRisk, TheDetectorRaisesNoMoreFalseAlarmsThanItSays) {
  constexpr std::size_t kRuns = 60;
  const Commissioning model = learn(GetParam().axis, 1);
  ASSERT_TRUE(model.has_model()) << model.message;
  ASSERT_TRUE(model.model.at_risk) << testing::PrintToString(model.notes);
  EXPECT_LE(runs_with_alarm(GetParam().axis, model.model, kRuns, 1e-2), most_failures(kRuns, 1e-2));
}

INSTANTIATE_TEST_SUITE_P(Worlds, AtRisk, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

// With as many runs as the promise is stated for.
class SlowAtRisk : public AtRisk {};

TEST_P(SlowAtRisk, TheSetHoldsTheTruthAsOftenAsItSays) {
  constexpr std::size_t kRuns = 10000;
  const Coverage c = coverage(GetParam().axis, kRuns, 1);
  std::cout << GetParam().name << ": truth outside in " << c.outside << " of " << kRuns << " runs, width " << c.ratio
            << " of the guaranteed\n";
  EXPECT_LE(c.outside, kRuns / 100);
}

TEST_P(SlowAtRisk, TheDetectorRaisesNoMoreFalseAlarmsThanItSays) {
  constexpr std::size_t kRuns = 10000;
  const Commissioning model = learn(GetParam().axis, 1);
  ASSERT_TRUE(model.model.at_risk) << testing::PrintToString(model.notes);
  const std::size_t alarms = runs_with_alarm(GetParam().axis, model.model, kRuns, 1e-2);
  std::cout << GetParam().name << ": a false alarm in " << alarms << " of " << kRuns << " runs\n";
  EXPECT_LE(alarms, kRuns / 100);
}

// The same model with a set that is nothing but the truth: what is left is the bound on errors and the looks' union.
OnlineModel known(OnlineModel model, const ExactAxis& axis) {
  const double truth[2] = {axis.mass, axis.viscous};
  model.at_risk->facets.clear();
  for (Eigen::Index j = 0; j < 2; ++j) {
    Interval& side = model.at_risk->box.sides[static_cast<std::size_t>(j)];
    side = {std::nextafter(truth[j], 0.0), std::nextafter(truth[j], 1e300)};
    model.estimate[j] = truth[j];
    for (const double sign : {1.0, -1.0}) {
      bounds::HalfSpace facet;
      facet.a = sign * Eigen::Vector2d::Unit(j);
      facet.b = sign > 0.0 ? side.upper : -side.lower;
      model.at_risk->facets.push_back(facet);
    }
  }
  return model;
}

TEST_P(SlowAtRisk, OfAKnownRobotThereAreAsManyFalseAlarmsAsTheSumsAllow) {
  constexpr std::size_t kRuns = 10000;
  const Commissioning model = learn(GetParam().axis, 1);
  ASSERT_TRUE(model.model.at_risk) << testing::PrintToString(model.notes);
  const std::size_t alarms = runs_with_alarm(GetParam().axis, known(model.model, GetParam().axis), kRuns, 1e-2);
  std::cout << GetParam().name << ", known: a false alarm in " << alarms << " of " << kRuns << " runs\n";
  EXPECT_LE(alarms, kRuns / 100);
}

INSTANTIATE_TEST_SUITE_P(Worlds, SlowAtRisk, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

// Random axes, laws and rates from 10 to 500 Hz, watched for half a million samples each at one false alarm in ten
// years: 10⁸ samples a seed.
class SlowAtRiskRobots : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SlowAtRiskRobots, RaiseNoFalseAlarm) {
  constexpr std::size_t kRobots = 200;
  constexpr double kRows = 5e5;
  std::mt19937_64 random(GetParam());
  const auto between = [&](double a, double b) { return a * std::pow(b / a, std::ldexp(random() >> 11, -53)); };
  std::size_t robots = 0, silent = 0, alarms = 0, contradicted = 0, refused = 0;
  double rows = 0.0, years = 0.0;
  for (std::size_t k = 0; k < kRobots; ++k) {
    ExactAxis axis;
    axis.mass = between(2.0, 100.0);
    axis.viscous = between(0.5, 30.0);
    axis.rate = between(10.0, 500.0);
    axis.seconds = 60.0;
    axis.bound = between(0.05, 4.0);
    axis.bias = random() % 2 == 0 ? 0.0 : between(0.001, 0.2) * axis.bound;
    axis.count = between(1e-5, 1e-3);
    axis.jitter = random() % 2 == 0 ? 0.0 : between(0.01, 0.4);
    axis.feedback = random() % 3 == 0 ? between(1.0, 30.0) : 0.0;
    axis.law = static_cast<ErrorLaw>(random() % 7);
    if (axis.law == ErrorLaw::together) {
      axis.correlation = between(1.0, 8.0) / axis.rate;
    }
    if (axis.law == ErrorLaw::spikes || axis.law == ErrorLaw::skewed) {
      axis.deviation = between(0.03, 0.9) * (axis.bound - axis.bias);
    }
    Commissioning model;
    try {
      model = learn(axis, 2 * k + 1);
    } catch (const Error&) {
      ++refused;
      continue;
    }
    if (!model.model.at_risk) {
      ++silent;
      const auto said = std::ranges::find(model.assumptions, kNoiseAverages, &core::Assumption::id);
      contradicted += said != model.assumptions.end() && said->verdict == core::AssumptionVerdict::fails ? 1 : 0;
      continue;
    }
    ++robots;
    axis.seconds = kRows / axis.rate;
    const LogTable log = drive(axis, 2 * k + 2);
    detector::ScaleDetector detector(model.model);
    bool alarm = false;
    for (std::size_t i = 0; i < log.rows(); ++i) {
      const double sample[2] = {log.columns[0][i], log.columns[1][i]};
      alarm = (detector.step(log.t[i], sample) && detector.alarm()) || alarm;
    }
    alarms += alarm ? 1 : 0;
    rows += static_cast<double>(log.rows());
    years += axis.seconds / (365.25 * 86400.0);
  }
  std::cout << "seed " << GetParam() << ": " << robots << " robots, " << rows << " samples, " << years
            << " years, robots with a "
            << "false alarm " << alarms << "; nothing said at a risk: " << silent << ", contradicted: " << contradicted
            << ", refused: " << refused << '\n';
  EXPECT_EQ(alarms, 0u);
  EXPECT_LE(contradicted, kRobots / 100);
  EXPECT_GT(robots, kRobots / 2);
}

INSTANTIATE_TEST_SUITE_P(Seeds, SlowAtRiskRobots, ::testing::Range<std::uint64_t>(1, 11));

// Assumptions that are broken: where a later drive would raise a false alarm, the log that the robot was commissioned
// on had said so.
TEST(SlowBrokenAssumption, IsToldBeforeFalseAlarmsCome) {
  struct Broken {
    std::string name;
    double bias, correlation;   // what errors have, in bounds and s
    double declared, together;  // what the robot file says
  };
  for (const Broken& b :
       {Broken{"bias twice as large", 0.2, 0.0, 0.1, 0.0}, Broken{"bias five times as large", 0.5, 0.0, 0.1, 0.0},
        Broken{"bias ten times as large", 0.5, 0.0, 0.05, 0.0},
        Broken{"correlation ten times as long", 0.0, 0.5, 0.0, 0.05},
        Broken{"correlation where there is said to be none", 0.0, 0.1, 0.0, 0.0}}) {
    constexpr std::size_t kRuns = 300;
    std::size_t told = 0, alarms = 0;
    for (std::size_t k = 0; k < kRuns; ++k) {
      ExactAxis axis;
      axis.bias = b.bias * axis.bound;
      axis.correlation = b.correlation;
      axis.law = b.correlation > 0.0 ? ErrorLaw::together : ErrorLaw::two_point;
      const LogTable learnt = drive(axis, 2 * k + 1);
      Robot robot = robot_of(axis);
      robot.noise.effort.bias = b.declared * axis.bound;
      robot.noise.effort.correlation = b.together;
      robot.parameters = {"inertia", "viscous"};  // an offset as a parameter would learn the bias
      TableSource source(learnt);
      const Commissioning c = commission_robot(source, robot);
      if (!c.model.at_risk) {
        ++told;
        continue;
      }
      const LogTable log = drive(axis, 2 * k + 2);
      detector::ScaleDetector detector(c.model);
      bool alarm = false;
      for (std::size_t i = 0; i < log.rows(); ++i) {
        const double sample[2] = {log.columns[0][i], log.columns[1][i]};
        alarm = (detector.step(log.t[i], sample) && detector.alarm()) || alarm;
      }
      alarms += alarm ? 1 : 0;
    }
    std::cout << b.name << ": told by " << told << " of " << kRuns << " logs, false alarms after the other " << alarms
              << '\n';
    EXPECT_LE(20 * alarms, told + alarms) << b.name;
  }
}

TEST(RiskSet, IsSharperThanTheWorstCase) {
  ExactAxis axis;
  axis.seconds = 120.0;
  const Commissioning c = learn(axis, 1);
  ASSERT_TRUE(c.at_risk && c.at_risk->set) << testing::PrintToString(c.notes);
  EXPECT_EQ(c.at_risk->risk, 1e-9);
  for (std::size_t j = 0; j < 2; ++j) {
    const Interval wide = c.feasible.hull.sides[j], narrow = c.at_risk->set->hull().sides[j];
    EXPECT_LT(narrow.upper - narrow.lower, 0.3 * (wide.upper - wide.lower)) << j;
  }
}

// A declared deviation brings nearly as much as its share of the bound.
TEST(RiskSet, IsSharperWhereADeviationIsDeclared) {
  ExactAxis axis;
  axis.seconds = 120.0;
  axis.law = ErrorLaw::spikes;
  axis.deviation = 0.3 * axis.bound;
  const LogTable log = drive(axis, 1);
  Robot robot = robot_of(axis);
  TableSource source(log);
  const Commissioning with = commission_robot(source, robot);
  robot.noise.effort.deviation.reset();
  source.rewind();
  const Commissioning without = commission_robot(source, robot);
  ASSERT_TRUE(with.at_risk && with.at_risk->set && without.at_risk && without.at_risk->set);
  for (std::size_t j = 0; j < 2; ++j) {
    const auto width = [&](const Commissioning& c) {
      const Interval side = c.at_risk->set->hull().sides[j];
      return side.upper - side.lower;
    };
    EXPECT_LT(width(with), 0.6 * width(without)) << j;
  }
}

TEST(RiskSet, ABiasOfTheEffortIsSeenThatTheDeadZoneDoesNotSee) {
  ExactAxis axis;
  axis.seconds = 60.0;
  const Commissioning c = learn(axis, 1);
  ASSERT_TRUE(c.model.at_risk);
  axis.fault_at = 20.0;
  axis.fault_bias = 0.8;  // 0.4 of the bound
  const LogTable log = drive(axis, 2);
  detector::ScaleDetector scales(c.model);
  detector::TorqueDetector dead_zone = make_detector(c.model);
  double first = -1.0;
  bool seen = false;
  for (std::size_t i = 0; i < log.rows(); ++i) {
    const double sample[2] = {log.columns[0][i], log.columns[1][i]};
    scales.step(log.t[i], sample);
    if (scales.alarm() && first < 0.0) {
      first = log.t[i];
    }
    const detector::Decision& decision = dead_zone.step(log.t[i], sample);
    seen = seen || (decision.valid && decision.fault);
  }
  EXPECT_GT(first, 20.0);
  EXPECT_LT(first, 35.0);
  EXPECT_FALSE(seen);
}

// What is called certain is seen: from more than half of all moments, within the time, on another drive of that kind.
TEST(RiskReach, AFaultOfThatSizeIsSeen) {
  ExactAxis axis;
  axis.seconds = 60.0;
  const Commissioning c = learn(axis, 1);
  ASSERT_FALSE(c.reach.empty());
  const RiskReach& bias = c.reach.front();
  ASSERT_EQ(bias.weight.shape, detector::SumWeight::Shape::constant);
  for (std::size_t k = 0; k < bias.within.size(); ++k) {
    ASSERT_TRUE(std::isfinite(bias.size[k]));
    EXPECT_TRUE(k == 0 || bias.size[k] <= bias.size[k - 1]);
    std::size_t seen = 0, runs = 0;
    for (double onset = 7.0; onset + bias.within[k] < axis.seconds; onset += 6.0) {
      ExactAxis faulty = axis;
      faulty.fault_at = onset;
      faulty.fault_bias = bias.size[k];
      const LogTable log = drive(faulty, 50 + runs);
      detector::ScaleDetector detector(c.model);
      double first = 1e300;
      for (std::size_t i = 0; i < log.rows(); ++i) {
        const double sample[2] = {log.columns[0][i], log.columns[1][i]};
        if (detector.step(log.t[i], sample) && detector.alarm()) {
          first = std::min(first, log.t[i]);
        }
      }
      EXPECT_GE(first, onset);
      seen += first <= onset + bias.within[k] ? 1 : 0;
      ++runs;
    }
    EXPECT_GE(2 * seen, runs) << bias.within[k] << " s: " << seen << " of " << runs;
  }
}

// Errors that are more biased, or correlated for longer, than declared: the log says so, and the worst case stands
// alone.
TEST(RiskSet, IsNotSaidWhereTheLogContradictsIt) {
  ExactAxis axis;
  axis.seconds = 60.0;
  axis.law = ErrorLaw::together;
  axis.correlation = 0.5;
  LogTable log = drive(axis, 3);
  Robot robot = robot_of(axis);
  robot.noise.effort.correlation = 0.0;
  TableSource source(log);
  const Commissioning c = commission_robot(source, robot);
  ASSERT_TRUE(c.has_model()) << c.message;
  EXPECT_FALSE(c.model.at_risk);
  const auto found = std::ranges::find(c.assumptions, "noise_averages", &core::Assumption::id);
  ASSERT_NE(found, c.assumptions.end());
  EXPECT_EQ(found->verdict, core::AssumptionVerdict::fails) << found->detail;
  EXPECT_FALSE(c.notes.empty());
}

TEST(RiskSet, IsNotSaidWithoutADeclaredBias) {
  ExactAxis axis;
  axis.seconds = 30.0;
  const LogTable log = drive(axis, 3);
  Robot robot = robot_of(axis);
  robot.noise.effort.bias.reset();
  TableSource source(log);
  const Commissioning c = commission_robot(source, robot);
  EXPECT_FALSE(c.at_risk);
  EXPECT_FALSE(c.model.at_risk);
}

}  // namespace
}  // namespace wheelwright::commission::risk_set_test
