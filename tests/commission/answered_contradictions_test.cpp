// SPDX-License-Identifier: Apache-2.0
// Logs that contradict what a model takes for granted: each has a name and a sentence, and leaves no model.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/contradictions.hpp"
#include "commission/setting.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::commission::answered_contradictions_test {

using sim::simulate;

namespace {

using ::testing::HasSubstr;
using Kind = LogContradiction::Kind;
using Status = Commissioning::Status;
using testing_support::noisy_drive;

// Commands that change at samples, whose noise is learnt from the log, as `wheelwright robot` writes it.
Scenario learnt_drive(std::uint64_t seed, double duration = 30.0) {
  Scenario s = noisy_drive(seed, duration);
  s.robot.effort_changes = model::EffortChanges::at_samples;
  s.robot.noise = {};
  return s;
}

Commissioning commissioned(const LogTable& table, const Robot& robot) {
  TableSource log(table);
  return commission_robot(log, robot);
}

const LogContradiction* find(const Commissioning& result, Kind kind) {
  const auto found = std::ranges::find(result.contradictions, kind, &LogContradiction::kind);
  return found == result.contradictions.end() ? nullptr : &*found;
}

bool any_withdraws(const Commissioning& result) {
  return std::ranges::any_of(result.contradictions, &LogContradiction::withdraws);
}

void expect_no_model(const Commissioning& result) {
  EXPECT_TRUE(result.status == Status::contradicted || result.status == Status::empty) << result.message;
  EXPECT_TRUE(result.model.facets.empty());
  EXPECT_FALSE(result.model.kinematic.has_value());
}

// Efforts logged `rows` rows after they acted.
LogTable late(LogTable table, std::ptrdiff_t rows) {
  for (const char* name : {"tau_r", "tau_l"}) {
    std::vector<double>& tau = table.column(name);
    std::rotate(tau.begin(), rows > 0 ? tau.end() - rows : tau.begin() - rows, tau.end());
  }
  return core::slice(table, 20, table.rows() - 20);
}

// One row of `every` is lost.
LogTable with_losses(const LogTable& table, std::size_t every = 500) {
  LogTable out;
  out.names = table.names;
  out.columns.resize(table.columns.size());
  for (std::size_t k = 0; k < table.rows(); ++k) {
    if (k % every != every / 2) {
      out.t.push_back(table.t[k]);
      for (std::size_t c = 0; c < table.columns.size(); ++c) {
        out.columns[c].push_back(table.columns[c][k]);
      }
    }
  }
  return out;
}

TEST(AnsweredContradiction, ADeadCurrentSensorIsNoRobotOfNoMass) {
  for (const bool declared : {false, true}) {
    Scenario s = learnt_drive(1);
    if (declared) {
      s.robot.noise.effort.value = 0.02;
    }
    LogTable table = simulate(s);
    for (const char* name : {"tau_r", "tau_l"}) {
      std::ranges::fill(table.column(name), 0.0);
    }
    const Commissioning result = commissioned(table, s.robot);
    expect_no_model(result);
    const LogContradiction* found = find(result, Kind::effort_constant);
    ASSERT_NE(found, nullptr);
    EXPECT_TRUE(found->withdraws);
    EXPECT_THAT(result.message, HasSubstr("tau_r is 0 in every row"));
  }
}

TEST(AnsweredContradiction, OneDeadSensorOfTwoIsNamed) {
  const Scenario s = learnt_drive(2);
  LogTable table = simulate(s);
  std::ranges::fill(table.column("tau_l"), 0.7);
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  ASSERT_NE(find(result, Kind::effort_constant), nullptr);
  EXPECT_EQ(find(result, Kind::effort_constant)->subject, "tau_l");
}

TEST(AnsweredContradiction, AnEffortOfNoiseAloneDependsOnNoMotion) {
  const Scenario s = learnt_drive(3);
  LogTable table = simulate(s);
  std::mt19937_64 rng(3);
  std::normal_distribution<double> noise(0.0, 0.5);
  std::ranges::generate(table.column("tau_r"), [&] { return noise(rng); });
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  ASSERT_NE(find(result, Kind::effort_unrelated), nullptr);
  EXPECT_EQ(find(result, Kind::effort_unrelated)->subject, "tau_r");
}

TEST(AnsweredContradiction, AnArrayOfWrappedAnglesWantsUnwrapping) {
  const Scenario s = learnt_drive(4);
  LogTable table = simulate(s);
  ASSERT_EQ(find(commissioned(table, s.robot), Kind::angle_wrapped), nullptr);
  constexpr double kTurn = 2.0 * std::numbers::pi;
  for (const char* name : {"phi_r", "phi_l"}) {
    for (double& angle : table.column(name)) {
      angle -= kTurn * std::floor(angle / kTurn);
    }
  }
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  ASSERT_NE(find(result, Kind::angle_wrapped), nullptr);
  EXPECT_THAT(find(result, Kind::angle_wrapped)->next, HasSubstr("unwrap"));
}

// The samples stay where they are; only what is written beside them is wrong.
TEST(AnsweredContradiction, StampsThatScatterAreNoUnevenSampling) {
  const Scenario s = learnt_drive(5);
  LogTable table = simulate(s);
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> scatter(-0.002, 0.002);
  for (double& t : table.t) {
    t += scatter(rng);
  }
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  ASSERT_NE(find(result, Kind::stamps_scatter), nullptr);
}

// Noise of one sign all the way is inside its bounds: dry friction is told of, and nothing is called guaranteed.
TEST(AnsweredContradiction, DryFrictionInsideTheDeclaredNoiseTakesTheGuarantee) {
  Scenario s = noisy_drive(6, 30.0);
  s.robot.noise.effort.value = 0.05;
  const Commissioning without = commissioned(simulate(s), s.robot);
  EXPECT_EQ(find(without, Kind::dry_friction), nullptr);
  EXPECT_EQ(without.model.warrant, core::Warrant::guaranteed);
  LogTable table = simulate(s);
  const std::vector<double> right = table.column("phi_r"), left = table.column("phi_l");
  const auto add_friction = [](std::vector<double>& tau, const std::vector<double>& angle) {
    for (std::size_t k = 1; k < tau.size(); ++k) {
      const double moved = angle[k] - angle[k - 1];
      tau[k] += moved > 0.0 ? 0.015 : moved < 0.0 ? -0.015 : 0.0;
    }
  };
  add_friction(table.column("tau_r"), right);
  add_friction(table.column("tau_l"), left);
  const Commissioning with = commissioned(table, s.robot);
  ASSERT_NE(find(with, Kind::dry_friction), nullptr) << with.message;
  EXPECT_FALSE(find(with, Kind::dry_friction)->withdraws);
  EXPECT_EQ(with.model.warrant, core::Warrant::extrapolated);
}

TEST(AnsweredContradiction, TorquesOneSampleLateOrEarlyAreTold) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const int rows : {1, -1, 2}) {
      const Scenario s = learnt_drive(seed);
      const Commissioning result = commissioned(late(simulate(s), rows), s.robot);
      expect_no_model(result);
      const LogContradiction* found = find(result, Kind::effort_timing);
      ASSERT_NE(found, nullptr) << "seed " << seed << ", " << rows << " rows";
      EXPECT_NEAR(found->value, 0.01 * rows, 0.001);
      EXPECT_THAT(found->next, HasSubstr("effort: {delay: ["));
    }
  }
}

