// SPDX-License-Identifier: Apache-2.0
// Laws of drives, tyres and wheels.
#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>

#include <fmt/format.h>

#include "tests/world/law.hpp"

namespace wheelwright::reality {
namespace {

constexpr double full_turn = 2.0 * std::numbers::pi;
constexpr double mean_lag = 0.035;  // s, of a lag or a delay of severity 1

/// Acts on each wheel's torque by itself: double law(torque, state of the world, wheel), with a copy for each wheel.
template <typename OneWheel>
Effect on_torque(Parameters parameters, OneWheel law) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.actuate = [laws = std::array<OneWheel, 2>{law, law}](const State& state, Pair& torque) mutable {
    for (std::size_t i = 0; i < 2; ++i) {
      torque[i] = laws[i](torque[i], state, i);
    }
  };
  return effect;
}

/// Motors of the engine at the wheels' joints, with `attributes`.
Effect engine_motor(Parameters parameters, const std::string& attributes) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.build = [attributes](Body& body) { body.motor += " " + attributes; };
  return effect;
}

// Lags.

Effect engine_filter(const RobotDesign&, Random, double severity) {
  const double time = mean_lag * severity;
  return engine_motor({{"T", time}}, fmt::format(R"(dyntype="filter" dynprm="{}")", time));
}

Effect second_order(const RobotDesign&, Random random, double severity) {
  const double ratio = random.uniform(0.45, 1.0);
  const double rate = 2.0 * ratio / (mean_lag * severity);
  return on_torque({{"natural_rad_s", rate}, {"damping_ratio", ratio}},
                   [=, y = 0.0, dy = 0.0](double torque, const State& state, std::size_t) mutable {
                     constexpr int substeps = 10;
                     const double h = state.step / substeps;
                     for (int k = 0; k < substeps; ++k) {
                       dy = (dy + h * rate * rate * (torque - y)) / (1.0 + 2.0 * h * ratio * rate);
                       y += h * dy;
                     }
                     return y;
                   });
}

Effect rate_limit(const RobotDesign& robot, Random, double severity) {
  const double slew = 4.0 * robot.typical_torque() / std::max(severity, 1e-3);
  return on_torque({{"slew", slew}}, [=, y = 0.0](double torque, const State& state, std::size_t) mutable {
    return y += std::clamp(torque - y, -slew * state.step, slew * state.step);
  });
}

Effect lead_lag(const RobotDesign&, Random random, double severity) {
  const double direct = random.uniform(0.2, 0.45);
  const double time = mean_lag * severity / (1.0 - direct);
  return on_torque({{"direct", direct}, {"time", time}},
                   [=, y = 0.0](double torque, const State& state, std::size_t) mutable {
                     y += (1.0 - std::exp(-state.step / time)) * (torque - y);
                     return direct * torque + (1.0 - direct) * y;
                   });
}

// Delays.

/// Commands that arrive `due` after they were made, and hold until the next.
struct Line {
  std::deque<std::pair<double, double>> on_the_way;  ///< time of arrival and torque
  double held = 0.0;
  double next = 0.0;  ///< time at which a command is sent
  double operator()(double now) {
    while (!on_the_way.empty() && on_the_way.front().first <= now) {
      held = on_the_way.front().second;
      on_the_way.pop_front();
    }
    return held;
  }
};

Effect jitter(const RobotDesign&, Random random, double severity) {
  const double mean = mean_lag * severity;
  const double spread = random.uniform(0.15, 0.4) * mean;
  const double period = 0.005;
  return on_torque({{"mean", mean}, {"spread", spread}},
                   [=, line = Line(), noise = random](double torque, const State& state, std::size_t) mutable {
                     if (state.t >= line.next - 1e-9) {
                       // Messages do not overtake each other.
                       const double due = state.t + std::max(mean - 0.5 * period + spread * noise.normal(), 0.0);
                       const double last = line.on_the_way.empty() ? 0.0 : line.on_the_way.back().first;
                       line.on_the_way.emplace_back(std::max(due, last), torque);
                       line.next += period;
                     }
                     return line(state.t);
                   });
}

