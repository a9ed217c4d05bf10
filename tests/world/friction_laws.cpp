// SPDX-License-Identifier: Apache-2.0
// Laws of friction and drag.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/world/law.hpp"

namespace wheelwright::reality {
namespace {

/// Knots on [0, top] whose values go from `from` to `to` in uneven steps.
Table draw_table(Random& random, double top, double from, double to) {
  constexpr std::size_t knots = 5;
  std::array<double, knots> gaps{}, rises{};
  double width = 0.0;
  double height = 0.0;
  for (std::size_t k = 0; k < knots; ++k) {
    width += gaps[k] = random.uniform(0.3, 1.0);
    height += rises[k] = random.uniform(0.0, 1.0);
  }
  Table table{{0.0}, {from}};
  for (std::size_t k = 0; k < knots; ++k) {
    table.at.push_back(table.at.back() + top * gaps[k] / width);
    table.value.push_back(table.value.back() + (to - from) * rises[k] / height);
  }
  return table;
}

// Friction of a wheel: `size` is its largest torque, `top` the fastest wheel. Shapes are drawn.

using MakeFriction = Friction (*)(double size, double top, Random& random, Parameters& parameters);

Friction soft_dry(double size, double top, Random& random, Parameters& parameters) {
  const double width = top * random.uniform(0.02, 0.08);
  parameters.emplace_back("width", width);
  return [=](double speed, double) { return size * std::tanh(speed / width); };
}

Friction atan_dry(double size, double top, Random& random, Parameters& parameters) {
  const double width = top * random.uniform(0.01, 0.05);
  parameters.emplace_back("width", width);
  return [=](double speed, double) { return size * 2.0 / std::numbers::pi * std::atan(speed / width); };
}

Friction lugre_dry(double size, double, Random& random, Parameters& parameters) {
  const double deflection = random.log_uniform(0.003, 0.02);
  parameters.emplace_back("deflection", deflection);
  return lugre([=](double) { return size; }, size / deflection, 0.02 * size / deflection);
}

Friction dahl_dry(double size, double, Random& random, Parameters& parameters) {
  const double deflection = random.log_uniform(0.005, 0.04);
  const double exponent = std::array{0.5, 1.0, 1.5}[random.below(3)];
  parameters.insert(parameters.end(), {{"deflection", deflection}, {"exponent", exponent}});
  return dahl(size, size / deflection, exponent);
}

Friction table_dry(double size, double top, Random& random, Parameters&) {
  return static_friction(draw_table(random, 0.5 * top, random.uniform(0.5, 0.8) * size, size));
}

double draw_edge(double top, Random& random, Parameters& parameters) {
  const double edge = top * random.uniform(0.08, 0.2);
  parameters.emplace_back("edge", edge);
  return edge;
}

Friction bo_pavelescu(double size, double top, Random& random, Parameters& parameters) {
  const double edge = draw_edge(top, random, parameters);
  return static_friction([=](double speed) { return size * std::exp(-speed / edge); });
}

Friction lorentzian(double size, double top, Random& random, Parameters& parameters) {
  const double edge = draw_edge(top, random, parameters);
  return static_friction([=](double speed) { return size / (1.0 + speed * speed / (edge * edge)); });
}

Friction flat_top(double size, double top, Random& random, Parameters& parameters) {
  const double edge = 1.4 * draw_edge(top, random, parameters);
  const double exponent = random.uniform(3.0, 6.0);
  parameters.emplace_back("exponent", exponent);
  return static_friction([=](double speed) { return size * std::exp(-std::pow(speed / edge, exponent)); });
}

Friction lugre_stribeck(double size, double top, Random& random, Parameters& parameters) {
  const double edge = draw_edge(top, random, parameters);
  const double deflection = random.log_uniform(0.003, 0.015);
  const auto level = [=](double speed) { return size * (0.05 + 0.95 * std::exp(-speed * speed / (edge * edge))); };
  return lugre(level, size / deflection, 0.02 * size / deflection);
}

Friction falling_table(double size, double top, Random& random, Parameters&) {
  return static_friction(draw_table(random, 0.45 * top, size, 0.0));
}

Friction palmgren(double size, double top, Random&, Parameters&) {
  return [=](double speed, double) {
    const double share = speed / top;
    return size * share * std::pow(share * share + 1e-6, -1.0 / 6.0);
  };
}

Friction eyring(double size, double top, Random& random, Parameters& parameters) {
  const double edge = top * random.uniform(0.08, 0.25);
  parameters.emplace_back("edge", edge);
  return [=](double speed, double) { return size * std::asinh(speed / edge) / std::asinh(top / edge); };
}

Friction thinning(double size, double top, Random& random, Parameters& parameters) {
  const double edge = top * random.uniform(0.25, 0.7);
  parameters.emplace_back("edge", edge);
  return [=](double speed, double) { return size * (1.0 + edge / top) * speed / (std::abs(speed) + edge); };
}

Friction thickening(double size, double top, Random& random, Parameters& parameters) {
  const double linear = random.uniform(0.3, 0.6);
  parameters.emplace_back("linear_share", linear);
  return [=](double speed, double) {
    const double share = speed / top;
    return size * (linear * share + (1.0 - linear) * share * share * share);
  };
}

/// `make` on the right and left wheel with these sizes; both have the same shape.
Effect on_wheels(MakeFriction make, const RobotDesign& robot, Random random, double right_size, double left_size) {
  Effect effect;
  effect.parameters = {{"level_R", right_size}, {"level_L", left_size}};
  Random again = random;
  Parameters ignored;
  std::array<Friction, 2> wheels{make(right_size, robot.wheel_speed, random, effect.parameters),
                                 make(left_size, robot.wheel_speed, again, ignored)};
  effect.push = [wheels](const State& state, Push& push) mutable {
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= wheels[i](state.speed[i], state.step);
    }
  };
  return effect;
}

/// Equal on both wheels, `percent` of the typical torque at severity 1.
template <MakeFriction make, int percent>
Effect on_both(const RobotDesign& robot, Random random, double severity) {
  const double size = 0.01 * percent * severity * robot.typical_torque();
  return on_wheels(make, robot, random, size, size);
}

/// On one wheel, and up to `least` of it on the other.
template <MakeFriction make, int percent, int least>
Effect on_one(const RobotDesign& robot, Random random, double severity) {
  const double large = 0.01 * percent * severity * robot.typical_torque();
  const double small = std::max(0.01 * least * random.uniform(0.0, 1.0), 1e-6) * large;
  const bool on_right = random.sign() > 0.0;
  return on_wheels(make, robot, random, on_right ? large : small, on_right ? small : large);
}

Effect joint_friction(const RobotDesign& robot, Random, double severity) {
  const double c = 0.25 * severity * robot.typical_torque();
  Effect effect;
  effect.parameters = {{"c", c}};
  effect.build = [c](Body& body) {
    body.friction[right] += c;
    body.friction[left] += c;
  };
  return effect;
}

Effect joint_damping(const RobotDesign& robot, Random, double severity) {
  const double more = 0.5 * severity * robot.typical_torque() / robot.wheel_speed;
  Effect effect;
  effect.parameters = {{"damping", more}};
  effect.build = [more](Body& body) {
    body.damping[right] += more;
    body.damping[left] += more;
  };
  return effect;
}

// Drag on the body.

/// Force at 1 of a drag that is `percent` of the typical traction at top speed; its yaw share is drawn.
struct BodyDrag {
  BodyDrag(const RobotDesign& robot, Random& random, double severity)
      : top(robot.radius * robot.wheel_speed),
        arm(robot.half_track),
        force(1.6 * severity * robot.typical_torque() / robot.radius),
        turning(random.uniform(0.0, 1.0)) {}

