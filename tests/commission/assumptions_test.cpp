// SPDX-License-Identifier: Apache-2.0
// Guaranteed, extrapolated, statistical: which word a commissioning earns, and what its log says of the assumptions.
#include <algorithm>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "commission/assumptions.hpp"
#include "commission/commission.hpp"
#include "formats/files/bytes.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::commission::assumptions_test {

using core::Warrant;
using core::weaker;

namespace {

using testing_support::noisy_drive;
using Verdict = core::AssumptionVerdict;

Commissioning commissioned(const Scenario& scenario, filter::NoiseMode mode = filter::NoiseMode::worst_case) {
  Simulation log(scenario);
  CommissionOptions options;
  options.noise_mode = mode;
  return commission_robot(log, scenario.robot, options);
}

Scenario undeclared() {
  Scenario s = noisy_drive(1);
  s.robot.noise = {};
  s.robot.encoder_counts_per_turn.reset();
  return s;
}

std::set<Warrant> warrants(const Commissioning& c) {
  std::set<Warrant> all = {c.model.warrant};
  for (const ParameterResult& p : c.parameters) {
    all.insert(p.warrant);
  }
  for (const OutputNoise& n : c.noise) {
    all.insert(n.warrant);
  }
  for (const OutputValidation& v : c.validation) {
    all.insert(v.warrant);
  }
  return all;
}

const core::Assumption& of(const std::vector<core::Assumption>& list, const std::string& id) {
  const auto found = std::ranges::find(list, id, &core::Assumption::id);
  if (found == list.end()) {
    throw Error("no assumption " + id);
  }
  return *found;
}

TEST(Warrants, DeclaredBoundsAreGuaranteed) {
  EXPECT_EQ(warrants(commissioned(noisy_drive(1))), (std::set{Warrant::guaranteed}));
}

TEST(Warrants, BoundsLearntFromTheLogAreExtrapolatedInEitherMode) {
  EXPECT_EQ(warrants(commissioned(undeclared())), (std::set{Warrant::extrapolated}));
  EXPECT_EQ(warrants(commissioned(undeclared(), filter::NoiseMode::statistical)), (std::set{Warrant::extrapolated}));
}

TEST(Warrants, DeclaredBoundsAtAConfidenceAreStatistical) {
  const Commissioning c = commissioned(noisy_drive(1), filter::NoiseMode::statistical);
  EXPECT_EQ(warrants(c), (std::set{Warrant::statistical}));
  EXPECT_EQ(of(c.assumptions, "noise_independent").verdict, Verdict::not_tested);
}

TEST(Warrants, NothingIsGuaranteedWhereAnAssumptionFails) {
  Commissioning c = commissioned(noisy_drive(1));
  c.validation.front().outside = 1;
  settle_warrants(c);
  EXPECT_EQ(of(c.assumptions, "constant_parameters").verdict, Verdict::fails);
  EXPECT_EQ(warrants(c), (std::set{Warrant::extrapolated}));
}

TEST(Warrants, TheWeakerOfTwoIsSymmetricIdempotentAndAssociative) {
  const auto all = {Warrant::guaranteed, Warrant::extrapolated, Warrant::statistical};
  for (const Warrant a : all) {
    EXPECT_EQ(weaker(a, a), a);
    EXPECT_EQ(weaker(a, Warrant::guaranteed), a);
    EXPECT_EQ(weaker(a, Warrant::extrapolated), Warrant::extrapolated);
    for (const Warrant b : all) {
      EXPECT_EQ(weaker(a, b), weaker(b, a));
      for (const Warrant c : all) {
        EXPECT_EQ(weaker(weaker(a, b), c), weaker(a, weaker(b, c)));
      }
    }
  }
}

TEST(Assumptions, AreTheSameInResultAndModelEachNamedOnce) {
  const Commissioning c = commissioned(noisy_drive(1));
  EXPECT_EQ(c.assumptions, c.model.assumptions);
  std::set<std::string> ids;
  for (const core::Assumption& a : c.assumptions) {
    EXPECT_TRUE(ids.insert(a.id).second) << a.id;
    EXPECT_TRUE(a.statement.ends_with('.')) << a.statement;
    EXPECT_TRUE(a.verdict == Verdict::not_tested || !a.test.empty()) << a.id << ": a verdict without a test";
  }
}

// docs/methods/assumptions.md has a row for each that code can list, and the key that declares it.
TEST(Assumptions, AreInTheirTable) {
  const std::string page = files::read_bytes(
      std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "docs/methods/assumptions.md", std::size_t{1} << 20);
  Scenario limited = noisy_drive(1);
  limited.robot.limits = {{"effort", 1e3}, {"speed", 1e3}, {"acceleration", 1e3}};
  limited.sensors.pose = true;
  Scenario speeds = noisy_drive(1);
  speeds.sensors.angles = false;
  speeds.sensors.speeds = true;
  speeds.robot.encoder_counts_per_turn.reset();
  speeds.robot.noise.wheel_speed.value = 0.05;
  for (const Commissioning& c : {commissioned(limited), commissioned(speeds), commissioned(undeclared()),
                                 commissioned(noisy_drive(1), filter::NoiseMode::statistical)}) {
    for (const core::Assumption& a : c.assumptions) {
      EXPECT_NE(page.find("| `" + a.id + "` |"), std::string::npos) << a.id;
    }
  }
}

TEST(Assumptions, SayHowTheRobotFileDeclaresItsEfforts) {
  Commissioning c;
  c.model.robot.hold = Hold::zero_order;
  EXPECT_NE(of(assumptions_of(c), "effort_hold").statement.find("unknown moment"), std::string::npos);
  c.model.robot.effort_changes = model::EffortChanges::at_samples;
  EXPECT_EQ(of(assumptions_of(c), "effort_hold").statement.find("unknown moment"), std::string::npos);
  c.model.robot.hold = Hold::first_order;
  EXPECT_NE(of(assumptions_of(c), "effort_hold").statement.find("straight"), std::string::npos);
  EXPECT_NE(of(assumptions_of(c), "effort_delay").statement.find("neither late nor early"), std::string::npos);
  c.model.robot.effort_delay = {0.002, 0.0125};
  EXPECT_NE(of(assumptions_of(c), "effort_delay").statement.find("between 0.002 and 0.0125 s"), std::string::npos);
}

// 12 rad/s² in the samples, of which angles wrong by 1e-4 rad at 100 Hz explain 4: a limit of 7.9 is contradicted.
TEST(Assumptions, ADeclaredAccelerationIsHeldAgainstTheSamples) {
  Commissioning c;
  c.survey.median_step = 0.01;
  c.survey.sharpest_change = {3.0, 12.0};
  c.model.measurement.motion = MotionKind::angle;
  c.model.robot.noise.wheel_angle.value = 1e-4;
  const auto with_limit = [&](double limit) {
    c.model.robot.limits["acceleration"] = limit;
    return of(assumptions_of(c), "motion_between_samples").verdict;
  };
  EXPECT_EQ(with_limit(8.1), Verdict::holds);
  EXPECT_EQ(with_limit(7.9), Verdict::fails);
  c.model.robot.limits.clear();
  EXPECT_EQ(of(assumptions_of(c), "motion_between_samples").verdict, Verdict::not_tested);
}

// A wheel that reaches 36 rad/s², its speed read with noise or in steps of an encoder: differences of single samples
// show several times as much.
TEST(Assumptions, AnAccelerationReadFromSamplesAllowsForTheirNoise) {
  testing_support::Random random(5);
  for (const double rate : {50.0, 100.0, 500.0}) {
    for (const double noise : {0.0, 0.03, 0.3}) {
      const std::size_t rows = 6000;
      LogTable log;
      log.names = {"omega_r", "omega_l"};
      log.columns.assign(2, {});
      for (std::size_t k = 0; k < rows; ++k) {
        const double t = static_cast<double>(k) / rate;
        log.t.push_back(t);
        for (std::size_t j = 0; j < 2; ++j) {
          log.columns[j].push_back(12.0 * std::sin(3.0 * t) + noise * random.normal());
        }
      }
      Measurement measurement;
      measurement.motion = MotionKind::speed;
      measurement.motion_columns = {"omega_r", "omega_l"};
      TableSource source(log);
      Commissioning c;
      c.survey = survey(source, measurement);
      c.model.measurement = measurement;
      c.model.robot.noise.wheel_speed.value = 1e-3;
      c.model.robot.limits["acceleration"] = 40.0;
      EXPECT_NE(of(assumptions_of(c), "motion_between_samples").verdict, Verdict::fails) << rate << " " << noise;
      c.model.robot.limits["acceleration"] = 15.0;
      if (noise * rate < 2.0) {  // else noise hides what is beyond
        EXPECT_EQ(of(assumptions_of(c), "motion_between_samples").verdict, Verdict::fails) << rate << " " << noise;
      }
    }
  }
}

// Intervals stand on the log, thresholds on driving to come.
TEST(Assumptions, DynamicsThatBoundNothingLeaveThresholdsExtrapolated) {
  Commissioning c = commissioned(noisy_drive(1));
  ASSERT_EQ(c.model.warrant, Warrant::guaranteed);
  EXPECT_EQ(of(c.assumptions, "motion_in_driving").verdict, Verdict::holds);
  c.model.errors.motion.mobility.resize(0, 0);
  settle_warrants(c);
  EXPECT_EQ(of(c.assumptions, "motion_in_driving").verdict, Verdict::fails);
  EXPECT_EQ(c.model.warrant, Warrant::extrapolated);
  EXPECT_EQ(c.validation.front().warrant, Warrant::extrapolated);
  EXPECT_EQ(interval_warrant(c), Warrant::guaranteed);
}

// Steps that vary by more than a third hide a missing row: two short ones are shorter than a long one.
TEST(Assumptions, WhereStepsVaryTooMuchAMissingRowDoesNotShow) {
  Commissioning c;
  c.survey.median_step = c.model.measurement.nominal_step = 0.01;
  c.model.measurement.shortest_step = 0.0072;
  EXPECT_EQ(of(assumptions_of(c), "lost_rows").verdict, Verdict::holds);
  c.model.measurement.shortest_step = 0.006;
  EXPECT_EQ(of(assumptions_of(c), "lost_rows").verdict, Verdict::not_tested);
}

TEST(Assumptions, OfAnEmptySetSomeFail) {
  Scenario s = noisy_drive(1);
  s.sensors.effort = 2.0;  // a hundred times what is declared
  const Commissioning c = commissioned(s);
  ASSERT_EQ(c.status, Commissioning::Status::empty);
  EXPECT_EQ(of(c.assumptions, "noise_effort").verdict, Verdict::fails);
  EXPECT_EQ(warrants(c), (std::set{Warrant::extrapolated}));
}

}  // namespace
}  // namespace wheelwright::commission::assumptions_test
