// SPDX-License-Identifier: Apache-2.0
// Speeds in whole multiples of a unit, of which the log does not tell whether they were rounded or cut off.
#include "commission/speed_unit.hpp"

#include <cmath>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "model/model.hpp"
#include "model/sim/simulation.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::open_cut_test {
namespace {

using testing_support::exact_drive;
using testing_support::Shown;

Scenario drive() {
  Scenario s = exact_drive(Shown::speeds, Hold::zero_order);
  s.duration = 40.0;
  s.trajectory.period = 8.0;
  s.sensors.effort = 0.01;
  s.robot.effort_changes = model::EffortChanges::at_samples;
  s.robot.noise = {};
  s.seed = 4;
  return s;
}

LogTable in_units(const Scenario& s, double unit, bool cut) {
  LogTable log = sim::simulate(s);
  for (const char* name : {"omega_r", "omega_l"}) {
    for (double& speed : log.column(name)) {
      speed = unit * (cut ? std::trunc(speed / unit) : std::round(speed / unit));
    }
  }
  return log;
}

TEST(OpenCut, IntervalsHoldTheTruthWhetherSpeedsWereRoundedOrCutOff) {
  const Scenario s = drive();
  const Eigen::VectorXd truth = sim::true_parameters(s, model::make_model(s.robot));
  for (const double unit : {0.02, 0.05, 0.1}) {
    for (const bool cut : {false, true}) {
      const std::string what = fmt::format("unit {} {}", unit, cut ? "cut off" : "rounded");
      const LogTable table = in_units(s, unit, cut);
      TableSource log(table);
      const Commissioning result = commission_robot(log, s.robot);
      ASSERT_TRUE(result.has_model()) << what << ": " << result.message;
      for (std::size_t j = 0; j < result.parameters.size(); ++j) {
        const ParameterResult& p = result.parameters[j];
        EXPECT_TRUE((Interval{p.lower, p.upper}.contains(truth[static_cast<Eigen::Index>(j)])))
            << what << ": " << p.parameter.name << ' ' << truth[static_cast<Eigen::Index>(j)] << " is not in ["
            << p.lower << ", " << p.upper << ']';
      }
      TableSource again(table);
      EXPECT_TRUE(open_cut(again, s.robot, {"omega_r", "omega_l"})) << what;
    }
  }
}

TEST(OpenCut, IsNoneOfFineSpeedsOrOfDeclaredNoise) {
  Scenario s = drive();
  const LogTable fine = sim::simulate(s), coarse = in_units(s, 0.1, true);
  TableSource of_fine(fine), of_coarse(coarse);
  EXPECT_FALSE(open_cut(of_fine, s.robot, {"omega_r", "omega_l"}));
  s.robot.noise.wheel_speed.value = 0.1;
  EXPECT_FALSE(open_cut(of_coarse, s.robot, {"omega_r", "omega_l"}));
}

}  // namespace
}  // namespace wheelwright::commission::open_cut_test
