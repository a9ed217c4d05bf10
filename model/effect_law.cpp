// SPDX-License-Identifier: Apache-2.0
#include "model/effect_law.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/words.hpp"

namespace wheelwright::model {

DriveGeometry drive_geometry(const Robot& robot) {
  const double r = robot.wheel_radius * (1.0 + effect_value(robot, "wheel_radius", "eps"));
  const double eps = effect_value(robot, "wheel_radius_asymmetric", "eps");
  return {{r * (1.0 + eps), r * (1.0 - eps)},
          robot.track_width * (1.0 + effect_value(robot, "track_width", "eps")),
          {1.0 + effect_value(robot, "encoder_scale", "s_R"), 1.0 + effect_value(robot, "encoder_scale", "s_L")}};
}

void apply_geometry(Model& model, const Robot& robot) {
  const bool changed = std::ranges::any_of(robot.effects, [](const RobotEffect& effect) {
    return effect_law(effect.name).mechanism == EffectMechanism::geometry;
  });
  if (!changed) {
    return;
  }
  const DriveGeometry g = drive_geometry(robot);
  model.motion << 0.5 * g.radius[0], 0.5 * g.radius[1], g.radius[0] / g.track_width, -g.radius[1] / g.track_width;
  model.motion.array().rowwise() /= g.encoder_scale.transpose().array();
  model.input.array().rowwise() *= robot.wheel_radius / g.radius.transpose().array();
  for (std::size_t j = 0; j < model.p(); ++j) {
    if (model.parameters[j].dry_friction) {
      std::erase_if(model.terms, [&](const Term& term) { return term.parameter == j; });
      add_dry_friction(model, j);
    }
  }
}

namespace {

using Constants = std::array<double, 2>;

constexpr double unknown_mass = 1e6;  // kg

bool in_doubt(double x, double error) { return error > 0.0 && std::abs(x) <= error; }

// sgn x; any number in [−1, 1] where it is in doubt.
TermValue sign_of(double x, double error) {
  return in_doubt(x, error) ? TermValue{0.0, 1.0} : TermValue{core::sign(x), 0.0};
}

// constants: joint.
TermValue dry(const MotionState& s, const Constants& constants) {
  const auto j = static_cast<std::size_t>(constants[0]);
  return sign_of(s.joint_speed[j], s.joint_error[j]);
}

// constants: joint, ω_s. The slope of e^{−x²} is √(2/e) at most.
TermValue stribeck(const MotionState& s, const Constants& constants) {
  const auto j = static_cast<std::size_t>(constants[0]);
  const double w = s.joint_speed[j], error = s.joint_error[j], x = w / constants[1];
  const double value = std::exp(-x * x) * core::sign(w);
  const double smooth = std::min(1.0, std::sqrt(2.0 / std::numbers::e) * error / constants[1]);
  return in_doubt(w, error) ? TermValue{0.0, 1.0} : TermValue{value, smooth};
}

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
    for (const EffectParameterLaw& law : effect_law(effect.name).parameters_of(robot)) {
      if (law.linear && law.physical == physical && effect.parameters.contains(law.name)) {
        return {&effect, law.name, law.times_mass};
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

}  // namespace

// The model that gets the terms of one robot's effects.
class EffectTerms {
 public:
  EffectTerms(Model& to, const Robot& of) : model(to), robot(of) {
    if (on_two_wheels(robot)) {
      half_track = 0.5 * drive_geometry(robot).track_width;
      arm_ratio = robot.lever_arm_is_track ? 2.0 : 1.0;
    }
  }

  Model& model;
  const Robot& robot;
  double half_track = 0.0;  // of the geometry
  double arm_ratio = 1.0;   // k

  // θ_L gets an entry where the effect has the parameter; whether it has.
  bool parameter(const RobotEffect& effect, const char* name, Parameter p) {
    if (!effect.parameters.contains(name)) {
      return false;
    }
    const auto& known = effect_law(effect.name).parameters_of(robot);
    const auto law = std::ranges::find(known, name, &EffectParameterLaw::name);
    p.physical = law->physical;
    p.never_negative = law->lower >= 0.0;
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
};

namespace {

Parameter wheel_torque() { return torque_like("N·m", "drive both wheels in both directions"); }

void coulomb_asymmetric(EffectTerms& add, const RobotEffect& effect) {
  for (std::size_t j = 0; j < 2; ++j) {
    if (add.parameter(effect, j == 0 ? "c_R" : "c_L", wheel_torque())) {
      add.at_joint(j, {dry, {static_cast<double>(j), 0.0}});
    }
  }
}

void torque_bias(EffectTerms& add, const RobotEffect& effect) {
  for (std::size_t j = 0; j < 2; ++j) {
    if (add.parameter(effect, j == 0 ? "b_R" : "b_L", wheel_torque())) {
      add.at_joint(j, TermShape::constant);
    }
  }
}

void stribeck_of_wheels(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "c_s", torque_like("N·m", "drive slowly and fast, in both directions"));
  for (std::size_t j = 0; j < add.model.joints.size(); ++j) {
    const double scale = drive_geometry(add.robot).encoder_scale[static_cast<Eigen::Index>(j)];
    add.at_joint(j, {stribeck, {static_cast<double>(j), scale * effect.value("omega_s")}});
  }
}

void stribeck_of_axis(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "c_s", torque_like("N (rotary: N·m)", "drive slowly and fast, in both directions"));
  for (std::size_t j = 0; j < add.model.joints.size(); ++j) {
    add.at_joint(j, {stribeck, {static_cast<double>(j), effect.value("omega_s")}});
  }
}

void viscous_asymmetric(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "b", torque_like("N·m·s/rad", "drive straight and turn"));
  const double r = add.robot.wheel_radius;
  add.term(0, add.half_track / r, Term::Kind::speed, 1);
  add.term(1, add.arm_ratio * add.half_track / r, Term::Kind::speed, 0);
}

void quadratic_drag(EffectTerms& add, const RobotEffect& effect) {
  if (add.parameter(effect, "c", torque_like("N·s²/m", "drive straight at different speeds"))) {
    add.term(0, 1.0, {signed_square, {0.0, 0.0}});
  }
  if (add.parameter(effect, "c2", torque_like("N·m²·s²/rad²", "turn at different rates"))) {
    add.term(1, add.arm_ratio, {signed_square, {1.0, 0.0}});
  }
}

void quadratic_drag_of_axis(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "c", torque_like("N·s²/m² (rotary: N·m·s²/rad²)", "move at different speeds"));
  add.term(0, 1.0, {signed_square, {}});
}

void caster_drag(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "c", torque_like("N·m", "drive straight, turn, and both"));
  const double p = effect.value("p");
  add.term(0, 1.0, {caster_direction, {p, 0.0}});
  add.term(1, add.arm_ratio * p, {caster_direction, {p, 1.0}});
}

