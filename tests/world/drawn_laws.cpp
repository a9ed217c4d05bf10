// SPDX-License-Identifier: Apache-2.0
// Laws drawn from families: no two seeds have the same.
#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <numbers>

#include "tests/world/law.hpp"

namespace wheelwright::reality {
namespace {

using Bend = Increasing::Bend;

/// A sign of a speed: sharp, smooth, or that of bristles. `top` is the largest speed.
Friction drawn_sign(Random& random, double top, double deflection) {
  switch (random.below(3)) {
    case 0: return [](double speed, double) { return soft_sign(speed, creep); };
    case 1:
      return [width = top * random.log_uniform(0.005, 0.06)](double speed, double) { return soft_sign(speed, width); };
    default: return dahl(1.0, 1.0 / deflection, random.uniform(0.5, 1.6));
  }
}

/// level(|speed| / top) by a drawn sign, of size 1.
Friction drawn_dry(Random& random, double top, double deflection, const Curve& level) {
  return [level, top, sign = drawn_sign(random, top, deflection)](double speed, double step) mutable {
    return level(std::abs(speed) / top) * sign(speed, step);
  };
}

Friction rising_dry(Random& random, double top, double deflection) {
  const double least = random.uniform(0.5, 1.0);
  return drawn_dry(random, top, deflection,
                   [least, rise = Increasing(random)](double u) { return least + (1.0 - least) * rise(u); });
}

/// Friction of size 1 at each wheel.
Effect at_wheels(const Friction& friction, Pair size, Parameters parameters) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.push = [wheels = std::array<Friction, 2>{friction, friction}, size](const State& state, Push& push) mutable {
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= size[i] * wheels[i](state.speed[i], state.step);
    }
  };
  return effect;
}

/// All of `size` at one wheel, which is drawn, and `share` of it at the other.
Pair one_sided(Random& random, double size, double share) {
  return random.below(2) == right ? Pair{size, share * size} : Pair{share * size, size};
}

Effect drawn_coulomb(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.25 * severity * robot.typical_torque();
  return at_wheels(rising_dry(random, robot.wheel_speed, random.log_uniform(0.003, 0.04)), {size, size},
                   {{"level", size}});
}

Effect drawn_coulomb_asymmetric(const RobotDesign& robot, Random random, double severity) {
  const Pair size = one_sided(random, 0.35 * severity * robot.typical_torque(), random.uniform(0.0, 0.3));
  return at_wheels(rising_dry(random, robot.wheel_speed, random.log_uniform(0.003, 0.04)), size,
                   {{"level_R", size[right]}, {"level_L", size[left]}});
}

Effect drawn_stribeck(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.6 * severity * robot.typical_torque();
  const double edge = robot.wheel_speed * random.uniform(0.15, 0.4);
  return at_wheels(drawn_dry(random, edge, random.log_uniform(0.003, 0.02),
                             [fall = Increasing(random)](double u) { return 1.0 - std::min(fall(u), 1.0); }),
                   {size, size}, {{"level", size}, {"edge", edge}});
}

Friction viscous_form(Random& random, double top) {
  return [top, rise = Increasing(random)](double speed, double) {
    return std::copysign(rise(std::abs(speed) / top), speed);
  };
}

Effect drawn_viscous(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.4 * severity * robot.typical_torque();
  return at_wheels(viscous_form(random, robot.wheel_speed), {size, size}, {{"at_top_speed", size}});
}

Effect drawn_viscous_asymmetric(const RobotDesign& robot, Random random, double severity) {
  const Pair size = one_sided(random, 0.9 * severity * robot.typical_torque(), 0.0);
  return at_wheels(viscous_form(random, robot.wheel_speed), size,
                   {{"at_top_speed_R", size[right]}, {"at_top_speed_L", size[left]}});
}

