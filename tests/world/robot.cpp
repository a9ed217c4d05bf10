// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "tests/world/robot.hpp"

namespace wheelwright::reality {
namespace {

void lump(RobotDesign& robot) {
  const Body& b = robot.body;
  const double spin = wheel_spin(b) + b.armature[right];
  const double across = 0.5 * wheel_spin(b);
  const double share = 2.0 * spin / (robot.radius * robot.radius);
  const double arm = robot.half_track * robot.half_track;
  robot.mass = b.chassis_mass + 2.0 * b.wheel_mass + share;
  robot.yaw_inertia = b.chassis_inertia.z() + 2.0 * (across + b.wheel_mass * arm) + share * arm;
}

void make_imperfect(RobotDesign& robot, Random& random) {
  Body& b = robot.body;
  const double common = random.uniform(-0.003, 0.003);
  const double apart = random.uniform(-0.0015, 0.0015);
  b.radius = {robot.radius * (1.0 + common + apart), robot.radius * (1.0 + common - apart)};
  b.half_track *= 1.0 + random.uniform(-0.005, 0.005);
  b.friction.fill(random.uniform(0.0, 0.01) * robot.typical_torque());
  const double mismatch = random.uniform(-0.005, 0.005);
  robot.gain = {1.0 + mismatch, 1.0 - mismatch};
  robot.bias = {random.uniform(-0.006, 0.006) * robot.typical_torque(),
                random.uniform(-0.006, 0.006) * robot.typical_torque()};
}

}  // namespace

double wheel_spin(const Body& body) {
  const double r = 0.5 * (body.radius[right] + body.radius[left]);
  return 0.5 * body.wheel_mass * r * r;
}

RobotDesign draw_robot(Random& random, const Lot& lot) {
  RobotDesign robot;
  Body& b = robot.body;
  const double total = random.log_uniform(lot.least, lot.most);
  const double size = std::cbrt(total / 40.0);
  robot.radius = size * random.uniform(0.08, 0.13);
  robot.half_track = size * random.uniform(0.20, 0.30);
  b.radius = {robot.radius, robot.radius};
  b.half_track = robot.half_track;
  b.wheel_mass = total * random.uniform(0.02, 0.04);
  b.wheel_width = 0.15 * robot.radius;
  b.chassis_mass = total - 2.0 * b.wheel_mass;
  const double gyration = robot.half_track * random.uniform(0.75, 1.1);
  const double z = b.chassis_mass * gyration * gyration;
  b.chassis_inertia = {0.6 * z, 0.6 * z, z};
  b.centre = {0.0, 0.0, robot.radius * random.uniform(-0.2, 0.5)};
  b.armature.fill(random.log_uniform(0.01, 0.08) * total * robot.radius * robot.radius);
  b.caster = robot.half_track * random.uniform(0.8, 1.2);
  lump(robot);

  robot.wheel_speed = random.uniform(5.0, 11.0);
  robot.acceleration = robot.radius * robot.wheel_speed * random.uniform(1.2, 2.6);
  robot.damping = random.log_uniform(0.08, 0.4) * robot.typical_torque() / (0.5 * robot.wheel_speed);
  b.damping.fill(robot.damping);
  robot.bandwidth = random.uniform(6.0, 12.0);
  robot.effort_limit = 7.0 * robot.typical_torque();

  const std::array<double, 3> rates{100.0, 125.0, 200.0};
  robot.rate = rates[random.below(rates.size())];
  robot.counts = std::exp2(10.0 + static_cast<double>(random.below(7)));
  robot.torque_noise = lot.noise * robot.typical_torque() * random.log_uniform(0.005, 0.06);
  robot.position_noise = lot.noise * random.log_uniform(0.0003, 0.002);
  robot.heading_noise = lot.noise * random.log_uniform(0.0003, 0.002);
  if (lot.imperfect) {
    make_imperfect(robot, random);
  }
  return robot;
}

std::string engine_xml(const Body& b, double step) {
  const double height = 0.5 * (b.radius[right] + b.radius[left]);
  const double spin = wheel_spin(b);
  std::string wheels;
  for (const auto& [name, side, y] : {std::tuple{"right", right, -b.half_track}, {"left", left, b.half_track}}) {
    wheels += fmt::format(
        R"(<body name="{0}" pos="0 {1} {2}"><joint name="{0}" type="hinge" axis="0 1 0" armature="{3}" )"
        R"(damping="{4}" frictionloss="{5}"/>
<inertial pos="0 0 0" mass="{6}" diaginertia="{7} {8} {7}"/>
<geom type="ellipsoid" size="{9} {10} {9}" pos="{11} 0 {12}" condim="3" priority="1" friction="{13} 0 0"/></body>
)",
        name, y, b.radius[side] - height, b.armature[side], b.damping[side], b.friction[side], b.wheel_mass, 0.5 * spin,
        spin, b.radius[side], b.wheel_width, b.off_centre[side][0], b.off_centre[side][1], b.grip);
  }
  const double ball = 0.3 * height;
  std::string casters;
  for (const double x : {-b.caster, b.caster}) {
    casters +=
        fmt::format(R"(<geom type="sphere" size="{0}" pos="{1} 0 {2}" condim="{3}" priority="1" friction="{4} 0 0"/>
)",
                    ball, x, ball - height, b.caster_grip > 0.0 ? 3 : 1, b.caster_grip);
  }
  std::string motors;
  if (!b.motor.empty() || !b.motor_at.empty()) {
    motors = fmt::format(R"(<actuator><general name="right" joint="{0}right" {1}/>)"
                         R"(<general name="left" joint="{0}left" {1}/></actuator>)",
                         b.motor_at, b.motor);
  }
  return fmt::format(
      R"(<mujoco><compiler boundmass="1e-9" boundinertia="1e-12"/>
<option timestep="{0}" cone="elliptic" impratio="100" solver="Newton" iterations="30" )"
      R"(tolerance="1e-12" gravity="{1} {2} {3}" density="{16}"/>
<default><geom solref="{4} 1" solimp="0.99 0.99 0.001"/></default>
<worldbody><geom type="plane" size="0 0 1" condim="1" friction="1.5 0 0"/>
<body name="chassis" pos="0 0 {5}"><freejoint/>
<inertial pos="{6} {7} {8}" mass="{9}" diaginertia="{10} {11} {12}"/>
{13}{14}{15}</body></worldbody>{17}</mujoco>)",
      step, b.gravity.x(), b.gravity.y(), b.gravity.z(), 2.0 * step, height, b.centre.x(), b.centre.y(), b.centre.z(),
      b.chassis_mass, b.chassis_inertia.x(), b.chassis_inertia.y(), b.chassis_inertia.z(), casters, wheels, b.attached,
      b.fluid_density, b.beside + motors);
}

}  // namespace wheelwright::reality
