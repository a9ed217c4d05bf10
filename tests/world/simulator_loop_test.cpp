// SPDX-License-Identifier: Apache-2.0
// The loop closed on the engine: what an edited MJCF is there, and how far robot and simulator are apart before and
// after.
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include <mujoco/mujoco.h>
#include <Eigen/Core>

#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/simulator_file.hpp"
#include "gap/diagnose.hpp"
#include "gap/prepared.hpp"
#include "gap/write_back.hpp"
#include "tests/robots/simulator_samples.hpp"
#include "tests/support/scratch.hpp"
#include "tests/world/case.hpp"
#include "tests/world/replay.hpp"
#include "tests/world/signals.hpp"

namespace wheelwright::reality::simulator_loop_test {
namespace {

using model::SimulatorChange;

using SimulatorInTheEngine = testing::ScratchTest;
using OwnedModel = std::unique_ptr<mjModel, void (*)(mjModel*)>;

OwnedModel loaded(const std::string& path) {
  char message[500] = "";
  OwnedModel model(mj_loadXML(path.c_str(), nullptr, message, sizeof message), mj_deleteModel);
  EXPECT_NE(model, nullptr) << message;
  return model;
}

/// Mass matrix of all joints at rest, and where the engine has the robot's mass.
struct Masses {
  Eigen::MatrixXd matrix;
  Eigen::Vector3d centre;
  double mass = 0.0;
};
Masses masses(const mjModel& model) {
  const std::unique_ptr<mjData, void (*)(mjData*)> data(mj_makeData(&model), mj_deleteData);
  mj_forward(&model, data.get());
  const auto n = static_cast<Eigen::Index>(model.nv);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> full(n, n);
  mj_fullM(&model, full.data(), data->qM);
  return {full, Eigen::Map<const Eigen::Vector3d>(data->subtree_com + 3), model.body_subtreemass[1]};
}

Robot cart() {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  return robot;
}

TEST_F(SimulatorInTheEngine, EditedFileIsTheRobotThatWasMeant) {
  SimulatorChange change;
  for (const char* member : {"mass", "yaw_inertia", "moment_ahead", "moment_left", "dry_friction", "damping",
                             "armature", "gain", "effort_limit", "radius_factor", "track_factor"}) {
    change.because[member] = "a_cause";
  }
  change.mass = 2.0;
  change.yaw_inertia = 0.25;
  change.moment_ahead = 0.3;
  change.moment_left = 0.1;
  change.dry_friction = {0.1, 0.2};
  change.damping = {0.005, 0.0};
  change.armature = {0.004, 0.004};
  change.gain = {0.8, 0.9};
  change.effort_limit = 6.0;
  change.radius_factor = {1.0, 1.03};
  const auto edit = [&](const SimulatorChange& c) {
    return robots::edit_simulator(robots::SimulatorFormat::mjcf, testing::sample_mjcf, "cart.xml", c, cart());
  };
  const robots::EditedSimulator edited = edit(change);
  EXPECT_TRUE(edited.not_expressed.empty());
  const OwnedModel before = loaded(put("before.xml", testing::sample_mjcf).string());
  const OwnedModel after = loaded(put("after.xml", edited.text).string());
  ASSERT_TRUE(before && after);
  const Masses a = masses(*before), b = masses(*after);
  EXPECT_NEAR(b.mass, a.mass + 2.0, 1e-7);
  // First moments about the middle of the axle, and the moment about the vertical through it: the free joint's own.
  EXPECT_NEAR(b.mass * b.centre.x(), a.mass * a.centre.x() + 0.3, 1e-6);
  EXPECT_NEAR(b.mass * b.centre.y(), a.mass * a.centre.y() + 0.1, 1e-6);
  EXPECT_NEAR(b.matrix(5, 5), a.matrix(5, 5) + 0.25, 1e-6);
  for (const auto& [name, side] : {std::pair{"right", 0}, {"left", 1}}) {
    const int joint = mj_name2id(after.get(), mjOBJ_JOINT, name);
    const int dof = after->jnt_dofadr[joint];
    EXPECT_NEAR(b.matrix(dof, dof), a.matrix(dof, dof) + 0.004, 1e-9) << "the wheel keeps its own inertia";
    EXPECT_NEAR(after->dof_frictionloss[dof], change.dry_friction[side], 1e-9);
    EXPECT_NEAR(after->dof_damping[dof], before->dof_damping[dof] + change.damping[side], 1e-9);
    const int motor = mj_name2id(after.get(), mjOBJ_ACTUATOR, side == 0 ? "r" : "l");
    EXPECT_NEAR(after->actuator_gear[6 * motor], 2.0 * change.gain[side], 1e-8);
    EXPECT_NEAR(after->actuator_gear[6 * motor] * after->actuator_forcerange[2 * motor + 1], 6.0, 1e-7);
    EXPECT_TRUE(after->actuator_forcelimited[motor]);
    const int body = after->jnt_bodyid[joint];
    EXPECT_NEAR(after->body_mass[body], before->body_mass[body], 1e-7);
    EXPECT_NEAR(after->geom_size[3 * after->body_geomadr[body]], 0.1 * change.radius_factor[side], 1e-9);
    EXPECT_NEAR(after->body_pos[3 * body + 2],
                before->body_pos[3 * body + 2] + 0.1 * (change.radius_factor[side] - 1.0), 1e-9);
  }
  SimulatorChange wider;
  wider.because["track_factor"] = "track_width";
  wider.track_factor = 1.05;
  const OwnedModel wide = loaded(put("wide.xml", edit(wider).text).string());
  ASSERT_TRUE(wide);
  for (const char* name : {"right", "left"}) {
    const int body = wide->jnt_bodyid[mj_name2id(wide.get(), mjOBJ_JOINT, name)];
    EXPECT_NEAR(wide->body_pos[3 * body + 1], 1.05 * before->body_pos[3 * body + 1], 1e-9);
  }
}

// Masses that come from densities are written as the engine itself reckons them.
TEST_F(SimulatorInTheEngine, MassesOfGeomsAreTheEngines) {
  for (const char* geom :
       {"type=\"box\" size=\"0.2 0.15 0.05\" pos=\"0.01 0.02 0.03\" euler=\"10 20 30\"",
        "type=\"sphere\" size=\"0.1\" mass=\"7\"", "type=\"capsule\" fromto=\"-0.1 0 0 0.2 0.05 0.1\" size=\"0.06\"",
        "type=\"ellipsoid\" size=\"0.2 0.1 0.05\" axisangle=\"1 1 0 40\"",
        "type=\"cylinder\" size=\"0.1 0.05\" density=\"700\" xyaxes=\"0 1 0 0 0 1\""}) {
    std::string text = testing::sample_mjcf;
    const std::size_t at = text.find("<inertial"), end = text.find("/>", at) + 2;
    text.replace(at, end - at, std::string("<geom ") + geom + " contype=\"0\" conaffinity=\"0\"/>");
    const OwnedModel before = loaded(put("before.xml", text).string());
    SimulatorChange change;
    change.because["mass"] = "payload";
    change.mass = 1.0;
    const robots::EditedSimulator edited =
        robots::edit_simulator(robots::SimulatorFormat::mjcf, text, "cart.xml", change, cart());
    const OwnedModel after = loaded(put("after.xml", edited.text).string());
    ASSERT_TRUE(before && after);
    const Masses a = masses(*before), b = masses(*after);
    EXPECT_NEAR(b.mass, a.mass + 1.0, 1e-6) << geom;
    EXPECT_NEAR(b.mass * b.centre.x(), a.mass * a.centre.x(), 1e-6) << geom;
    EXPECT_NEAR(b.matrix(5, 5), a.matrix(5, 5), 1e-6) << geom;
  }
}

struct LoopCase {
  std::string effect;
  std::uint64_t seed;
};

// A robot with a hidden effect, diagnosed against its designer's robot file; the designer's MJCF edited with what was
// found; on a drive that nothing saw before, the engine runs both files along the robot's log.
class Loop : public ::testing::TestWithParam<LoopCase> {};

TEST_P(Loop, TheSimulatorComesNearerToTheRobot) {
  Request request;
  request.seed = GetParam().seed;
  request.effect = GetParam().effect;
  request.laws = LawChoice("given");
  request.duration = 60.0;
  request.low = 8.0;
  const Case c = make_case(request, 0);
  const Robot robot = robots::parse_robot(robot_yaml(c.robot, "case"), "robot.yaml");
  TableSource real(c.real), healthy(c.baseline);
  gap::DiagnoseOptions options;
  options.shrink = false;
  const Diagnosis found = gap::diagnose(real, &healthy, robot, options);
  ASSERT_TRUE(found.verdict == gap::GapVerdict::explained || found.verdict == gap::GapVerdict::ambiguous);
  const gap::PreparedGap prepared = gap::prepare_gap(real, &healthy, robot, options);
  const SimulatorChange change = gap::simulator_change(robot, prepared.drive, found);
  const std::string nominal = designers_xml(c.robot);
  const robots::EditedSimulator edited =
      robots::edit_simulator(robots::SimulatorFormat::mjcf, nominal, "robot.xml", change, robot);
  ASSERT_FALSE(edited.changed.empty());

  ReplayOptions how;
  how.beta = found.beta;
  const Replay floor = replay(nominal, c.baseline, how);
  how.wheel_radius = floor.wheel_radius;
  how.track_width = floor.track_width;
  const Replay before = replay(nominal, c.fresh, how), after = replay(edited.text, c.fresh, how);
  const auto torque = [&](const Replay& r) {
    return std::hypot(r.sum, r.difference / (0.5 * how.track_width.value()));
  };
  EXPECT_LT(torque(after), 0.4 * torque(before));
  EXPECT_LT(after.velocity, 0.6 * before.velocity);
  EXPECT_LT(after.position, 0.6 * before.position);
  // What separates a healthy robot from its own simulator: noise, and the servo.
  // At a limit the noise of the servo is cut off on one side: that is not in the healthy log.
  EXPECT_LT(torque(after), 2.0 * torque(floor));
  EXPECT_LT(after.velocity, 1.5 * floor.velocity);
  EXPECT_LT(after.position, 1.5 * floor.position);
}

INSTANTIATE_TEST_SUITE_P(All, Loop,
                         ::testing::Values(LoopCase{"payload", 5}, LoopCase{"coulomb", 5}, LoopCase{"wheel_radius", 5},
                                           LoopCase{"saturation", 5}),
                         [](const auto& tested) { return tested.param.effect; });

// A robot of the engine without any effect, and its designer's file run by the engine at the same speeds.
class FromASimulator : public ::testing::Test {
 protected:
  static Case healthy_case() {
    Request request;
    request.seed = 5;
    request.effect = "payload";
    request.laws = LawChoice("given");
    request.duration = 60.0;
    request.low = 8.0;
    return make_case(request, 0);
  }

