// SPDX-License-Identifier: Apache-2.0
#include "gap/prepared.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::prepared_test {
namespace {

using gap_example::counted_robot;
using gap_example::effect_called;
using gap_example::kYawFriction;
using gap_example::noisy_scenario;
using gap_example::only;
using gap_example::plain_robot;
using gap_example::prepared_log;
using gap_example::Problem;
using gap_example::robot_with;
using gap_example::simulated_drive;
using testing::HasSubstr;

constexpr double kRadius = 0.0975;
const Eigen::Vector4d kTheta = kRadius * Eigen::Vector4d(21.0, 0.9, 4.0, kYawFriction);

template <class Call>
std::string message_of(const Call& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST(FitBase, FindsThetaOfAPerfectLog) {
  const Drive drive =
      gap_example::drive_of_log(sim::simulate(simulated_drive(plain_robot(), 40.0, 200.0)), plain_robot());
  const Eigen::VectorXd theta = fit_base(drive, 10.0);
  for (Eigen::Index j = 0; j < 4; ++j) {
    EXPECT_NEAR(theta[j], kTheta[j], 2e-3 * kTheta[j]) << j;
  }
}

TEST(PrepareGap, BelievesTheRobotFileAsFarAsItSays) {
  Robot file = counted_robot();
  file.nominal.erase("yaw_inertia");
  Simulation log(noisy_scenario(counted_robot(), 1));
  const PreparedGap prepared = prepare_gap(log, nullptr, file, {});
  EXPECT_EQ(prepared.trusted, (std::vector<bool>{true, false, true, true}));
  EXPECT_DOUBLE_EQ(prepared.theta[0], kTheta[0]);
  EXPECT_NE(prepared.theta[1], kTheta[1]);
  EXPECT_NEAR(prepared.theta[1], kTheta[1], 0.05 * kTheta[1]);
  EXPECT_EQ(Problem(prepared).problem.table.unknown, std::vector<std::size_t>{1});
}

TEST(PrepareGap, TakesWhatTheHealthyRobotHasForGranted) {
  // Both logs have the friction; only the slope is new.
  const Robot healthy = robot_with("coulomb", {{"c", 0.3}});
  Robot world = healthy;
  world.effects.push_back({"slope", {{"g_x", {0.3, 0.3}}, {"g_y", {0.1, 0.1}}}});
  Simulation log(noisy_scenario(world, 1)), before(noisy_scenario(healthy, 2));
  const PreparedGap prepared = prepare_gap(log, &before, counted_robot(), {});
  EXPECT_TRUE(std::any_of(prepared.healthy.begin(), prepared.healthy.end(),
                          [](const FittedEffect& e) { return e.effect.name == "coulomb"; }));
  EXPECT_NEAR(prepared.theta[0], kTheta[0], 0.01 * kTheta[0]);
  EXPECT_EQ(prepared.trusted, std::vector<bool>(4, true));
  const Problem problem(prepared);
  EXPECT_EQ(names_of(problem.problem.table, problem.select().all), std::vector<std::string>{"slope"});
}

TEST(PrepareGap, TheHealthyLogsClockIsNoCause) {
  // Speeds 4 ms late in both.
  const Robot late = robot_with("sensor_time_offset", {{"dt", 0.004}});
  Simulation log(noisy_scenario(late, 1)), before(noisy_scenario(late, 2));
  const PreparedGap prepared = prepare_gap(log, &before, counted_robot(), {});
  const Problem problem(prepared);
  const Selection found = problem.select();
  EXPECT_FALSE(found.any_cause);
  EXPECT_TRUE(found.reaches_floor);
}

TEST(ExpectEfforts, AddsTheCausesOwnEffort) {
  DiagnoseOptions options;
  options.catalogue = only({"coulomb"});
  PreparedGap prepared = prepared_log(noisy_scenario(robot_with("coulomb", {{"c", 0.5}}), 3), false, options);
  const Problem problem(prepared);
  const auto off = [&prepared](const Eigen::VectorXd& effort) {
    return (effort - prepared.drive.joints[0].smooth_effort).norm();
  };
  const double before = off(prepared.drive.joints[0].predicted_effort);
  const Eigen::VectorXd predicted = prepared.drive.joints[0].predicted_effort;
  expect_efforts(prepared, problem.problem, evaluate(problem.problem.table, {0}, BaseModel::refitted));
  EXPECT_LT(off(prepared.drive.joints[0].expected_effort), 0.3 * before);
  EXPECT_EQ(prepared.drive.joints[0].predicted_effort, predicted);
}

TEST(Residuals, AreWhatTheFitLeaves) {
  DiagnoseOptions options;
  options.catalogue = only({"coulomb"});
  const PreparedGap prepared = prepared_log(noisy_scenario(robot_with("coulomb", {{"c", 0.5}}), 3), false, options);
  const Problem problem(prepared);
  const Subset subset = subset_of(problem.problem.table, {0}, BaseModel::refitted);
  const BlockFit fit = problem.gram->fit(subset);
  const std::vector<Eigen::VectorXd> left = residuals(problem.problem.rows, subset, fit.coefficients);
  double sum = 0.0, rows = 0.0;
  for (std::size_t s = 0; s < left.size(); ++s) {
    sum += left[s].squaredNorm() / std::pow(problem.problem.rows.spaces[s].floor, 2);
    rows += static_cast<double>(left[s].size());
  }
  EXPECT_NEAR(sum / rows, fit.mean_square, 1e-6 * fit.mean_square);
}

TEST(PrepareGap, SaysWhatIsWrongAndWhatToDo) {
  const Scenario good = noisy_scenario(counted_robot(), 1);
  DiagnoseOptions options;
  options.without = {"coulomb", "friktion"};
  EXPECT_THAT(message_of([&] { (void)prepared_log(good, false, options); }), HasSubstr("friktion"));
  Scenario still = good;
  still.trajectory.speed = still.trajectory.yaw_rate = 0.0;
  EXPECT_THAT(message_of([&] { (void)prepared_log(still, false); }),
              testing::AllOf(HasSubstr("in motion"), HasSubstr("drive")));
  Scenario brief = good;
  brief.duration = 0.8;
  EXPECT_THAT(message_of([&] { (void)prepared_log(brief, false); }), HasSubstr("drive longer"));
  options.without.clear();
  options.catalogue = only({"coulomb"});
  options.catalogue->front().columns = nullptr;
  EXPECT_THAT(message_of([&] { (void)prepared_log(good, false, options); }), HasSubstr("columns"));
}

}  // namespace
}  // namespace wheelwright::gap::prepared_test