Effect sample_and_hold(const RobotDesign&, Random random, double severity) {
  const double dead = random.uniform(0.0, 0.5) * mean_lag * severity;
  const double period = 2.0 * (mean_lag * severity - dead);
  return on_torque({{"period", period}, {"dead_time", dead}},
                   [=, line = Line()](double torque, const State& state, std::size_t) mutable {
                     if (state.t >= line.next - 1e-9) {
                       line.on_the_way.emplace_back(state.t + dead, torque);
                       line.next += period;
                     }
                     return line(state.t);
                   });
}

Effect erlang(const RobotDesign&, Random random, double severity) {
  const auto stages = 4 + random.below(4);
  const double time = mean_lag * severity / static_cast<double>(stages);
  return on_torque({{"mean", mean_lag * severity}, {"stages", static_cast<double>(stages)}},
                   [=, y = std::vector<double>(stages)](double torque, const State& state, std::size_t) mutable {
                     const double part = 1.0 - std::exp(-state.step / time);
                     for (double& stage : y) {
                       torque = stage += part * (torque - stage);
                     }
                     return torque;
                   });
}

// Dead zones and limits.

Effect smooth_deadzone(const RobotDesign& robot, Random random, double severity) {
  const double width = 0.25 * severity * robot.typical_torque();
  const double power = random.uniform(2.0, 4.0);
  return on_torque({{"width", width}, {"power", power}}, [=](double torque, const State&, std::size_t) {
    const double size = std::abs(torque);
    return std::copysign(std::pow(std::pow(size, power) + std::pow(width, power), 1.0 / power) - width, torque);
  });
}

Effect play_deadzone(const RobotDesign& robot, Random, double severity) {
  const double width = 0.2 * severity * robot.typical_torque();
  return on_torque({{"half_width", width}}, [play = PlayOperator{width}](double torque, const State&,
                                                                         std::size_t) mutable { return play(torque); });
}

Effect leaky_deadzone(const RobotDesign& robot, Random random, double severity) {
  const double width = 0.3 * severity * robot.typical_torque();
  const double inside = random.uniform(0.15, 0.45);
  return on_torque({{"width", width}, {"slope", inside}}, [=](double torque, const State&, std::size_t) {
    const double within = std::clamp(torque, -width, width);
    return torque - (1.0 - inside) * within;
  });
}

double limit_of(const RobotDesign& robot, double severity) {
  return 1.6 * robot.typical_torque() / std::max(severity, 1e-3);
}

Effect force_range(const RobotDesign& robot, Random, double severity) {
  const double limit = limit_of(robot, severity);
  return engine_motor({{"tau_max", limit}}, fmt::format(R"(forcelimited="true" forcerange="{} {}")", -limit, limit));
}

Effect soft_limit(const RobotDesign& robot, Random, double severity) {
  const double limit = 1.5 * limit_of(robot, severity);
  return on_torque({{"limit", limit}},
                   [=](double torque, const State&, std::size_t) { return limit * std::tanh(torque / limit); });
}

Effect speed_line(const RobotDesign& robot, Random random, double severity) {
  const double stall = 2.2 * limit_of(robot, severity);
  const double idle = robot.wheel_speed * random.uniform(1.05, 1.4);
  return on_torque({{"stall", stall}, {"idle_speed", idle}}, [=](double torque, const State& state, std::size_t i) {
    const double most = stall * std::clamp(1.0 - state.speed[i] / idle, 0.0, 1.0);
    const double least = -stall * std::clamp(1.0 + state.speed[i] / idle, 0.0, 1.0);
    return std::clamp(torque, least, most);
  });
}

Effect limit_table(const RobotDesign& robot, Random random, double severity) {
  const double limit = limit_of(robot, severity);
  const double first = random.uniform(0.4, 0.6);
  const double last = random.uniform(0.02, 0.15);
  const Table table{{0.0, 0.6 * limit, 1.2 * limit, 6.0 * limit},
                    {0.0, 0.6 * limit, (0.6 + 0.6 * first) * limit, (0.6 + 0.6 * first + 4.8 * last) * limit}};
  return on_torque(
      {{"knee", 0.6 * limit}, {"slope", first}, {"last_slope", last}},
      [=](double torque, const State&, std::size_t) { return std::copysign(table(std::abs(torque)), torque); });
}

