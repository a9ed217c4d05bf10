// SPDX-License-Identifier: Apache-2.0
// Robot files from URDF and controllers: closed forms, frames that stand anyhow, and the way back through the
// reader.
#include "formats/robots/robot_origin.hpp"

#include <nlohmann/json.hpp>

#include "formats/robots/controller_file.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/robots/robot_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::robots::robot_origin_test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using testing::input_error;
using testing::SampleRobot;

void expect_relative(double value, double truth, double tolerance = 1e-12) {
  EXPECT_NEAR(value, truth, tolerance * std::abs(truth));
}

RobotWithOrigins from_urdf(const std::string& text, const RobotHints& hints = {}) {
  const RobotTree tree = parse_urdf(text, "robot.urdf");
  return robot_from(&tree, nullptr, hints);
}

void expect_sample(const Robot& robot, const SampleRobot& sample, double tolerance) {
  const double r = sample.radius, half = 0.5 * sample.track;
  EXPECT_EQ(robot.name, "sample");
  EXPECT_EQ(robot.wheel_radius, r);
  expect_relative(robot.track_width, sample.track, tolerance);
  expect_relative(robot.nominal.at("mass"), sample.mass() + sample.spin() / (r * r), tolerance);
  expect_relative(robot.nominal.at("yaw_inertia"), sample.yaw_inertia() + sample.spin() * half * half / (r * r),
                  tolerance);
  expect_relative(robot.nominal.at("viscous_linear"), 2.0 * sample.damping / (r * r), tolerance);
  expect_relative(robot.nominal.at("viscous_yaw"), 2.0 * sample.damping * half * half / (r * r), tolerance);
  EXPECT_EQ(robot.limits.at("effort"), 6.0);
  EXPECT_EQ(robot.limits.at("speed"), 12.0);
  ASSERT_EQ(robot.effects.size(), 1u);  // the mast's share of a lateral offset is below a hundredth of the track
  EXPECT_EQ(robot.effects[0].name, "com_longitudinal");
  expect_relative(robot.effects[0].value("a"), sample.ahead(), tolerance);
}

TEST(RobotOrigin, ClosedFormsOfBoxesAndCylinders) {
  const SampleRobot sample;
  expect_sample(from_urdf(sample_urdf(sample, usual_frames(sample))).robot, sample, 1e-12);
}

// Values by hand: 12.5 kg + 2 · ½ m_w; the wheels add m_w (D/2)² each as bodies and ½ m_w (D/2)² each by their spin.
TEST(RobotOrigin, NumbersByHand) {
  SampleRobot sample;
  sample.mast.mass = 1e-9;
  sample.base.mass = 12.0;
  sample.base.size = {0.3, 0.4, 0.1};
  sample.base.pose.translation() = Eigen::Vector3d(0.0, 0.0, 0.1);
  sample.track = 0.4;
  const Robot robot = from_urdf(sample_urdf(sample, usual_frames(sample))).robot;
  expect_relative(robot.nominal.at("mass"), 12.0 + 1.0 + 0.5, 1e-9);
  const double wheels = 0.5 * (3.0 * 0.05 * 0.05 + 0.02 * 0.02) / 12.0 + 0.5 * 0.04 + 0.25 * 0.04;
  expect_relative(robot.nominal.at("yaw_inertia"), 0.25 + 2.0 * wheels, 1e-8);
  EXPECT_TRUE(robot.effects.empty());
}

TEST(RobotOrigin, FramesMayStandAnyhow) {
  std::mt19937_64 random(71);
  const SampleRobot sample;
  for (int k = 0; k < 20; ++k) {
    const testing::SampleFrames frames = random_frames(sample, random);
    expect_sample(from_urdf(sample_urdf(sample, frames)).robot, sample, 1e-9);
  }
}