void lateral_scrub(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "mu", torque_like("N·m²", "turn to both sides"));
  add.term(1, add.arm_ratio, {yaw_sign, {}});
}

Parameter moment_of_mass(const EffectTerms& add, const char* excite) {
  return torque_like("kg·m²", excite, add.robot.wheel_radius, "kg·m");
}

void com_longitudinal(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "a", moment_of_mass(add, "drive in fast curves"));
  add.term(0, 1.0, {minus_yaw_square, {}});
  add.term(1, add.arm_ratio, {product_of_speeds, {}});
}

void com_lateral(EffectTerms& add, const RobotEffect& effect) {
  add.parameter(effect, "b", moment_of_mass(add, "accelerate and brake on straight lines"));
  add.term(0, -1.0, Term::Kind::acceleration, 1);
  add.term(1, -add.arm_ratio, Term::Kind::acceleration, 0);
}

void slope(EffectTerms& add, const RobotEffect& effect) {
  const Parameter force = torque_like("N·m", "drive straight in different directions", add.robot.wheel_radius, "N");
  if (add.parameter(effect, "g_x", force)) {
    add.term(0, 1.0, {along_x, {}});
  }
  if (add.parameter(effect, "g_y", force)) {
    add.term(0, 1.0, {along_y, {}});
  }
  add.model.heading_used = true;
}

}  // namespace

