// SPDX-License-Identifier: Apache-2.0
// `wheelwright gap`, as a user runs it: a simulated robot whose bearings are dry, its plain robot file, a healthy log.
#include <algorithm>

#include "formats/robots/robot_file.hpp"
#include "tests/app/program.hpp"
#include "tests/robots/simulator_samples.hpp"

namespace wheelwright::app::gap_test {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using testing::Outcome;

constexpr double kCoulomb = 0.25;  // N·m

class Gap : public testing::ProgramTest {
 protected:
  void drive(const std::string& name, const std::string& robot, int seed, const std::string& more = "",
             int duration = 50) const {
    put(name + ".yaml", "robot: " + robot +
                            "\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
                            "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 8}\n" +
                            more +
                            "sensors: {effort: 0.02, position: 0.002, heading: 0.003, "
                            "encoder_counts_per_turn: 4096, log: [angles, pose]}\nrate: 100\n" +
                            fmt::format("duration: {}\nseed: {}\n", duration, seed));
    const Outcome done = run("simulate " + name + ".yaml --out " + name + ".csv --quiet");
    ASSERT_EQ(done.code, 0) << done.err;
  }
};

TEST_F(Gap, ADryBearingIsNamedAndTheImprovedRobotFileIsNotContradicted) {
  // Left open, commissioning would choose a model with dry friction by itself.
  put("robot.yaml", bytes(path("robot.yaml")) + "parameters: [mass, yaw_inertia, viscous_linear, viscous_yaw]\n");
  drive("healthy", "robot.yaml", 1);
  drive("real", "robot.yaml", 2, fmt::format("effects: [{{effect: coulomb, c: {}}}]\n", kCoulomb));
  const Outcome told = run("gap real.csv --robot robot.yaml --baseline healthy.csv --out gap --naive");
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, AllOf(HasSubstr("Dry friction"), HasSubstr("next: wheelwright commission"),
                              HasSubstr("robot_improved.yaml"), Not(HasSubstr("coulomb"))));
  EXPECT_THAT(names_in("gap"), ElementsAre("gap.json", "report.html", "residuals.csv", "robot_improved.yaml"));
  if (has_validator()) {
    EXPECT_EQ(misfit("gap.schema.json", "gap/gap.json"), "");
  }
  const Json gap = files::read_json(path("gap/gap.json"));
  EXPECT_EQ(gap.at("verdict"), "explained");
  ASSERT_EQ(gap.at("causes").size(), 1U);
  EXPECT_EQ(gap.at("causes")[0].at("effect"), "coulomb");
  const Json& c = gap.at("causes")[0].at("parameters").at("c");
  EXPECT_LE(c.at("lower"), kCoulomb);
  EXPECT_GE(c.at("upper"), kCoulomb);
  EXPECT_TRUE(gap.at("next_manoeuvre").is_null());
  EXPECT_THAT(gap.at("naive").at("effects"), Not(IsEmpty()));

  EXPECT_THAT(bytes(path("gap/robot_improved.yaml")), HasSubstr("# robot.yaml with what"));
  ASSERT_EQ(read_robot(path("gap/robot_improved.yaml")).effects.size(), 1U);
  drive("improved", "gap/robot_improved.yaml", 3, "", 5);
  // The log contradicts the plain robot, and says how one gets on; the improved one explains it.
  const Outcome plain = run("commission real.csv --robot robot.yaml --out plain --quiet");
  EXPECT_EQ(plain.code, 1);
  const Json none = files::read_json(path("plain/model.json"));
  EXPECT_EQ(none.at("status"), "empty");
  EXPECT_THAT(none.at("message").get<std::string>(), HasSubstr("`gap`"));
  EXPECT_THAT(none.at("validation").at("outputs"), IsEmpty());
  const Outcome done = run("commission real.csv --robot gap/robot_improved.yaml --out model --quiet");
  EXPECT_EQ(done.code, 0) << done.err;
  const Json model = files::read_json(path("model/model.json"));
  EXPECT_EQ(model.at("status"), "done");
  EXPECT_THAT(model.at("contradictions"), IsEmpty());
  ASSERT_EQ(model.at("validation").at("outputs").size(), 2U);
  for (const Json& channel : model.at("validation").at("outputs")) {
    EXPECT_GT(channel.at("width_over_torque_rms").get<double>(), 0.0);
    EXPECT_EQ(channel.at("false_alarms"), 0);
  }
  const auto of_dry_friction = [](const Json& p) { return p.at("name") == "coulomb"; };
  const auto bounds = std::ranges::find_if(model.at("parameters"), of_dry_friction);
  ASSERT_NE(bounds, model.at("parameters").end());
  EXPECT_LE(bounds->at("lower"), kCoulomb);
  EXPECT_GE(bounds->at("upper"), kCoulomb);
}

TEST_F(Gap, AHealthyRobotHasNone) {
  drive("healthy", "robot.yaml", 1, "", 40);
  drive("again", "robot.yaml", 2, "", 40);
  std::filesystem::create_directories(path("gap"));
  put("gap/robot_improved.yaml", "of an earlier run");
  put("gap/gap.json", "{\n  \"schema\": \"wheelwright/gap/1\"}");
  const Outcome told = run("gap again.csv --robot robot.yaml --baseline healthy.csv --no-shrink --out gap");
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, AllOf(HasSubstr("No gap"), HasSubstr("nothing is to be added")));
  EXPECT_EQ(files::read_json(path("gap/gap.json")).at("verdict"), "no_gap");
  EXPECT_FALSE(std::filesystem::exists(path("gap/robot_improved.yaml")));
}