// The kinetic energy of the bodies, each with its own velocity: M̄ is its second derivative.
TEST(RobotOrigin, NominalValuesAreThoseOfTheKineticEnergy) {
  const SampleRobot sample;
  const Robot robot = from_urdf(sample_urdf(sample, usual_frames(sample))).robot;
  const auto energy = [&](double v1, double v2) {
    double twice = 0.0;
    for (const testing::SampleBody& body : sample.bodies()) {
      const Eigen::Vector3d at = body.pose.translation();
      const Eigen::Vector3d velocity(v1 - v2 * at.y(), v2 * at.x(), 0.0);
      Eigen::Vector3d turning(0.0, 0.0, v2);
      if (body.name.find("wheel") != std::string::npos) {
        turning.y() = (v1 - v2 * at.y()) / sample.radius;  // rolling
      }
      const Eigen::Vector3d local = body.pose.linear().transpose() * turning;
      twice += body.mass * velocity.squaredNorm() + local.dot(body.moments().asDiagonal() * local);
    }
    return 0.5 * twice;
  };
  expect_relative(robot.nominal.at("mass"), 2.0 * energy(1.0, 0.0), 1e-12);
  expect_relative(robot.nominal.at("yaw_inertia"), 2.0 * energy(0.0, 1.0), 1e-12);
}

TEST(RobotOrigin, FileReadsBackToTheSameRobotAndEveryValueHasItsOrigin) {
  SampleRobot sample;
  sample.friction = 0.1;
  const std::string control = R"(<ros2_control name="c" type="system"><hardware>
<param name="enc_counts_per_rev">3436</param></hardware>
<joint name="left_wheel_joint"><command_interface name="effort"/><state_interface name="velocity"/></joint>
<joint name="right_wheel_joint"><command_interface name="effort"/></joint></ros2_control>
<transmission name="t"><joint name="left_wheel_joint"/><actuator name="m"><mechanicalReduction>30</mechanicalReduction>
</actuator></transmission>)";
  const RobotTree tree = parse_urdf(sample_urdf(sample, usual_frames(sample), control), "robot.urdf");
  const DriveFacts controller = parse_ros2_control(testing::sample_controller, "control.yaml");
  const RobotWithOrigins made = robot_from(&tree, &controller);
  const std::string text = robot_yaml(made);
  EXPECT_EQ(to_json(parse_robot(text, "robot.yaml")), to_json(made.robot)) << text;

  EXPECT_EQ(made.columns.at("omega_r"), "velocity[right_wheel_joint]");
  EXPECT_EQ(made.columns.at("tau_l"), "effort[left_wheel_joint]");
  EXPECT_EQ(to_json(made, "x").at("robot").at("columns"), made.columns);
  EXPECT_EQ(made.robot.encoder_counts_per_turn, 3436.0);
  EXPECT_EQ(made.robot.motor->gear_ratio, 30.0);
  EXPECT_EQ(made.robot.hold, Hold::zero_order);
  EXPECT_EQ(made.robot.nominal.at("coulomb"), 0.1);
  EXPECT_THAT(*made.robot.parameters, Contains("coulomb"));
  EXPECT_EQ(made.robot.limits.at("speed"), std::min(0.5 / 0.05, 0.5 * 0.38 / 0.05 * 1.9));
  EXPECT_FALSE(made.robot.limits.contains("acceleration"));  // has_acceleration_limits: false
  EXPECT_THAT(made.remarks, AllOf(Contains(HasSubstr("control at 100 Hz: control.yaml:3")),
                                  Contains(HasSubstr("odometry at 50 Hz: control.yaml:13"))));

  std::istringstream lines(text);
  std::string before;
  for (std::string line; std::getline(lines, line); before = line) {
    const std::size_t first = line.find_first_not_of(' ');
    if (line[first] != '#' && line.back() != ':') {
      EXPECT_EQ(before[before.find_first_not_of(' ')], '#') << line;
    }
  }
  EXPECT_THAT(
      text,
      AllOf(
          HasSubstr("# robot.urdf:2: robot 'sample'\nname: "),
          HasSubstr("  # robot.urdf:56: effort in <limit> of joint 'right_wheel_joint' and robot.urdf:40: effort in")));
}