void add_effect_terms(Model& model, const Robot& robot) {
  EffectTerms terms{model, robot};
  for (const RobotEffect& effect : robot.effects) {
    const EffectLaw& law = effect_law(effect.name);
    if (const auto add = on_two_wheels(robot) ? law.add_terms : law.add_terms_of_axis) {
      add(terms, effect);
    }
  }
}

Model effect_terms(Model model, const Robot& robot) {
  model.parameters.clear();
  model.terms.clear();
  model.heading_used = false;
  add_effect_terms(model, robot);
  return model;
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

namespace {

using Parameters = std::vector<EffectParameterLaw>;

constexpr double longest_time = 10.0;  // s: of a lag, a delay, an offset
constexpr double largest_share = 0.5;  // of a radius, a track, an encoder's scale
constexpr double longest_drift = 1e6;  // s

EffectParameterLaw linear(const char* name, const char* unit) { return {name, unit, true}; }
EffectParameterLaw not_negative(const char* name, const char* unit) { return {name, unit, true, 0.0}; }
EffectParameterLaw shape(const char* name, const char* unit, double upper = core::kInfinity) {
  return {name, unit, false, 0.0, upper, true};
}
EffectParameterLaw share(const char* name) { return {name, "1", false, -largest_share, largest_share}; }
EffectParameterLaw fixed(const char* name, const char* unit) { return {name, unit, false}; }

// The quantity behind θ where it is not called after effect and parameter.
EffectParameterLaw known_as(const char* physical, EffectParameterLaw law, bool times_mass = false) {
  law.physical = physical;
  law.times_mass = times_mass;
  return law;
}

EffectParameterLaw optional(EffectParameterLaw law) {
  law.optional = true;
  return law;
}

using AddTerms = void (*)(EffectTerms&, const RobotEffect&);

Parameters named(const std::string& effect, Parameters parameters) {
  for (EffectParameterLaw& law : parameters) {
    if (law.linear && law.physical.empty()) {
      law.physical = effect + "_" + law.name;
    }
  }
  return parameters;
}

EffectLaw terms(const char* name, const char* noun, AddTerms add, Parameters parameters, AddTerms add_of_axis = nullptr,
                Parameters of_axis = {}) {
  return {.name = name,
          .noun = noun,
          .mechanism = EffectMechanism::term,
          .parameters = named(name, std::move(parameters)),
          .of_axis = named(name, std::move(of_axis)),
          .add_terms = add,
          .add_terms_of_axis = add_of_axis};
}

EffectLaw effort(const char* name, const char* noun, const Parameters& parameters, bool axis) {
  return {name, noun, EffectMechanism::effort, parameters, axis ? parameters : Parameters{}};
}

EffectLaw geometry(const char* name, const char* noun, Parameters parameters) {
  return {name, noun, EffectMechanism::geometry, std::move(parameters), {}};
}

EffectLaw simulation(const char* name, const char* noun, Parameters parameters, const char* remedy) {
  return {name, noun, EffectMechanism::simulation, std::move(parameters), {}, remedy};
}

EffectLaw coulomb_law() {
  const Parameters parameters{known_as("coulomb", not_negative("c", "N·m"))};
  EffectLaw law = terms("coulomb", "dry friction", nullptr, parameters, nullptr, parameters);
  law.of_each_wheel = "coulomb_asymmetric";
  return law;
}

std::vector<EffectLaw> make_laws() {
  return {
      coulomb_law(),
      terms("coulomb_asymmetric", "dry friction that differs between the wheels", coulomb_asymmetric,
            {not_negative("c_R", "N·m"), not_negative("c_L", "N·m")}),
      terms("stribeck", "dry friction that fades with speed", stribeck_of_wheels,
            {linear("c_s", "N·m"), shape("omega_s", "rad/s")}, stribeck_of_axis,
            {linear("c_s", "N·m"), shape("omega_s", "rad/s")}),
      terms("viscous_asymmetric", "viscous friction that differs between the wheels", viscous_asymmetric,
            {linear("b", "N·m·s/rad")}),
      terms("quadratic_drag", "drag that grows with the square of the speed", quadratic_drag,
            {linear("c", "N·s²/m"), linear("c2", "N·m²·s²/rad²")}, quadratic_drag_of_axis,
            {linear("c", "N·m·s²/rad²")}),
      terms("com_longitudinal", "a centre of mass before or behind the axle", com_longitudinal,
            {known_as("com_longitudinal_moment", linear("a", "m"), true)}),
      terms("com_lateral", "a centre of mass beside the middle", com_lateral,
            {known_as("com_lateral_moment", linear("b", "m"), true)}),
      effort("torque_gain_asymmetric", "an actuator gain that differs between the wheels", {share("g")}, false),
      terms("torque_bias", "a constant offset of the torque", torque_bias, {linear("b_R", "N·m"), linear("b_L", "N·m")},
            nullptr, {known_as("offset", linear("b", "N·m"))}),
      terms("slope", "a slope of the ground", slope,
            {known_as("slope_force_x", linear("g_x", "m/s²"), true),
             known_as("slope_force_y", linear("g_y", "m/s²"), true)}),
      effort("actuator_lag", "a lag of the actuators", {shape("T", "s", longest_time)}, true),
      effort("delay", "a delay of the torque", {shape("T_d", "s", longest_time)}, true),
      effort("sensor_time_offset", "a time offset between the sensors", {shape("dt", "s", longest_time)}, true),
      effort("torque_deadzone", "a dead zone of the actuators", {shape("b", "N·m")}, true),
      effort("saturation", "a limit of the torque", {shape("tau_max", "N·m")}, true),
      simulation(
          "backlash", "play in the gears", {shape("gap", "rad", 1.0)},
          "where a wheel stands inside its play cannot be seen from the log; leave it out of the robot file, and "
          "avoid reversals of torque in the log, or widen noise.effort"),
      simulation(
          "load_friction", "friction in proportion to the load", {{"k", "1", false, 0.0, largest_share}},
          "its regressor is the measured torque itself, whose noise it shares; leave it out of the robot file and "
          "give coulomb instead, which takes its mean part"),
      simulation(
          "battery_sag", "a sagging battery", {fixed("k", "1/s"), fixed("R_b", "1/(N·m)")},
          "the battery's charge at the start of a log is not known; leave it out of the robot file, and commission "
          "with a log of the same length and charge, or measure the current instead of the command"),
      simulation("friction_drift", "friction that falls as the drive warms up",
                 {{"k", "1", false, -1.0, 1.0}, shape("T", "s", longest_drift)},
                 "how warm the robot was at the start of a log is not known; leave it out of the robot file, and "
                 "commission with a log of the warm robot, or give wide priors of friction"),
      terms("caster_drag", "a dragging castor", caster_drag, {not_negative("c", "N·m"), shape("p", "m")}),
      terms("lateral_scrub", "scrubbing of the tyres in turns", lateral_scrub, {linear("mu", "N·m²")}),
      simulation("wheel_out_of_round", "a wheel that is out of round",
                 {fixed("A_R", "N·m"), fixed("B_R", "N·m"), fixed("A_L", "N·m"), fixed("B_L", "N·m")},
                 "the angle at which a log's encoders begin is not known; leave it out of the robot file, and let the "
                 "noise of the effort be estimated, which takes it in"),
      simulation(
          "longitudinal_slip", "slip of the wheels", {shape("stiffness", "N")},
          "the body's speed is not that of the wheels, and depends on the force; leave it out of the robot file, "
          "and commission with a log of gentle driving"),
      geometry("wheel_radius_asymmetric", "a difference between the wheel radii", {share("eps")}),
      geometry("wheel_radius", "a wheel radius other than designed", {share("eps")}),
      geometry("track_width", "a track width other than designed", {share("eps")}),
      geometry("encoder_scale", "an encoder scale other than in the robot file",
               {optional(share("s_R")), optional(share("s_L"))}),
  };
}

std::string limits_of(const EffectParameterLaw& law) {
  if (law.positive) {
    return std::isfinite(law.upper) ? "a number > 0 and at most " + std::to_string(law.upper) : "a number > 0";
  }
  if (law.lower == 0.0 && !std::isfinite(law.upper)) {
    return "a number >= 0";
  }
  return std::isfinite(law.lower) ? "a number from " + std::to_string(law.lower) + " to " + std::to_string(law.upper)
                                  : "a finite number";
}

void validate_effect(const RobotEffect& effect, const Robot& robot) {
  const EffectLaw& law = effect_law(effect.name);
  const Parameters& known = law.parameters_of(robot);
  check::that(!known.empty(), "effects." + effect.name,
              "an effect of the model " + robot.model + ", one of " + core::listed(effect_names(robot)));
  for (const auto& [name, interval] : effect.parameters) {
    const std::string where = "effects." + effect.name + "." + name;
    const auto found = std::ranges::find(known, name, &EffectParameterLaw::name);
    std::string names;
    for (const EffectParameterLaw& parameter : known) {
      names += (names.empty() ? "" : ", ") + parameter.name;
    }
    check::that(found != known.end(), where, "one of " + names);
    check::finite(interval.lower, where);
    check::finite(interval.upper, where);
    check::that(interval.lower <= interval.upper, where, "lower <= upper");
    check::that(found->linear || interval.lower == interval.upper, where, "a single value");
    check::that(
        interval.lower >= found->lower && interval.upper <= found->upper && (!found->positive || interval.lower > 0.0),
        where, limits_of(*found));
    check::that(!found->linear || interval.lower != 0.0 || interval.upper != 0.0, where,
                "a value other than 0, or an interval");
  }
  bool any_linear = false, some_linear = false;
  for (const EffectParameterLaw& parameter : known) {
    const bool given = effect.parameters.contains(parameter.name);
    any_linear = any_linear || parameter.linear;
    some_linear = some_linear || (parameter.linear && given);
    check::that(parameter.linear || given || parameter.optional, "effects." + effect.name,
                "the parameter " + parameter.name);
  }
  check::that((!any_linear || some_linear) && !effect.parameters.empty(), "effects." + effect.name,
              "at least one parameter");
}

}  // namespace

const std::vector<EffectLaw>& effect_laws() {
  static const std::vector<EffectLaw> laws = make_laws();
  return laws;
}

const EffectLaw& effect_law(const std::string& name) {
  const auto& laws = effect_laws();
  const auto found = std::ranges::find(laws, name, &EffectLaw::name);
  std::string known;
  for (const EffectLaw& law : laws) {
    known += (known.empty() ? "" : ", ") + law.name;
  }
  check::that(found != laws.end(), "effects: '" + name + "'", "one of " + known);
  return *found;
}

std::vector<std::string> effect_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const EffectLaw& law : effect_laws()) {
    if (!law.parameters_of(robot).empty()) {
      names.push_back(law.name);
    }
  }
  return names;
}