Effect drawn_drag(const RobotDesign& robot, Random random, double severity) {
  const double force = 1.6 * severity * robot.typical_torque() / robot.radius;
  const double top = robot.radius * robot.wheel_speed;
  const double turning = random.uniform(0.0, 1.0);
  const auto law = [growth = Increasing(random, Bend::convex)](double u) { return u * growth(std::abs(u)); };
  Effect effect;
  effect.parameters = {{"force_N", force}};
  effect.push = [=, arm = robot.half_track](const State& state, Push& push) {
    push.forward -= force * law(state.v1 / top);
    push.yaw -= turning * force * arm * law(state.v2 * arm / top);
  };
  return effect;
}

Effect drawn_load_friction(const RobotDesign& robot, Random random, double severity) {
  const double unit = 4.0 * robot.typical_torque();
  const double driving = 0.18 * severity;
  const double driven = driving * random.uniform(1.0, 2.5);
  Effect effect;
  effect.parameters = {{"driving_loss", driving}, {"back_driving_loss", driven}};
  effect.actuate = [=, lost = Increasing(random)](const State& state, Pair& torque) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double way = soft_sign(state.speed[i], creep);
      const double load = std::abs(torque[i]);
      const double share = torque[i] * way > 0.0 ? driving : driven;
      torque[i] -= way * std::min(share * unit * lost(load / unit), 0.9 * load);
    }
  };
  return effect;
}

Effect drawn_friction_drift(const RobotDesign& robot, Random random, double severity) {
  const double level = random.uniform(0.2, 0.8) * severity * robot.typical_torque();
  const double damping = random.uniform(0.0, 1.2) * severity * robot.damping;
  Effect effect;
  effect.parameters = {{"dry", level}, {"damping", damping}};
  effect.push = [=, grown = Increasing(random)](const State& state, Push& push) {
    const double share = grown(state.t / 120.0);
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= share * (damping * state.speed[i] + level * soft_sign(state.speed[i], creep));
    }
  };
  return effect;
}

Effect drawn_caster_drag(const RobotDesign& robot, Random random, double severity) {
  const double force = 0.8 * severity * robot.typical_torque() / robot.radius;
  const double place = random.sign() * robot.half_track * random.uniform(0.7, 1.4);
  const double least = random.uniform(0.5, 1.0);
  const double top = robot.radius * robot.wheel_speed;
  Effect effect;
  effect.parameters = {{"force_N", force}, {"place_m", place}};
  effect.push = [=, rise = Increasing(random)](const State& state, Push& push) {
    const double across = place * state.v2;
    const double speed = std::max(std::hypot(state.v1, across), 0.003);
    const double pull = force * (least + (1.0 - least) * rise(speed / top)) / speed;
    push.forward -= pull * state.v1;
    push.sideways -= pull * across;
    push.yaw -= place * pull * across;
  };
  return effect;
}

Effect drawn_lateral_scrub(const RobotDesign& robot, Random random, double severity) {
  const double moment = 0.6 * severity * robot.typical_torque() * robot.half_track / robot.radius;
  const double top = robot.radius * robot.wheel_speed / robot.half_track;
  Effect effect;
  effect.parameters = {{"moment", moment}};
  effect.push = [=, friction = rising_dry(random, top, random.log_uniform(0.005, 0.04))](
                    const State& state, Push& push) mutable { push.yaw -= moment * friction(state.v2, state.step); };
  return effect;
}

/// Acts on each wheel's torque by itself, with a copy of `law` for each.
template <typename OneWheel>
Effect at_drives(Parameters parameters, OneWheel law) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.actuate = [laws = std::array<OneWheel, 2>{law, law}](const State& state, Pair& torque) mutable {
    for (std::size_t i = 0; i < 2; ++i) {
      torque[i] = laws[i](torque[i], state.step);
    }
  };
  return effect;
}

