// SPDX-License-Identifier: Apache-2.0
// wheelwright robot: where the file goes, what stands in it, and what is never written over.
#include "tests/app/program.hpp"

#include "formats/robots/robot_file.hpp"
#include "tests/robots/robot_samples.hpp"

namespace wheelwright::app::robot_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class RobotCommand : public testing::ProgramTest {
 protected:
  RobotCommand() {
    const testing::SampleRobot sample;
    put("robot.urdf", sample_urdf(sample, usual_frames(sample)));
    put("control.yaml", testing::sample_controller);
  }
};

TEST_F(RobotCommand, FileFromDescriptionAndController) {
  const Outcome made = run("robot --urdf robot.urdf --ros2-control control.yaml --out-file made.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  const Robot robot = read_robot(path("made.yaml"));
  EXPECT_EQ(robot.wheel_radius, 0.05);
  EXPECT_EQ(robot.limits.at("effort"), 6.0);
  // The same on standard output.
  EXPECT_EQ(run("robot --urdf robot.urdf --ros2-control control.yaml").out, bytes(path("made.yaml")));
  // With --out it has the name that the other commands' examples have.
  EXPECT_EQ(run("robot --urdf robot.urdf --out folder --quiet").code, 0);
  EXPECT_EQ(read_robot(path("folder/robot.yaml")).name, "sample");
}

TEST_F(RobotCommand, NothingIsWrittenOverInSilence) {
  put("made.yaml", "precious");
  const Outcome refused = run("robot --urdf robot.urdf --out-file made.yaml");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("made.yaml: is there already"), HasSubstr("--force")));
  EXPECT_EQ(bytes(path("made.yaml")), "precious");
  EXPECT_EQ(run("robot --urdf robot.urdf --out-file made.yaml --force --quiet").code, 0);
  EXPECT_EQ(read_robot(path("made.yaml")).name, "sample");
}

TEST_F(RobotCommand, JsonHasValuesAndOrigins) {
  const Json result = Json::parse(run("robot --urdf robot.urdf --json").out);
  EXPECT_EQ(result.at("schema"), "wheelwright/robot-file/1");
  EXPECT_EQ(result.at("robot").at("wheel_radius"), 0.05);
  EXPECT_THAT(result.at("origins").at("wheel_radius").get<std::string>(), HasSubstr("robot.urdf:"));
}

TEST_F(RobotCommand, LengthsHaveUnits) {
  const std::string metres = run("robot --urdf robot.urdf --wheel-radius 0.0975 --track-width 0.381").out;
  EXPECT_THAT(metres, HasSubstr("wheel_radius: 0.0975"));
  EXPECT_EQ(run("robot --urdf robot.urdf --wheel-radius 9.75cm --track-width '381 mm'").out, metres);
  EXPECT_EQ(run("robot --urdf robot.urdf --wheel-radius '97.5 mm' --track-width 15in").out, metres);
  const Outcome seconds = run("robot --urdf robot.urdf --wheel-radius 5s");
  EXPECT_EQ(seconds.code, 2);
  EXPECT_THAT(seconds.err, AllOf(HasSubstr("--wheel-radius"), HasSubstr("'5s'"), HasSubstr("m, cm, mm, km, in")));
}

TEST_F(RobotCommand, RefusalsLeaveNothing) {
  put("broken.urdf", "<robot name=\"a\">\n<link name=\"b\"><inertial></inertial></link></robot>");
  for (const auto& [words, message] : {std::pair{"", "expected at least one of --urdf, --ros2-control"},
                                       {"--urdf broken.urdf", "broken.urdf:2: <inertial> of link 'b'"},
                                       {"--urdf no.urdf", "no.urdf: no such file"},
                                       {"--urdf robot.urdf --controller x", "--controller"}}) {
    const Outcome refused = run(fmt::format("robot {} --out-file made.yaml", words));
    EXPECT_EQ(refused.code, 2) << words;
    EXPECT_THAT(refused.out, IsEmpty());
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_FALSE(std::filesystem::exists(path("made.yaml")));
  }
}

}  // namespace
}  // namespace wheelwright::app::robot_test