// Batteries: the voltage left, as a share.

Effect battery(Parameters parameters, std::function<double(const State&, const Pair& torque)> lost) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.actuate = [lost = std::move(lost)](const State& state, Pair& torque) {
    const double rest = std::clamp(1.0 - lost(state, torque), 0.2, 1.0);
    torque[right] *= rest;
    torque[left] *= rest;
  };
  return effect;
}

double sum_of_sizes(const Pair& torque) { return std::abs(torque[right]) + std::abs(torque[left]); }

Effect sag_exponential(const RobotDesign&, Random random, double severity) {
  const double most = 0.4 * severity;
  const double time = random.uniform(15.0, 50.0);
  return battery({{"most", most}, {"time", time}},
                 [=](const State& state, const Pair&) { return most * (1.0 - std::exp(-state.t / time)); });
}

Effect sag_charge(const RobotDesign& robot, Random, double severity) {
  const double rate = 0.4 * severity / 120.0 / robot.typical_torque();
  return battery({{"rate", rate}}, [=, charge = 0.0](const State& state, const Pair& torque) mutable {
    charge += state.step * sum_of_sizes(torque);
    return rate * charge;
  });
}

Effect sag_thevenin(const RobotDesign& robot, Random random, double severity) {
  const double resistance = severity * 0.08 / robot.typical_torque();
  const double slow = resistance * random.uniform(0.7, 1.5);
  const double time = random.uniform(1.0, 6.0);
  return battery({{"R0", resistance}, {"R1", slow}, {"time", time}},
                 [=, level = 0.0](const State& state, const Pair& torque) mutable {
                   const double load = sum_of_sizes(torque);
                   level += state.step / time * (load - level);
                   return resistance * load + slow * level;
                 });
}

Effect sag_power(const RobotDesign& robot, Random, double severity) {
  const double share = 0.3 * severity / (robot.typical_torque() * robot.wheel_speed);
  return battery({{"share", share}}, [=](const State& state, const Pair& torque) {
    return share * std::max(torque[right] * state.speed[right] + torque[left] * state.speed[left], 0.0);
  });
}

// Play between rotor and wheel.

/// Inertia at a wheel of half the robot, without rotors, kg m².
double met_inertia(const RobotDesign& robot) {
  return std::max(0.5 * robot.mass * robot.radius * robot.radius - robot.body.armature[right], 1e-9);
}

/// The rotor leaves the engine's joint.
void take_rotor(Body& body) { body.armature.fill(1e-9); }

Effect joint_limits(const RobotDesign& robot, Random, double severity) {
  const double gap = 0.03 * severity;
  Effect effect;
  effect.parameters = {{"play_rad", gap}};
  effect.build = [=, inertia = robot.body.armature](Body& body) {
    std::string tendons;
    for (const auto& [name, side] : {std::pair{"right", right}, {"left", left}}) {
      body.attached += fmt::format(R"(<body><joint name="rotor_{0}" type="hinge" axis="0 1 0" armature="{1}"/>)"
                                   R"(<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/></body>
)",
                                   name, inertia[side]);
      tendons +=
          fmt::format(R"(<fixed limited="true" range="{0} {1}" solreflimit="0.004 1" solimplimit="0.95 0.99 1e-4">)"
                      R"(<joint joint="rotor_{2}" coef="1"/><joint joint="{2}" coef="-1"/></fixed>)",
                      -0.5 * gap, 0.5 * gap, name);
    }
    body.beside += "<tendon>" + tendons + "</tendon>";
    body.motor_at = "rotor_";
    take_rotor(body);
  };
  return effect;
}