  [[nodiscard]] Effect effect(const std::function<double(double)>& law, Parameters parameters) const {
    Effect made;
    made.parameters = std::move(parameters);
    made.parameters.emplace_back("force_N", force);
    made.push = [law, self = *this](const State& state, Push& push) {
      push.forward -= self.force * law(state.v1 / self.top);
      push.yaw -= self.turning * self.force * self.arm * law(state.v2 * self.arm / self.top);
    };
    return made;
  }

  double top, arm, force, turning;
};

Effect power_drag(const RobotDesign& robot, Random random, double severity) {
  const double power = random.below(2) == 0 ? random.uniform(1.5, 1.75) : random.uniform(2.3, 2.8);
  return BodyDrag(robot, random, severity)
      .effect([=](double u) { return std::copysign(std::pow(std::abs(u), power), u); }, {{"power", power}});
}

Effect transition_drag(const RobotDesign& robot, Random random, double severity) {
  const double edge = random.uniform(0.15, 0.35);
  return BodyDrag(robot, random, severity)
      .effect([=](double u) { return u * std::max(std::abs(u) - edge, 0.0); }, {{"edge", edge}});
}

Effect wheel_churning(const RobotDesign& robot, Random, double severity) {
  const double size = 0.8 * severity * robot.typical_torque() / (robot.wheel_speed * robot.wheel_speed);
  Effect effect;
  effect.parameters = {{"churning", size}};
  effect.push = [size](const State& state, Push& push) {
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= size * state.speed[i] * std::abs(state.speed[i]);
    }
  };
  return effect;
}

