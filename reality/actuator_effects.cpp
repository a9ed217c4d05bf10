// SPDX-License-Identifier: Apache-2.0
// What lies between commanded torque and wheel.
#include <algorithm>
#include <cmath>
#include <vector>

#include <wheelwright/reality/catalogue.hpp>

namespace wheelwright::reality {
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

}  // namespace wheelwright::reality
