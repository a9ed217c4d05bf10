// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/effect_terms.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include <wheelwright/model/effect_geometry.hpp>
#include <wheelwright/model/effect_law.hpp>

namespace wheelwright {
namespace {

using Constants = std::array<double, 2>;

constexpr double unknown_mass = 1e6;  // kg

double sign(double x) { return static_cast<double>(x > 0.0) - static_cast<double>(x < 0.0); }

bool in_doubt(double x, double error) { return error > 0.0 && std::abs(x) <= error; }

// sgn x; any number in [−1, 1] where it is in doubt.
TermValue sign_of(double x, double error) { return in_doubt(x, error) ? TermValue{0.0, 1.0} : TermValue{sign(x), 0.0}; }

// constants: joint.
TermValue dry(const MotionState& s, const Constants& constants) {
  const auto j = static_cast<std::size_t>(constants[0]);
  return sign_of(s.joint_speed[j], s.joint_error[j]);
}

// constants: joint, ω_s. The slope of e^{−x²} is √(2/e) at most.
TermValue stribeck(const MotionState& s, const Constants& constants) {
  const auto j = static_cast<std::size_t>(constants[0]);
  const double w = s.joint_speed[j], error = s.joint_error[j], x = w / constants[1];
  const double value = std::exp(-x * x) * sign(w);
  const double smooth = std::min(1.0, std::sqrt(2.0 / std::numbers::e) * error / constants[1]);
  return in_doubt(w, error) ? TermValue{0.0, 1.0} : TermValue{value, smooth};
}

TermValue one(const MotionState&, const Constants&) { return {1.0, 0.0}; }

// constants: coordinate. v|v|
TermValue signed_square(const MotionState& s, const Constants& constants) {
  const auto c = static_cast<std::size_t>(constants[0]);
  const double v = s.speed[c], error = s.speed_error[c];
  return {v * std::abs(v), error * (2.0 * std::abs(v) + error)};
}

TermValue minus_yaw_square(const MotionState& s, const Constants&) {
  const double v = s.speed[1], error = s.speed_error[1];
  return {-v * v, error * (2.0 * std::abs(v) + error)};
}

TermValue product_of_speeds(const MotionState& s, const Constants&) {
  const double a = s.speed[0], b = s.speed[1], ea = s.speed_error[0], eb = s.speed_error[1];
  return {a * b, ea * std::abs(b) + eb * std::abs(a) + ea * eb};
}

TermValue yaw_sign(const MotionState& s, const Constants&) { return sign_of(s.speed[1], s.speed_error[1]); }

// |cos a − cos b| <= min(2, |a − b|), and the same for sin.
TermValue along_x(const MotionState& s, const Constants&) {
  return {std::cos(s.heading), std::min(2.0, s.heading_error)};
}
TermValue along_y(const MotionState& s, const Constants&) {
  return {std::sin(s.heading), std::min(2.0, s.heading_error)};
}

// constants: p, component. The unit vector [v1, p v2]/V: moved by e it turns by asin(e/V) <= (π/2) e/V at most.
TermValue caster_direction(const MotionState& s, const Constants& constants) {
  const double p = constants[0];
  const std::array<double, 2> along = {s.speed[0], p * s.speed[1]};
  const double v = std::hypot(along[0], along[1]), error = std::hypot(s.speed_error[0], p * s.speed_error[1]);
  const double value = v > 0.0 ? along[static_cast<std::size_t>(constants[1])] / v : 0.0;
  if (in_doubt(v, error)) {
    return {0.0, 1.0};
  }
  return {value, v > 0.0 ? std::min(2.0, 0.5 * std::numbers::pi * error / v) : 0.0};
}

// What stands behind the θ of an effect's parameter: its name, and whether the mass is in it.
struct Quantity {
  std::string physical;
  bool times_mass = false;
};

Quantity quantity(const Robot& robot, const std::string& effect, const std::string& parameter) {
  if (effect == "coulomb") {
    return {"coulomb"};
  }
  if (effect == "torque_bias" && robot.model == "single_axis") {
    return {"offset"};
  }
  if (effect == "com_longitudinal" || effect == "com_lateral") {
    return {effect + "_moment", true};
  }
  if (effect == "slope") {
    return {effect + (parameter == "g_x" ? "_force_x" : "_force_y"), true};
  }
  return {effect + "_" + parameter};
}

struct Found {
  const RobotEffect* effect = nullptr;
  std::string parameter;
  bool times_mass = false;
};

Found find(const Robot& robot, const std::string& physical) {
  for (const RobotEffect& effect : robot.effects) {
    if (effect_law(effect.name).mechanism != EffectMechanism::term) {
      continue;
    }
    for (const EffectParameterLaw& law : effect_law(effect.name).parameters_of(robot.model)) {
      const Quantity q = quantity(robot, effect.name, law.name);
      if (law.linear && q.physical == physical && effect.parameters.contains(law.name)) {
        return {&effect, law.name, q.times_mass};
      }
    }
  }
  return {};
}

Interval around(const Interval& given) {
  if (given.lower < given.upper) {
    return given;
  }
  const double v = given.lower;
  return v > 0.0 ? Interval{v / 3.0, 3.0 * v} : Interval{3.0 * v, v / 3.0};
}

Interval mass_of(const Robot& robot) {
  if (const auto prior = robot.prior.find("mass"); prior != robot.prior.end()) {
    return prior->second;
  }
  const auto nominal = robot.nominal.find("mass");
  return nominal != robot.nominal.end() ? Interval{nominal->second / 3.0, 3.0 * nominal->second}
                                        : Interval{0.0, unknown_mass};
}

Parameter torque_like(const char* unit, const char* excite, double per_physical = 1.0,
                      const char* physical_unit = nullptr) {
  Parameter p;
  p.unit = unit;
  p.physical_unit = physical_unit != nullptr ? physical_unit : unit;
  p.per_physical = per_physical;
  p.excite = excite;
  return p;
}

// Fills a model with the terms of one robot's effects.
struct Builder {
  Model& model;
  const Robot& robot;
  double half_track = 0.0;  // of the geometry
  double arm_ratio = 1.0;   // k

