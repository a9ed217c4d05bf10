// SPDX-License-Identifier: Apache-2.0
// `wheelwright choose`, as a user runs it.
#include "tests/app/program.hpp"

namespace wheelwright::app::choose_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Choose : public testing::ProgramTest {
 protected:
  void prepare() const {
    put("learn.yaml",
        "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
        "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 2}\nduration: 10\n"
        "sensors: {effort: 0.02, encoder_counts_per_turn: 4096, log: [angles]}\n");
    ASSERT_EQ(run("simulate learn.yaml --out learn.csv --quiet").code, 0);
  }
};

TEST_F(Choose, GivesADetectorAndWhatTheOthersCost) {
  prepare();
  const Outcome told =
      run("choose learn.csv --robot robot.yaml --fault wheel_radius=0.2 --window 0.5 --out choice --quiet");
  ASSERT_EQ(told.code, 0) << told.err;
  EXPECT_THAT(told.out, IsEmpty());
  EXPECT_THAT(names_in("choice"), ElementsAre("choice.json", "model.json", "report.html"));
  const Json json = files::read_json(path("choice/choice.json"));
  if (has_validator()) {
    EXPECT_EQ(misfit("choice.schema.json", "choice/choice.json"), "");
    EXPECT_EQ(misfit("model.schema.json", "choice/model.json"), "");
  }
  // The model is the chosen filter's; its line in a robot file gives commissioning the same thresholds.
  const Json model = files::read_json(path("choice/model.json"));
  EXPECT_EQ(model.at("filter").at("beta"), json.at("chosen").at("beta"));
  const std::string line = json.at("robot_file").get<std::string>();
  put("chosen.yaml", bytes(path("robot.yaml")) + line + "\n");
  ASSERT_EQ(run("commission learn.csv --robot chosen.yaml --out again --quiet").code, 0);
  EXPECT_EQ(files::read_json(path("again/model.json")).at("parameters"), model.at("parameters"));
  // Where no filter will do, the model of another question is not left beside that answer.
  ASSERT_EQ(run("choose learn.csv --robot robot.yaml --fault wheel_radius=0.2 --window 0.01 --out choice --quiet").code,
            1);
  EXPECT_THAT(names_in("choice"), ElementsAre("choice.json"));
  EXPECT_TRUE(files::read_json(path("choice/choice.json")).at("chosen").is_null());
}

// What is said of the pose is made once for all candidates, and what was commissioned on the way is not commissioned
// again: the model is, to the last digit, that of commissioning with the chosen filter.
TEST_F(Choose, TheModelIsThatOfCommission) {
  put("posed.yaml",
      "robot: posed_robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 2}\nduration: 20\n"
      "sensors: {effort: 0.02, position: 0.002, heading: 0.003, encoder_counts_per_turn: 4096, log: [angles, pose]}\n");
  std::string robot = bytes(path("robot.yaml"));
  const std::string worst_case = "position: 0.002, heading: 0.003";
  const std::size_t at = robot.find(worst_case);
  ASSERT_NE(at, std::string::npos);
  robot.replace(at, worst_case.size(), "position: {bound: 0.002, bias: 0.0001}, heading: {bound: 0.003, bias: 0.0001}");
  put("posed_robot.yaml", robot);
  ASSERT_EQ(run("simulate posed.yaml --out posed.csv --quiet").code, 0);
  const std::string choose = "choose posed.csv --robot posed_robot.yaml --fault wheel_radius=0.2 --window 0.5 --quiet";
  for (const std::string threads : {"1", "2"}) {
    ASSERT_EQ(run(choose + " --threads " + threads + " --out by_" + threads).code, 0);
  }
  EXPECT_EQ(bytes(path("by_1/choice.json")), bytes(path("by_2/choice.json")));
  const Json chosen = files::read_json(path("by_1/model.json"));
  EXPECT_EQ(chosen, files::read_json(path("by_2/model.json")));
  ASSERT_FALSE(chosen.at("at_risk").is_null());
  ASSERT_FALSE(chosen.at("kinematic").at("at_risk").is_null());
  put("chosen.yaml", robot + files::read_json(path("by_1/choice.json")).at("robot_file").get<std::string>() + "\n");
  ASSERT_EQ(run("commission posed.csv --robot chosen.yaml --out again --quiet").code, 0);
  EXPECT_EQ(Json::diff(chosen, files::read_json(path("again/model.json"))).dump(), "[]");
}

// The robot file declares errors that average out: the answer at the risk stands beside the one for every noise, and
// either can be asked for.
TEST_F(Choose, SaysWhichGuaranteeDecides) {
  prepare();
  const std::string choose = "choose learn.csv --robot robot.yaml --fault effort_bias_right=0.2 --window 2 ";
  const Outcome told = run(choose + "--guarantee either --json --quiet");
  ASSERT_EQ(told.code, 0) << told.err;
  const Json json = Json::parse(told.out);
  EXPECT_EQ(json.at("guarantee"), "either");
  ASSERT_FALSE(json.at("at_risk").is_null());
  EXPECT_LT(json.at("at_risk").at("miss").get<double>(), 1e-8);
  ASSERT_EQ(json.at("decides").size(), 2U);
  for (const Json& fault : json.at("candidates").at(0).at("faults")) {
    const double either = fault.at("either").at("median").get<double>();
    EXPECT_LE(either, fault.at("at_risk").at("median").get<double>());
  }
  EXPECT_GE(json.at("recommendation").size(), 4U);  // what the filter has to do with it, two sides, and the chance
  EXPECT_EQ(run(choose + "--guarantee both").code, 2);
}

TEST_F(Choose, TellsWhatIsWrongWithAQuestion) {
  prepare();
  const std::string choose = "choose learn.csv --robot robot.yaml ";
  const Outcome name = run(choose + "--fault wheel_radios=0.1");
  EXPECT_EQ(name.code, 2);
  EXPECT_THAT(name.err, AllOf(HasSubstr("wheel_radios"), HasSubstr("wheel_radius_right")));
  for (const std::string wrong : {"--fault wheel_radius=much", "--fault wheel_radius=-0.1", "--fault wheel_radius=3",
                                  "--false-alarms 1.5", "--window 0"}) {
    const Outcome outcome = run(choose + wrong);
    EXPECT_EQ(outcome.code, 2) << wrong;
    EXPECT_THAT(outcome.err, ::testing::Not(IsEmpty())) << wrong;
  }
}

}  // namespace
}  // namespace wheelwright::app::choose_test