void validate_effects(const Robot& robot) {
  for (std::size_t k = 0; k < robot.effects.size(); ++k) {
    const RobotEffect& effect = robot.effects[k];
    validate_effect(effect, robot);
    for (std::size_t i = 0; i < k; ++i) {
      check::that(robot.effects[i].name != effect.name, "effects." + effect.name, "each effect once");
    }
    const EffectMechanism mechanism = effect_law(effect.name).mechanism;
    check::that(mechanism == EffectMechanism::geometry || effort_per_torque(robot).has_value(),
                "effects." + effect.name, "effort as torque, or the motor's constants, to make effort of it");
  }
  for (const RobotEffect& effect : robot.effects) {
    const std::string& each = effect_law(effect.name).of_each_wheel;
    check::that(!has_effect(robot, each), "effects",
                effect.name + " or " + each + ", not both: they say the same of equal wheels");
  }
}

bool has_effect(const Robot& robot, const std::string& name) {
  return std::ranges::find(robot.effects, name, &RobotEffect::name) != robot.effects.end();
}

double effect_value(const Robot& robot, const std::string& effect, const std::string& parameter) {
  const auto found = std::ranges::find(robot.effects, effect, &RobotEffect::name);
  return found != robot.effects.end() && found->parameters.contains(parameter) ? found->value(parameter) : 0.0;
}

}  // namespace wheelwright::model
