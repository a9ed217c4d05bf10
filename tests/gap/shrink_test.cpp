// SPDX-License-Identifier: Apache-2.0
// What is promised of a model with its causes, against fresh logs of the same simulated world.
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "gap/improved_robot.hpp"
#include "gap/shrink.hpp"
#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::shrink_test {
namespace {

using gap_example::effect_called;
using gap_example::fit_effects;
using gap_example::plain_robot;
using gap_example::simulated_drive;

constexpr double kCounts = 16384.0;

Robot file() {
  Robot robot = plain_robot();
  robot.encoder_counts_per_turn = kCounts;
  return robot;
}

PreparedGap prepared_log(const Robot& world, std::uint64_t seed, double period) {
  Scenario s = simulated_drive(world, 40.0);
  s.trajectory.period = period;
  s.sensors.sampling = sim::Sampling::interval;
  s.sensors.encoder_counts_per_turn = kCounts;
  s.sensors.effort = 0.05;
  s.sensors.position = 0.002;
  s.sensors.heading = 0.003;
  s.seed = seed;
  Simulation log(s);
  return prepare_gap(log, nullptr, file(), {});
}

struct World {
  Robot robot = plain_robot();
  std::vector<FittedEffect> causes;
};

World with(const std::string& name, const std::string& parameter, double value, std::vector<double> shape = {}) {
  World world;
  world.robot.effects = {{name, {{parameter, {value, value}}}}};
  world.causes = {{effect_called(name), std::move(shape), {}}};
  return world;
}

struct Found {
  Eigen::VectorXd theta;
  ShrinkCauses causes;
};

Found found_on(const PreparedGap& log, const World& world) {
  Found found;
  std::vector<FittedEffect> fitted;
  std::tie(found.theta, fitted) = fit_effects(log.drive, world.causes, true);
  std::string why_not;
  found.causes = {fitted, BaseModel::refitted, improved_robot(file(), log.drive, found.theta, fitted, {}, why_not)};
  EXPECT_TRUE(found.causes.improved) << why_not;
  return found;
}

GapShrink measured(const PreparedGap& log, const ShrinkCauses& causes, bool commissioning = false,
                   std::size_t threads = 1) {
  std::vector<std::string> notes;
  GapShrink shrink = measure_shrink(
      file(), log, causes, {.blocks = {.blocks = 10}, .commissioning = commissioning, .threads = threads}, notes);
  for (const std::string& note : notes) {
    ADD_FAILURE() << note;
  }
  return shrink;
}

double rms(const Eigen::VectorXd& x) { return std::sqrt(x.squaredNorm() / static_cast<double>(x.size())); }

// Filtered efforts of `log` that θ and causes found elsewhere leave.
std::vector<double> left_on(PreparedGap log, const Found& found) {
  predict_efforts(log.drive, found.theta);
  const GapRows rows = make_gap_rows(log.drive, log.floor, found.causes.causes, log.row_options);
  return {rms(rows.spaces[0].response), rms(rows.spaces[1].response)};
}

// Another drive of the same world, its sensors with other noise; nothing is fitted to it.
class Promise : public testing::TestWithParam<World> {};

TEST_P(Promise, IsWhatAFreshLogShows) {
  const PreparedGap log = prepared_log(GetParam().robot, 3, 8.0), fresh = prepared_log(GetParam().robot, 9, 9.0);
  const Found found = found_on(log, GetParam());
  const GapShrink promised = measured(log, found.causes);
  const std::vector<double> left = left_on(fresh, found);
  const std::vector<double> before = left_on(fresh, {fresh.drive.theta, {}});
  ASSERT_EQ(promised.torque_rms.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const ShrinkFigure& f = promised.torque_rms[i];
    const double shrink = 1.0 - left[i] / before[i];
    EXPECT_NEAR(1.0 - f.after / f.before, shrink, 0.1 * shrink) << f.name;
    EXPECT_LT(f.after, 0.3 * f.before) << f.name;
    EXPECT_NEAR(f.after, left[i], f.upper - f.lower) << f.name;  // two means of as many blocks
    EXPECT_LT(f.upper - f.lower, 0.5 * f.after) << f.name;
    EXPECT_LE(f.lower, f.after);
    EXPECT_GE(f.upper, f.after);
  }
  const Robot& improved = *found.causes.improved;
  const std::vector<Eigen::Index> starts = rollout_starts(fresh.drive, {}, rollout_margin(improved));
  const std::vector<RolloutErrors> with_causes = rollouts(fresh.drive, improved, starts);
  const std::vector<RolloutErrors> nominal = rollouts(fresh.drive, file(), starts);
  ASSERT_EQ(promised.rollout.size(), 8u);
  EXPECT_EQ(promised.rollout[0].name, "velocity_1s");
  EXPECT_EQ(promised.rollout[7].name, "heading_5s");
  for (std::size_t h = 0; h < 2; ++h) {
    std::size_t q = 4 * h;
    for (const auto quantity :
         {&RolloutErrors::velocity, &RolloutErrors::yaw_rate, &RolloutErrors::position, &RolloutErrors::heading}) {
      const ShrinkFigure& f = promised.rollout[q++];
      const double shrink = 1.0 - rms(with_causes[h].*quantity) / rms(nominal[h].*quantity);
      EXPECT_NEAR(1.0 - f.after / f.before, shrink, 0.1 * shrink) << f.name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, Promise,
                         testing::Values(with("actuator_lag", "T", 0.06, {0.06}), with("coulomb", "c", 0.3),
                                         with("viscous_asymmetric", "b", 0.05, {0.0})),
                         [](const auto& test) { return test.param.causes.front().effect.name; });

TEST(Shrink, WithoutAnEffectBeforeAndAfterAreTheFloor) {
  const PreparedGap log = prepared_log(plain_robot(), 5, 8.0);
  const GapShrink shrink = measured(log, found_on(log, {}).causes);
  for (const ShrinkFigure& f : shrink.torque_rms) {
    EXPECT_NEAR(f.before / f.floor, 1.0, 0.15) << f.name;
    EXPECT_NEAR(f.after / f.floor, 1.0, 0.15) << f.name;
  }
  for (const ShrinkFigure& f : shrink.rollout) {
    EXPECT_GT(f.floor, 0.4 * f.after) << f.name;
    EXPECT_LT(f.floor, 2.5 * f.after) << f.name;
  }
}

// The lag that the nominal model lacks widens its thresholds; with it smaller faults are certain, as on a healthy
// robot.
TEST(Shrink, ThresholdsAndSmallestFaultsFall) {
  const World world = with("actuator_lag", "T", 0.06, {0.06});
  PreparedGap log = prepared_log(world.robot, 3, 8.0);
  log.baseline_log = prepared_log(plain_robot(), 4, 8.0).log;
  const GapShrink shrink = measured(log, found_on(log, world).causes, true);
  ASSERT_EQ(shrink.threshold_width.size(), 2u);
  ASSERT_EQ(shrink.smallest_fault.size(), 2u);
  for (const auto* figures : {&shrink.threshold_width, &shrink.smallest_fault}) {
    for (const ShrinkFigure& f : *figures) {
      EXPECT_LT(f.after, 0.3 * f.before) << f.name;
      EXPECT_GT(f.floor, 0.3 * f.after) << f.name;
      EXPECT_LT(f.floor, 3.0 * f.after) << f.name;
    }
  }
}

TEST(Shrink, WhatCannotBeMeasuredIsLeftOutAndSaid) {
  const World world = with("longitudinal_slip", "stiffness", 1000.0, {1000.0, 0.2});
  const PreparedGap log = prepared_log(world.robot, 3, 8.0);
  const Found found = found_on(log, world);
  std::vector<std::string> notes;
  const GapShrink shrink = measure_shrink(file(), log, found.causes, {.blocks = {.blocks = 10}}, notes);
  EXPECT_TRUE(shrink.threshold_width.empty());
  EXPECT_EQ(shrink.rollout.size(), 8u);
  ASSERT_FALSE(notes.empty());
  EXPECT_NE(notes.front().find("longitudinal_slip"), std::string::npos) << notes.front();

  ShrinkCauses early = {{{effect_called("sensor_time_offset"), {-0.02}, {}}}, BaseModel::refitted, std::nullopt};
  notes.clear();
  const GapShrink torque_only = measure_shrink(file(), log, early, {.blocks = {.blocks = 10}}, notes);
  EXPECT_EQ(torque_only.torque_rms.size(), 2u);
  EXPECT_TRUE(torque_only.rollout.empty());
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes.front().find("early"), std::string::npos) << notes.front();
}

TEST(Shrink, DoesNotDependOnThreads) {
  const World world = with("actuator_lag", "T", 0.06, {0.06});
  const PreparedGap log = prepared_log(world.robot, 3, 8.0);
  const ShrinkCauses causes = found_on(log, world).causes;
  const GapShrink one = measured(log, causes), two = measured(log, causes, false, 2);
  for (std::size_t k = 0; k < one.rollout.size(); ++k) {
    EXPECT_EQ(one.rollout[k].after, two.rollout[k].after);
    EXPECT_EQ(one.rollout[k].upper, two.rollout[k].upper);
  }
  EXPECT_EQ(one.torque_rms[0].after, two.torque_rms[0].after);
}

// Dry friction that is not in the model is taken for viscous friction.
TEST(ParameterShifts, ShowWhatTheMissingCauseHadPoisoned) {
  const World world = with("coulomb", "c", 0.3);
  const PreparedGap log = prepared_log(world.robot, 3, 8.0);
  GapProblem problem =
      make_problem(log.drive, log.floor, {}, log.trusted, {effect_called("coulomb")}, {{{}}}, log.row_options);
  const BlockGram gram(problem.rows.spaces, {.blocks = 10});
  problem.table.gram = &gram;
  const std::vector<ParameterShift> shifts = parameter_shifts(file(), log.drive, problem.table, {0});
  ASSERT_EQ(shifts.size(), 4u);
  EXPECT_EQ(shifts[2].parameter, "viscous_linear");
  EXPECT_EQ(shifts[2].nominal, 4.0);
  EXPECT_GT(shifts[2].without_causes, 8.0);
  for (const ParameterShift& s : shifts) {
    const double truth = plain_robot().nominal.at(s.parameter);
    EXPECT_NEAR(s.estimate, truth, 0.05 * truth) << s.parameter;
    EXPECT_LT(s.lower, s.estimate);
    EXPECT_GT(s.upper, s.estimate);
    EXPECT_LT(s.upper - s.lower, 0.2 * truth) << s.parameter;
  }
}

}  // namespace
}  // namespace wheelwright::gap::shrink_test
