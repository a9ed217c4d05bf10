// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/regimes.hpp"
#include "gap/rows/drive.hpp"
#include "model/robot.hpp"
#include "tests/gap/made_up_drive.hpp"

namespace wheelwright::gap::contradictions_test {
namespace {

constexpr double kBeta = 5.0, kMass = 20.0, kInertia = 0.8, kDrag = 4.0, kYawDrag = 0.5;

// r (m v̇1 + f1 v1) and r (I v̇2 + f3 v2) shared between the wheels, and dry friction of `friction` N·m at each.
Drive driven(double friction, double seconds = 60.0) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  robot.parameters = {{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"}};
  Drive d = gap_example::made_up_drive(seconds);
  d.model = model::make_model(robot);
  for (CoordinateSignals& c : d.coordinates) {
    c.speed = c.smooth_speed;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const double side = i == 0 ? 1.0 : -1.0;
    const Eigen::ArrayXd s =
        0.1 * (kMass * d.coordinates[0].smooth_acceleration + kDrag * d.coordinates[0].smooth_speed).array();
    const Eigen::ArrayXd difference =
        0.1 * (kInertia * d.coordinates[1].smooth_acceleration + kYawDrag * d.coordinates[1].smooth_speed).array();
    d.joints[i].effort = 0.5 * (s + side * difference / 0.2) + friction * d.joints[i].smooth_speed.array().sign();
  }
  return d;
}

Mask used(const Drive& drive) { return settled(drive, kBeta) && moving(drive, kBeta); }

Box prior(double mass_low, double mass_high) {
  return {{{0.1 * mass_low, 0.1 * mass_high}, {0.0, 1.0}, {0.0, 10.0}, {0.0, 10.0}}};
}

const std::vector<double> kFloors = {0.01, 0.002};

// The filter remembers the jump of the efforts where the made-up drive stops and starts: only rows well after it count.
TEST(Contradictions, NoneWhereTheModelIsRight) {
  const Drive drive = driven(0.0);
  const Contradictions found = find_contradictions(drive, kBeta, used(drive), {0.05, 0.02}, prior(5, 60));
  EXPECT_TRUE(found.rows.empty());
  EXPECT_NE(found.statement.find("not excluded"), std::string::npos);
}

TEST(Contradictions, AFewRowsProveThatFrictionIsMissing) {
  const Drive drive = driven(0.5);
  const Contradictions found = find_contradictions(drive, kBeta, used(drive), kFloors, prior(5, 60));
  ASSERT_FALSE(found.rows.empty());
  EXPECT_LE(found.rows.size(), drive.model.p() + 1);
  double sum = 0.0;
  for (const Contradiction& row : found.rows) {
    sum += row.weight;
    EXPECT_GT(row.weight, 0.0);
    EXPECT_GE(row.t, drive.t[0]);
    EXPECT_LE(row.t, drive.t[drive.rows() - 1]);
    EXPECT_TRUE(row.channel == "sum" || row.channel == "difference");
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_GE(found.rows.front().weight, found.rows.back().weight);
  // With noise as large as the friction itself nothing is proved.
  EXPECT_TRUE(find_contradictions(drive, kBeta, used(drive), {1.0, 1.0}, prior(5, 60)).rows.empty());
}

TEST(Contradictions, APriorThatIsWrongContradictsTheLog) {
  const Drive drive = driven(0.0);
  EXPECT_FALSE(find_contradictions(drive, kBeta, used(drive), {0.05, 0.02}, prior(40, 60)).rows.empty());
}

TEST(Contradictions, PointAtTheMomentThatDoesNotFit) {
  Drive drive = driven(0.0);
  drive.joints[0].effort.segment(3500, 20).array() += 30.0;  // 35.0 to 35.2 s
  const Contradictions found = find_contradictions(drive, kBeta, used(drive), {0.05, 0.02}, prior(5, 60));
  ASSERT_FALSE(found.rows.empty());
  EXPECT_GE(found.rows.front().t, 35.0);
  EXPECT_LE(found.rows.front().t, 36.5);
}

TEST(Contradictions, TheBoundIsAUnionOverAllRows) {
  const Drive drive = driven(0.0);
  const Mask rows = used(drive);
  const Contradictions found = find_contradictions(drive, kBeta, rows, kFloors, prior(5, 60));
  EXPECT_NEAR(2.0 * static_cast<double>(rows.count()) * std::erfc(found.factor / std::sqrt(2.0)), 1e-3, 1e-8);
  EXPECT_DOUBLE_EQ(found.bounds[0], found.factor * kFloors[0]);
  EXPECT_DOUBLE_EQ(found.bounds[1], found.factor * kFloors[1]);
}

TEST(Contradictions, RefuseWhatMakesNoSense) {
  const Drive drive = driven(0.0, 10.0);
  const Mask rows = used(drive);
  EXPECT_THROW((void)find_contradictions(drive, kBeta, rows, {0.1}, prior(5, 60)), InvalidArgument);
  EXPECT_THROW((void)find_contradictions(drive, kBeta, rows, {0.1, 0.0}, prior(5, 60)), InvalidArgument);
  EXPECT_THROW((void)find_contradictions(drive, 0.0, rows, kFloors, prior(5, 60)), InvalidArgument);
  EXPECT_THROW((void)find_contradictions(drive, kBeta, rows.head(5), kFloors, prior(5, 60)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::gap::contradictions_test
