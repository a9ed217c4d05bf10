// SPDX-License-Identifier: Apache-2.0
// What identification says of simulated drives, whose truth is known.
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/identification.hpp"
#include "results/words/identification_words.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::identification_test {

using identify::ShapeState;
using sim::simulate;

using namespace inference;
using namespace words;
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using testing_support::exact_drive;
using testing_support::noisy_drive;
using testing_support::Shown;

Identification identified(const LogTable& table, const Robot& robot, bool shapes = false) {
  TableSource log(table);
  IdentificationOptions options;
  options.shapes = shapes;
  return identify(log, robot, options);
}

std::vector<double>& column(LogTable& table, const std::string& name) {
  const auto at = std::ranges::find(table.names, name);
  return table.columns[static_cast<std::size_t>(at - table.names.begin())];
}

Eigen::VectorXd truth_of(const Identification& result, const Scenario& s) {
  return sim::true_parameters(s, result.setting.model);
}

// Eight drives of four parameters: more than 6 misses of 32 at 95 %, or more than 2 of 8, have a probability below 1 %.
TEST(Identification, IntervalsOfEveryMethodHoldTheTruth) {
  std::map<RegionMethod, int> misses, missed_drives;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const Scenario s = noisy_drive(seed, 30.0);
    const Identification result = identified(simulate(s), s.robot);
    const Eigen::VectorXd truth = truth_of(result, s);
    ASSERT_EQ(result.regions.rows.size(), 3U);
    for (const RegionRow& row : result.regions.rows) {
      ASSERT_TRUE(row.available) << row.remark;
      EXPECT_FALSE(row.promise.empty());
      int missed = 0;
      for (Eigen::Index j = 0; j < truth.size(); ++j) {
        missed += row.lower[j] <= truth[j] && truth[j] <= row.upper[j] ? 0 : 1;
      }
      misses[row.method] += missed;
      missed_drives[row.method] += missed > 0 ? 1 : 0;
    }
  }
  for (const auto& [method, missed] : misses) {
    EXPECT_LE(missed, 6) << to_string(method);
  }
  EXPECT_LE(missed_drives[RegionMethod::sign_perturbed_sums], 2);
}

TEST(Identification, AWholeDriveIsGoodNewsWithNothingUnseen) {
  const Scenario s = noisy_drive(1, 30.0);
  const Identification result = identified(simulate(s), s.robot);
  EXPECT_EQ(standing(result), IdentificationStanding::good) << verdict(result);
  EXPECT_TRUE(result.identifiability.unseen.empty());
  EXPECT_EQ(result.identifiability.rank, 4);
  for (const ParameterInformation& p : result.information.parameters) {
    EXPECT_NEAR(p.share.sum(), 1.0, 1e-9);
    EXPECT_LE(p.seconds, 30.0);
  }
  // The combinations are of physical quantities: mass is known to its own standard error over the radius.
  ASSERT_EQ(result.identifiability.known.size(), 4U);
  EXPECT_THAT(result.identifiability.known[0].words, HasSubstr("kg"));
}

// Efforts stamped three samples too late, in both directions: T is 30 ms and −30 ms.
TEST(Identification, ADelayThatWasPutIntoTheLogIsFound) {
  Scenario s = noisy_drive(1, 20.0);
  s.robot.hold = Hold::first_order;
  for (const int late : {3, -3}) {
    LogTable table = simulate(s);
    for (const char* name : {"tau_r", "tau_l"}) {
      std::vector<double>& effort = column(table, name);
      const std::vector<double> before = effort;
      for (std::size_t k = 0; k < effort.size(); ++k) {
        const auto from = std::clamp<std::ptrdiff_t>(static_cast<std::ptrdiff_t>(k) - late, 0,
                                                     static_cast<std::ptrdiff_t>(effort.size()) - 1);
        effort[k] = before[static_cast<std::size_t>(from)];
      }
    }
    const Identification result = identified(table, s.robot, true);
    const auto delay = std::ranges::find(result.shapes, "delay", &ShapeFinding::name);
    ASSERT_NE(delay, result.shapes.end());
    EXPECT_EQ(delay->state, ShapeState::identified);
    EXPECT_NEAR(delay->estimate, 0.01 * late, 1e-3);
    EXPECT_TRUE(matters(*delay));
    EXPECT_EQ(standing(result), IdentificationStanding::caution);
    EXPECT_THAT(next_steps(result), Contains(HasSubstr(late > 0 ? "the effort comes" : "the motion comes")));
    // The curve is lowest where the estimate is.
    const auto lowest = std::ranges::min_element(delay->curve, {}, &ShapePoint::residual_ratio);
    EXPECT_NEAR(lowest->shape, delay->estimate, 0.02);
    EXPECT_TRUE(std::ranges::is_sorted(delay->curve, {}, &ShapePoint::shape));
  }
}

TEST(Identification, WithoutTurningTheYawParametersAreUnseenAndTheAdviceIsToTurn) {
  Scenario s = noisy_drive(1, 20.0);
  s.trajectory.kind = sim::Trajectory::Kind::straight;
  const Identification result = identified(simulate(s), s.robot);
  EXPECT_EQ(standing(result), IdentificationStanding::caution);
  EXPECT_THAT(verdict(result), HasSubstr("not shown: yaw inertia and viscous yaw"));
  EXPECT_THAT(next_steps(result), Contains(HasSubstr("Turn with changing yaw rate")));
  EXPECT_THAT(next_steps(result), Contains(HasSubstr("Drive in curves")));
  for (std::size_t j = 0; j < 4; ++j) {
    const bool yaw = result.setting.model.parameters[j].physical.find("yaw") != std::string::npos;
    EXPECT_EQ(result.fit.excitation[j].state == identify::Excitation::not_excited, yaw) << j;
  }
}