TEST(AnsweredContradiction, TenMillisecondsAreToldAtHalfTheRateToo) {
  for (const double rate : {50.0}) {
    Scenario s = learnt_drive(6, 60.0);
    s.rate = 100.0;
    const LogTable fine = late(simulate(s), 1);
    // Every fourth or second row of efforts that are measured.
    const auto every = static_cast<std::size_t>(100.0 / rate);
    LogTable coarse;
    coarse.names = fine.names;
    coarse.columns.resize(fine.columns.size());
    for (std::size_t k = 0; k < fine.rows(); k += every) {
      coarse.t.push_back(fine.t[k]);
      for (std::size_t c = 0; c < fine.columns.size(); ++c) {
        coarse.columns[c].push_back(fine.columns[c][k]);
      }
    }
    s.robot.hold = Hold::first_order;
    const Commissioning result = commissioned(coarse, s.robot);
    // 10 ms, and half of a 10 ms step by which a held command is late for one that is measured.
    const LogContradiction* found = find(result, Kind::effort_timing);
    ASSERT_NE(found, nullptr) << rate;
    EXPECT_NEAR(found->value, 0.005, 0.004) << rate;
  }
}

// The usual driver: ω_k = (φ_k − φ_{k−1})/h with the stamp of φ_k.
TEST(AnsweredContradiction, SpeedsDifferencedBackwardsAreToldByTheirLag) {
  Scenario s = learnt_drive(7, 60.0);
  s.sensors.encoder_counts_per_turn = 65536.0;
  s.robot.encoder_counts_per_turn.reset();
  s.robot.effort_changes = model::EffortChanges::at_samples;
  const LogTable angles = simulate(s);
  LogTable speeds = core::slice(angles, 1, angles.rows());
  for (const auto& [angle, speed] : {std::pair{"phi_r", "omega_r"}, std::pair{"phi_l", "omega_l"}}) {
    const std::vector<double>& phi = angles.column(angle);
    std::vector<double>& column = speeds.column(angle);
    for (std::size_t k = 1; k < phi.size(); ++k) {
      column[k - 1] = (phi[k] - phi[k - 1]) / (angles.t[k] - angles.t[k - 1]);
    }
    *std::ranges::find(speeds.names, angle) = speed;
  }
  const Commissioning result = commissioned(speeds, s.robot);
  expect_no_model(result);
  const LogContradiction* found = find(result, Kind::effort_timing);
  ASSERT_NE(found, nullptr) << result.message;
  EXPECT_NEAR(found->value, -0.005, 0.002);
}