  static Diagnosis gap_from(const std::string& simulator, const LogTable& log, const Robot& robot) {
    const Replay run = replay(simulator, log);
    TableSource real(log), simulated(run.simulated);
    gap::DiagnoseOptions options;
    options.shrink = false;
    options.baseline_simulated = true;
    return gap::diagnose(real, &simulated, robot, options);
  }

  const Case made = healthy_case();
  const Robot robot = robots::parse_robot(robot_yaml(made.robot, "case"), "robot.yaml");
};

TEST_F(FromASimulator, TheDesignersOwnIsNearlyTheHealthyRobot) {
  const Diagnosis found = gap_from(designers_xml(made.robot), made.baseline, robot);
  EXPECT_EQ(found.reference, gap::GapReference::simulator);
  EXPECT_LT(found.gap, 0.01) << found.floor_origin;
}

// The robot is healthy and the file wrong: what is found is what the file lacks, though the robot file has it.
TEST_F(FromASimulator, WhatTheFileLacksIsFound) {
  SimulatorChange lighter;
  lighter.mass = -1.5;
  lighter.because["mass"] = "payload";
  const robots::EditedSimulator wrong =
      robots::edit_simulator(robots::SimulatorFormat::mjcf, designers_xml(made.robot), "robot.xml", lighter, robot);
  ASSERT_FALSE(wrong.changed.empty());
  const Diagnosis found = gap_from(wrong.text, made.baseline, robot);
  ASSERT_FALSE(found.causes.empty());
  EXPECT_EQ(found.causes.front().effect, "payload");
  EXPECT_NEAR(found.causes.front().parameters.front().estimate, 1.5, 0.15);
}

TEST_F(FromASimulator, AnEffectOfTheRobotIsFound) {
  const Diagnosis found = gap_from(designers_xml(made.robot), made.real, robot);
  ASSERT_FALSE(found.causes.empty());
  EXPECT_EQ(found.causes.front().effect, "payload");
}

}  // namespace
}  // namespace wheelwright::reality::simulator_loop_test
