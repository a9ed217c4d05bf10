// SPDX-License-Identifier: Apache-2.0
// From causes that were fitted to numbers of bodies and joints.
#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/error.hpp"
#include "gap/write_back.hpp"
#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::simulator_change_test {
namespace {

using gap_example::fitted;
using gap_example::plain_drive;
using gap_example::plain_robot;
using model::SimulatorChange;

SimulatorChange change_of(const std::vector<FittedEffect>& causes, const Robot& robot = plain_robot()) {
  Diagnosis found;
  found.fitted = causes;
  for (const FittedEffect& cause : causes) {
    found.causes.push_back({cause.effect.name, cause.effect.sentence, cause.effect.parametric, {}, 0.0});
  }
  return simulator_change(robot, plain_drive(), found);
}

TEST(SimulatorChange, OfBodies) {
  const double mass = plain_drive().physical("mass"), yaw = plain_drive().physical("yaw_inertia");
  const SimulatorChange c = change_of({fitted("payload", {3.0, 0.2}), fitted("com_longitudinal", {0.05, 0.1})});
  EXPECT_DOUBLE_EQ(c.mass, 3.0);
  EXPECT_DOUBLE_EQ(c.yaw_inertia, 0.2 + 0.1 * yaw);
  EXPECT_DOUBLE_EQ(c.moment_ahead, 0.05 * mass);
  EXPECT_EQ(c.because.at("yaw_inertia"), "payload, com_longitudinal");
  const SimulatorChange off = change_of({fitted("payload_offset", {3.0, 0.2, 0.6})});
  EXPECT_DOUBLE_EQ(off.mass, 3.0);
  EXPECT_DOUBLE_EQ(off.moment_ahead, 0.6);
  EXPECT_TRUE(off.not_expressed.empty());
}

TEST(SimulatorChange, OfJoints) {
  const double r = plain_drive().wheel_radius, d = plain_drive().track_width, c = 0.03;
  // f1 = 2c/r² and f3 = c D²/(2r²) of a damping c at each wheel.
  const SimulatorChange change = change_of({fitted("viscous", {2.0 * c / (r * r), 0.5 * c * d * d / (r * r)}),
                                            fitted("coulomb", {0.2}), fitted("coulomb_asymmetric", {0.1, 0.3}),
                                            fitted("armature", {0.004}), fitted("viscous_asymmetric", {0.01}, {1.0})});
  EXPECT_NEAR(change.damping[0], c, 1e-12);
  EXPECT_NEAR(change.damping[1], c + 0.01, 1e-12);
  EXPECT_NEAR(change.dry_friction[0], 0.3, 1e-12);
  EXPECT_NEAR(change.dry_friction[1], 0.5, 1e-12);
  EXPECT_NEAR(change.armature[0], 0.004, 1e-12);
  EXPECT_NEAR(change.armature[1], 0.004, 1e-12);
}

TEST(SimulatorChange, OfGeometryAndActuators) {
  const SimulatorChange c =
      change_of({fitted("wheel_radius", {0.02, 0.0}), fitted("wheel_radius_asymmetric", {-0.01, 0.0}, {1.0}),
                 fitted("track_width", {0.05, 0.0}), fitted("torque_gain", {0.25}),
                 fitted("torque_gain_asymmetric", {0.1}, {0.0}), fitted("saturation", {}, {6.0})});
  EXPECT_DOUBLE_EQ(c.radius_factor[0], 1.02);
  EXPECT_DOUBLE_EQ(c.radius_factor[1], 1.02 * 0.99);
  EXPECT_DOUBLE_EQ(c.track_factor, 1.0 / 0.95);
  EXPECT_DOUBLE_EQ(c.gain[0], 1.0 / 1.25 / 1.1);
  EXPECT_DOUBLE_EQ(c.gain[1], 1.0 / 1.25);
  EXPECT_DOUBLE_EQ(c.effort_limit.value(), 6.0);
}

// An ampere is no newton metre: numbers are those of torques, or are not given.
TEST(SimulatorChange, CurrentsNeedTheMotorsConstants) {
  Robot robot = plain_robot();
  robot.effort = model::EffortKind::current;
  const std::vector<FittedEffect> causes = {fitted("coulomb", {0.2}), fitted("payload", {3.0, 0.2}),
                                            fitted("wheel_radius", {0.02, 0.0})};
  const SimulatorChange blind = change_of(causes, robot);
  EXPECT_EQ(blind.because.size(), 1U);
  ASSERT_EQ(blind.not_expressed.size(), 2U);
  EXPECT_NE(blind.not_expressed[0].instead.find("torque_constant"), std::string::npos);
  robot.motor = model::Motor{0.05, std::nullopt, std::nullopt, 20.0};
  const SimulatorChange known = change_of(causes, robot);
  EXPECT_DOUBLE_EQ(known.dry_friction[0], 0.2 * 0.05 * 20.0);
  EXPECT_DOUBLE_EQ(known.mass, 3.0);
}

// Every effect of the catalogue becomes a change, or is named with something to do.
TEST(SimulatorChange, NoCauseIsLost) {
  for (const Effect& effect : effect_catalogue(plain_drive().model)) {
    std::vector<double> shape;
    for (const ShapeParameter& s : effect.shapes) {
      shape.push_back(s.lower);
    }
    const FittedEffect cause{effect, shape, Eigen::VectorXd::Constant(std::ssize(effect.parameters), 0.01)};
    const SimulatorChange change = change_of({cause});
    EXPECT_TRUE(!change.because.empty() || !change.not_expressed.empty()) << effect.name;
    for (const model::NotExpressed& n : change.not_expressed) {
      EXPECT_EQ(n.cause, effect.name);
      EXPECT_FALSE(n.why.empty());
      EXPECT_FALSE(n.instead.empty());
    }
  }
  // Play that is known by its reversals alone has no fit.
  Diagnosis found;
  found.causes.push_back({"backlash", "", false, {}, 1.0});
  EXPECT_EQ(simulator_change(plain_robot(), plain_drive(), found).not_expressed.at(0).cause, "backlash");
}

}  // namespace
}  // namespace wheelwright::gap::simulator_change_test
