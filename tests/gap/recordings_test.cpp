// SPDX-License-Identifier: Apache-2.0
// Gaps of real machines, read where their recordings lie beside the project.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "gap/diagnose.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::gap::recordings_test {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;

class GapRecordings : public ::testing::Test {
 protected:
  void SetUp() override { (void)testing_support::skip_without_recordings(root); }
  [[nodiscard]] Diagnosis diagnosed(const std::string& log, const Robot& robot) const {
    CsvLog file({root / log});
    DiagnoseOptions options;
    options.shrink = false;
    return diagnose(file, nullptr, robot, options);
  }
  const fs::path root = fs::path(WHEELWRIGHT_SHARED_DIR) / "data";
};

std::vector<std::string> effects(const Diagnosis& diagnosis) {
  std::vector<std::string> names;
  for (const GapCause& cause : diagnosis.causes) {
    names.push_back(cause.effect);
  }
  return names;
}

GapEstimate estimate(const Diagnosis& diagnosis, const std::string& effect, const std::string& name) {
  for (const GapCause& cause : diagnosis.causes) {
    for (const GapEstimate& number : cause.parameters) {
      if (cause.effect == effect && number.name == name) {
        return number;
      }
    }
  }
  ADD_FAILURE() << "no " << effect << ' ' << name;
  return {};
}

bool credible_with(const Diagnosis& diagnosis, const std::string& effect) {
  return std::ranges::any_of(diagnosis.credible,
                             [&](const CredibleCauses& c) { return std::ranges::count(c.effects, effect) > 0; });
}

// Janot, Gautier and Brunot (2019) publish a dry friction of 20.3935 N, an offset of −3.1648 N and 203.5034 N·s/m of
// viscous friction for this axis.
TEST_F(GapRecordings, AnAxisWithoutFrictionAndOffsetInItsModelLacksBoth) {
  Robot robot = read_robot(root / "emps.yaml");
  robot.parameters = {"inertia", "viscous"};
  const Diagnosis diagnosis = diagnosed("emps/emps.csv", robot);
  EXPECT_THAT(effects(diagnosis), ::testing::UnorderedElementsAre("coulomb", "torque_bias"));
  EXPECT_LT(diagnosis.remaining, 0.05);
  const GapEstimate friction = estimate(diagnosis, "coulomb", "c"), offset = estimate(diagnosis, "torque_bias", "b");
  EXPECT_NEAR(friction.estimate, 20.3935, 0.05 * 20.3935);
  EXPECT_LT(friction.lower, 20.3935);
  EXPECT_GT(friction.upper, 20.3935);
  EXPECT_LT(offset.lower, -3.1648);
  EXPECT_GT(offset.upper, -3.1648);
  // The missing causes had doubled the viscous friction.
  ASSERT_EQ(diagnosis.parametric.size(), 2U);
  EXPECT_GT(diagnosis.parametric[1].without_causes, 1.5 * 203.5034);
  EXPECT_NEAR(diagnosis.parametric[1].estimate, 203.5034, 0.05 * 203.5034);
}

// The same axis with both in its model has no cause that counts as much.
TEST_F(GapRecordings, TheAxisWithBothLacksNeither) {
  Robot robot = read_robot(root / "emps.yaml");
  robot.parameters = {"inertia", "viscous", "coulomb", "offset"};
  const Diagnosis diagnosis = diagnosed("emps/emps.csv", robot);
  EXPECT_THAT(effects(diagnosis), ::testing::Not(Contains("coulomb")));
  EXPECT_THAT(effects(diagnosis), ::testing::Not(Contains("torque_bias")));
}

struct SkidSteer {
  const char* name;
  double track_in_effect;  // m: what the robot's turning answers like
};

class GapOfSkidSteer : public GapRecordings, public ::testing::WithParamInterface<SkidSteer> {};

// Wheel speeds and pose alone: slip and a wider track are the same, and the tool says so. It never takes the track's
// word.
TEST_P(GapOfSkidSteer, IsSlipOrAnotherTrackAndNoOneCanTellFromThisLog) {
  const auto [name, track] = GetParam();
  const Robot robot = read_robot(root / (std::string(name) + ".yaml"));
  const Diagnosis diagnosis = diagnosed("warthog/" + std::string(name) + "_pose.csv", robot);
  EXPECT_EQ(diagnosis.verdict, GapVerdict::ambiguous);
  EXPECT_THAT(effects(diagnosis), Contains("turning_slip"));
  EXPECT_TRUE(credible_with(diagnosis, "turning_slip"));
  EXPECT_TRUE(credible_with(diagnosis, "track_width"));
  EXPECT_NEAR(estimate(diagnosis, "turning_slip", "track_in_effect").estimate * robot.track_width, track, 0.03 * track);
  const auto turning = std::ranges::find(diagnosis.causes, "turning_slip", &GapCause::effect);
  ASSERT_NE(turning, diagnosis.causes.end());
  EXPECT_NE(turning->sentence.find("turntable"), std::string::npos);
  EXPECT_TRUE(std::ranges::any_of(
      diagnosis.notes, [](const std::string& note) { return note.find("no efforts") != std::string::npos; }));
}

INSTANTIATE_TEST_SUITE_P(Robots, GapOfSkidSteer,
                         ::testing::Values(SkidSteer{"warthog", 1.86}, SkidSteer{"husky", 1.42}),
                         [](const auto& tested) { return std::string(tested.param.name); });

// Only the size of the current is logged: a friction in proportion to it would be all of it.
TEST_F(GapRecordings, UnsignedEffortsAreNoLoadFriction) {
  const Diagnosis diagnosis = diagnosed("warthog/current.csv", read_robot(root / "warthog.yaml"));
  EXPECT_THAT(effects(diagnosis), ::testing::Not(Contains("load_friction")));
  EXPECT_TRUE(std::ranges::any_of(
      diagnosis.not_excited, [](const std::string& sentence) { return sentence.rfind("load_friction: ", 0) == 0; }));
  EXPECT_TRUE(effects(diagnosis).empty()) << "where the motors braked is not known";
  EXPECT_FALSE(std::ranges::any_of(diagnosis.parametric, [](const ParameterShift& p) { return p.estimate < 0.0; }));
}

}  // namespace
}  // namespace wheelwright::gap::recordings_test
