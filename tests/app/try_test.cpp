// SPDX-License-Identifier: Apache-2.0
// `wheelwright try` on recordings of stock robots, and what commands refuse that the doctor calls wrong.
#include "tests/app/program.hpp"
#include "tests/app/stock_robots.hpp"

#include <tuple>
#include <utility>

#include "formats/robots/robot_file.hpp"

namespace wheelwright::app::try_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;
using testing::StockBag;
using testing::StockRobot;
using testing::StockRow;

class Try : public testing::ProgramTest {
 protected:
  Json model() const { return files::read_json(path("wheelwright_try/commission/model.json")); }
  static double estimate(const Json& model, const char* name) {
    return model.at("physical").at(name).at("estimate").get<double>();
  }
  static std::string csv(const std::vector<StockRow>& rows, double speed_scale, double effort_scale) {
    std::string out = "t,omega_r,omega_l,tau_r,tau_l\n";
    for (const StockRow& row : rows) {
      out += fmt::format("{},{},{},{},{}\n", row.t, speed_scale * row.speed[0], speed_scale * row.speed[1],
                         effort_scale * row.effort[0], effort_scale * row.effort[1]);
    }
    return out;
  }
};

// Four wheels, efforts that begin with NaN, messages that come late, and a controller whose wheel_separation_multiplier
// is 1.5.
TEST_F(Try, JackalWithItsDescriptionAndController) {
  const double r = 0.098, track = 0.37559;
  const std::vector<std::string> wheels = {"front_left_wheel", "front_right_wheel", "rear_left_wheel",
                                           "rear_right_wheel"};
  put("jackal.urdf", testing::stock_urdf("jackal", 16.523, 0.4485, r, 0.477,
                                         {{wheels[0], {0.131, 0.5 * track}},
                                          {wheels[1], {0.131, -0.5 * track}},
                                          {wheels[2], {-0.131, 0.5 * track}},
                                          {wheels[3], {-0.131, -0.5 * track}}}));
  put("control.yaml",
      "c:\n  ros__parameters:\n    d:\n      type: diff_drive_controller/DiffDriveController\nd:\n  ros__parameters:\n"
      "    left_wheel_names: [front_left_wheel, rear_left_wheel]\n"
      "    right_wheel_names: [front_right_wheel, rear_right_wheel]\n    wheel_separation: 0.37559\n"
      "    wheel_separation_multiplier: 1.5\n    wheel_radius: 0.098\n");
  const StockRobot jackal{r, 1.5 * track, 18.9, 0.7};
  StockBag bag;
  std::vector<StockRow> rows = testing::stock_drive(jackal, 40.0);
  for (std::size_t k = 10; k + 1 < rows.size(); k += 25) {
    std::swap(rows[k], rows[k + 1]);
  }
  for (const StockRow& row : rows) {
    bag.add_joints("/joint_states", row, wheels, row.t > 0.5);
  }
  put("jackal.mcap", bag.bytes());
  const Outcome told = run("try jackal.mcap --urdf jackal.urdf --ros2-control control.yaml");
  ASSERT_EQ(told.code, 0) << told.err << told.out;
  EXPECT_THAT(told.out, AllOf(HasSubstr("certainly seen"), HasSubstr("front_right_wheel and rear_right_wheel"),
                              HasSubstr("put in the order of their stamps"), HasSubstr("effort.hold")));
  const Robot robot = robots::read_robot(path("wheelwright_try/robot.yaml"));
  EXPECT_NEAR(robot.track_width, jackal.D, 1e-6);
  EXPECT_NEAR(robot.wheel_radius, r, 1e-9);
  EXPECT_EQ(robot.hold, Hold::zero_order);
  EXPECT_TRUE(robot.effects.empty());  // the middle is that of all wheels
  EXPECT_NEAR(estimate(model(), "mass"), jackal.mass, 0.02 * jackal.mass);
  EXPECT_NEAR(estimate(model(), "yaw_inertia"), jackal.yaw_inertia, 0.02 * jackal.yaw_inertia);
  if (has_validator()) {
    EXPECT_EQ(misfit("try.schema.json", "wheelwright_try/try.json"), "");
  }
  EXPECT_THAT(names_in("wheelwright_try"), ::testing::IsSupersetOf({"report.html", "robot.yaml", "try.json"}));
}

