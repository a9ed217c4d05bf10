// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "tests/world/effect.hpp"

namespace wheelwright::reality {

// Mass, ground and wheel shape.

namespace {

constexpr double gravity = 9.81;

Effect com_longitudinal(const RobotDesign& robot, Random random, double severity) {
  const double shift = random.sign() * 0.25 * severity * robot.half_track;
  return {"com_longitudinal",
          {{"a", shift * robot.body.chassis_mass / robot.mass}, {"com_x_m", shift}},
          [=](Body& body) { body.centre.x() += shift; },
          {},
          {},
          {},
          0.0};
}

Effect com_lateral(const RobotDesign& robot, Random random, double severity) {
  const double shift = random.sign() * 0.15 * severity * robot.half_track;
  return {"com_lateral",
          {{"b", shift * robot.body.chassis_mass / robot.mass}, {"com_y_m", shift}},
          [=](Body& body) { body.centre.y() += shift; },
          {},
          {},
          {},
          0.0};
}

Effect slope(const RobotDesign& robot, Random random, double severity) {
  const double angle = 0.25 * severity * robot.typical_torque() / (0.5 * robot.radius * robot.mass * gravity);
  const double uphill = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double weight = robot.body.chassis_mass + 2.0 * robot.body.wheel_mass;
  const double pull = gravity * std::sin(angle);
  return {"slope",
          {{"g_x", pull * std::cos(uphill) * weight / robot.mass},
           {"g_y", pull * std::sin(uphill) * weight / robot.mass},
           {"angle_rad", angle},
           {"uphill_heading_rad", uphill}},
          [=](Body& body) {
            body.gravity = {-pull * std::cos(uphill), -pull * std::sin(uphill), -gravity * std::cos(angle)};
          },
          {},
          {},
          {},
          0.0};
}

Effect wheel_out_of_round(const RobotDesign& robot, Random random, double severity) {
  // The load on a wheel whose axle is off its centre pulls it to its low side.
  const double large = 0.4 * severity * robot.typical_torque();
  const std::size_t side = random.below(2);
  const double other = random.uniform(0.0, 1.0) < 0.5 ? 0.0 : random.uniform(0.0, 0.6) * large;
  Pair size{other, other};
  size[side] = large;
  const Pair phase{random.uniform(0.0, 2.0 * std::numbers::pi), random.uniform(0.0, 2.0 * std::numbers::pi)};
  return {"wheel_out_of_round",
          {{"A_R", size[right] * std::cos(phase[right])},
           {"B_R", size[right] * std::sin(phase[right])},
           {"A_L", size[left] * std::cos(phase[left])},
           {"B_L", size[left] * std::sin(phase[left])}},
          {},
          {},
          [=](const State& state, Push& push) {
            for (std::size_t i = 0; i < 2; ++i) {
              push.wheel[i] -= size[i] * std::cos(state.angle[i] - phase[i]);
            }
          },
          {},
          0.0};
}

}  // namespace

std::vector<Entry> body_effects() {
  using enum Class;
  return {{"com_longitudinal", structural, com_longitudinal, 2.6},
          {"com_lateral", structural, com_lateral, 3.0},
          {"slope", structural, slope},
          {"wheel_out_of_round", structural, wheel_out_of_round}};
}

// Effects that the catalogue of the tool does not have, on purpose.

namespace {

constexpr double standard_gravity = 9.81;

/// A mass on a joint of the chassis, at `place` and `arm` below (or above) it.
std::string hung(std::string_view name, double height, std::string_view joint, double arm, double mass, double size) {
  return fmt::format(
      R"(<body name="{}" pos="0 0 {}">{}<inertial pos="0 0 {}" mass="{}" diaginertia="{} {} {}"/></body>
)",
      name, height, joint, arm, mass, mass * size * size, mass * size * size, mass * size * size);
}

Effect pendulum(const RobotDesign& robot, Random random, double severity) {
  const double mass = std::min(0.12 * severity, 0.4) * robot.mass;
  const double length = robot.half_track * random.uniform(0.5, 1.2);
  const double ratio = random.uniform(0.02, 0.12);
  const double damping = 2.0 * ratio * mass * length * std::sqrt(standard_gravity * length);
  return {"pendulum",
          {{"mass_kg", mass}, {"length_m", length}, {"damping_ratio", ratio}},
          [=](Body& body) {
            const auto joint = fmt::format(R"(<joint type="hinge" axis="0 1 0" damping="{}"/>)", damping);
            body.attached += hung("pendulum", 1.5 * length, joint, -length, mass, 0.1 * length);
          },
          {},
          {},
          {},
          0.0};
}

Effect flexible_mast(const RobotDesign& robot, Random random, double severity) {
  const bool torsion = random.uniform(0.0, 1.0) < 0.4;
  const double frequency = 2.0 * std::numbers::pi * random.uniform(0.7, 2.5);
  const double ratio = random.uniform(0.02, 0.1);
  if (torsion) {
    const double inertia = std::min(0.3 * severity, 1.5) * robot.yaw_inertia;
    return {"flexible_mast",
            {{"inertia_kg_m2", inertia}, {"frequency_Hz", frequency / (2.0 * std::numbers::pi)}, {"torsion", 1.0}},
            [=](Body& body) {
              body.attached += fmt::format(
                  R"(<body pos="0 0 0.1"><joint type="hinge" axis="0 0 1" stiffness="{}" damping="{}"/>
<inertial pos="0 0 0" mass="0.01" diaginertia="{} {} {}"/></body>
)",
                  inertia * frequency * frequency, 2.0 * ratio * frequency * inertia, inertia, inertia, inertia);
            },
            {},
            {},
            {},
            0.0};
  }
  const double mass = std::min(0.12 * severity, 0.4) * robot.mass;
  const double length = robot.half_track * random.uniform(1.0, 2.0);
  const double inertia = mass * length * length;
  const double stiffness = inertia * frequency * frequency + mass * standard_gravity * length;
  return {"flexible_mast",
          {{"mass_kg", mass}, {"length_m", length}, {"frequency_Hz", frequency / (2.0 * std::numbers::pi)}},
          [=](Body& body) {
            const auto joint = fmt::format(R"(<joint type="hinge" axis="0 1 0" stiffness="{}" damping="{}"/>)",
                                           stiffness, 2.0 * ratio * frequency * inertia);
            body.attached += hung("mast", 0.0, joint, length, mass, 0.1 * length);
          },
          {},
          {},
          {},
          0.0};
}

