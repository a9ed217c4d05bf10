// SPDX-License-Identifier: Apache-2.0
// Another load or ground from before the log's first row is told as such; what changes during the log is not.
#include <algorithm>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/watch/detector_walk.hpp"
#include "commission/watch/other_parameters.hpp"
#include "detector/online_model.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::other_parameters_test {
namespace {

class AnotherDrive : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scenario() = testing_support::noisy_drive(3, 20.0);
    scenario().sensors.pose = true;
    scenario().sensors.position = 0.002;
    scenario().sensors.heading = 0.003;
    scenario().robot.noise.position.value = 0.002;
    scenario().robot.noise.heading.value = 0.003;
    Simulation log(scenario());
    const Commissioning result = commission_robot(log, scenario().robot);
    ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
    ASSERT_TRUE(result.model.kinematic) << result.kinematic.message;
    model() = result.model;
  }
  static Scenario& scenario() {
    static Scenario s;
    return s;
  }
  static OnlineModel& model() {
    static OnlineModel m;
    return m;
  }
  static std::optional<OtherParameters> asked(Scenario s, std::size_t& alarms) {
    s.seed = 77;
    Simulation log(s);
    const Detection detection = detect(log, detector::make_detector(model()));
    const KinematicWatch kinematic = watch_kinematics(log, model(), {});
    alarms = detection.events.size() + kinematic.detection->events.size();
    return explained_by_other_parameters(log, model(), detection, kinematic);
  }
  static const ChangedParameter* change(const OtherParameters& other, const std::string& name) {
    const auto at = std::ranges::find(other.changes, name, &ChangedParameter::name);
    return at == other.changes.end() ? nullptr : &*at;
  }
};

TEST_F(AnotherDrive, ALoadFromTheFirstRowOnIsTold) {
  Scenario s = scenario();
  s.parameters.mass *= 1.5;
  std::size_t alarms = 0;
  const auto other = asked(s, alarms);
  ASSERT_GT(alarms, 0u);
  ASSERT_TRUE(other);
  EXPECT_THAT(other->residuals, testing::ElementsAre("torque"));
  const ChangedParameter* mass = change(*other, "mass");
  ASSERT_NE(mass, nullptr);
  EXPECT_TRUE(mass->now.contains(s.parameters.mass)) << mass->now.lower << " to " << mass->now.upper;
  EXPECT_TRUE(mass->before.contains(scenario().parameters.mass));
  EXPECT_EQ(change(*other, "yaw_inertia"), nullptr);
  EXPECT_THAT(sentence(*other),
              testing::AllOf(testing::StartsWith("other constant parameters explain the whole drive: mass "),
                             testing::HasSubstr("wheelwright gap")));
}

TEST_F(AnotherDrive, ATyreFromTheFirstRowOnIsToldByThePose) {
  Scenario s = scenario();
  s.seed = 78;
  s.faults = {{.kind = model::Fault::Kind::wheel_radius_left,
               .magnitude = -0.1 * s.robot.wheel_radius,
               .profile = {.onset = 0.0}}};
  Simulation log(s);
  const KinematicWatch kinematic = watch_kinematics(log, model(), {});
  ASSERT_FALSE(kinematic.detection->events.empty());
  const auto other = explained_by_other_parameters(log, model(), {}, kinematic);
  ASSERT_TRUE(other);
  EXPECT_THAT(other->residuals, testing::ElementsAre("kinematic"));
  const ChangedParameter* radius = change(*other, "radius_left");
  ASSERT_NE(radius, nullptr);
  EXPECT_TRUE(radius->now.contains(0.9 * s.robot.wheel_radius));
  EXPECT_EQ(change(*other, "radius_right"), nullptr);
}

TEST_F(AnotherDrive, AFaultDuringTheLogIsNone) {
  for (const auto kind : {model::Fault::Kind::wheel_radius_left, model::Fault::Kind::unmatched}) {
    Scenario s = scenario();
    const bool radius = kind == model::Fault::Kind::wheel_radius_left;
    s.faults = {{.kind = kind, .magnitude = radius ? -0.3 * s.robot.wheel_radius : 0.2, .profile = {.onset = 9.003}}};
    std::size_t alarms = 0;
    EXPECT_FALSE(asked(s, alarms));
    EXPECT_GT(alarms, 0u);
  }
}

TEST_F(AnotherDrive, NothingIsAskedOfAHealthyOne) {
  std::size_t alarms = 0;
  EXPECT_FALSE(asked(scenario(), alarms));
  EXPECT_EQ(alarms, 0u);
}

}  // namespace
}  // namespace wheelwright::commission::other_parameters_test