TEST(AnsweredContradiction, ADeclaredDelayIsNone) {
  Scenario s = learnt_drive(8);
  const LogTable table = late(simulate(s), 1);
  s.robot.effort_delay = {0.009, 0.011};
  const Commissioning result = commissioned(table, s.robot);
  EXPECT_EQ(result.status, Status::done) << result.message;
  EXPECT_EQ(find(result, Kind::effort_timing), nullptr);
}

// 0.3 s is more than is looked for around none: it is looked for around what is declared. Efforts in N·m and in A, even
// steps and steps with samples lost.
TEST(AnsweredContradiction, ALongDelayIsHeldAgainstWhatIsDeclared) {
  struct Case {
    std::ptrdiff_t rows;  // of 10 ms, that efforts come late
    Interval declared;    // s
    bool told;
  };
  for (const Case& c : {Case{30, {0.295, 0.305}, false}, Case{-30, {-0.305, -0.295}, false},
                        Case{30, {0.25, 0.27}, true}, Case{30, {0.34, 0.36}, true}, Case{-30, {0.295, 0.305}, true},
                        Case{0, {0.25, 0.3}, true}, Case{0, {-0.3, -0.25}, true}}) {
    for (const bool currents : {false, true}) {
      for (const bool lossy : {false, true}) {
        Scenario s = learnt_drive(8, 60.0);
        LogTable table = late(simulate(s), c.rows);
        if (currents) {
          s.robot.effort = model::EffortKind::current;
          for (std::string& name : table.names) {
            if (name.starts_with("tau_")) {
              std::ranges::transform(table.column(name), table.column(name).begin(), [](double y) { return y / 0.7; });
              name.replace(0, 3, "current");
            }
          }
        }
        s.robot.effort_delay = c.declared;
        if (lossy) {
          s.robot.effort_changes = model::EffortChanges::between;
          table = with_losses(table);
        }
        const Commissioning result = commissioned(table, s.robot);
        const LogContradiction* found = find(result, Kind::effort_timing);
        const std::string what =
            fmt::format("{} rows late, declared {} to {} s{}{}: {}", c.rows, c.declared.lower, c.declared.upper,
                        currents ? ", in A" : "", lossy ? ", samples lost" : "", result.message);
        EXPECT_EQ(found != nullptr, c.told) << what;
        if (found != nullptr) {
          EXPECT_NEAR(found->value, 0.01 * static_cast<double>(c.rows), 0.006) << what;
        }
      }
    }
  }
}

TEST(AnsweredContradiction, ALogOfWhichNothingIsLeftSaysWhy) {
  Scenario s = learnt_drive(8);
  const LogTable table = with_losses(late(simulate(s), 30), 7);
  s.robot.effort_delay = {0.295, 0.305};
  try {
    commissioned(table, s.robot);
    FAIL() << "expected an error";
  } catch (const InvalidArgument& error) {
    EXPECT_THAT(error.what(), HasSubstr("never 0.35 s in a row without a step above 17.5 ms"));
    EXPECT_THAT(error.what(), HasSubstr("delay: [0.295, 0.305]"));
  }
}