// The file of the user's own simulator: the friction is put at its joints, and not a byte changes beside.
TEST_F(Gap, WhatIsFoundGoesBackIntoTheSimulator) {
  drive("healthy", "robot.yaml", 1, "", 40);
  drive("real", "robot.yaml", 2, fmt::format("effects: [{{effect: coulomb, c: {}}}]\n", kCoulomb), 40);
  put("robot.xml", testing::sample_mjcf);
  const std::string gap = " --robot robot.yaml --baseline healthy.csv --no-shrink --write-mjcf robot.xml --out gap";
  const Outcome told = run("gap real.csv" + gap);
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, AllOf(HasSubstr("robot_improved.xml"), HasSubstr("frictionloss (none) -> 0.2")));
  if (has_validator()) {
    EXPECT_EQ(misfit("gap.schema.json", "gap/gap.json"), "");
  }
  const Json edit = files::read_json(path("gap/gap.json")).at("simulators").at(0);
  EXPECT_EQ(edit.at("file"), "robot_improved.xml");
  EXPECT_THAT(edit.at("not_expressed"), IsEmpty());
  EXPECT_EQ(edit.at("wheels").at("right"), "right");
  ASSERT_EQ(edit.at("changed").size(), 2U);
  EXPECT_EQ(bytes(path("robot.xml")), testing::sample_mjcf);
  std::string text = bytes(path("gap/robot_improved.xml"));
  for (const Json& number : edit.at("changed")) {
    EXPECT_EQ(number.at("number"), "frictionloss");
    EXPECT_EQ(number.at("because"), "coulomb");
    EXPECT_NEAR(std::stod(number.at("after").get<std::string>()), kCoulomb, 0.1 * kCoulomb);
    const std::string added = " frictionloss=\"" + number.at("after").get<std::string>() + "\"";
    ASSERT_THAT(text, HasSubstr(added));
    text.erase(text.find(added), added.size());
  }
  EXPECT_EQ(text, testing::sample_mjcf);

  // A healthy robot asks for nothing, and an edited file of an earlier run would contradict that.
  const Outcome none = run("gap healthy.csv" + gap);
  ASSERT_EQ(none.code, 0) << none.err;
  EXPECT_TRUE(files::read_json(path("gap/gap.json")).at("simulators").at(0).at("file").is_null());
  EXPECT_FALSE(std::filesystem::exists(path("gap/robot_improved.xml")));
}

TEST_F(Gap, WhatOneLeavesOutIsNotNamed) {
  drive("healthy", "robot.yaml", 1, "", 40);
  drive("real", "robot.yaml", 2, fmt::format("effects: [{{effect: coulomb, c: {}}}]\n", kCoulomb), 40);
  const Outcome told =
      run("gap real.csv --robot robot.yaml --baseline healthy.csv --without coulomb --without coulomb_asymmetric "
          "--no-shrink --no-manoeuvre --json");
  ASSERT_EQ(told.code, 0) << told.err;
  const Json gap = Json::parse(told.out);
  for (const Json& cause : gap.at("causes")) {
    EXPECT_NE(cause.at("effect"), "coulomb");
  }
  EXPECT_NE(gap.at("verdict"), "no_gap");
  EXPECT_TRUE(gap.at("improved").is_null());
  EXPECT_FALSE(gap.contains("naive"));
}

TEST_F(Gap, SaysWhatIsWrong) {
  drive("short", "robot.yaml", 1, "", 1);
  const auto complaint = [&](const std::string& arguments) {
    const Outcome done = run("gap " + arguments + " --quiet");
    EXPECT_EQ(done.code, 2) << arguments;
    EXPECT_THAT(done.out, IsEmpty());
    return done.err;
  };
  EXPECT_THAT(complaint("gone.csv --robot robot.yaml"), HasSubstr("gone.csv"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --baseline gone.csv"), HasSubstr("gone.csv"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --without colomb"), HasSubstr("did you mean 'coulomb'"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --without nothing"),
              AllOf(HasSubstr("expected one of coulomb, "), Not(ContainsRegex(" coulomb,.* coulomb,"))));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --out short"), HasSubstr("drive longer"));
  EXPECT_THAT(names_in("short"), ElementsAre("report.html"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --beta 0"), HasSubstr("--beta"));
  put("robot.xml", "<mujoco>\n<worldbody>\n</mujoco>\n");
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --write-mjcf robot.xml"), HasSubstr("--out"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --write-mjcf robot.xml --out x"), HasSubstr("robot.xml:"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --write-urdf robot.yaml --out x"),
              HasSubstr("robot_improved.yaml"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --write-sdf gone.sdf --out x"), HasSubstr("gone.sdf"));
  EXPECT_THAT(complaint("short.csv --robot robot.yaml --left a --right b"), HasSubstr("--write-mjcf"));
}

}  // namespace
}  // namespace wheelwright::app::gap_test