// The description is in the recording; joints are published by one topic each.
TEST_F(Try, Create3ByTheDescriptionInItsRecording) {
  const StockRobot create{0.03575, 0.233, 2.4, 0.03};
  StockBag bag;
  bag.add_text("/robot_description",
               testing::stock_urdf("create3", 2.3, 0.02, create.r, 0.05,
                                   {{"left_wheel_joint", {0.0, 0.1165}}, {"right_wheel_joint", {0.0, -0.1165}}}));
  for (const StockRow& row : testing::stock_drive(create, 40.0, 2)) {
    bag.add_joints("/wheels/left", row, {"left_wheel_joint"});
    bag.add_joints("/wheels/right", row, {"right_wheel_joint"});
  }
  put("create.mcap", bag.bytes());
  const Outcome told = run("try create.mcap");
  ASSERT_EQ(told.code, 0) << told.err << told.out;
  EXPECT_NEAR(robots::read_robot(path("wheelwright_try/robot.yaml")).track_width, create.D, 1e-6);
  // One joint a topic: each has twice the effort that a wheel of two has in add_joints().
  EXPECT_NEAR(estimate(model(), "mass"), 2.0 * create.mass, 0.04 * create.mass);
}

// No description: the driver's own odometry has the geometry, and is no pose, whatever its stamps.
TEST_F(Try, TurtleBotByItsOdometryWhichIsNoPose) {
  const StockRobot burger{0.033, 0.16, 1.0, 0.008};
  const std::vector<StockRow> rows = testing::stock_drive(burger, 40.0, 3);
  StockBag bag;
  testing::add_wheel_odometry(bag, "/odom", burger, rows, 0.037, 0.0041);
  for (const StockRow& row : rows) {
    bag.add_joints("/joint_states", row, {"wheel_left_joint", "wheel_right_joint"});
  }
  put("burger.mcap", bag.bytes());
  const Outcome told = run("try burger.mcap");
  ASSERT_EQ(told.code, 0) << told.err << told.out;
  const Robot robot = robots::read_robot(path("wheelwright_try/robot.yaml"));
  EXPECT_NEAR(robot.wheel_radius, burger.r, 1e-3 * burger.r);
  EXPECT_NEAR(robot.track_width, burger.D, 1e-3 * burger.D);
  EXPECT_THAT(told.out, HasSubstr("cannot be told from wheel odometry"));
  EXPECT_FALSE(model().contains("kinematic"));
  EXPECT_THAT(run("identify burger.mcap --robot wheelwright_try/robot.yaml").out,
              AllOf(HasSubstr("cannot be told from wheel odometry"), Not(HasSubstr("radius_right"))));
}

// What was settled needs no option twice: a map stays in the robot file, and in model.json for detect.
TEST_F(Try, HuskyRemembersItsMap) {
  const StockRobot husky{0.1651, 1.07, 50.0, 6.0};
  StockBag bag;
  for (const StockRow& row : testing::stock_drive(husky, 40.0, 4)) {
    bag.add_joints("/a", row, {"left", "right"});
    bag.add_joints("/b", row, {"left", "right"});
  }
  put("husky.mcap", bag.bytes());
  std::string maps;
  for (const auto& [column, array] : {std::pair("phi", "position"), {"omega", "velocity"}, {"tau", "effort"}}) {
    for (const auto& [letter, joint] : {std::pair("r", "right"), {"l", "left"}}) {
      maps += fmt::format(" --map '{}_{}=/a.{}[{}]'", column, letter, array, joint);
    }
  }
  const Outcome told = run("try husky.mcap --wheel-radius 16.51cm --track-width 107cm" + maps);
  ASSERT_EQ(told.code, 0) << told.err << told.out;
  EXPECT_EQ(robots::read_columns(path("wheelwright_try/robot.yaml"),
                                 {"phi_r", "phi_l", "omega_r", "omega_l", "tau_r", "tau_l"})
                .at("tau_r"),
            "/a.effort[right]");
  EXPECT_EQ(run("detect husky.mcap --model wheelwright_try/commission/model.json").code, 0);
  EXPECT_EQ(run("try husky.mcap --quiet").code, 0);
}