TEST(Identification, AStandstillShowsNothingAndSaysSo) {
  const Scenario s = noisy_drive(1, 20.0);
  LogTable table = simulate(s);
  for (std::vector<double>& values : table.columns) {
    std::ranges::fill(values, 0.0);
  }
  const Identification result = identified(table, s.robot, true);
  EXPECT_EQ(standing(result), IdentificationStanding::bad);
  EXPECT_TRUE(result.regions.rows.empty());
  EXPECT_FALSE(next_steps(result).empty());
}

// Glitches of one sign, 4 N·m, at one row in 400.
TEST(Identification, TheRobustFitStaysNearTheTruthWhereGlitchesPullLeastSquares) {
  const Scenario s = noisy_drive(1, 40.0);
  LogTable table = simulate(s);
  std::mt19937_64 random(5);
  for (double& effort : column(table, "tau_r")) {
    effort += random() % 400 == 0 ? 4.0 : 0.0;
  }
  const Identification result = identified(table, s.robot);
  const Eigen::VectorXd truth = truth_of(result, s);
  const Eigen::ArrayXd plain = (result.fit.squares.estimate - truth).array() / truth.array();
  const Eigen::ArrayXd robust = (result.robust.estimate - truth).array() / truth.array();
  EXPECT_LT(robust.abs().maxCoeff(), 0.02) << robust.transpose();
  EXPECT_LT(robust.abs().maxCoeff(), 0.5 * plain.abs().maxCoeff()) << plain.transpose();
  EXPECT_THAT(next_steps(result), Contains(HasSubstr("heavy tails")));
}

TEST(Identification, NoiseOfAnAngleWithKnownCountsIsThatOfTheCounts) {
  const Scenario s = noisy_drive(1, 20.0);
  const Identification result = identified(simulate(s), s.robot);
  ASSERT_EQ(result.noise.size(), 4U);
  for (const ColumnNoise& n : result.noise) {
    ASSERT_TRUE(n.known) << n.column;
    const bool angle = n.column.starts_with("phi");
    EXPECT_EQ(n.known->origin, angle ? "half an encoder count" : "as declared");
    EXPECT_DOUBLE_EQ(n.known->bound, angle ? M_PI / 4096.0 : 0.02);
  }
}

TEST(Identification, IsTheSameForASeed) {
  const Scenario s = noisy_drive(3, 20.0);
  const LogTable table = simulate(s);
  const Identification a = identified(table, s.robot), b = identified(table, s.robot);
  ASSERT_EQ(a.regions.rows.size(), b.regions.rows.size());
  for (std::size_t k = 0; k < a.regions.rows.size(); ++k) {
    EXPECT_EQ(a.regions.rows[k].lower, b.regions.rows[k].lower);
    EXPECT_EQ(a.regions.rows[k].upper, b.regions.rows[k].upper);
  }
}

// Wheel speeds and pose of a robot whose wheels stand further apart than its file says.
TEST(Identification, WithoutEffortsThePoseStillTellsTheTrackWidth) {
  Scenario s = exact_drive(Shown::speeds, Hold::first_order);
  s.sensors.pose = true;
  s.duration = 30.0;
  LogTable table = simulate(s);
  for (const char* name : {"tau_r", "tau_l"}) {
    const auto at = std::ranges::find(table.names, name) - table.names.begin();
    table.names.erase(table.names.begin() + at);
    table.columns.erase(table.columns.begin() + at);
  }
  Robot robot = s.robot;
  robot.track_width = 0.3;
  const Identification result = identified(table, robot);
  EXPECT_FALSE(result.effort);
  ASSERT_TRUE(result.kinematics);
  EXPECT_NEAR(result.kinematics->track_at_nominal_radius.estimate, 0.381, 1e-3);
  EXPECT_EQ(standing(result), IdentificationStanding::good);
  EXPECT_THAT(next_steps(result), Contains(HasSubstr("0.381 m")));
}

TEST(ShapeWords, SayWhereTheLogDoesNotShowIt) {
  ShapeFinding shape{.kind = ShapeKind::stribeck_speed,
                     .name = "stribeck_speed",
                     .unit = "rad/s",
                     .state = ShapeState::flat,
                     .converged = true,
                     .estimate = 2.0,
                     .standard_error = INFINITY,
                     .freedom = 20.0,
                     .residual_ratio = 0.999,
                     .searched = {0.1, 5.0},
                     .curve = {}};
  for (const ShapeState state : {ShapeState::flat, ShapeState::at_lower, ShapeState::at_upper}) {
    shape.state = state;
    EXPECT_THAT(in_words(shape), HasSubstr("the log does not show it"));
    EXPECT_FALSE(matters(shape));
  }
  shape.kind = ShapeKind::effort_lag;
  shape.name = "effort_lag";
  shape.unit = "s";
  shape.state = ShapeState::at_lower;
  shape.searched = {0.0, 0.2};
  EXPECT_THAT(in_words(shape), HasSubstr("none"));
  shape.state = ShapeState::identified;
  shape.estimate = 0.01;
  shape.standard_error = 0.001;
  EXPECT_THAT(in_words(shape), HasSubstr("of no consequence"));
  shape.residual_ratio = 0.5;
  EXPECT_THAT(in_words(shape), HasSubstr("10 ms"));
  EXPECT_TRUE(matters(shape));
}

}  // namespace
}  // namespace wheelwright::commission::identification_test
