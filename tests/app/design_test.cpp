// SPDX-License-Identifier: Apache-2.0
// Design a manoeuvre, drive it in simulation, commission its log: three commands in a row.
#include "tests/app/program.hpp"

namespace wheelwright::app::design_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Design : public testing::ProgramTest {
 protected:
  // A scenario that drives `table`, with the noise that robot.yaml declares.
  void scenario(const std::string& name, const std::string& table) const {
    put(name,
        "robot: robot.yaml\n"
        "parameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
        "trajectory: {kind: table, file: " +
            table +
            "}\n"
            "sensors: {effort: 0.02, encoder_counts_per_turn: 4096, log: [angles]}\n"
            "seed: 4\n");
  }

  static double width(const Json& model, const std::string& name) {
    const Json& side = model.at("physical").at(name);
    return side.at("upper").get<double>() - side.at("lower").get<double>();
  }
};

class SlowDesign : public Design {};

constexpr const char* kLimits = " --for bounds --speed 8 --acceleration 20 --effort 6 --radius 1 --quiet";

TEST_F(SlowDesign, DesignSimulateCommissionInARow) {
  // A fixed filter, so that both logs are looked at alike.
  put("robot.yaml", bytes(path("robot.yaml")) + "filter: {order: 2, alpha: 10, beta: 10}\n");
  const Outcome designed = run(std::string("design --robot robot.yaml --out plan") + kLimits);
  ASSERT_EQ(designed.code, 0) << designed.err;
  EXPECT_THAT(names_in("plan"),
              ::testing::ElementsAre("design.json", "figure_eight.csv", "manoeuvre.csv", "manoeuvre_cmd_vel.csv",
                                     "manoeuvre_cmd_vel.mcap", "report.html"));
  EXPECT_EQ(testing::lines_of(bytes(path("plan/manoeuvre.csv"))).front(), "t,command_r,command_l,v1,v2,x,y,theta");
  const Json design = files::read_json(path("plan/design.json"));
  for (const auto& [limit, share] : design.at("use").items()) {
    EXPECT_LE(share.get<double>(), 1.0) << limit;
  }

  std::vector<Json> models;
  for (const std::string name : {"manoeuvre", "figure_eight"}) {
    scenario(name + ".yaml", "plan/" + name + ".csv");
    ASSERT_EQ(run("simulate " + name + ".yaml --out " + name + ".csv --quiet").code, 0);
    const Outcome done = run("commission " + name + ".csv --robot robot.yaml --quiet --out " + name);
    ASSERT_EQ(done.code, 0) << done.err;
    models.push_back(files::read_json(path(name) / "model.json"));
  }
  double product = 1.0;
  for (const std::string name : {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"}) {
    product *= width(models[0], name) / width(models[1], name);
  }
  EXPECT_LE(product, 1.0 / 16.0);  // geometric mean of four: a half

  // From the model that came out, the next drive can be designed.
  const Outcome next = run(std::string("design --model manoeuvre/model.json --json --duration 6 --stages 1") + kLimits);
  ASSERT_EQ(next.code, 0) << next.err;
  const Json second = Json::parse(next.out);
  EXPECT_EQ(second.at("schema"), "wheelwright/design/1");
  for (const Json& parameter : second.at("parameters")) {
    EXPECT_FALSE(parameter.at("model").is_null());
  }
}

TEST_F(Design, NamesAllThatIsMissingAtOnce) {
  // The robot file of docs/use/own_log.md.
  const std::string own =
      "name: my_robot\nmodel: differential_drive\nwheel_radius: 0.0975\ntrack_width: 0.381\n"
      "effort: {kind: torque}\n";
  put("own.yaml", own + "noise: estimate\n");
  const Outcome refused = run("design --robot own.yaml --for bounds --out plan");
  EXPECT_EQ(refused.code, 2);
  EXPECT_FALSE(std::filesystem::exists(path("plan")));
  EXPECT_THAT(refused.err, AllOf(HasSubstr("own.yaml"), HasSubstr("kg, kg·m², N·s/m, N·m·s/rad"),
                                 HasSubstr("rad/s, N·m"), HasSubstr("--speed and --acceleration")));

  // What it says to write is all that was missing, for currents the motor's constants, too.
  const std::string brief = " --for bounds --duration 4 --stages 1 --rate 50 --quiet";
  for (const std::string kind : {"torque", "current", "voltage"}) {
    std::string file = own;
    file.replace(file.find("torque"), 6, kind);
    put("robot_of_kind.yaml", file);
    std::string lines;
    for (const std::string& line : testing::lines_of(run("design --robot robot_of_kind.yaml" + brief).err)) {
      lines += line.starts_with("  ") ? line.substr(2) + "\n" : "";
    }
    EXPECT_EQ(lines.find("motor:") != std::string::npos, kind != "torque") << lines;
    put("robot_of_kind.yaml", file + lines);
    const Outcome done = run("design --robot robot_of_kind.yaml" + brief);
    EXPECT_EQ(done.code, 0) << done.err << lines;
  }
}

TEST_F(Design, TellsBothPromises) {
  const std::string design = "design --robot robot.yaml --json --duration 10 --stages 1 --rate 50";
  const Outcome told = run(design + kLimits);
  ASSERT_EQ(told.code, 0) << told.err;
  const Json json = Json::parse(told.out);
  EXPECT_EQ(json.at("guarantee"), "every_noise");
  EXPECT_EQ(json.at("at_risk").at("warrant"), "guaranteed");
  for (const Json& parameter : json.at("parameters")) {
    EXPECT_LT(parameter.at("at_risk").at("promised").at("physical_half_width").get<double>(),
              parameter.at("promised").at("physical_half_width").get<double>());
  }
  std::string sure = bytes(path("robot.yaml"));
  sure.replace(sure.find("{bound: 0.02, bias: 0.0001}"), 27, "0.02");
  put("sure.yaml", sure);
  const Outcome refused =
      run(std::string("design --robot sure.yaml --guarantee at-risk --duration 10 --stages 1") + kLimits);
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr("--guarantee"), HasSubstr("bias")));
}