/// Mean lateness of `mean`: a part at once, the rest after `dead` and through one to three lags.
Effect late(Random& random, double mean, double direct, double dead_share) {
  const double later = mean / (1.0 - direct);
  const double dead = dead_share * later;
  std::vector<double> times(1 + random.below(3));
  double sum = 0.0;
  for (double& time : times) {
    sum += time = random.uniform(0.2, 1.0);
  }
  for (double& time : times) {
    time *= (later - dead) / sum;
  }
  return at_drives(
      {{"mean", mean}, {"dead_time", dead}, {"direct", direct}},
      [=, line = std::deque<double>(), stages = std::vector<double>(times.size())](double torque, double step) mutable {
        line.push_back(torque);
        double moved = 0.0;
        if (line.size() > static_cast<std::size_t>(std::lround(dead / step))) {
          moved = line.front();
          line.pop_front();
        }
        for (std::size_t k = 0; k < stages.size(); ++k) {
          moved = stages[k] += (1.0 - std::exp(-step / times[k])) * (moved - stages[k]);
        }
        return direct * torque + (1.0 - direct) * moved;
      });
}

Effect drawn_actuator_lag(const RobotDesign&, Random random, double severity) {
  const double direct = random.uniform(0.0, 0.4);
  return late(random, 0.035 * severity, direct, 0.0);
}

Effect drawn_delay(const RobotDesign&, Random random, double severity) {
  const double dead_share = random.uniform(0.6, 0.95);
  return late(random, 0.035 * severity, 0.0, dead_share);
}

Effect drawn_torque_deadzone(const RobotDesign& robot, Random random, double severity) {
  const double width = 0.4 * severity * robot.typical_torque();
  const double passed = width * random.uniform(0.1, 0.5);
  return at_drives({{"width", width}, {"lost", width - passed}},
                   [=, inside = Increasing(random, Bend::convex)](double torque, double) {
                     const double size = std::abs(torque);
                     return std::copysign(size < width ? passed * inside(size / width) : size - width + passed, torque);
                   });
}

Effect drawn_saturation(const RobotDesign& robot, Random random, double severity) {
  const double limit = 1.6 * robot.typical_torque() / std::max(severity, 1e-3);
  const double knee = limit * random.uniform(0.5, 1.0);
  const double reach = limit * random.uniform(2.0, 4.0);
  const double span = reach * random.uniform(0.05, 0.25);
  return at_drives({{"knee", knee}, {"most", knee + span}},
                   [=, beyond = Increasing(random, Bend::concave)](double torque, double) {
                     const double size = std::abs(torque);
                     const double over = std::clamp((size - knee) / reach, 0.0, 1.0);
                     return std::copysign(std::min(size, knee + span * beyond(over)), torque);
                   });
}

Effect drawn_battery_sag(const RobotDesign& robot, Random random, double severity) {
  const double most = 0.5 * severity;
  const double time = random.log_uniform(0.3, 30.0);
  const double unit = 6.0 * robot.typical_torque();
  Effect effect;
  effect.parameters = {{"most", most}, {"time", time}};
  effect.actuate = [=, lost = Increasing(random), level = 0.0](const State& state, Pair& torque) mutable {
    const double load = (std::abs(torque[right]) + std::abs(torque[left])) / unit;
    level += (1.0 - std::exp(-state.step / time)) * (load - level);
    const double rest = std::clamp(1.0 - most * lost(level), 0.2, 1.0);
    torque = {rest * torque[right], rest * torque[left]};
  };
  return effect;
}