Effect fluid(const RobotDesign& robot, Random, double severity) {
  // The engine's drag on the box that has the chassis' inertia: 2 ρ b_y b_z v|v|.
  const Body& b = robot.body;
  const Eigen::Vector3d half =
      (1.5 / b.chassis_mass * (Eigen::Vector3d::Constant(b.chassis_inertia.sum()) - 2.0 * b.chassis_inertia))
          .cwiseMax(1e-9)
          .cwiseSqrt();
  const double top = robot.radius * robot.wheel_speed;
  const double density =
      1.2 * severity * robot.typical_torque() / robot.radius / (2.0 * half.y() * half.z() * top * top);
  Effect effect;
  effect.parameters = {{"density", density}};
  effect.build = [density](Body& body) { body.fluid_density = density; };
  return effect;
}

// Friction by load.

/// Takes a torque from each wheel's, against its motion.
Effect by_load(double k, const std::function<double(double load)>& lost, Parameters parameters) {
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.parameters.emplace_back("share", k);
  effect.actuate = [lost, k](const State& state, Pair& torque) {
    for (std::size_t i = 0; i < 2; ++i) {
      torque[i] -= k * lost(std::abs(torque[i])) * soft_sign(state.speed[i], creep);
    }
  };
  return effect;
}

Effect gear_efficiency(const RobotDesign&, Random random, double severity) {
  const double driving = std::min(0.18 * severity, 0.9);
  const double driven = driving * random.uniform(1.5, 2.5);
  Effect effect;
  effect.parameters = {{"driving_loss", driving}, {"back_driving_loss", driven}};
  effect.actuate = [=](const State& state, Pair& torque) {
    for (std::size_t i = 0; i < 2; ++i) {
      const double way = soft_sign(state.speed[i], creep);
      torque[i] -= way * std::abs(torque[i]) * (torque[i] * way > 0.0 ? driving : driven);
    }
  };
  return effect;
}

Effect load_power(const RobotDesign& robot, Random random, double severity) {
  const double power = random.below(2) == 0 ? random.uniform(0.5, 0.75) : random.uniform(1.35, 1.7);
  const double unit = robot.typical_torque();
  return by_load(0.18 * severity, [=](double load) { return unit * std::pow(load / unit, power); }, {{"power", power}});
}

Effect load_threshold(const RobotDesign& robot, Random random, double severity) {
  const double edge = random.uniform(0.3, 0.9) * robot.typical_torque();
  return by_load(0.3 * severity, [=](double load) { return std::max(load - edge, 0.0); }, {{"edge", edge}});
}

Effect load_memory(const RobotDesign&, Random random, double severity) {
  const double time = random.uniform(0.08, 0.3);
  const double k = 0.2 * severity;
  Effect effect;
  effect.parameters = {{"share", k}, {"time", time}};
  effect.actuate = [=, level = Pair{}](const State& state, Pair& torque) mutable {
    for (std::size_t i = 0; i < 2; ++i) {
      level[i] += (1.0 - std::exp(-state.step / time)) * (std::abs(torque[i]) - level[i]);
      torque[i] -= k * level[i] * soft_sign(state.speed[i], creep);
    }
  };
  return effect;
}

// Friction that changes.

/// Friction of which `growth` says how much is there: part viscous, part dry.
Effect growing(const RobotDesign& robot, Random& random, double severity, Parameters parameters,
               std::function<double(const State&, double power)> growth) {
  const double dry = random.uniform(0.2, 0.8) * severity * robot.typical_torque();
  const double damping = random.uniform(0.0, 1.2) * severity * robot.damping;
  Effect effect;
  effect.parameters = std::move(parameters);
  effect.parameters.insert(effect.parameters.end(), {{"dry", dry}, {"damping", damping}});
  effect.push = [=, growth = std::move(growth)](const State& state, Push& push) mutable {
    const double power =
        0.5 * (std::abs(state.torque[right] * state.speed[right]) + std::abs(state.torque[left] * state.speed[left]));
    const double share = growth(state, power);
    for (std::size_t i = 0; i < 2; ++i) {
      push.wheel[i] -= share * (damping * state.speed[i] + dry * soft_sign(state.speed[i], creep));
    }
  };
  return effect;
}