// The commands of speed and yaw rate, integrated here by themselves, end where the wheels' commands say; the recording
// has the same numbers, and a robot whose lever arm is the whole track is not turned twice as fast.
TEST_F(Design, ItsControllerIsGivenTheSameDrive) {
  put("whole.yaml", bytes(path("robot.yaml")) + "lever_arm: track\n");
  for (const std::string robot : {"robot", "whole"}) {
    ASSERT_EQ(run("design --robot " + robot + ".yaml --out " + robot + " --duration 8 --stages 2" + kLimits).code, 0);
    ASSERT_EQ(run("convert " + robot + "/manoeuvre_cmd_vel.mcap " + robot +
                  ".csv --map omega_l=/cmd_vel_unstamped.linear.x --map omega_r=/cmd_vel_unstamped.angular.z --quiet")
                  .code,
              0);
    const auto wheels = testing::lines_of(bytes(path(robot + "/manoeuvre.csv")));
    const auto body = testing::lines_of(bytes(path(robot + "/manoeuvre_cmd_vel.csv")));
    const auto played = testing::lines_of(bytes(path(robot + ".csv")));
    ASSERT_EQ(wheels.size(), body.size());
    ASSERT_EQ(played.size(), body.size());
    double x = 0.0, y = 0.0, heading = 0.0, before = 0.0, speed = 0.0, rate = 0.0, turned = 0.0;
    for (std::size_t k = 1; k < body.size(); ++k) {
      double t = 0.0, v = 0.0, w = 0.0, again_t = 0.0, again_v = 0.0, again_w = 0.0;
      ASSERT_EQ(std::sscanf(body[k].c_str(), "%lf,%lf,%lf", &t, &v, &w), 3);
      ASSERT_EQ(std::sscanf(played[k].c_str(), "%lf,%lf,%lf", &again_t, &again_v, &again_w), 3) << played[k];
      EXPECT_NEAR(again_t, t, 1e-9);
      EXPECT_EQ(again_v, v);
      EXPECT_EQ(again_w, w);
      const double step = k > 1 ? t - before : 0.0, turn = 0.5 * step * (w + rate);
      x += 0.5 * step * (v + speed) * std::cos(heading + 0.5 * turn);
      y += 0.5 * step * (v + speed) * std::sin(heading + 0.5 * turn);
      heading += turn;
      turned = std::max(turned, std::abs(heading));
      before = t;
      speed = v;
      rate = w;
    }
    EXPECT_EQ(speed, 0.0) << "it ends at rest";
    EXPECT_GT(turned, 0.2);
    double place[8] = {};
    ASSERT_EQ(std::sscanf(wheels.back().c_str(), "%lf,%lf,%lf,%lf,%lf,%lf,%lf,%lf", place, place + 1, place + 2,
                          place + 3, place + 4, place + 5, place + 6, place + 7),
              8);
    EXPECT_NEAR(x, place[5], 1e-3) << robot;
    EXPECT_NEAR(y, place[6], 1e-3) << robot;
    EXPECT_NEAR(heading, place[7], 1e-6) << robot;
  }
}

// A corner whose linear program failed asked for the same row for ever.
TEST_F(Design, EndsAlsoWhereAPlanLeavesThinSets) {
  commission_shipped();
  const Outcome done = run(
      "design --model model/model.json --for bounds --speed 8 --acceleration 20 --radius 1.5 --duration 10 --stages 2",
      "/dev/null", "timeout 200");
  EXPECT_EQ(done.code, 0) << done.err;
}

TEST_F(Design, WhatIsMissingIsAskedFor) {
  EXPECT_EQ(run("design").code, 2);
  EXPECT_EQ(run("design --for bounds").code, 2);
  EXPECT_EQ(run("design --for tea --robot robot.yaml").code, 2);
  const Outcome no_speed = run("design --for bounds --robot robot.yaml");
  EXPECT_EQ(no_speed.code, 2);
  EXPECT_THAT(no_speed.err, AllOf(HasSubstr("--speed"), HasSubstr("limits:")));
  EXPECT_THAT(no_speed.out, IsEmpty());
  const Outcome no_acceleration = run("design --for bounds --robot robot.yaml --speed 8");
  EXPECT_EQ(no_acceleration.code, 2);
  EXPECT_THAT(no_acceleration.err, HasSubstr("--acceleration"));
  put("bare.yaml", "wheel_radius: 0.1\ntrack_width: 0.4\n");
  const Outcome bare = run("design --for bounds --robot bare.yaml --speed 8 --acceleration 10");
  EXPECT_EQ(bare.code, 2);
  EXPECT_THAT(bare.err, HasSubstr("nominal"));
  EXPECT_EQ(run("design --for bounds --robot robot.yaml --model model.json --speed 8 --acceleration 10").code, 2);
  const Outcome outside = run("design --for bounds --robot robot.yaml --speed 8 --acceleration 10 --box 1 2 -1 1");
  EXPECT_EQ(outside.code, 2);
  EXPECT_THAT(outside.err, HasSubstr("box"));
}

}  // namespace
}  // namespace wheelwright::app::design_test