TEST(AnsweredContradiction, HealthyLogsHaveNone) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const bool declared : {false, true}) {
      Scenario s = learnt_drive(seed, seed % 2 == 0 ? 12.0 : 30.0);
      if (declared) {
        s.robot.noise.effort.value = 0.02;
      }
      const Commissioning result = commissioned(simulate(s), s.robot);
      EXPECT_FALSE(any_withdraws(result)) << "seed " << seed << ": " << result.message;
      EXPECT_EQ(result.status, Status::done) << "seed " << seed << ": " << result.message;
    }
  }
}

TEST(AnsweredContradiction, SwappedEffortsShowANegativeInertia) {
  const Scenario s = learnt_drive(9);
  LogTable table = simulate(s);
  std::swap(table.column("tau_r"), table.column("tau_l"));
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  const LogContradiction* found = find(result, Kind::wrong_sign);
  ASSERT_NE(found, nullptr) << result.message;
  EXPECT_TRUE(found->withdraws);
  EXPECT_LT(found->value, 0.0);
}

TEST(AnsweredContradiction, TwoEffortsOfDifferentUnitsDisagreeAboutTheMass) {
  const Scenario s = learnt_drive(10);
  LogTable table = simulate(s);
  for (double& tau : table.column("tau_l")) {
    tau *= 0.4;
  }
  const Commissioning result = commissioned(table, s.robot);
  expect_no_model(result);
  const LogContradiction* found = find(result, Kind::wheels_disagree);
  ASSERT_NE(found, nullptr) << result.message;
  EXPECT_EQ(found->subject, "tau_r");
  EXPECT_NEAR(found->value, 2.5, 0.1);
}

// A drive, and another one with `times` the mass behind it.
LogTable loaded_halfway(Scenario s, double times) {
  LogTable table = simulate(s);
  s.parameters.mass *= times;
  ++s.seed;
  const LogTable heavier = simulate(s);
  table.segment_starts = {0, table.rows()};
  for (std::size_t k = 0; k < heavier.rows(); ++k) {
    table.t.push_back(heavier.t[k] + 100.0);
  }
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    table.columns[c].insert(table.columns[c].end(), heavier.columns[c].begin(), heavier.columns[c].end());
  }
  return table;
}

TEST(AnsweredContradiction, HalvesOfDifferentMassDisagree) {
  const Scenario s = learnt_drive(11, 40.0);
  const Commissioning result = commissioned(loaded_halfway(s, 1.2), s.robot);
  const LogContradiction* found = find(result, Kind::halves_disagree);
  ASSERT_NE(found, nullptr) << result.message;
  EXPECT_EQ(found->subject, "mass");
}

TEST(AnsweredContradiction, WhatOnlyHalvesAreExplainedByIsSaidOfALogThatNoParametersExplain) {
  const Scenario s = noisy_drive(11, 40.0);
  const auto found = [&](const LogTable& table) {
    const Commissioning result = commissioned(table, s.robot);
    EXPECT_EQ(result.status, Status::empty) << result.message;
    return find(result, Kind::halves_disagree) != nullptr &&
           result.message.find("each of its halves") != std::string::npos;
  };
  EXPECT_TRUE(found(loaded_halfway(s, 1.3)));
  LogTable offset = simulate(s);  // no half is explained where the efforts are another signal
  for (std::size_t k = 0; k < offset.rows(); ++k) {
    offset.column("tau_r")[k] += std::sin(2.0 * offset.t[k]);
  }
  EXPECT_FALSE(found(offset));
}

// Numbers as they were on real logs: the guess, its 95 % interval and the set lie apart.
TEST(AnsweredContradiction, ABestGuessFarOutsideADeclaredSetWithdrawsTheModel) {
  Scenario s = noisy_drive(13);
  Simulation log(s);
  Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.status, Status::done) << result.message;
  Setting setting = settle(log, s.robot);
  ASSERT_TRUE(setting.noise_complete);
  ParameterResult& mass = result.parameters[0];
  const double width = mass.upper - mass.lower;
  const auto outside_by = [&](double widths, double error) {
    mass.estimate = mass.upper + widths * width;
    mass.standard_error = error * width;
    mass.estimate_inside = false;
    const auto found = contradictions_in_result(result, setting, std::nullopt, 1.0);
    return found.empty() ? -1 : static_cast<int>(found.front().withdraws);
  };
  EXPECT_EQ(outside_by(2.0, 0.01), 1);
  EXPECT_EQ(outside_by(2.0, 1.5), 0) << "its interval reaches the set";
  EXPECT_EQ(outside_by(0.1, 0.001), 0) << "noise at its bounds moves least squares by as much";
  setting.noise_complete = false;
  EXPECT_EQ(outside_by(2.0, 0.01), 0) << "the set is learnt: a doubt beside the model";
}