TEST(RobotOrigin, ControllerAlone) {
  const DriveFacts controller = parse_ros2_control(testing::sample_controller, "control.yaml");
  const RobotWithOrigins made = robot_from(nullptr, &controller);
  EXPECT_EQ(made.robot.wheel_radius, 0.05);
  EXPECT_EQ(made.robot.track_width, 0.38);
  EXPECT_TRUE(made.robot.nominal.empty());
  EXPECT_EQ(made.origins.at("track_width"),
            "control.yaml:10: wheel_separation times wheel_separation_multiplier (control.yaml:11)");
  EXPECT_EQ(to_json(parse_robot(robot_yaml(made), "robot.yaml")), to_json(made.robot));
}

TEST(RobotOrigin, PluginAndDescriptionAreCompared) {
  const SampleRobot sample;
  const auto with = [&](const std::string& keys) {
    return from_urdf(
        sample_urdf(sample, usual_frames(sample),
                    "<gazebo><plugin filename=\"gz-sim-diff-drive-system\" name=\"gz::sim::systems::DiffDrive\">"
                    "<left_joint>left_wheel_joint</left_joint><right_joint>right_wheel_joint</right_joint>" +
                        keys + "</plugin></gazebo>\n"));
  };
  EXPECT_EQ(with("<wheel_separation>0.39</wheel_separation>").robot.track_width, 0.38);
  EXPECT_THAT(with("<wheel_separation>0.39</wheel_separation>").remarks,
              Contains(AllOf(HasSubstr("0.39 m: robot.urdf:"), HasSubstr("the first is taken"))));
  EXPECT_THAT(input_error([&] { with("<wheel_diameter>0.2</wheel_diameter>"); }),
              AllOf(HasSubstr("wheel_radius 0.05 m: robot.urdf:"), HasSubstr("but 0.1 m: robot.urdf:"),
                    HasSubstr("--wheel-radius")));
  EXPECT_EQ(with("<max_linear_acceleration>1</max_linear_acceleration>").robot.limits.at("acceleration"), 20.0);
}

TEST(RobotOrigin, WheelThatIsAMeshNeedsARadius) {
  const SampleRobot sample;
  std::string text = sample_urdf(sample, usual_frames(sample));
  const std::string wheel = "<cylinder radius=\"0.05\" length=\"0.02\"/>";
  for (std::size_t at = text.find(wheel); at != std::string::npos; at = text.find(wheel)) {
    text.replace(at, wheel.size(), "<mesh filename=\"wheel.stl\"/>");
  }
  EXPECT_THAT(input_error([&] { from_urdf(text); }),
              AllOf(HasSubstr("collision <mesh> of link 'right_wheel'"), HasSubstr("give --wheel-radius")));
  RobotHints hints;
  hints.wheel_radius = 0.05;
  const RobotWithOrigins made = from_urdf(text, hints);
  EXPECT_EQ(made.robot.wheel_radius, 0.05);
  EXPECT_EQ(made.origins.at("wheel_radius"), "--wheel-radius");
}

TEST(RobotOrigin, VisualShapeIsSecondChoiceAndSaidSo) {
  const SampleRobot sample;
  std::string text = sample_urdf(sample, usual_frames(sample));
  for (const auto& [from, to] : {std::pair{"<collision>", "<visual>"}, {"</collision>", "</visual>"}}) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from)) {
      text.replace(at, std::string(from).size(), to);
    }
  }
  EXPECT_THAT(from_urdf(text).origins.at("wheel_radius"), HasSubstr("a visual shape, since there is no round"));
}

}  // namespace
}  // namespace wheelwright::robots::robot_origin_test
