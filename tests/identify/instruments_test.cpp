// SPDX-License-Identifier: Apache-2.0
#include "identify/instruments.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/filter/row_stream.hpp"
#include "model/single_axis.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::identify::instruments_test {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Shown;

// The drive with its exact speeds logged as commands too.
LogTable with_commands(const Scenario& scenario) {
  LogTable log = sim::simulate(scenario);
  log.names.insert(log.names.end(), {"command_r", "command_l"});
  log.columns.push_back(log.column("omega_r"));
  log.columns.push_back(log.column("omega_l"));
  return log;
}

TEST(InstrumentStream, GivesTheRowsOfTheLogAndOfTheCommandedMotion) {
  const Scenario scenario = exact_drive(Shown::speeds, Hold::first_order);
  LogTable table = with_commands(scenario);
  table.segment_starts = {0, 700};
  const RegressorFilter filter = filter_of(scenario);
  TableSource log(table);
  const auto motion = commanded_motion(log, filter.model());
  ASSERT_TRUE(motion);
  InstrumentStream stream(log, filter, *motion);
  const RegressionBlock both = read_all(stream);
  TorqueRows plain(log, filter);
  const RegressionBlock rows = read_all(plain);
  EXPECT_EQ(both.sample, rows.sample);
  EXPECT_EQ(both.Y.leftCols(4), rows.Y);
  EXPECT_EQ(both.Y.rightCols(4), rows.Y);  // the commands are the speeds here
  EXPECT_EQ(both.y, rows.y);
  EXPECT_EQ(moments_with_instruments(stream).instants(), rows.instants());
  EXPECT_EQ(stream.speed_ratio(), 1.0);
}

TEST(InstrumentStream, MatchesInstantsWhereTheFiltersSettleDifferently) {
  const Scenario scenario = exact_drive(Shown::angles, Hold::zero_order);
  LogTable table = sim::simulate(scenario);
  Scenario speeds = scenario;
  speeds.sensors.speeds = true;
  const LogTable both = sim::simulate(speeds);
  table.names.insert(table.names.end(), {"command_r", "command_l"});
  table.columns.push_back(both.column("omega_r"));
  table.columns.push_back(both.column("omega_l"));
  TableSource log(table);
  const RegressorFilter filter = filter_of(scenario);
  InstrumentStream stream(log, filter, *commanded_motion(log, filter.model()));
  const std::size_t instants = read_all(stream).instants();
  TorqueRows plain(log, filter);
  EXPECT_EQ(instants, read_all(plain).instants());
}

TEST(CommandedMotion, IsThereOnlyWithAllItsColumns) {
  const Scenario scenario = exact_drive(Shown::speeds, Hold::first_order);
  const LogTable table = sim::simulate(scenario);
  const TableSource log(table);
  EXPECT_FALSE(commanded_motion(log, model::make_model(scenario.robot)));
  EXPECT_FALSE(commanded_motion(log, model::SingleAxis{}.model()));
}

// One axis under a constant force: v = F/f·(1 − e^{−ft/m}).
TEST(MotionSimulation, FollowsTheClosedFormOfOneAxis) {
  const Eigen::VectorXd theta = Eigen::Vector2d(2.0, 3.0);
  MotionSimulation simulation(model::SingleAxis{}.model(), theta, Hold::zero_order);
  const Eigen::VectorXd force = Eigen::VectorXd::Constant(1, 6.0);
  simulation.restart(0.0, Eigen::VectorXd::Zero(1), force);
  for (int k = 1; k <= 200; ++k) {
    const double t = 0.01 * k;
    const double exact = 2.0 * (1.0 - std::exp(-1.5 * t));
    // Fourth order: (1.5·0.005)⁵/120 a step, 400 steps.
    EXPECT_NEAR(simulation.step(t, force)[0], exact, 1e-10);
  }
}

TEST(MotionSimulation, RepeatsTheDriveThatTheSimulatedWorldMade) {
  const Scenario scenario = exact_drive(Shown::speeds, Hold::first_order);
  const LogTable log = sim::simulate(scenario);
  const Model model = model::make_model(scenario.robot);
  MotionSimulation simulation(model, sim::true_parameters(scenario, model), Hold::first_order);
  const auto at = [&](const char* right, const char* left, std::size_t k) -> Eigen::VectorXd {
    return Eigen::Vector2d(log.column(right)[k], log.column(left)[k]);
  };
  simulation.restart(log.t[0], at("omega_r", "omega_l", 0), at("tau_r", "tau_l", 0));
  double worst = 0.0, largest = 0.0;
  for (std::size_t k = 1; k < log.rows(); ++k) {
    const Eigen::VectorXd expected = at("omega_r", "omega_l", k);
    worst = std::max(worst, (simulation.step(log.t[k], at("tau_r", "tau_l", k)) - expected).norm());
    largest = std::max(largest, expected.norm());
  }
  EXPECT_LE(worst, 1e-6 * largest);
}

TEST(MotionSimulation, IsRefusedWhereItCannotBe) {
  const Model model = model::SingleAxis{}.model();
  EXPECT_FALSE(MotionSimulation::possible(model, Eigen::Vector2d(0.0, 1.0)));
  EXPECT_FALSE(MotionSimulation::possible(model, Eigen::VectorXd::Ones(3)));
  EXPECT_THROW(MotionSimulation(model, Eigen::Vector2d(0.0, 1.0), Hold::zero_order), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::identify::instruments_test