Effect drift_linear(const RobotDesign& robot, Random random, double severity) {
  const double time = random.uniform(90.0, 160.0);
  return growing(robot, random, severity, {{"time", time}}, [=](const State& state, double) { return state.t / time; });
}

Effect drift_thermal(const RobotDesign& robot, Random random, double severity) {
  const double time = random.uniform(25.0, 70.0);
  const double unit = 0.15 * robot.typical_torque() * robot.wheel_speed;
  return growing(robot, random, severity, {{"time", time}}, [=, heat = 0.0](const State& state, double power) mutable {
    heat += state.step / time * (power / unit - heat);
    return heat;
  });
}

Effect drift_running_in(const RobotDesign& robot, Random random, double severity) {
  const double turns = robot.wheel_speed * random.uniform(5.0, 20.0);
  return growing(robot, random, severity, {{"angle_rad", turns}},
                 [=, rolled = 0.0](const State& state, double) mutable {
                   rolled += 0.5 * state.step * (std::abs(state.speed[right]) + std::abs(state.speed[left]));
                   return 1.0 - std::exp(-rolled / turns);
                 });
}

Effect drift_logistic(const RobotDesign& robot, Random random, double severity) {
  const double when = random.uniform(25.0, 60.0);
  const double time = random.uniform(3.0, 12.0);
  return growing(robot, random, severity, {{"when", when}, {"time", time}},
                 [=](const State& state, double) { return 0.6 / (1.0 + std::exp((when - state.t) / time)); });
}

// Casters and scrub.

/// Force of a caster at `place` before (behind) the axle.
void drag_at(double place, double forward, double sideways, Push& push) {
  push.forward -= forward;
  push.sideways -= sideways;
  push.yaw -= place * sideways;
}

struct CasterDraw {
  CasterDraw(const RobotDesign& robot, Random& random, double severity)
      : force(0.6 * severity * robot.typical_torque() / robot.radius),
        place(random.sign() * robot.half_track * random.uniform(0.7, 1.4)) {}
  [[nodiscard]] Effect effect(Parameters parameters, std::function<void(const State&, Push&)> push) const {
    Effect made;
    made.parameters = std::move(parameters);
    made.parameters.insert(made.parameters.end(), {{"force_N", force}, {"place_m", place}});
    made.push = std::move(push);
    return made;
  }
  double force, place;
};

Effect caster_swivel(const RobotDesign& robot, Random random, double severity) {
  const CasterDraw c(robot, random, severity);
  const double trail = robot.half_track * random.uniform(0.12, 0.3);
  return c.effect({{"trail_m", trail}}, [=, angle = 0.0](const State& state, Push& push) mutable {
    const double across = c.place * state.v2;
    const double along = state.v1 * std::cos(angle) + across * std::sin(angle);
    angle += state.step * ((across * std::cos(angle) - state.v1 * std::sin(angle)) / trail - state.v2);
    const double pull = c.force * soft_sign(along, 0.003);
    drag_at(c.place, pull * std::cos(angle), pull * std::sin(angle), push);
  });
}

Effect caster_two(const RobotDesign& robot, Random random, double severity) {
  const CasterDraw c(robot, random, severity);
  const double share = random.uniform(0.3, 0.7);
  const double second = -c.place * random.uniform(0.4, 1.5);
  return c.effect({{"second_place_m", second}, {"share", share}}, [=](const State& state, Push& push) {
    for (const auto& [place, part] : {std::pair{c.place, share}, std::pair{second, 1.0 - share}}) {
      const double across = place * state.v2;
      const double pull = part * c.force / std::max(std::hypot(state.v1, across), 0.003);
      drag_at(place, pull * state.v1, pull * across, push);
    }
  });
}

