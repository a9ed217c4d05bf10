// SPDX-License-Identifier: Apache-2.0
#include "gap/diagnose.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::diagnose_test {
namespace {

using gap_example::counted_robot;
using gap_example::healthy_scenario;
using gap_example::noisy_scenario;
using gap_example::plain_robot;
using gap_example::robot_with;
using gap_example::simulated_drive;

DiagnoseOptions quick(std::size_t threads = 1) {
  DiagnoseOptions options;
  options.shrink = false;
  options.threads = threads;
  return options;
}

Diagnosis diagnosis_of(const Scenario& scenario, bool with_baseline, const Robot& robot,
                       const DiagnoseOptions& options = quick()) {
  Simulation log(scenario), healthy(healthy_scenario(scenario));
  return diagnose(log, with_baseline ? &healthy : nullptr, robot, options);
}

// No noise, no effect: at every rate, with and without stamps at the middle of the interval.
TEST(Diagnose, TheGapOfPerfectDataIsNothing) {
  for (const double rate : {50.0, 100.0}) {
    for (const sim::Sampling sampling : {sim::Sampling::instant, sim::Sampling::interval}) {
      Scenario s = simulated_drive(plain_robot(), 40.0, rate);
      s.sensors.sampling = sampling;
      const Diagnosis found = diagnosis_of(s, false, plain_robot());
      EXPECT_EQ(found.verdict, GapVerdict::no_gap) << rate;
      EXPECT_TRUE(found.causes.empty());
      EXPECT_LE(found.gap, 1e-6);
      EXPECT_LE(found.structural, 1e-6);
    }
  }
}

TEST(Diagnose, ExplainsAndSharesAddUp) {
  Robot world = robot_with("coulomb", {{"c", 0.3}});
  world.effects.push_back({"slope", {{"g_x", {0.2, 0.2}}, {"g_y", {-0.3, -0.3}}}});
  const Diagnosis found = diagnosis_of(noisy_scenario(world, 2), true, counted_robot());
  EXPECT_EQ(found.verdict, GapVerdict::explained);
  ASSERT_EQ(found.causes.size(), 2u);
  EXPECT_GE(found.causes[0].share, found.causes[1].share);
  EXPECT_NEAR(found.causes[0].share + found.causes[1].share + found.remaining, 1.0, 0.02);
  for (const GapCause& cause : found.causes) {
    const bool friction = cause.effect == "coulomb";
    EXPECT_TRUE(friction || cause.effect == "slope") << cause.effect;
    for (const GapEstimate& number : cause.parameters) {
      const std::optional<double> truth = number.name == "c"     ? std::optional(0.3)
                                          : number.name == "g_x" ? std::optional(0.2)
                                          : number.name == "g_y" ? std::optional(-0.3)
                                                                 : std::nullopt;
      if (truth) {
        EXPECT_LE(number.lower, *truth) << number.name;
        EXPECT_GE(number.upper, *truth) << number.name;
      }
    }
  }
  EXPECT_GT(found.gap, found.structural * 0.5);
  ASSERT_FALSE(found.credible.empty());
  EXPECT_EQ(found.credible[0].effects, (std::vector<std::string>{"coulomb", "slope"}));
  ASSERT_FALSE(found.looked_at.empty());
  EXPECT_TRUE(found.looked_at[0].effects.empty());
}

// Friction that both robots have and the catalogue lacks is no noise; noise is, however much there is of it.
TEST(Diagnose, SaysThatAModelDoesNotFitTheHealthyRobot) {
  DiagnoseOptions few = quick();
  few.catalogue = gap_example::only({"slope", "payload"});
  Scenario log = noisy_scenario(robot_with("coulomb", {{"c", 1.5}}), 12);
  Scenario before = log;
  before.seed += 5000;
  const auto diagnosis = [&](const DiagnoseOptions& options) {
    Simulation real(log), healthy(before);
    return diagnose(real, &healthy, counted_robot(), options);
  };
  const Diagnosis found = diagnosis(few);
  EXPECT_EQ(found.verdict, GapVerdict::unexplained);
  EXPECT_TRUE(found.causes.empty());
  EXPECT_FALSE(found.record);
  ASSERT_TRUE(found.misfit);
  EXPECT_GT(found.misfit->share, 0.05);
  EXPECT_LT(found.misfit->share, 1.0);
  EXPECT_FALSE(found.misfit->regime.empty());
  EXPECT_FALSE(found.visible.empty());
  // With the friction in the catalogue it is learnt from the healthy log.
  const Diagnosis whole = diagnosis(quick());
  EXPECT_EQ(whole.verdict, GapVerdict::no_gap);
  EXPECT_FALSE(whole.misfit);
  EXPECT_TRUE(whole.record);
  log.robot = before.robot = counted_robot();
  log.sensors.effort = before.sensors.effort = 4.0;
  const Diagnosis noisy = diagnosis(few);
  EXPECT_EQ(noisy.verdict, GapVerdict::no_gap);
  EXPECT_FALSE(noisy.misfit);
}

// Columns that are made of the measured efforts have their noise in them: it is taken out of a residual by them, and
// that is no cause.
TEST(Diagnose, NoiseOfTheEffortsIsNoCause) {
  for (const double rate : {25.0, 50.0}) {
    for (const unsigned seed : {311U, 312U, 313U, 314U, 315U}) {
      Scenario log = noisy_scenario(counted_robot(), seed, rate);
      log.sensors.effort = 0.35 + 0.05 * static_cast<double>(seed % 5);
      Scenario before = healthy_scenario(log);
      before.sensors = log.sensors;
      Simulation real(log), healthy(before);
      const Diagnosis found = diagnose(real, &healthy, counted_robot(), quick());
      EXPECT_EQ(found.verdict, GapVerdict::no_gap) << rate << " Hz, seed " << seed;
    }
  }
}

// A healthy log on which an asymmetry is too small to be a cause tells it for one on which it is not.
TEST(Diagnose, WhatARobotHasAsItIsBuiltIsKnown) {
  Scenario log = noisy_scenario(robot_with("com_lateral", {{"b", 0.006}}), 41);
  log.sensors.effort = 0.2;
  Scenario before = log;
  before.seed += 5000;
  before.trajectory.speed = 0.55;
  before.trajectory.yaw_rate = 1.1;
  const auto diagnosis = [&](const Scenario& real, bool as_built) {
    DiagnoseOptions options = quick();
    options.catalogue = effect_catalogue();
    for (Effect& effect : *options.catalogue) {
      effect.as_built = effect.as_built && as_built;
    }
    Simulation now(real), healthy(before);
    return diagnose(now, &healthy, counted_robot(), options);
  };
  EXPECT_EQ(diagnosis(log, true).verdict, GapVerdict::no_gap);
  EXPECT_NE(diagnosis(log, false).verdict, GapVerdict::no_gap);
  Scenario more = log;
  more.robot = robot_with("com_lateral", {{"b", 0.026}});
  const Diagnosis found = diagnosis(more, true);
  ASSERT_EQ(found.causes.size(), 1U);
  EXPECT_EQ(found.causes.front().effect, "com_lateral");
  EXPECT_LE(found.causes.front().parameters.front().lower, 0.02);
  EXPECT_GE(found.causes.front().parameters.front().upper, 0.02);
}

// It was counted on logs with a healthy one beside them and the catalogue whole, and says nothing of others.
TEST(Diagnose, HasARecordWhereOneWasCounted) {
  const Scenario scenario = noisy_scenario(robot_with("coulomb", {{"c", 0.3}}), 2);
  const Diagnosis found = diagnosis_of(scenario, true, counted_robot());
  ASSERT_TRUE(found.record);
  ASSERT_EQ(found.causes.size(), 1u);
  EXPECT_GT(found.causes[0].probability.value_or(0.0), 0.5);
  EXPECT_TRUE(found.credible.at(0).probability);
  DiagnoseOptions less = quick();
  less.without = {"slope"};
  for (const Diagnosis& other :
       {diagnosis_of(scenario, false, counted_robot()), diagnosis_of(scenario, true, counted_robot(), less)}) {
    EXPECT_FALSE(other.record);
    for (const GapCause& cause : other.causes) {
      EXPECT_FALSE(cause.probability);
    }
  }
}

// θ fitted again holds the load's mass, too: its size is that of the healthy robot's θ held.
TEST(Diagnose, APayloadOffTheAxleHasItsSizeAndPlace) {
  constexpr double kMass = 2.0, kAhead = 0.2, kOfRobot = 21.0;
  const Robot world = robot_with("com_longitudinal", {{"a", kMass * kAhead / (kOfRobot + kMass)}});
  Scenario loaded = noisy_scenario(world, 4);
  loaded.parameters.mass = kOfRobot + kMass;
  loaded.parameters.yaw_inertia += kMass * kAhead * kAhead;
  const Diagnosis found = diagnosis_of(loaded, true, counted_robot());
  EXPECT_EQ(found.verdict, GapVerdict::explained);
  ASSERT_EQ(found.causes.size(), 1u);
  EXPECT_EQ(found.causes[0].effect, "payload_offset");
  const std::map<std::string, double> truth = {
      {"mass_kg", kMass}, {"yaw_inertia", kMass * kAhead * kAhead}, {"moment", kMass * kAhead}, {"x_m", kAhead}};
  for (const GapEstimate& number : found.causes[0].parameters) {
    EXPECT_LE(number.lower, truth.at(number.name)) << number.name;
    EXPECT_GE(number.upper, truth.at(number.name)) << number.name;
    EXPECT_LT(number.upper - number.lower, 0.3 * truth.at(number.name)) << number.name;
  }
}

void expect_same(const Diagnosis& a, const Diagnosis& b) {
  EXPECT_EQ(a.verdict, b.verdict);
  EXPECT_EQ(a.gap, b.gap);
  EXPECT_EQ(a.structural, b.structural);
  EXPECT_EQ(a.remaining, b.remaining);
  ASSERT_EQ(a.causes.size(), b.causes.size());
  for (std::size_t k = 0; k < a.causes.size(); ++k) {
    EXPECT_EQ(a.causes[k].effect, b.causes[k].effect);
    EXPECT_EQ(a.causes[k].share, b.causes[k].share);
    ASSERT_EQ(a.causes[k].parameters.size(), b.causes[k].parameters.size());
    for (std::size_t i = 0; i < a.causes[k].parameters.size(); ++i) {
      EXPECT_EQ(a.causes[k].parameters[i].estimate, b.causes[k].parameters[i].estimate);
      EXPECT_EQ(a.causes[k].parameters[i].lower, b.causes[k].parameters[i].lower);
      EXPECT_EQ(a.causes[k].parameters[i].upper, b.causes[k].parameters[i].upper);
    }
  }
  ASSERT_EQ(a.credible.size(), b.credible.size());
  for (std::size_t k = 0; k < a.credible.size(); ++k) {
    EXPECT_EQ(a.credible[k].effects, b.credible[k].effects);
    EXPECT_EQ(a.credible[k].held_out_error, b.credible[k].held_out_error);
    EXPECT_EQ(a.credible[k].p_value, b.credible[k].p_value);
  }
  ASSERT_EQ(a.looked_at.size(), b.looked_at.size());
  for (std::size_t k = 0; k < a.looked_at.size(); ++k) {
    EXPECT_EQ(a.looked_at[k].effects, b.looked_at[k].effects);
    EXPECT_EQ(a.looked_at[k].held_out_error, b.looked_at[k].held_out_error);
  }
  ASSERT_EQ(a.where.size(), b.where.size());
  for (std::size_t k = 0; k < a.where.size(); ++k) {
    EXPECT_EQ(a.where[k].regime, b.where[k].regime);
    EXPECT_EQ(a.where[k].share, b.where[k].share);
    EXPECT_EQ(a.where[k].p_value, b.where[k].p_value);
  }
  ASSERT_EQ(a.series.size(), b.series.size());
  for (std::size_t k = 0; k < a.series.size(); ++k) {
    EXPECT_EQ(a.series[k].after, b.series[k].after);
  }
  ASSERT_EQ(a.shrink.torque_rms.size(), b.shrink.torque_rms.size());
  for (std::size_t k = 0; k < a.shrink.torque_rms.size(); ++k) {
    EXPECT_EQ(a.shrink.torque_rms[k].after, b.shrink.torque_rms[k].after);
    EXPECT_EQ(a.shrink.torque_rms[k].upper, b.shrink.torque_rms[k].upper);
  }
}

TEST(Diagnose, DoesNotDependOnTheNumberOfThreads) {
  const Scenario s = noisy_scenario(robot_with("actuator_lag", {{"T", 0.03}}), 5);
  expect_same(diagnosis_of(s, true, counted_robot(), quick(1)), diagnosis_of(s, true, counted_robot(), quick(2)));
}

TEST(Diagnose, TellsHowFarItIs) {
  DiagnoseOptions options = quick();
  std::vector<double> shares;
  options.progress = [&shares](std::string_view stage, double share) {
    EXPECT_FALSE(stage.empty());
    shares.push_back(share);
  };
  (void)diagnosis_of(noisy_scenario(counted_robot(), 1), false, counted_robot(), options);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_EQ(shares.front(), 0.0);
  EXPECT_EQ(shares.back(), 1.0);
}

// The promise is held out; the fresh log was not looked at.
TEST(TorqueOn, AFreshLogHoldsThePromise) {
  for (const auto& [name, parameters] : std::vector<std::pair<std::string, std::map<std::string, double>>>{
           {"coulomb", {{"c", 0.3}}}, {"actuator_lag", {{"T", 0.05}}}, {"torque_gain_asymmetric", {{"g", 0.1}}}}) {
    SCOPED_TRACE(name);
    const Robot world = robot_with(name, parameters);
    DiagnoseOptions options;
    Simulation log(noisy_scenario(world, 5)), healthy(healthy_scenario(noisy_scenario(world, 5)));
    const Diagnosis found = diagnose(log, &healthy, counted_robot(), options);
    ASSERT_EQ(found.verdict, GapVerdict::explained);
    Simulation fresh(noisy_scenario(world, 6)), before(healthy_scenario(noisy_scenario(world, 5)));
    const std::vector<ShrinkFigure> there = torque_on(fresh, &before, counted_robot(), found, options);
    ASSERT_EQ(there.size(), found.shrink.torque_rms.size());
    for (std::size_t k = 0; k < there.size(); ++k) {
      const ShrinkFigure& promised = found.shrink.torque_rms[k];
      EXPECT_LT(there[k].lower, promised.upper) << there[k].name;
      EXPECT_GT(there[k].upper, promised.lower) << there[k].name;
      EXPECT_LT(there[k].after, 0.5 * there[k].before) << there[k].name;
      EXPECT_LT(there[k].lower, there[k].after);
      EXPECT_GT(there[k].upper, there[k].after);
    }
  }
}

TEST(Diagnose, SaysThatALogIsTooShort) {
  Scenario s = noisy_scenario(robot_with("coulomb", {{"c", 0.3}}), 1);
  const auto said = [&s](std::size_t blocks, double duration) {
    s.duration = duration;
    DiagnoseOptions options = quick();
    options.blocks.blocks = blocks;
    const Diagnosis found = diagnosis_of(s, false, counted_robot(), options);
    EXPECT_NE(found.verdict, GapVerdict::no_gap);
    return std::any_of(found.notes.begin(), found.notes.end(),
                       [](const std::string& note) { return note.find("drive longer") != std::string::npos; });
  };
  EXPECT_TRUE(said(8, 13.0)) << "eight pieces of half a second";
  EXPECT_FALSE(said(8, 40.0)) << "eight blocks of four pieces";
  EXPECT_FALSE(said(24, 40.0));
}

}  // namespace
}  // namespace wheelwright::gap::diagnose_test