/// Rigid contacts; the encoder is on the rotor's shaft or at the wheel.
Effect rigid_gear(const RobotDesign& robot, double severity, double restitution, bool on_rotor) {
  const double gap = 0.03 * severity;
  struct Side {
    Gear gear;
    double before = 0.0, passed = 0.0;
  };
  const Gear gear{gap, restitution, robot.body.armature[right], met_inertia(robot)};
  const auto sides = std::make_shared<std::array<Side, 2>>(std::array<Side, 2>{Side{gear}, Side{gear}});
  Effect effect;
  effect.parameters = {{"play_rad", gap}, {"restitution", restitution}};
  effect.build = take_rotor;
  effect.actuate = [sides](const State& state, Pair& torque) {
    for (std::size_t i = 0; i < 2; ++i) {
      Side& side = (*sides)[i];
      const double load = (state.speed[i] - side.before) / state.step - side.passed / side.gear.wheel;
      side.before = state.speed[i];
      torque[i] = side.passed = side.gear.step(torque[i], state.speed[i], load, state.step);
    }
  };
  if (on_rotor) {
    effect.measure = [sides](const State&, Pair& speed) {
      for (std::size_t i = 0; i < 2; ++i) {
        speed[i] = (*sides)[i].gear.speed;
      }
    };
  }
  return effect;
}

Effect restitution(const RobotDesign& robot, Random random, double severity) {
  return rigid_gear(robot, severity, random.uniform(0.3, 0.7), false);
}

Effect play_at_rotor(const RobotDesign& robot, Random, double severity) {
  return rigid_gear(robot, severity, 0.0, true);
}

Effect hunt_crossley(const RobotDesign& robot, Random random, double severity) {
  const double gap = 0.03 * severity;
  const double inertia = robot.body.armature[right];
  // A typical torque presses the teeth together by a few thousandths of a radian.
  const double stiffness = robot.typical_torque() / std::pow(random.log_uniform(0.002, 0.006), 1.5);
  const double loss = random.uniform(0.5, 2.0);
  struct Rotor {
    Pair offset{}, speed{};
  };
  Effect effect;
  effect.parameters = {{"play_rad", gap}, {"stiffness", stiffness}, {"loss", loss}};
  effect.build = take_rotor;
  effect.actuate = [=, rotor = Rotor()](const State& state, Pair& torque) mutable {
    constexpr int substeps = 50;
    const double h = state.step / substeps;
    for (std::size_t i = 0; i < 2; ++i) {
      double sum = 0.0;
      for (int k = 0; k < substeps; ++k) {
        const double beyond = rotor.offset[i] - std::clamp(rotor.offset[i], -0.5 * gap, 0.5 * gap);
        const double closing = (rotor.speed[i] - state.speed[i]) * std::copysign(1.0, beyond);
        const double force = stiffness * std::pow(std::abs(beyond), 1.5) * std::max(1.0 + loss * closing, 0.0);
        const double passed = std::copysign(force, beyond);
        rotor.speed[i] += h * (torque[i] - passed) / inertia;
        rotor.offset[i] += h * (rotor.speed[i] - state.speed[i]);
        sum += passed;
      }
      torque[i] = sum / substeps;
    }
  };
  return effect;
}

// Tyres.

/// Stiffness (torque at slip 1 of the straight line) and the largest torque of a tyre.
std::pair<double, double> draw_tyre(const RobotDesign& robot, Random& random, double severity) {
  return {robot.typical_torque() / (0.05 * severity), robot.typical_torque() * random.uniform(1.2, 3.0)};
}

Effect pacejka(const RobotDesign& robot, Random random, double severity) {
  const auto [stiffness, most] = draw_tyre(robot, random, severity);
  const double c = random.uniform(1.3, 1.7);
  const MagicFormula formula{stiffness / (c * most), c, most, random.uniform(-0.5, 0.5)};
  return tyre(robot, {{"B", formula.b}, {"C", c}, {"D", most}, {"E", formula.e}}, formula);
}

Effect brush(const RobotDesign& robot, Random random, double severity) {
  const auto [stiffness, most] = draw_tyre(robot, random, severity);
  return tyre(robot, {{"slope", stiffness}, {"limit", most}}, BrushTyre{stiffness, most});
}

Effect linear_sliding(const RobotDesign& robot, Random random, double severity) {
  const auto [stiffness, most] = draw_tyre(robot, random, severity);
  const double sliding = random.uniform(0.75, 1.0) * most;
  return tyre(robot, {{"slope", stiffness}, {"limit", most}, {"sliding", sliding}},
              [sliding, most = most, k = stiffness](double slip) {
                const double edge = most / k;
                const double past = std::clamp((std::abs(slip) - edge) / (2.0 * edge), 0.0, 1.0);
                return std::abs(slip) < edge ? k * slip : std::copysign(most + past * (sliding - most), slip);
              });
}

