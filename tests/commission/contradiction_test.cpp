// SPDX-License-Identifier: Apache-2.0
// Logs that cannot be commissioned, or only in part, and what is said of them.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bounds/certificate.hpp"
#include "commission/commission.hpp"
#include "core/error.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::contradiction_test {
namespace {

using ::testing::HasSubstr;
using Status = Commissioning::Status;
using testing_support::noisy_drive;

Commissioning commissioned(const Scenario& s, const Robot& robot) {
  Simulation log(s);
  return commission_robot(log, robot);
}

// One torque is wrong by ten times what is declared, on top of noise that is as declared.
TEST(Contradiction, NamesSamplesThatCannotBeTrueTogether) {
  const Scenario s = noisy_drive(4);
  LogTable table = sim::simulate(s);
  const double declared = *s.robot.noise.effort.value;
  for (double& torque : table.column("tau_r")) {
    torque += 10.0 * declared;
  }
  const auto raised = [&](double factor) {
    Robot robot = s.robot;
    *robot.noise.effort.value *= factor;
    TableSource log(table);
    return commission_robot(log, robot);
  };
  const Commissioning result = raised(1.0);
  ASSERT_EQ(result.status, Status::empty) << result.message;
  EXPECT_THAT(result.message, HasSubstr("declared noise"));
  EXPECT_TRUE(result.model.facets.empty());

  ASSERT_FALSE(result.feasible.contradiction.empty());
  EXPECT_LE(result.feasible.contradiction.size(), 5u);
  EXPECT_TRUE(bounds::proves_empty(result.feasible.contradiction, result.feasible.hull));
  for (const bounds::WeightedRow& row : result.feasible.contradiction) {
    EXPECT_GE(row.multiplier, 0.0);
    if (!row.row.origin.is_prior) {
      ASSERT_LT(row.row.origin.sample, table.rows());
      EXPECT_EQ(row.row.origin.t, table.t[row.row.origin.sample]);
    }
  }

  // The truth explains the log with eleven times the declared bound, so the smallest factor is not above that; with the
  // declaration raised by the factor the log is explained, and with a little less it is not.
  EXPECT_GT(result.minimax, 1.0);
  EXPECT_LE(result.minimax, 11.0);
  EXPECT_NE(raised(1.001 * result.minimax).status, Status::empty);
  EXPECT_EQ(raised(0.999 * result.minimax).status, Status::empty);
}

TEST(Contradiction, AFaultMidwayContradictsTheModel) {
  Scenario s = noisy_drive(5, 30.0);
  s.faults = {{.kind = model::Fault::Kind::wheel_radius_left,
               .magnitude = -0.03,
               .profile = {.shape = model::TimeProfile::Shape::smooth, .onset = 15.0, .rise_time = 1.0}}};
  const Commissioning result = commissioned(s, s.robot);
  ASSERT_EQ(result.status, Status::empty) << result.message;
  EXPECT_TRUE(bounds::proves_empty(result.feasible.contradiction, result.feasible.hull));
}

TEST(Unexcited, AStraightDriveSaysNothingOfYaw) {
  Scenario s = noisy_drive(6);
  s.trajectory.kind = sim::Trajectory::Kind::straight;
  for (const bool declared : {true, false}) {
    Robot robot = s.robot;
    if (!declared) {
      robot.noise.effort.value.reset();
    }
    const Commissioning result = commissioned(s, robot);
    ASSERT_EQ(result.status, Status::partial) << result.message;
    EXPECT_THAT(result.message, HasSubstr("drive in curves"));
    EXPECT_THAT(result.message, HasSubstr("r_viscous_yaw"));
    for (const ParameterResult& p : result.parameters) {
      const bool yaw = p.parameter.physical == "yaw_inertia" || p.parameter.physical == "viscous_yaw";
      EXPECT_EQ(p.excitation == identify::Excitation::not_excited, yaw) << p.parameter.name;
      EXPECT_EQ(p.estimate.has_value(), !yaw) << p.parameter.name;
      EXPECT_EQ(p.standard_error.has_value(), !yaw) << p.parameter.name;
      if (yaw) {
        EXPECT_THAT(p.reason, HasSubstr(p.parameter.excite));
      }
    }
    EXPECT_FALSE(result.model.facets.empty());
  }
}

TEST(Unexcited, ARobotThatStandsStillSaysNothing) {
  Scenario s = noisy_drive(7);
  s.trajectory.speed = 0.0;
  s.trajectory.yaw_rate = 0.0;
  s.trajectory.kind = sim::Trajectory::Kind::straight;
  const Commissioning result = commissioned(s, s.robot);
  ASSERT_EQ(result.status, Status::nothing) << result.message;
  EXPECT_THAT(result.message, HasSubstr("nothing"));
  for (const ParameterResult& p : result.parameters) {
    EXPECT_EQ(p.excitation, identify::Excitation::not_excited);
    EXPECT_FALSE(p.estimate.has_value());
  }
  EXPECT_TRUE(result.model.facets.empty());
}

TEST(Unusable, AShortLogIsRefused) {
  Scenario s = noisy_drive(8, 12.0);
  s.duration = 0.3;
  Simulation log(s);
  EXPECT_THROW(static_cast<void>(commission_robot(log, s.robot)), InvalidArgument);
}

TEST(Unusable, AMissingColumnIsNamed) {
  const LogTable whole = sim::simulate(noisy_drive(9));
  LogTable table = whole;
  table.names.erase(table.names.begin() + 2);
  table.columns.erase(table.columns.begin() + 2);
  ASSERT_EQ(whole.names[2], "tau_r");
  TableSource log(table);
  try {
    static_cast<void>(commission_robot(log, noisy_drive(9).robot));
    FAIL() << "no exception";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("tau_r"));
  }
}

}  // namespace
}  // namespace wheelwright::commission::contradiction_test
