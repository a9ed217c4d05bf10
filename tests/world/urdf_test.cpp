// SPDX-License-Identifier: Apache-2.0
// The physics engine's own reader of URDF against ours: masses, and the mass matrix of the robot as it drives.
#include <gtest/gtest.h>

#include <memory>
#include <random>

#include <mujoco/mujoco.h>
#include <Eigen/Core>

#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_origin.hpp"
#include "tests/robots/robot_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::reality::urdf_test {
namespace {

using UrdfInTheEngine = testing::ScratchTest;

// The engine fixes a URDF's root to the world: three joints put before it let the robot move in the plane and turn.
std::string with_planar_base(const std::string& urdf) {
  std::string out = urdf;
  const std::string root = "<link name=\"base_footprint\"/>";
  const std::string body =
      "<inertial><mass value=\"1e-9\"/><inertia ixx=\"1e-12\" ixy=\"0\" ixz=\"0\" iyy=\"1e-12\" iyz=\"0\" "
      "izz=\"1e-12\"/></inertial>";
  out.replace(
      out.find(root), root.size(),
      "<mujoco><compiler fusestatic=\"false\" boundmass=\"0\" boundinertia=\"0\" balanceinertia=\"false\"/></mujoco>"
      "<link name=\"ground\"/><link name=\"on_x\">" +
          body +
          "</link>"
          "<joint name=\"x\" type=\"prismatic\"><parent link=\"ground\"/><child link=\"on_x\"/><axis xyz=\"1 0 0\"/>"
          "<limit lower=\"-9\" upper=\"9\" effort=\"1\" velocity=\"1\"/></joint>"
          "<link name=\"base_footprint\">" +
          body +
          "</link><joint name=\"yaw\" type=\"continuous\"><parent link=\"on_x\"/>"
          "<child link=\"base_footprint\"/><axis xyz=\"0 0 1\"/></joint>");
  return out;
}

TEST_F(UrdfInTheEngine, MassMatrixOfTheRollingRobotIsTheNominalOne) {
  std::mt19937_64 random(5);
  for (int k = 0; k < 5; ++k) {
    const testing::SampleRobot sample;
    const std::string urdf = sample_urdf(sample, random_frames(sample, random));
    const robots::RobotTree tree = robots::parse_urdf(urdf, "robot.urdf");
    const Robot robot = robots::robot_from(&tree, nullptr).robot;

    char message[500] = "";
    const std::unique_ptr<mjModel, void (*)(mjModel*)> model(
        mj_loadXML(put("robot.urdf", with_planar_base(urdf)).c_str(), nullptr, message, sizeof message),
        mj_deleteModel);
    ASSERT_NE(model, nullptr) << message;
    const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(model.get()), mj_deleteData);
    mj_forward(model.get(), data.get());
    const auto n = static_cast<Eigen::Index>(model->nv);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> mass(n, n);
    mj_fullM(model.get(), mass.data(), data->qM);

    // Velocities of all joints of the robot that drives at v1 = 1 m/s, and that turns at v2 = 1 rad/s: wheels roll.
    const auto dof = [&](const char* name) {
      return static_cast<Eigen::Index>(model->jnt_dofadr[mj_name2id(model.get(), mjOBJ_JOINT, name)]);
    };
    Eigen::VectorXd ahead = Eigen::VectorXd::Zero(n), turn = Eigen::VectorXd::Zero(n);
    ahead[dof("x")] = 1.0;
    turn[dof("yaw")] = 1.0;
    for (const auto& [name, side] : {std::pair{"right_wheel_joint", 1.0}, {"left_wheel_joint", -1.0}}) {
      ahead[dof(name)] = 1.0 / sample.radius;
      turn[dof(name)] = side * 0.5 * sample.track / sample.radius;
    }
    EXPECT_NEAR(robot.nominal.at("mass"), ahead.dot(mass * ahead), 1e-7 * robot.nominal.at("mass"));
    EXPECT_NEAR(robot.nominal.at("yaw_inertia"), turn.dot(mass * turn), 1e-6 * robot.nominal.at("yaw_inertia"));
  }
}

}  // namespace
}  // namespace wheelwright::reality::urdf_test