/// Teeth whose force grows with their depth by a drawn curve; the encoder is on the motor's shaft or at the wheel.
Effect drawn_backlash(const RobotDesign& robot, Random random, double severity) {
  const double gap = 0.03 * severity;
  const double inertia = robot.body.armature[right];
  const double depth = random.log_uniform(0.004, 0.015);
  const double most = 2.0 * robot.typical_torque();
  const double loss = random.uniform(0.3, 2.0);
  const bool on_rotor = random.below(2) == 0;
  struct Rotor {
    Pair offset{}, speed{};
  };
  const auto rotor = std::make_shared<Rotor>();
  Effect effect;
  effect.parameters = {{"play_rad", gap}, {"encoder_on_motor", on_rotor ? 1.0 : 0.0}};
  effect.build = [](Body& body) { body.armature.fill(1e-9); };
  effect.actuate = [=, force = Increasing(random, Bend::convex)](const State& state, Pair& torque) {
    constexpr int substeps = 50;
    const double h = state.step / substeps;
    for (std::size_t i = 0; i < 2; ++i) {
      double sum = 0.0;
      for (int k = 0; k < substeps; ++k) {
        const double beyond = rotor->offset[i] - std::clamp(rotor->offset[i], -0.5 * gap, 0.5 * gap);
        const double closing = (rotor->speed[i] - state.speed[i]) * std::copysign(1.0, beyond);
        const double push = most * force(std::abs(beyond) / depth) * std::max(1.0 + loss * closing, 0.0);
        const double passed = std::copysign(push, beyond);
        rotor->speed[i] += h * (torque[i] - passed) / inertia;
        rotor->offset[i] += h * (rotor->speed[i] - state.speed[i]);
        sum += passed;
      }
      torque[i] = sum / substeps;
    }
  };
  if (on_rotor) {
    effect.measure = [rotor](const State&, Pair& speed) { speed = rotor->speed; };
  }
  return effect;
}

Effect drawn_longitudinal_slip(const RobotDesign& robot, Random random, double severity) {
  const double most = robot.typical_torque() * random.uniform(1.2, 3.0);
  const double edge = 0.05 * severity * most / robot.typical_torque() * random.uniform(1.5, 3.0);
  const double sliding = random.uniform(0.75, 1.0);
  return tyre(robot, {{"limit", most}, {"edge", edge}, {"sliding", sliding}},
              [=, grip = Increasing(random, Bend::concave)](double slip) {
                const double u = std::abs(slip) / edge;
                const double fallen = std::clamp(u - 1.0, 0.0, 1.0) * (1.0 - sliding);
                return std::copysign(most * (grip(std::min(u, 1.0)) - fallen), slip);
              });
}

Effect drawn_wheel_out_of_round(const RobotDesign& robot, Random random, double severity) {
  constexpr std::size_t harmonics = 4;
  const Pair size = one_sided(random, 0.5 * severity * robot.typical_torque(), random.uniform(0.0, 0.6));
  std::array<Pair, harmonics> weight{};
  std::array<Pair, harmonics> phase{};
  for (std::size_t k = 0; k < harmonics; ++k) {
    for (std::size_t i = 0; i < 2; ++i) {
      weight[k][i] = random.uniform(0.3, 1.0) / static_cast<double>((k + 1) * (k + 1));
      phase[k][i] = random.uniform(0.0, 2.0 * std::numbers::pi);
    }
  }
  Effect effect;
  effect.parameters = {{"size_R", size[right]}, {"size_L", size[left]}};
  effect.push = [=](const State& state, Push& push) {
    for (std::size_t i = 0; i < 2; ++i) {
      for (std::size_t k = 0; k < harmonics; ++k) {
        push.wheel[i] -= size[i] * weight[k][i] * std::cos(static_cast<double>(k + 1) * state.angle[i] + phase[k][i]);
      }
    }
  };
  return effect;
}

}  // namespace

