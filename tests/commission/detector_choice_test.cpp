// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/detector_choice.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::detector_choice_test {
namespace {

using ::testing::HasSubstr;
using testing_support::Commissioned;
using testing_support::exact_drive;
using testing_support::FaultyRun;
using testing_support::noisy_drive;
using testing_support::Shown;

FilterDesign design_of(int order, double beta) { return {.order = order, .alpha = beta, .beta = beta}; }

LogTable log_of(const Scenario& scenario) {
  Simulation source(scenario);
  return read_all(source);
}

// Few onsets of one fault: margins are exact at each.
TrialOptions few() { return {.faults = {{"wheel_radius", 0.2}}, .window = 0.5, .most_onsets = 8, .commission = {}}; }

// A drive of which speeds are logged, for both orders; noise inside what is declared.
Scenario speeds_drive() {
  Scenario s = exact_drive(Shown::speeds, Hold::zero_order);
  s.duration = 12.0;
  s.trajectory.period = 2.4;
  s.sensors.effort = 0.01;
  s.robot.noise.effort.value = 0.02;
  s.robot.noise.wheel_speed.value = 0.01;
  s.robot.filter = {};
  s.robot.wheel_directions_checked = true;
  s.seed = 3;
  return s;
}

void expect_same(const DetectorCandidate& a, const DetectorCandidate& b, double tolerance) {
  ASSERT_EQ(a.faults.size(), b.faults.size());
  for (std::size_t i = 0; i < a.faults.size(); ++i) {
    EXPECT_NEAR(a.faults[i].median / b.faults[i].median, 1.0, tolerance);
    EXPECT_EQ(a.faults[i].delay, b.faults[i].delay);
  }
}

// The gain scales residual and threshold alike; sizes are found to 1e-9, the set's vertices to rounding.
TEST(DetectorChoice, AlphaChangesNothing) {
  const Scenario s = noisy_drive(5);
  const LogTable log = log_of(s);
  FilterDesign filter = design_of(2, 8.0);
  const Trial one = try_detector(log, s.robot, filter, {{}}, "", few());
  filter.alpha = 32.0;
  const Trial other = try_detector(log, s.robot, filter, {{}}, "", few());
  ASSERT_EQ(one.candidates[0].failure, "");
  ASSERT_LT(one.candidates[0].faults[0].median, 0.5);
  expect_same(one.candidates[0], other.candidates[0], 1e-5);
}

TEST(DetectorChoice, SeveralOfSeveralNeverGainUnderTheSameBounds) {
  const Scenario s = noisy_drive(6);
  const auto candidates =
      try_detector(log_of(s), s.robot, design_of(2, 8.0), {{1, 1}, {2, 3}, {3, 5}, {5, 5}}, "", few()).candidates;
  ASSERT_EQ(candidates.size(), 4u);
  bool loses = false;
  for (const DetectorCandidate& candidate : candidates) {
    ASSERT_EQ(candidate.failure, "");
    ASSERT_EQ(candidate.faults.size(), 2u);  // growing and shrinking
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_GE(candidate.faults[i].median, candidates[0].faults[i].median);
      EXPECT_GE(candidate.faults[i].worst, candidates[0].faults[i].worst);
      EXPECT_GE(candidate.faults[i].delay, candidates[0].faults[i].delay);
      loses = loses || candidate.faults[i].median > candidates[0].faults[i].median;
    }
  }
  EXPECT_TRUE(loses);
}

// The confidence leaves P for the rows of the log and of an hour together, at equal bounds.
TEST(DetectorChoice, AnHourOfFalseAlarmsAsAConfidence) {
  EXPECT_DOUBLE_EQ(1.0 - hourly_confidence(0.25, 360000.0, 0.01), 0.125);    // a log of one hour
  EXPECT_DOUBLE_EQ(1.0 - hourly_confidence(0.5, 360000.0, 0.01, 3), 0.125);  // three learn from it, one drives
  for (const double rows : {1200.0, 1e7}) {
    const double failures = 1.0 - hourly_confidence(1e-3, rows, 0.01);
    EXPECT_NEAR(failures / rows * (rows + 360000.0), 1e-3, 1e-9);
  }
  for (const double wrong : {0.0, 1.0, -0.1, std::nan("")}) {
    EXPECT_THROW(static_cast<void>(hourly_confidence(wrong, 1000.0, 0.01)), InvalidArgument);
  }
}