Effect contact_slip(const RobotDesign& robot, Random random, double severity) {
  // The engine's Coulomb cone: balls and wheels share the weight about equally.
  const double most = robot.typical_torque() * random.uniform(0.75, 1.1) / std::sqrt(severity);
  const double weight = 9.81 * (robot.body.chassis_mass + 2.0 * robot.body.wheel_mass);
  const double grip = most / robot.radius / (0.25 * weight);
  Effect effect;
  effect.parameters = {{"grip", grip}};
  effect.build = [grip](Body& body) { body.grip = grip; };
  return effect;
}

// Wheels that are not round.

/// One wheel, drawn, has `large`, the other up to 60 % of it.
Pair uneven(Random& random, double large) {
  const std::size_t side = random.below(2);
  Pair size{};
  size[side] = large;
  size[1 - side] = random.uniform(0.0, 0.6) * large;
  return size;
}

Effect off_centre(const RobotDesign& robot, Random random, double severity) {
  // The engine's: the tyre's centre beside the axle.
  const double weight = 9.81 * (robot.body.chassis_mass + 2.0 * robot.body.wheel_mass);
  const double large = std::min(0.4 * severity * robot.typical_torque() / (0.25 * weight), 0.2 * robot.radius);
  const Pair size = uneven(random, large);
  const Pair phase{random.uniform(0.0, full_turn), random.uniform(0.0, full_turn)};
  Effect effect;
  effect.parameters = {{"offset_R_m", size[right]}, {"offset_L_m", size[left]}};
  effect.build = [=](Body& body) {
    for (std::size_t i = 0; i < 2; ++i) {
      body.off_centre[i] = {size[i] * std::cos(phase[i]), size[i] * std::sin(phase[i])};
    }
  };
  return effect;
}

/// Torque by the angle of each wheel; the second wheel has a share of the first's.
Effect by_angle(const RobotDesign& robot, Random& random, double severity, Parameters parameters, const Curve& shape) {
  const double large = 0.5 * severity * robot.typical_torque();
  const Pair size = uneven(random, large);
  const Pair phase{random.uniform(0.0, full_turn), random.uniform(0.0, full_turn)};
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.parameters.insert(effect.parameters.end(), {{"size_R", size[right]}, {"size_L", size[left]}});
  effect.push = [=](const State& state, Push& push) {
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= size[i] * shape(state.angle[i] - phase[i]);
    }
  };
  return effect;
}

Effect two_harmonics(const RobotDesign& robot, Random random, double severity) {
  const double second = random.uniform(0.5, 1.2);
  const double turn = random.uniform(0.0, full_turn);
  return by_angle(robot, random, severity, {{"second", second}},
                  [=](double angle) { return 0.8 * (std::cos(angle) + second * std::cos(2.0 * angle - turn)); });
}

Effect flat_spot(const RobotDesign& robot, Random random, double severity) {
  // The axle goes down and up again over the flat: torque as the slope of its height.
  const double half = random.uniform(0.25, 0.6);
  return by_angle(robot, random, severity, {{"half_width_rad", half}}, [=](double angle) {
    const double place = std::remainder(angle, full_turn) / half;
    return std::abs(place) < 1.0 ? 2.5 * std::sin(std::numbers::pi * place) : 0.0;
  });
}

Effect oval(const RobotDesign& robot, Random random, double severity) {
  const double higher = random.uniform(0.2, 0.5);
  return by_angle(robot, random, severity, {{"third", higher}},
                  [=](double angle) { return std::cos(2.0 * angle) + higher * std::cos(3.0 * angle); });
}

}  // namespace