Effect sloshing(const RobotDesign& robot, Random random, double severity) {
  const double mass = std::min(0.12 * severity, 0.4) * robot.mass;
  const double frequency = 2.0 * std::numbers::pi * random.uniform(0.5, 1.5);
  const double ratio = random.uniform(0.03, 0.12);
  return {"sloshing",
          {{"mass_kg", mass}, {"frequency_Hz", frequency / (2.0 * std::numbers::pi)}, {"damping_ratio", ratio}},
          [=](Body& body) {
            const double k = mass * frequency * frequency;
            const double d = 2.0 * ratio * frequency * mass;
            const auto joints = fmt::format(R"(<joint type="slide" axis="1 0 0" stiffness="{0}" damping="{1}"/>)"
                                            R"(<joint type="slide" axis="0 1 0" stiffness="{0}" damping="{1}"/>)",
                                            k, d);
            body.attached += hung("liquid", 0.0, joints, 0.0, mass, 0.02);
          },
          {},
          {},
          {},
          0.0};
}

Effect trailer(const RobotDesign& robot, Random random, double severity) {
  const double mass = std::min(0.3 * severity, 0.8) * robot.mass;
  const double hitch = robot.half_track * random.uniform(0.6, 1.2);
  const double bar = robot.half_track * random.uniform(1.5, 2.5);
  const double r = robot.radius;
  const double track = 0.8 * robot.half_track;
  return {
      "trailer",
      {{"mass_kg", mass}, {"hitch_m", hitch}, {"bar_m", bar}},
      [=](Body& body) {
        std::string wheels;
        for (const double y : {-track, track}) {
          wheels += fmt::format(R"(<body pos="{0} {1} 0"><joint type="hinge" axis="0 1 0"/>)"
                                R"(<inertial pos="0 0 0" mass="{2}" diaginertia="{3} {3} {3}"/>
<geom type="ellipsoid" size="{4} {5} {4}" condim="3" friction="1.5 0 0"/></body>
)",
                                -bar, y, 0.03 * mass, 0.015 * mass * r * r, r, 0.15 * r);
        }
        const double part = mass * 0.2 * bar * bar;
        body.attached += fmt::format(
            R"(<body pos="{} 0 0"><joint type="ball"/><inertial pos="{} 0 0" mass="{}" diaginertia="{} {} {}"/>{}</body>
)",
            -hitch, -bar, 0.94 * mass, part, part, part, wheels);
      },
      {},
      {},
      {},
      0.0};
}