Effect caster_power(const RobotDesign& robot, Random random, double severity) {
  const CasterDraw c(robot, random, severity);
  const double power = random.uniform(0.25, 0.5);
  const double top = robot.radius * robot.wheel_speed;
  return c.effect({{"power", power}}, [=](const State& state, Push& push) {
    const double across = c.place * state.v2;
    const double speed = std::max(std::hypot(state.v1, across), 1e-4);
    const double pull = 1.5 * c.force * std::pow(speed / top, power) / speed;
    drag_at(c.place, pull * state.v1, pull * across, push);
  });
}

Effect caster_bristle(const RobotDesign& robot, Random random, double severity) {
  const CasterDraw c(robot, random, severity);
  const double most = random.log_uniform(0.001, 0.006);
  return c.effect({{"deflection_m", most}}, [=, x = 0.0, y = 0.0](const State& state, Push& push) mutable {
    const double across = c.place * state.v2;
    const double keep = 1.0 / (1.0 + state.step * std::hypot(state.v1, across) / most);
    x = keep * (x + state.step * state.v1);
    y = keep * (y + state.step * across);
    drag_at(c.place, c.force * x / most, c.force * y / most, push);
  });
}

Effect caster_contact(const RobotDesign& robot, Random, double severity) {
  // The engine's sliding of the casters' balls, on which about half of the weight lies.
  const double weight = 9.81 * (robot.body.chassis_mass + 2.0 * robot.body.wheel_mass);
  const double grip = 0.6 * severity * robot.typical_torque() / robot.radius / (0.5 * weight);
  Effect effect;
  effect.parameters = {{"grip", grip}};
  effect.build = [grip](Body& body) { body.caster_grip = grip; };
  return effect;
}

double scrub_moment(const RobotDesign& robot, double severity) {
  return 0.6 * severity * robot.typical_torque() * robot.half_track / robot.radius;
}

template <MakeFriction make>
Effect scrub(const RobotDesign& robot, Random random, double severity) {
  Effect effect;
  const double moment = scrub_moment(robot, severity);
  const double top = robot.radius * robot.wheel_speed / robot.half_track;
  effect.parameters = {{"moment", moment}};
  effect.push = [friction = make(moment, top, random, effect.parameters)](const State& state, Push& push) mutable {
    push.yaw -= friction(state.v2, state.step);
  };
  return effect;
}

Friction torsion_bristle(double size, double, Random& random, Parameters& parameters) {
  const double angle = random.log_uniform(0.005, 0.04);
  parameters.emplace_back("deflection", angle);
  return dahl(size, size / angle, 1.0);
}

/// A moment that depends on the share of sideways motion of the tyres' ends.
Effect scrub_side_slip(const RobotDesign& robot, Random random, double severity) {
  const double moment = 1.2 * scrub_moment(robot, severity);
  const double length = robot.half_track * random.uniform(0.5, 1.0);
  const double stiffness = random.uniform(2.0, 5.0);
  Effect effect;
  effect.parameters = {{"moment", moment}, {"length_m", length}, {"stiffness", stiffness}};
  effect.push = [=](const State& state, Push& push) {
    const double slip = std::atan2(length * state.v2, std::abs(state.v1) + 0.01);
    push.yaw -= moment * MagicFormula{stiffness / 1.4, 1.4, 1.0, 0.0}(slip);
  };
  return effect;
}

}  // namespace

