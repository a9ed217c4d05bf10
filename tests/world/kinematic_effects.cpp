// SPDX-License-Identifier: Apache-2.0
// What moves the pose against wheel odometry, and changes of the nominal parameters.
#include <cmath>

#include <fmt/format.h>

#include "tests/world/effect.hpp"

namespace wheelwright::reality {
namespace {

Effect longitudinal_slip(const RobotDesign& robot, Random, double severity) {
  // A wheel runs ahead of the ground by a share that grows with its traction force and saturates at a fifth.
  constexpr double most = 0.2;
  const double share = 0.05 * severity / robot.typical_torque();
  return {"longitudinal_slip",
          {{"stiffness", 1.0 / (robot.radius * share)}, {"largest", most}},
          {},
          {},
          {},
          [=](const State& state, Pair& speed) {
            for (std::size_t i = 0; i < 2; ++i) {
              speed[i] += std::abs(state.speed[i]) * most * std::tanh(share * state.torque[i] / most);
            }
          },
          0.0};
}

Effect wheel_radius_asymmetric(const RobotDesign&, Random random, double severity) {
  const double change = random.sign() * 0.03 * severity;
  const std::size_t side = random.below(2);
  return {"wheel_radius_asymmetric",
          {{"epsilon", change}, {"side_right0_left1", static_cast<double>(side)}},
          [=](Body& body) { body.radius[side] *= 1.0 + change; },
          {},
          {},
          {},
          0.0};
}

Effect wheel_radius(const RobotDesign&, Random random, double severity) {
  const double change = random.sign() * 0.03 * severity;
  return {"wheel_radius",
          {{"radius_rel", change}},
          [=](Body& body) {
            body.radius[right] *= 1.0 + change;
            body.radius[left] *= 1.0 + change;
          },
          {},
          {},
          {},
          0.0};
}

Effect track_width(const RobotDesign&, Random random, double severity) {
  const double change = random.sign() * 0.04 * severity;
  return {
      "track_width", {{"track_rel", change}}, [=](Body& body) { body.half_track *= 1.0 + change; }, {}, {}, {}, 0.0};
}

Effect encoder_scale(const RobotDesign&, Random random, double severity) {
  const double change = random.sign() * 0.03 * severity;
  const std::size_t side = random.below(2);
  return {"encoder_scale",
          {{"scale", 1.0 + change}, {"side_right0_left1", static_cast<double>(side)}},
          {},
          {},
          {},
          [=](const State&, Pair& speed) { speed[side] *= 1.0 + change; },
          0.0};
}

Effect payload(const RobotDesign& robot, Random random, double severity) {
  const double mass = 0.15 * severity * robot.mass;
  const double size = random.uniform(0.05, 0.5) * robot.half_track;
  const double height = robot.radius * random.uniform(0.0, 1.0);
  return {"payload",
          {{"mass_kg", mass}, {"size_m", size}},
          [=](Body& body) {
            const double part = mass * size * size / 6.0;
            body.attached += fmt::format(
                "<body name=\"payload\" pos=\"0 0 {}\"><inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"{} {} "
                "{}\"/></body>\n",
                height, mass, part, part, part);
          },
          {},
          {},
          {},
          0.0};
}

Effect armature(const RobotDesign& robot, Random, double severity) {
  const double more = 0.15 * severity * 0.5 * robot.mass * robot.radius * robot.radius;
  return {"armature",
          {{"armature_kg_m2", more}},
          [=](Body& body) {
            body.armature[right] += more;
            body.armature[left] += more;
          },
          {},
          {},
          {},
          0.0};
}

Effect viscous(const RobotDesign& robot, Random, double severity) {
  const double more = 0.5 * severity * robot.typical_torque() / robot.wheel_speed;
  return {"viscous",
          {{"damping_rel", more / robot.damping}, {"damping", more}},
          [=](Body& body) {
            body.damping[right] += more;
            body.damping[left] += more;
          },
          {},
          {},
          {},
          0.0};
}

Effect torque_gain(const RobotDesign&, Random random, double severity) {
  const double gain = std::exp(random.sign() * 0.15 * severity);
  return {"torque_gain",
          {{"gain", gain}},
          {},
          [=](const State&, Pair& torque) {
            torque[right] *= gain;
            torque[left] *= gain;
          },
          {},
          {},
          0.0};
}

}  // namespace

std::vector<Entry> kinematic_effects() {
  using enum Class;
  return {{"longitudinal_slip", structural, longitudinal_slip, 4.0, true},
          {"wheel_radius_asymmetric", structural, wheel_radius_asymmetric, 2.0, true}};
}

std::vector<Entry> parametric_effects() {
  using enum Class;
  return {{"payload", parametric, payload},
          {"armature", parametric, armature},
          {"viscous", parametric, viscous},
          {"torque_gain", parametric, torque_gain},
          {"wheel_radius", parametric, wheel_radius, 2.0, true},
          {"track_width", parametric, track_width, 2.0, true},
          {"encoder_scale", parametric, encoder_scale, 2.0, true}};
}

}  // namespace wheelwright::reality