TEST(AnsweredContradiction, HeldOutRowsOutsideTheThresholdsAreTold) {
  Scenario s = learnt_drive(14);
  Simulation log(s);
  Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.status, Status::done) << result.message;
  const Setting setting = settle(log, s.robot);
  result.validation[0].instants = 1000;
  result.validation[0].outside = 50;
  const auto many = contradictions_in_result(result, setting, std::nullopt, 1.0);
  ASSERT_EQ(many.size(), 1U);
  EXPECT_EQ(many[0].kind, Kind::held_out_outside);
  EXPECT_TRUE(many[0].withdraws);
  result.validation[0].outside = 1;
  EXPECT_FALSE(contradictions_in_result(result, setting, std::nullopt, 1.0).at(0).withdraws);
}

// Some seconds of a block that is held out are noisier than all others: what is learnt of the others is raised, and
// only a noise of another kind withdraws the model.
TEST(AnsweredContradiction, LearntNoiseIsRaisedByWhatWasHeldOut) {
  const Scenario s = learnt_drive(21);
  const Eigen::VectorXd truth = sim::true_parameters(s, model::make_model(s.robot));
  std::size_t raised = 0, withdrawn = 0;
  for (const double times : {0.0, 0.02, 0.05, 0.1, 0.2, 0.5, 2.0}) {
    LogTable table = simulate(s);
    testing_support::Random random(5);
    const double end = table.t.back();
    std::vector<double>& efforts = table.column("tau_r");
    double size = 0.0;
    for (const double effort : efforts) {
      size = std::max(size, std::abs(effort));
    }
    double slow = 0.0;
    for (std::size_t k = 0; k < efforts.size(); ++k) {
      slow += 0.1 * (random.symmetric() - slow);
      const double share = table.t[k] / end;
      efforts[k] += share > 0.84 && share < 0.88 ? times * size * slow : 0.0;  // of the ninth tenth, the last held out
    }
    TableSource log(table);
    const Commissioning result = commission_robot(log, s.robot);
    const auto told = std::ranges::find(result.contradictions, Kind::held_out_outside, &LogContradiction::kind);
    if (!result.has_model()) {
      ++withdrawn;
      continue;
    }
    for (const OutputValidation& v : result.validation) {
      EXPECT_LE(100 * v.outside, v.instants) << times;
    }
    for (std::size_t j = 0; j < result.parameters.size(); ++j) {
      const ParameterResult& p = result.parameters[j];
      EXPECT_LE(p.lower, truth[static_cast<Eigen::Index>(j)]) << times << ' ' << p.parameter.name;
      EXPECT_GE(p.upper, truth[static_cast<Eigen::Index>(j)]) << times << ' ' << p.parameter.name;
    }
    if (told != result.contradictions.end() && told->sentence.find("was raised by") != std::string::npos) {
      EXPECT_FALSE(told->withdraws);
      ++raised;
    }
  }
  EXPECT_GT(raised, 0U);
  EXPECT_GT(withdrawn, 0U);
}

// A straddle carrier, and a robot beyond the tool's own default, which has to be named.
TEST(AnsweredContradiction, AHeavyRobotIsCommissionedAndTheDefaultPriorIsNamed) {
  for (const double factor : {2000.0, 2e5}) {
    for (const bool declared : {true, false}) {
      Scenario s = noisy_drive(15);
      LogTable table = simulate(s);  // 21 kg
      for (const char* name : {"tau_r", "tau_l"}) {
        for (double& tau : table.column(name)) {
          tau *= factor;
        }
      }
      *s.robot.noise.effort.value *= factor;
      if (!declared) {
        s.robot.noise = {};
      }
      const Commissioning result = commissioned(table, s.robot);
      if (factor < 1e4) {
        EXPECT_EQ(result.status, Status::done) << result.message;
        continue;
      }
      expect_no_model(result);
      EXPECT_THAT(result.message, HasSubstr("prior: {mass: ["));
      EXPECT_THAT(result.message, HasSubstr("the tool's own"));
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission::answered_contradictions_test