std::vector<Law> friction_laws() {
  using enum Origin;
  return {
      {"coulomb", "joint", joint_friction, "c sgn ω, stiction within c: dry friction of the engine's joints", engine,
       true},
      {"coulomb", "tanh", on_both<soft_dry, 25>, "c tanh(ω/ω_s), wide"},
      {"coulomb", "atan", on_both<atan_dry, 25>, "c (2/π) atan(ω/ω_s)"},
      {"coulomb", "lugre", on_both<lugre_dry, 25>, "bristles of Canudas de Wit et al. at a constant level"},
      {"coulomb", "dahl", on_both<dahl_dry, 25>, "Dahl, exponent 0.5, 1 or 1.5"},
      {"coulomb", "table", on_both<table_dry, 25>, "level linear between knots of speed, rising"},
      {"coulomb_asymmetric", "tanh", on_one<soft_dry, 35, 30>, "c tanh(ω/ω_s), wide, by wheel"},
      {"coulomb_asymmetric", "atan", on_one<atan_dry, 35, 30>, "c (2/π) atan(ω/ω_s), by wheel"},
      {"coulomb_asymmetric", "lugre", on_one<lugre_dry, 35, 30>, "bristles at a constant level, by wheel"},
      {"coulomb_asymmetric", "dahl", on_one<dahl_dry, 35, 30>, "Dahl, by wheel"},
      {"coulomb_asymmetric", "table", on_one<table_dry, 35, 30>, "rising table, by wheel"},
      {"stribeck", "exponential", on_both<bo_pavelescu, 60>, "c exp(−|ω|/ω_s) (Bo and Pavelescu)"},
      {"stribeck", "lorentzian", on_both<lorentzian, 60>, "c/(1 + (ω/ω_s)²) (Hess and Soom)"},
      {"stribeck", "flat_top", on_both<flat_top, 60>, "c exp(−(|ω|/ω_s)^n), n from 3 to 6"},
      {"stribeck", "lugre", on_both<lugre_stribeck, 60>, "bristles at a level that falls with speed"},
      {"stribeck", "table", on_both<falling_table, 60>, "level linear between knots of speed, falling to nothing"},
      {"viscous_asymmetric", "palmgren", on_one<palmgren, 90, 0>, "b |ω|^⅔ sgn ω on one wheel (Palmgren)"},
      {"viscous_asymmetric", "eyring", on_one<eyring, 90, 0>, "b asinh(ω/ω_s) on one wheel (Eyring)"},
      {"viscous_asymmetric", "thinning", on_one<thinning, 90, 0>, "b ω/(1 + |ω|/ω_s) on one wheel"},
      {"viscous_asymmetric", "thickening", on_one<thickening, 120, 0>, "b₁ ω + b₃ ω³ on one wheel"},
      {"quadratic_drag", "fluid", fluid, "a fluid about every body, drag by the engine's inertia boxes", engine},
      {"quadratic_drag", "power", power_drag, "|v|^p, p from 1.5 to 1.75 or from 2.3 to 2.8"},
      {"quadratic_drag", "transition", transition_drag, "nothing below a speed, then v(|v| − v₀)"},
      {"quadratic_drag", "churning", wheel_churning, "ω|ω| of each wheel"},
      {"load_friction", "efficiency", gear_efficiency, "a share when driving, a larger one when driven back"},
      {"load_friction", "power", load_power, "|τ|^p sgn ω, p from 0.5 to 0.75 or from 1.35 to 1.7"},
      {"load_friction", "threshold", load_threshold, "max(|τ| − τ₀, 0) sgn ω"},
      {"load_friction", "memory", load_memory, "|τ| as it was on average a moment ago, sgn ω"},
      {"friction_drift", "linear", drift_linear, "in proportion to time"},
      {"friction_drift", "thermal", drift_thermal, "heat of the drives' power, that is lost with a time constant"},
      {"friction_drift", "running_in", drift_running_in, "1 − exp(−angle rolled)"},
      {"friction_drift", "logistic", drift_logistic, "from one level to another about a moment"},
      {"caster_drag", "contact", caster_contact, "both balls slide by the engine's contacts", engine},
      {"caster_drag", "swivel", caster_swivel, "rolling resistance of one wheel that swivels behind its pivot"},
      {"caster_drag", "two", caster_two, "dry, at two places"},
      {"caster_drag", "power", caster_power, "V^p along the velocity, p from 0.25 to 0.5"},
      {"caster_drag", "bristle", caster_bristle, "plane bristles (Dahl)"},
      {"lateral_scrub", "atan", scrub<atan_dry>, "M (2/π) atan(v₂/v_s)"},
      {"lateral_scrub", "side_slip", scrub_side_slip, "magic formula of the angle of slip atan(l v₂/|v₁|)"},
      {"lateral_scrub", "bristle", scrub<torsion_bristle>, "Dahl, by the angle turned"},
      {"lateral_scrub", "table", scrub<table_dry>, "moment linear between knots of yaw rate, rising"},
      {"viscous", "joint", joint_damping, "b ω: damping of the engine's joints", engine, true},
      {"viscous", "palmgren", on_both<palmgren, 40>, "b |ω|^⅔ sgn ω (Palmgren)"},
      {"viscous", "eyring", on_both<eyring, 40>, "b asinh(ω/ω_s) (Eyring)"},
      {"viscous", "thinning", on_both<thinning, 40>, "b ω/(1 + |ω|/ω_s)"},
      {"viscous", "thickening", on_both<thickening, 50>, "b₁ ω + b₃ ω³"},
  };
}

}  // namespace wheelwright::reality
