// SPDX-License-Identifier: Apache-2.0
// Friction and drag: by the engine's joints, or as laws of their own on wheels and body.
#include <cmath>

#include <wheelwright/reality/catalogue.hpp>

namespace wheelwright::reality {
namespace {

/// Width of the smooth sign of a wheel's speed, rad/s; smaller than any speed that is driven.
constexpr double creep = 0.02;

Effect coulomb(const RobotDesign& robot, Random random, double severity) {
  const double c = 0.25 * severity * robot.typical_torque();
  Effect effect{"coulomb", {{"c", c}}, {}, {}, {}, {}, 0.0};
  if (random.uniform(0.0, 1.0) < 0.5) {
    effect.build = [c](Body& body) {
      body.friction[right] += c;
      body.friction[left] += c;
    };
  } else {
    effect.parameters.emplace_back("rolling", 1.0);
    effect.push = [c](const State& state, Push& push) {
      for (std::size_t i = 0; i < 2; ++i) {
        push.wheel[i] -= c * soft_sign(state.speed[i], creep);
      }
    };
  }
  return effect;
}

Effect coulomb_asymmetric(const RobotDesign& robot, Random random, double severity) {
  const double large = 0.35 * severity * robot.typical_torque();
  const double small = large * random.uniform(0.0, 0.3);
  const bool on_right = random.sign() > 0.0;
  const double r = on_right ? large : small;
  const double l = on_right ? small : large;
  return {"coulomb_asymmetric",
          {{"c_R", r}, {"c_L", l}},
          [=](Body& body) {
            body.friction[right] += r;
            body.friction[left] += l;
          },
          {},
          {},
          {},
          0.0};
}

Effect stribeck(const RobotDesign& robot, Random random, double severity) {
  const double c = 0.6 * severity * robot.typical_torque();
  const double edge = robot.wheel_speed * random.uniform(0.1, 0.25);
  return {"stribeck",
          {{"c_s", c}, {"omega_s", edge}},
          {},
          {},
          [=](const State& state, Push& push) {
            for (std::size_t i = 0; i < 2; ++i) {
              const double ratio = state.speed[i] / edge;
              push.wheel[i] -= c * std::exp(-ratio * ratio) * soft_sign(state.speed[i], creep);
            }
          },
          {},
          0.0};
}

Effect viscous_asymmetric(const RobotDesign& robot, Random random, double severity) {
  const double more = 1.2 * severity * robot.typical_torque() / robot.wheel_speed;
  const std::size_t side = random.below(2);
  return {"viscous_asymmetric",
          {{"b", side == right ? more : -more}, {"side_right0_left1", static_cast<double>(side)}},
          [=](Body& body) { body.damping[side] += more; },
          {},
          {},
          {},
          0.0};
}

Effect quadratic_drag(const RobotDesign& robot, Random random, double severity) {
  const double top = robot.radius * robot.wheel_speed;
  const double linear = severity * 1.6 * robot.typical_torque() / (robot.radius * top * top);
  const double turning = random.uniform(0.0, 1.0) * linear * std::pow(robot.half_track, 3);
  return {"quadratic_drag",
          {{"c", robot.radius * linear}, {"c2", robot.radius * turning}},
          {},
          {},
          [=](const State& state, Push& push) {
            push.forward -= linear * state.v1 * std::abs(state.v1);
            push.yaw -= turning * state.v2 * std::abs(state.v2);
          },
          {},
          0.0};
}

Effect load_friction(const RobotDesign&, Random, double severity) {
  const double k = 0.18 * severity;
  return {"load_friction",
          {{"k", k}},
          {},
          [=](const State& state, Pair& torque) {
            for (std::size_t i = 0; i < 2; ++i) {
              torque[i] -= k * std::abs(torque[i]) * soft_sign(state.speed[i], creep);
            }
          },
          {},
          {},
          0.0};
}

Effect friction_drift(const RobotDesign& robot, Random random, double severity) {
  // Bearings that warm up lose friction: part of the loss is viscous, part dry; the drive begins cold.
  const double time = random.uniform(20.0, 60.0);
  const double k = 1.2 * severity;
  const double dry = random.uniform(0.0, 1.0) < 0.5 ? 0.0 : 0.6 * severity * robot.typical_torque();
  const double damping = robot.damping;
  return {"friction_drift",
          {{"k", -k}, {"c_drift", dry}, {"T", time}},
          {},
          {},
          [=](const State& state, Push& push) {
            const double grown = 1.0 - std::exp(-state.t / time);
            for (std::size_t i = 0; i < 2; ++i) {
              push.wheel[i] -= grown * (k * damping * state.speed[i] + dry * soft_sign(state.speed[i], creep));
            }
          },
          {},
          0.0};
}

Effect caster_drag(const RobotDesign& robot, Random random, double severity) {
  const double force = 0.6 * severity * robot.typical_torque() / robot.radius;
  const double place = random.sign() * robot.half_track * random.uniform(0.7, 1.4);
  return {"caster_drag",
          {{"c", robot.radius * force}, {"p", std::abs(place)}},
          {},
          {},
          [=](const State& state, Push& push) {
            const double across = place * state.v2;
            const double speed = std::hypot(state.v1, across);
            const double pull = force * soft_sign(speed, 0.003) / std::max(speed, 1e-9);
            push.forward -= pull * state.v1;
            push.sideways -= pull * across;
            push.yaw -= place * pull * across;
          },
          {},
          0.0};
}

Effect lateral_scrub(const RobotDesign& robot, Random, double severity) {
  const double moment = 0.6 * severity * robot.typical_torque() * robot.half_track / robot.radius;
  return {"lateral_scrub",
          {{"mu", robot.radius * moment}},
          {},
          {},
          [=](const State& state, Push& push) { push.yaw -= moment * soft_sign(state.v2, 0.01); },
          {},
          0.0};
}

}  // namespace

std::vector<Entry> friction_effects() {
  using enum Class;
  return {{"coulomb", structural, coulomb},
          {"coulomb_asymmetric", structural, coulomb_asymmetric},
          {"stribeck", structural, stribeck},
          {"viscous_asymmetric", structural, viscous_asymmetric},
          {"quadratic_drag", structural, quadratic_drag},
          {"load_friction", structural, load_friction, 4.5},
          {"friction_drift", structural, friction_drift, 1e9, false, true},
          {"caster_drag", structural, caster_drag},
          {"lateral_scrub", structural, lateral_scrub}};
}

}  // namespace wheelwright::reality