TEST_F(Try, PlotJugglersTableWithCountedTimes) {
  std::string table = "__time";
  for (const char* field : {"left_wheel_joint/velocity", "left_wheel_joint/effort", "right_wheel_joint/velocity",
                            "right_wheel_joint/effort"}) {
    table += fmt::format(",/joint_states/{}", field);
  }
  for (const StockRow& row : testing::stock_drive({0.1, 0.4, 20.0, 1.0}, 40.0)) {
    table += fmt::format("\n{},{},{},{},{}", 1'764'000'000'000'000'000 + std::llround(1e9 * row.t), row.speed[1],
                         row.effort[1], row.speed[0], row.effort[0]);
  }
  put("drive.csv", table + "\n");
  const Outcome told = run("try drive.csv --wheel-radius 10cm --track-width 40cm");
  ASSERT_EQ(told.code, 0) << told.err << told.out;
  EXPECT_THAT(told.out, HasSubstr("times are counts of ns"));
  EXPECT_NEAR(estimate(model(), "yaw_inertia"), 1.0, 0.02);
}

TEST_F(Try, AsksForTheGeometryThatNothingTells) {
  put("drive.csv", csv(testing::stock_drive({0.1, 0.4, 20.0, 1.0}, 20.0), 1.0, 1.0));
  const Outcome told = run("try drive.csv");
  EXPECT_EQ(told.code, 2);
  EXPECT_THAT(told.err, HasSubstr("--wheel-radius and --track-width"));
  EXPECT_FALSE(std::filesystem::exists(path("wheelwright_try")));
}

TEST_F(Try, CommandsStopAtUnitsAndSignsThatCannotBe) {
  put("robot.yaml",
      "name: a\nwheel_radius: 0.1\ntrack_width: 0.4\neffort: {hold: zero_order}\n"
      "nominal: {mass: 20, yaw_inertia: 1, viscous_linear: 6, viscous_yaw: 0.5}\n"
      "noise: {wheel_speed: 0.5, effort: 0.2}\n");
  const std::vector<StockRow> rows = testing::stock_drive({0.1, 0.4, 20.0, 1.0}, 40.0);
  for (const auto& [name, speed, effort, finding] : {std::tuple{"degrees", 180.0 / M_PI, 1.0, "units.effort"},
                                                     {"rpm", 30.0 / M_PI, 1.0, "units.effort"},
                                                     {"negated", 1.0, -1.0, "units.effort_sign"}}) {
    put(fmt::format("{}.csv", name), csv(rows, speed, effort));
    for (const char* command : {"commission", "identify", "gap"}) {
      const Outcome told = run(fmt::format("{} {}.csv --robot robot.yaml --out made", command, name));
      EXPECT_EQ(told.code, 2) << command << name << told.out;
      EXPECT_THAT(told.err, AllOf(HasSubstr(finding), HasSubstr("--despite"))) << command << name;
    }
  }
  put("sound.csv", csv(rows, 1.0, 1.0));
  EXPECT_EQ(run("commission sound.csv --robot robot.yaml --quiet").code, 0);
  // Where a robot file is given none is written.
  const std::string told = run("try sound.csv --robot robot.yaml").out;
  EXPECT_THAT(told, AllOf(HasSubstr("wrote wheelwright_try/report.html"), ::testing::Not(HasSubstr("try/robot.yaml"))));
  EXPECT_FALSE(std::filesystem::exists(path("wheelwright_try/robot.yaml")));
  EXPECT_EQ(
      run("commission rpm.csv --robot robot.yaml --despite units.effort --despite units.wheel_speed --quiet").code, 0);
}

}  // namespace
}  // namespace wheelwright::app::try_test