Effect tyre(const RobotDesign& robot, Parameters parameters, const Curve& grip) {
  const double inertia = robot.body.armature[right] + 0.5 * wheel_spin(robot.body);
  const double least = 0.05 * robot.wheel_speed;  // rad/s: below it the slip is a speed over this
  const auto rim = std::make_shared<Pair>();
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.build = take_rotor;
  effect.actuate = [=](const State& state, Pair& torque) {
    constexpr int substeps = 20;
    const double h = state.step / substeps;
    for (std::size_t i = 0; i < 2; ++i) {
      double& speed = (*rim)[i];
      double sum = 0.0;
      for (int k = 0; k < substeps; ++k) {
        const auto ground = [&](double w) {
          return grip((w - state.speed[i]) / std::max({std::abs(w), std::abs(state.speed[i]), least}));
        };
        const double now = ground(speed);
        const double slope = std::max((ground(speed + 1e-4) - now) / 1e-4, 0.0);
        const double change = h * (torque[i] - now) / (inertia + h * slope);
        sum += now + slope * change;
        speed += change;
      }
      torque[i] = sum / substeps;
    }
  };
  effect.measure = [rim](const State&, Pair& speed) { speed = *rim; };
  return effect;
}

std::vector<Law> drive_laws() {
  using enum Origin;
  return {
      {"actuator_lag", "filter", engine_filter, "first order: activation of the engine's actuators", engine, true},
      {"actuator_lag", "second_order", second_order, "second order, damping ratio from 0.45 to 1"},
      {"actuator_lag", "rate_limit", rate_limit, "|τ̇| limited"},
      {"actuator_lag", "lead_lag", lead_lag, "first order beside a direct share"},
      {"delay", "jitter", jitter, "messages every 5 ms that arrive late, normally spread about a mean, and are held"},
      {"delay", "hold", sample_and_hold, "sampled and held, with or without dead time; the mean is the delay"},
      {"delay", "erlang", erlang, "four to seven equal lags in a row"},
      {"torque_deadzone", "smooth", smooth_deadzone, "(|τ|^p + b^p)^(1/p) − b"},
      {"torque_deadzone", "play", play_deadzone, "play operator on the torque: a dead zone with memory"},
      {"torque_deadzone", "leaky", leaky_deadzone, "a small slope inside"},
      {"saturation", "force_range", force_range, "clipped: force range of the engine's actuators", engine, true},
      {"saturation", "tanh", soft_limit, "τ_max tanh(τ/τ_max)"},
      {"saturation", "speed_line", speed_line, "clipped at τ_stall (1 − ω/ω₀), by quadrant"},
      {"saturation", "table", limit_table, "slope 1, then about a half, then nearly nothing"},
      {"backlash", "joint_limits", joint_limits, "limits of the engine between the rotor's and the wheel's joint",
       engine},
      {"backlash", "restitution", restitution, "rigid teeth, coefficient of restitution from 0.3 to 0.7"},
      {"backlash", "play", play_at_rotor, "rigid teeth without bounce, encoder on the motor's shaft: a play operator"},
      {"backlash", "hunt_crossley", hunt_crossley, "teeth of k x^1.5 (1 + d ẋ) (Hunt and Crossley)"},
      {"battery_sag", "exponential", sag_exponential, "k (1 − exp(−t/T))"},
      {"battery_sag", "charge", sag_charge, "in proportion to the charge drawn"},
      {"battery_sag", "thevenin", sag_thevenin, "a resistance, and one more with a time constant"},
      {"battery_sag", "power", sag_power, "in proportion to the mechanical power drawn"},
      {"longitudinal_slip", "contact", contact_slip, "Coulomb's cone of the engine's contacts", engine},
      {"longitudinal_slip", "pacejka", pacejka, "magic formula of the slip, falling beyond its peak"},
      {"longitudinal_slip", "brush", brush, "brush tyre with a parabolic pressure (Fiala)"},
      {"longitudinal_slip", "linear_sliding", linear_sliding, "in proportion up to a limit, then sliding at less"},
      {"wheel_out_of_round", "off_centre", off_centre, "the engine's wheels beside their axles", engine},
      {"wheel_out_of_round", "two_harmonics", two_harmonics, "first and second harmonic of the angle"},
      {"wheel_out_of_round", "flat_spot", flat_spot, "a pulse down and up once a turn"},
      {"wheel_out_of_round", "oval", oval, "second and third harmonic, no first"},
  };
}

}  // namespace wheelwright::reality