Increasing::Increasing(Random& random, Bend bend) : smooth_(bend == Bend::any && random.below(2) == 0) {
  constexpr double steepest = 4.0;
  std::vector<Pair> pieces;  // width and rise
  double steep = 0.0;
  do {
    pieces.assign(3 + random.below(5), {});
    double width = 0.0;
    double height = 0.0;
    for (Pair& piece : pieces) {
      piece = {random.uniform(0.2, 1.0), random.log_uniform(0.05, 1.0)};
      width += piece[0];
      height += piece[1];
    }
    steep = 0.0;
    for (Pair& piece : pieces) {
      piece = {piece[0] / width, piece[1] / height};
      steep = std::max(steep, piece[1] / piece[0]);
    }
  } while (steep > steepest);
  if (bend != Bend::any) {
    std::sort(pieces.begin(), pieces.end(), [&](const Pair& a, const Pair& b) {
      return bend == Bend::convex ? a[1] * b[0] < b[1] * a[0] : a[1] * b[0] > b[1] * a[0];
    });
  }
  for (const Pair& piece : pieces) {
    x_.push_back(x_.back() + piece[0]);
    y_.push_back(y_.back() + piece[1]);
  }
  const auto slope = [&](std::size_t k) { return pieces[k][1] / pieces[k][0]; };
  slope_.push_back(slope(0));
  for (std::size_t k = 1; k < pieces.size(); ++k) {
    slope_.push_back(2.0 * slope(k - 1) * slope(k) / (slope(k - 1) + slope(k)));
  }
  slope_.push_back(slope(pieces.size() - 1));
}

double Increasing::operator()(double x) const {
  if (x >= x_.back()) {
    return y_.back() + slope_.back() * (x - x_.back());
  }
  const auto right = static_cast<std::size_t>(std::upper_bound(x_.begin(), x_.end(), x) - x_.begin());
  const std::size_t k = std::max<std::size_t>(right, 1) - 1;
  const double width = x_[k + 1] - x_[k];
  const double u = (x - x_[k]) / width;
  const double line = y_[k] + u * (y_[k + 1] - y_[k]);
  if (!smooth_) {
    return line;
  }
  const double mean = (y_[k + 1] - y_[k]) / width;
  return line + width * u * (1.0 - u) * ((1.0 - u) * (slope_[k] - mean) - u * (slope_[k + 1] - mean));
}

const std::vector<Law>& drawn_laws() {
  static const std::vector<Law> all = {
      {"coulomb", "drawn", drawn_coulomb, "a level that rises by a drawn function; sharp, smooth or bristles"},
      {"coulomb_asymmetric", "drawn", drawn_coulomb_asymmetric, "likewise, more at one wheel"},
      {"stribeck", "drawn", drawn_stribeck, "a level that falls to nothing by a drawn function"},
      {"viscous", "drawn", drawn_viscous, "a drawn function of the speed from nothing"},
      {"viscous_asymmetric", "drawn", drawn_viscous_asymmetric, "likewise, at one wheel"},
      {"quadratic_drag", "drawn", drawn_drag, "the body's speed by a drawn convex function of it"},
      {"load_friction", "drawn", drawn_load_friction, "a drawn function of the load, more when driven back"},
      {"friction_drift", "drawn", drawn_friction_drift, "dry and viscous, grown by a drawn function of time"},
      {"caster_drag", "drawn", drawn_caster_drag, "along the velocity, by a drawn function of its size"},
      {"lateral_scrub", "drawn", drawn_lateral_scrub, "a moment that rises by a drawn function of the yaw rate"},
      {"actuator_lag", "drawn", drawn_actuator_lag, "one to three lags beside a direct share"},
      {"delay", "drawn", drawn_delay, "dead time for most of it, then one to three lags"},
      {"torque_deadzone", "drawn", drawn_torque_deadzone, "a drawn convex function inside"},
      {"saturation", "drawn", drawn_saturation, "a drawn concave function beyond a knee"},
      {"battery_sag", "drawn", drawn_battery_sag, "a drawn function of the load's mean over 0.3 to 30 s"},
      {"backlash", "drawn", drawn_backlash, "teeth of a drawn convex force, encoder at motor or wheel"},
      {"longitudinal_slip", "drawn", drawn_longitudinal_slip,
       "a drawn concave function of the slip, falling when it slides"},
      {"wheel_out_of_round", "drawn", drawn_wheel_out_of_round,
       "four harmonics of the angle with drawn sizes and phases"},
  };
  return all;
}

}  // namespace wheelwright::reality