TEST(DetectorChoice, BoundsThatMayFailAreNeverWider) {
  const Scenario s = speeds_drive();
  const LogTable log = log_of(s);
  TrialOptions options = few();
  bool narrower = false;
  for (const auto& [order, beta] : {std::pair(1, 8.0), std::pair(2, 8.0), std::pair(2, 30.0)}) {
    options.false_alarms = 0.0;
    const Trial never = try_detector(log, s.robot, design_of(order, beta), {{}}, "", options);
    options.false_alarms = 1e-3;
    const Trial hourly = try_detector(log, s.robot, design_of(order, beta), {{}}, "", options);
    ASSERT_EQ(never.candidates[0].failure + hourly.candidates[0].failure, "");
    EXPECT_EQ(never.candidates[0].guarantee, Guarantee::never);
    EXPECT_EQ(hourly.candidates[0].guarantee, Guarantee::hourly);
    const filter::SignalErrors& wide = never.commissioning->model.errors;
    const filter::SignalErrors& tight = hourly.commissioning->model.errors;
    EXPECT_TRUE((tight.output.array() <= wide.output.array()).all());
    EXPECT_TRUE((tight.speed.array() <= wide.speed.array()).all());
    EXPECT_TRUE((tight.acceleration.array() <= wide.acceleration.array()).all());
    narrower = narrower || tight.output[0] < 0.9 * wide.output[0];
    EXPECT_LE(hourly.candidates[0].faults[0].median, never.candidates[0].faults[0].median * (1.0 + 1e-9));
  }
  EXPECT_TRUE(narrower);
}

Scenario averaging_drive() {
  Scenario s = noisy_drive(8, 20.0);
  s.robot.noise.effort.bias = 0.0;
  s.robot.effort_changes = model::EffortChanges::at_samples;
  return s;
}

// Sums do not pass through the filter: of two filters, whose guaranteed sizes differ, they promise nearly the same.
TEST(DetectorChoice, TheFilterHardlyMattersAtTheRisk) {
  const Scenario s = averaging_drive();
  const LogTable log = log_of(s);
  TrialOptions options = few();
  options.faults = {{"effort_bias_right", 0.1}};
  options.window = 5.0;
  std::vector<StatedMargin> margins;
  for (const double beta : {4.0, 30.0}) {
    const DetectorCandidate candidate = try_detector(log, s.robot, design_of(2, beta), {{}}, "", options).candidates[0];
    ASSERT_EQ(candidate.failure, "");
    ASSERT_TRUE(candidate.miss && candidate.faults[0].at_risk && candidate.faults[0].either);
    margins.push_back(candidate.faults[0]);
  }
  EXPECT_GT(std::abs(margins[0].median / margins[1].median - 1.0), 0.1);
  EXPECT_NEAR(margins[0].at_risk->median / margins[1].at_risk->median, 1.0, 0.05);
  for (const StatedMargin& margin : margins) {
    EXPECT_LT(margin.at_risk->median, margin.median);
    EXPECT_LE(margin.either->median, std::min(margin.median, margin.at_risk->median));
    EXPECT_LE(margin.either->delay, std::min(margin.delay, margin.at_risk->delay));
    EXPECT_EQ(margin.medians.back(), margin.median);
    // From that delay on the sums are sharper, just before it they are not.
    const auto from = risk_decides_from(margin, options.window);
    ASSERT_TRUE(from);
    const auto at = static_cast<std::size_t>(std::lround(*from / options.window * 40.0)) - 1;
    for (std::size_t k = at; k < 40; ++k) {
      EXPECT_LT(margin.at_risk->medians[k], margin.medians[k]);
    }
    if (at > 0) {
      EXPECT_GE(margin.at_risk->medians[at - 1], margin.medians[at - 1]);
    }
  }
}

TEST(DetectorChoice, CanCountWhatEitherGuaranteeSees) {
  const Scenario s = averaging_drive();
  DetectorChoiceOptions options{.trial = few()};
  options.trial.faults = {{"effort_loss_right", 0.3}};
  options.trial.window = 2.0;
  options.beta_factor = 4.0;
  options.most_refinements = 0;
  options.persistences.clear();
  options.either = true;
  const LogTable log = log_of(s);
  TableSource source(log);
  const DetectorChoice choice = choose_detector(source, s.robot, options);
  ASSERT_TRUE(choice.chosen);
  ASSERT_TRUE(choice.risk_spread);
  for (const DetectorCandidate& each : choice.candidates) {
    double size = 0.0;
    for (const StatedMargin& margin : each.faults) {
      size = std::max(size, (margin.either ? margin.either->median : margin.median) / margin.asked);
    }
    EXPECT_EQ(each.size, each.failure.empty() ? size : each.size);
    EXPECT_LE(choice.candidates.front().size, each.size * (1.0 + options.tie));
  }
}