  // θ_L gets an entry where the effect has the parameter; whether it has.
  bool parameter(const RobotEffect& effect, const char* name, Parameter p) {
    if (!effect.parameters.contains(name)) {
      return false;
    }
    p.physical = quantity(robot, effect.name, name).physical;
    p.name = (p.per_physical == 1.0 ? "" : "r_") + p.physical;
    p.prior = *effect_prior(robot, p.physical);
    model.parameters.push_back(std::move(p));
    return true;
  }

  void term(std::size_t output, double scale, TermFunction function) {
    model.terms.push_back({.output = output,
                           .parameter = model.p() - 1,
                           .kind = Term::Kind::function,
                           .scale = scale,
                           .function = function});
  }
  void term(std::size_t output, double scale, Term::Kind kind, std::size_t coordinate) {
    model.terms.push_back(
        {.output = output, .parameter = model.p() - 1, .kind = kind, .coordinate = coordinate, .scale = scale});
  }
  // A torque at joint j reaches the outputs through the input matrix.
  void at_joint(std::size_t j, TermFunction function) {
    for (std::size_t i = 0; i < model.n(); ++i) {
      term(i, model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)), function);
    }
  }

  void friction_at_wheels(const RobotEffect& effect) {
    constexpr const char* both_ways = "drive both wheels in both directions";
    const Parameter torque = torque_like("N·m", both_ways);
    if (effect.name == "coulomb_asymmetric") {
      for (std::size_t j = 0; j < 2; ++j) {
        if (parameter(effect, j == 0 ? "c_R" : "c_L", torque)) {
          at_joint(j, {dry, {static_cast<double>(j), 0.0}});
        }
      }
    } else if (effect.name == "torque_bias") {
      for (std::size_t j = 0; j < 2; ++j) {
        if (parameter(effect, j == 0 ? "b_R" : "b_L", torque)) {
          at_joint(j, {one, {}});
        }
      }
    } else if (effect.name == "stribeck") {
      Parameter slow = torque;
      slow.excite = "drive slowly and fast, in both directions";
      const bool axis = robot.model == "single_axis";
      if (axis) {
        slow.unit = slow.physical_unit = "N (rotary: N·m)";
      }
      parameter(effect, "c_s", slow);
      for (std::size_t j = 0; j < model.joints.size(); ++j) {
        const double scale = axis ? 1.0 : drive_geometry(robot).encoder_scale[static_cast<Eigen::Index>(j)];
        at_joint(j, {stribeck, {static_cast<double>(j), scale * effect.value("omega_s")}});
      }
    }
  }