Effect tether(const RobotDesign& robot, Random random, double severity) {
  const double slack = random.uniform(0.1, 0.6);
  const double stiffness = 0.5 * severity * robot.typical_torque() / robot.radius;
  const double x = random.uniform(-0.7, 0.7);
  const double y = random.uniform(-0.7, 0.7);
  const double place = -robot.half_track * random.uniform(0.0, 1.0);
  return {"tether",
          {{"stiffness_N_per_m", stiffness}, {"slack_m", slack}, {"x_m", x}, {"y_m", y}},
          {},
          {},
          [=](const State& state, Push& push) {
            const double c = std::cos(state.heading);
            const double s = std::sin(state.heading);
            const double dx = x - (state.x + place * c);
            const double dy = y - (state.y + place * s);
            const double length = std::hypot(dx, dy);
            const double pull = stiffness * std::max(length - slack, 0.0) / std::max(length, 1e-9);
            push.forward += pull * (c * dx + s * dy);
            const double sideways = pull * (c * dy - s * dx);
            push.sideways += sideways;
            push.yaw += place * sideways;
          },
          {},
          0.0};
}

Effect wind(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.25 * severity * robot.typical_torque() / robot.radius;
  const double time = random.uniform(0.4, 2.0);
  const double place = robot.half_track * random.uniform(-0.8, 0.8);
  return {
      "wind",
      {{"force_N", size}, {"time_s", time}},
      {},
      {},
      [=, noise = Random(random.below(1U << 30), 0, 77), fx = 0.0, fy = 0.0](const State& state, Push& push) mutable {
        const double keep = std::exp(-state.step / time);
        const double fresh = size * std::sqrt(1.0 - keep * keep);
        fx = keep * fx + fresh * noise.normal();
        fy = keep * fy + fresh * noise.normal();
        const double c = std::cos(state.heading);
        const double s = std::sin(state.heading);
        push.forward += c * fx + s * fy;
        const double sideways = c * fy - s * fx;
        push.sideways += sideways;
        push.yaw += place * sideways;
      },
      {},
      0.0};
}

Effect bumps(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.4 * severity * robot.typical_torque() / robot.radius;
  const double length = random.uniform(0.15, 0.5);
  const double phase = random.uniform(0.0, 2.0 * std::numbers::pi);
  return {"bumps",
          {{"force_N", size}, {"length_m", length}},
          {},
          {},
          [=](const State& state, Push& push) {
            const double wave = 2.0 * std::numbers::pi / length;
            const double c = std::cos(state.heading);
            const double s = std::sin(state.heading);
            for (const double side : {-1.0, 1.0}) {
              const double x = state.x + side * robot.half_track * s;
              const double y = state.y - side * robot.half_track * c;
              const double fx = 0.5 * size * std::cos(wave * x + phase) * std::cos(wave * y);
              const double fy = -0.5 * size * std::sin(wave * x + phase) * std::sin(wave * y);
              const double along = c * fx + s * fy;
              push.forward += along;
              push.yaw += side * robot.half_track * along;
            }
          },
          {},
          0.0};
}

}  // namespace

std::vector<Entry> outside_effects() {
  using enum Class;
  return {{"pendulum", outside, pendulum, 3.0},
          {"flexible_mast", outside, flexible_mast, 4.0},
          {"sloshing", outside, sloshing, 3.0},
          {"trailer", outside, trailer, 2.5},
          {"tether", outside, tether},
          {"wind", outside, wind},
          {"bumps", outside, bumps}};
}

}  // namespace wheelwright::reality