TEST(DetectorChoice, TakesTheBestOfItsOwnTable) {
  const Scenario s = speeds_drive();
  const LogTable log = log_of(s);
  DetectorChoiceOptions options{.trial = few()};
  options.beta_factor = 3.0;
  options.most_refinements = 3;
  TableSource source(log);
  const DetectorChoice choice = choose_detector(source, s.robot, options);
  ASSERT_TRUE(choice.chosen.has_value());
  const DetectorCandidate& chosen = choice.candidates.front();
  std::map<std::string, int> origins;
  std::map<int, int> orders;
  double before = 0.0;
  const double least = std::ranges::min(choice.candidates, {}, &DetectorCandidate::size).size;
  for (std::size_t i = 0; i < choice.candidates.size(); ++i) {
    const DetectorCandidate& each = choice.candidates[i];
    ++origins[each.origin];
    ++orders[each.filter.order];
    EXPECT_LE(chosen.size, each.size * (1.0 + options.tie));
    EXPECT_TRUE(each.delay >= chosen.delay || each.size > least * (1.0 + options.tie));
    double size = 0.0;
    for (const StatedMargin& margin : each.faults) {
      size = std::max(size, margin.median / margin.asked);
    }
    EXPECT_EQ(each.size, each.failure.empty() ? size : each.size);
    if (i > 0) {
      EXPECT_GE(each.size, before);
      before = each.size;
    }
  }
  EXPECT_GT(orders[1], 2);
  EXPECT_GT(orders[2], 2);
  for (const char* origin : {"grid", "the paper's", "what commissioning takes", "the chosen filter"}) {
    EXPECT_GT(origins[origin], 0) << origin;
  }
  EXPECT_EQ(choice.chosen->model.filter.beta, chosen.filter.beta);
  EXPECT_EQ(choice.chosen->model.filter.order, chosen.filter.order);
  // The same on two threads.
  options.trial.threads = 2;
  const DetectorChoice again = choose_detector(source, s.robot, options);
  ASSERT_EQ(again.candidates.size(), choice.candidates.size());
  for (std::size_t i = 0; i < choice.candidates.size(); ++i) {
    EXPECT_EQ(again.candidates[i].size, choice.candidates[i].size);
    EXPECT_EQ(again.candidates[i].filter.beta, choice.candidates[i].filter.beta);
  }
}

// What cannot be commissioned is told: noise declared far too small, an order that angles do not allow.
TEST(DetectorChoice, TellsWhatCannotBe) {
  Scenario s = noisy_drive(7);
  s.sensors.effort = 5.0;
  s.robot.noise.effort.value = 0.001;
  const LogTable log = log_of(s);
  DetectorChoiceOptions options{.trial = few()};
  options.beta_factor = 6.0;
  TableSource source(log);
  const DetectorChoice choice = choose_detector(source, s.robot, options);
  EXPECT_FALSE(choice.chosen.has_value());
  ASSERT_FALSE(choice.candidates.empty());
  for (const DetectorCandidate& candidate : choice.candidates) {
    EXPECT_THAT(candidate.failure, HasSubstr("declared noise"));
  }
  EXPECT_THAT(choice.notes.front(), HasSubstr("order 1 is left out"));
  options.trial.faults = {{"wheel_radios", 0.1}};
  EXPECT_THROW(static_cast<void>(choose_detector(source, s.robot, options)), InvalidArgument);
  options.trial.faults = {{"wheel_radius", 0.9}};
  EXPECT_THROW(static_cast<void>(choose_detector(source, s.robot, options)), InvalidArgument);
  options.trial.faults = {{"effort_bias_right"}};
  EXPECT_THROW(static_cast<void>(choose_detector(source, s.robot, options)), InvalidArgument);
}

// A gain error of an encoder does not change the motion, so the promise for a healthy drive holds for the faulty one: a
// fault of the size that is certain there is seen within the window, and none is seen before it.
TEST(DetectorChoice, KeepsWhatItPromises) {
  const Scenario s = noisy_drive(8);
  const LogTable log = log_of(s);
  DetectorChoiceOptions options{.trial = few()};
  options.trial.faults = {{"encoder_scale_right", 0.3}};
  options.beta_factor = 4.0;
  options.most_refinements = 2;
  TableSource source(log);
  const DetectorChoice choice = choose_detector(source, s.robot, options);
  ASSERT_TRUE(choice.chosen.has_value());
  const Commissioned robot{s, choice.chosen->model};
  const testing_support::Breakage breakage{"encoder_scale_right", std::nullopt};
  int promised = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const FaultyRun run = testing_support::random_run(robot, seed, breakage);
    for (const double window : {0.1, options.trial.window}) {
      const double certain = testing_support::promise(run, 0.0, window, 0.0).certain;
      if (!std::isfinite(certain)) {
        continue;
      }
      const auto outcome = testing_support::watch(run, run.side * certain);
      EXPECT_FALSE(outcome.early) << seed;
      EXPECT_LE(outcome.first, window + 1.0 / s.rate) << seed;  // the onset lies between two samples
      ++promised;
    }
  }
  EXPECT_GE(promised, 4);
}

}  // namespace
}  // namespace wheelwright::commission::detector_choice_test
