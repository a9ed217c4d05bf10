// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/world/effect.hpp"

namespace wheelwright::reality {

// What lies between commanded torque and wheel.

namespace {

Effect torque_gain_asymmetric(const RobotDesign&, Random random, double severity) {
  const double gain = 1.0 + 0.25 * severity * random.sign();
  const std::size_t side = random.below(2);
  const double g = (side == right ? 1.0 : -1.0) * (gain - 1.0) / (gain + 1.0);
  return {"torque_gain_asymmetric",
          {{"g", g}, {"gain", gain}, {"side_right0_left1", static_cast<double>(side)}},
          {},
          [=](const State&, Pair& torque) { torque[side] *= gain; },
          {},
          {},
          0.0};
}

Effect torque_bias(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.2 * severity * robot.typical_torque();
  Pair bias{random.uniform(-1.0, 1.0) * size, random.uniform(-1.0, 1.0) * size};
  bias[random.below(2)] = random.sign() * size;
  return {"torque_bias",
          {{"b_R", -bias[right]}, {"b_L", -bias[left]}},
          {},
          [=](const State&, Pair& torque) {
            torque[right] += bias[right];
            torque[left] += bias[left];
          },
          {},
          {},
          0.0};
}

Effect actuator_lag(const RobotDesign&, Random, double severity) {
  const double time = 0.035 * severity;
  return {"actuator_lag",
          {{"T", time}},
          {},
          [=, behind = Pair{}](const State& state, Pair& torque) mutable {
            const double part = 1.0 - std::exp(-state.step / time);
            for (std::size_t i = 0; i < 2; ++i) {
              behind[i] += part * (torque[i] - behind[i]);
              torque[i] = behind[i];
            }
          },
          {},
          {},
          0.0};
}

Effect delay(const RobotDesign&, Random, double severity) {
  const double time = 0.035 * severity;
  return {"delay",
          {{"T_d", time}},
          {},
          [=, past = std::vector<Pair>()](const State& state, Pair& torque) mutable {
            past.push_back(torque);
            const double place = static_cast<double>(past.size() - 1) - time / state.step;
            const auto k = static_cast<std::size_t>(std::max(place, 0.0));
            const double part = std::max(place, 0.0) - static_cast<double>(k);
            const std::size_t next = std::min(k + 1, past.size() - 1);
            for (std::size_t i = 0; i < 2; ++i) {
              torque[i] = past[k][i] + part * (past[next][i] - past[k][i]);
            }
          },
          {},
          {},
          0.0};
}

Effect sensor_time_offset(const RobotDesign&, Random random, double severity) {
  const double late = random.sign() * 0.035 * severity;
  return {"sensor_time_offset", {{"dt", late}}, {}, {}, {}, {}, late};
}

Effect torque_deadzone(const RobotDesign& robot, Random, double severity) {
  const double width = 0.2 * severity * robot.typical_torque();
  return {"torque_deadzone",
          {{"b", width}},
          {},
          [=](const State&, Pair& torque) {
            for (double& value : torque) {
              value = std::copysign(std::max(std::abs(value) - width, 0.0), value);
            }
          },
          {},
          {},
          0.0};
}

Effect saturation(const RobotDesign& robot, Random, double severity) {
  // The gap grows as the limit falls.
  const double limit = 1.6 * robot.typical_torque() / std::max(severity, 1e-3);
  return {"saturation",
          {{"tau_max", limit}},
          {},
          [=](const State&, Pair& torque) {
            for (double& value : torque) {
              value = std::clamp(value, -limit, limit);
            }
          },
          {},
          {},
          0.0};
}

Effect backlash(const RobotDesign& robot, Random, double severity) {
  // The rotor runs through the gap before it meets the wheel: a mass, a gap and a stiff damped spring, in substeps.
  const double gap = 0.03 * severity;
  const double inertia = robot.body.armature[right];
  struct Rotor {
    Pair angle{}, speed{};
  };
  return {"backlash",
          {{"gap", gap}},
          [=](Body& body) { body.armature.fill(1e-9); },
          [=, rotor = Rotor()](const State& state, Pair& torque) mutable {
            constexpr int substeps = 20;
            const double h = state.step / substeps;
            // Ten steps of the world to a radian of the oscillation on the spring.
            const double stiffness = inertia / (100.0 * state.step * state.step);
            const double damping = 0.7 * inertia / (10.0 * state.step);
            for (std::size_t i = 0; i < 2; ++i) {
              double sum = 0.0;
              for (int k = 0; k < substeps; ++k) {
                const double wheel = state.angle[i] + h * k * state.speed[i];
                const double twist = rotor.angle[i] - wheel;
                const double beyond = twist - std::clamp(twist, -0.5 * gap, 0.5 * gap);
                const double rate = rotor.speed[i] - state.speed[i];
                double passed = beyond == 0.0 ? 0.0 : stiffness * beyond + damping * rate;
                passed = passed * beyond > 0.0 ? passed : 0.0;
                rotor.speed[i] += h * (torque[i] - passed) / inertia;
                rotor.angle[i] += h * rotor.speed[i];
                sum += passed;
              }
              torque[i] = sum / substeps;
            }
          },
          {},
          {},
          0.0};
}

Effect battery_sag(const RobotDesign& robot, Random random, double severity) {
  const double mix = random.uniform(0.0, 1.0);
  const double k = severity * 0.5 * mix / 120.0;
  const double resistance = severity * 0.18 * (1.0 - mix) / robot.typical_torque();
  return {"battery_sag",
          {{"k", k}, {"R_b", resistance}},
          {},
          [=](const State& state, Pair& torque) {
            const double load = std::abs(torque[right]) + std::abs(torque[left]);
            const double rest = std::max(1.0 - k * state.t - resistance * load, 0.2);
            torque[right] *= rest;
            torque[left] *= rest;
          },
          {},
          {},
          0.0};
}

}  // namespace

std::vector<Entry> actuator_effects() {
  using enum Class;
  return {{"torque_gain_asymmetric", structural, torque_gain_asymmetric, 3.0},
          {"torque_bias", structural, torque_bias},
          {"actuator_lag", structural, actuator_lag, 3.5},
          {"delay", structural, delay, 2.5},
          {"sensor_time_offset", structural, sensor_time_offset, 3.0},
          {"torque_deadzone", structural, torque_deadzone, 5.0},
          {"saturation", structural, saturation, 2.2},
          {"backlash", structural, backlash, 8.0},
          {"battery_sag", structural, battery_sag, 1.5, false, true}};
}

// Friction and drag: by the engine's joints, or as laws of their own on wheels and body.

namespace {

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