  void friction_of_motion(const RobotEffect& effect) {
    constexpr auto speed = Term::Kind::speed;
    if (effect.name == "viscous_asymmetric") {
      parameter(effect, "b", torque_like("N·m·s/rad", "drive straight and turn"));
      const double r = robot.wheel_radius;
      term(0, half_track / r, speed, 1);
      term(1, arm_ratio * half_track / r, speed, 0);
    } else if (effect.name == "quadratic_drag" && robot.model == "single_axis") {
      parameter(effect, "c", torque_like("N·s²/m² (rotary: N·m·s²/rad²)", "move at different speeds"));
      term(0, 1.0, {signed_square, {}});
    } else if (effect.name == "quadratic_drag") {
      if (parameter(effect, "c", torque_like("N·s²/m", "drive straight at different speeds"))) {
        term(0, 1.0, {signed_square, {0.0, 0.0}});
      }
      if (parameter(effect, "c2", torque_like("N·m²·s²/rad²", "turn at different rates"))) {
        term(1, arm_ratio, {signed_square, {1.0, 0.0}});
      }
    } else if (effect.name == "caster_drag") {
      parameter(effect, "c", torque_like("N·m", "drive straight, turn, and both"));
      const double p = effect.value("p");
      term(0, 1.0, {caster_direction, {p, 0.0}});
      term(1, arm_ratio * p, {caster_direction, {p, 1.0}});
    } else if (effect.name == "lateral_scrub") {
      parameter(effect, "mu", torque_like("N·m²", "turn to both sides"));
      term(1, arm_ratio, {yaw_sign, {}});
    }
  }

  void mass(const RobotEffect& effect) {
    constexpr auto acceleration = Term::Kind::acceleration;
    const double r = robot.wheel_radius;
    const Parameter moment = torque_like(
        "kg·m²", effect.name == "com_lateral" ? "accelerate and brake on straight lines" : "drive in fast curves", r,
        "kg·m");
    if (effect.name == "com_longitudinal") {
      parameter(effect, "a", moment);
      term(0, 1.0, {minus_yaw_square, {}});
      term(1, arm_ratio, {product_of_speeds, {}});
    } else if (effect.name == "com_lateral") {
      parameter(effect, "b", moment);
      term(0, -1.0, acceleration, 1);
      term(1, -arm_ratio, acceleration, 0);
    } else if (effect.name == "slope") {
      const Parameter force = torque_like("N·m", "drive straight in different directions", r, "N");
      if (parameter(effect, "g_x", force)) {
        term(0, 1.0, {along_x, {}});
      }
      if (parameter(effect, "g_y", force)) {
        term(0, 1.0, {along_y, {}});
      }
      model.heading_used = true;
    }
  }
};

}  // namespace

void add_effect_terms(Model& model, const Robot& robot) {
  Builder builder{model, robot};
  if (robot.model == "differential_drive") {
    builder.half_track = 0.5 * drive_geometry(robot).track_width;
    builder.arm_ratio = robot.lever_arm_is_track ? 2.0 : 1.0;
  }
  for (const RobotEffect& effect : robot.effects) {
    const bool own = effect.name == "coulomb" || (effect.name == "torque_bias" && robot.model == "single_axis");
    if (effect_law(effect.name).mechanism == EffectMechanism::term && !own) {
      builder.friction_at_wheels(effect);
      builder.friction_of_motion(effect);
      builder.mass(effect);
    }
  }
}

void add_dry_friction(Model& model, std::size_t parameter) {
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    for (std::size_t i = 0; i < model.n(); ++i) {
      model.terms.push_back({.output = i,
                             .parameter = parameter,
                             .kind = Term::Kind::function,
                             .scale = model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)),
                             .function = {dry, {static_cast<double>(j), 0.0}}});
    }
  }
}

std::optional<Interval> effect_prior(const Robot& robot, const std::string& physical) {
  const Found found = find(robot, physical);
  if (found.effect == nullptr) {
    return std::nullopt;
  }
  const Interval known = around(found.effect->parameters.at(found.parameter));
  return found.times_mass ? known * mass_of(robot) : known;
}

std::optional<double> effect_truth(const Robot& robot, const std::string& physical, double mass) {
  const Found found = find(robot, physical);
  if (found.effect == nullptr) {
    return std::nullopt;
  }
  return found.effect->value(found.parameter) * (found.times_mass ? mass : 1.0);
}

}  // namespace wheelwright
