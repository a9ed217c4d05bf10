// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/improved_robot.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/model/effect_law.hpp>

namespace wheelwright {
namespace {

constexpr double kWider = 3.0;        // times a 95 % interval's half width: a prior
constexpr double kMotorShare = 0.01;  // of a wheel's share of the mass, as the simulator's backlash has it

// The name in θ of a linear parameter of an effect, as effect_terms.hpp has it.
std::string physical_name(const Robot& robot, const std::string& effect, const std::string& parameter) {
  if (effect == "coulomb") {
    return "coulomb";
  }
  if (effect == "torque_bias" && robot.model == "single_axis") {
    return "offset";
  }
  if (effect == "com_longitudinal" || effect == "com_lateral") {
    return effect + "_moment";
  }
  return effect + (effect != "slope" ? "_" + parameter : parameter == "g_x" ? "_force_x" : "_force_y");
}

bool times_mass(std::string_view effect) {
  return effect == "com_longitudinal" || effect == "com_lateral" || effect == "slope";
}

// Parameters of one effect that add up when the effect is there twice, to first order where they are not linear.
bool adds_up(const std::string& effect, const EffectParameterLaw& law) {
  static const std::vector<std::string> additive = {
      "actuator_lag",           "delay",         "sensor_time_offset",
      "torque_deadzone",        "load_friction", "battery_sag",
      "torque_gain_asymmetric", "encoder_scale", "wheel_radius_asymmetric",
      "wheel_out_of_round"};
  return law.linear || std::ranges::find(additive, effect) != additive.end();
}

class Improvement {
 public:
  Improvement(const Robot& robot, const Drive& drive, const Eigen::VectorXd& theta)
      : drive_(drive), theta_(theta), improved_(robot), unit_(effort_per_torque(robot).value_or(1.0)) {}

  // What changes θ and the geometry.
  void change_parameters(const FittedEffect& cause) {
    const auto c = [&](Eigen::Index k) { return k < cause.coefficients.size() ? cause.coefficients[k] : 0.0; };
    const std::string& name = cause.effect.name;
    const Eigen::Vector2d side = sides(cause);
    if (name == "payload") {
      add(axis() ? "inertia" : "mass", c(0));
      add("yaw_inertia", c(1));
    } else if (name == "viscous") {
      add(axis() ? "viscous" : "viscous_linear", c(0));
      add("viscous_yaw", c(1));
    } else if (name == "armature") {
      add_armature(2.0 * c(0));
    } else if (name == "torque_gain") {
      theta_ += c(0) * drive_.theta;
    } else if (name == "torque_gain_asymmetric") {
      excess_ = c(0) * inertia_ratio() * side;
      theta_ *= 2.0 * (1.0 + excess_[0]) * (1.0 + excess_[1]) / (2.0 + excess_.sum());
    } else if (name == "viscous_asymmetric") {
      add_damping(c(0) * side.sum());
    } else if (name == "com_longitudinal") {
      add("yaw_inertia", c(1) * drive_.physical("yaw_inertia"));
    } else if (name == "encoder_scale") {
      add_armature(c(1) * side.sum());
    } else if (name == "wheel_radius") {
      grow_wheels(1.0 + c(0));
      add_armature(2.0 * c(1));
    } else if (name == "wheel_radius_asymmetric") {
      grow_wheels(1.0 + 0.5 * c(0) * side.sum());
      add_armature(c(1) * side.sum());
    } else if (name == "track_width") {
      improved_.track_width *= 1.0 + c(0);
      scale("viscous_yaw", std::pow(1.0 + c(0), 2));
      add("yaw_inertia", c(1) * drive_.physical("yaw_inertia"));
    }
  }

  // Nominal values of the new θ; false where they are none of a robot.
  bool settle_nominal() {
    improved_ = with_nominal(improved_, drive_.model, theta_);
    for (const char* inertia : {"mass", "yaw_inertia", "inertia"}) {
      const auto found = improved_.nominal.find(inertia);
      if (found != improved_.nominal.end() && !(found->second > 0.0)) {
        return refuse("the fitted " + std::string(inertia) + " is not positive");
      }
    }
    return true;
  }

  // What becomes an effect of the robot file; false where the file cannot have it.
  bool add_effect(const FittedEffect& cause, const std::vector<Interval>& intervals) {
    const std::string& name = cause.effect.name;
    static const std::vector<std::string> nominal_only = {"payload",     "viscous",      "armature",
                                                          "torque_gain", "wheel_radius", "track_width"};
    if (std::ranges::find(nominal_only, name) != nominal_only.end()) {
      return true;
    }
    const auto& laws = effect_laws();
    const auto law = std::ranges::find(laws, name, &EffectLaw::name);
    if (law == laws.end() || law->parameters_of(improved_.model).empty()) {
      return refuse("a robot file has no effect called " + name);
    }
    cause_ = &cause;
    intervals_ = &intervals;
    law_ = &*law;
    effect_ = {name, {}};
    if (!convert()) {
      return false;
    }
    if (!effect_.parameters.empty() && !no_linear_left() && !put()) {
      return false;
    }
    return name != "wheel_radius_asymmetric" || keep_joints();
  }

  [[nodiscard]] const Robot& robot() const { return improved_; }
  [[nodiscard]] const std::string& why_not() const { return why_not_; }

 private:
  [[nodiscard]] bool axis() const { return improved_.model == "single_axis"; }
  bool refuse(std::string why) {
    why_not_ = std::move(why);
    return false;
  }

  double* find(std::string_view physical) {
    for (std::size_t j = 0; j < drive_.model.p(); ++j) {
      if (drive_.model.parameters[j].physical == physical) {
        return &theta_[static_cast<Eigen::Index>(j)];
      }
    }
    return nullptr;
  }
  // The catalogue's efforts are those of drive.theta: by so much they are larger than those of θ.
  double inertia_ratio() {
    const double mass = drive_.physical("mass");
    const double* const entry = find("mass");
    if (entry == nullptr || !(mass > 0.0) || !(*entry > 0.0)) {
      return 1.0;
    }
    return drive_.theta[entry - theta_.data()] / *entry;
  }
  void add_to_theta(std::string_view physical, double amount) {
    if (double* const entry = find(physical)) {
      *entry += amount;
    }
  }
  void add(std::string_view physical, double amount) {
    for (const Parameter& parameter : drive_.model.parameters) {
      if (parameter.physical == physical) {
        add_to_theta(physical, parameter.per_physical * amount);
      }
    }
  }
  void scale(std::string_view physical, double factor) {
    if (double* const entry = find(physical)) {
      *entry *= factor;
    }
  }

  // Inertia J (kg·m²) of all joints together: J/2 each asks for J/r v̇1 and ℓ D/2 J/r v̇2.
  void add_armature(double inertia) {
    add_to_theta("mass", inertia / drive_.wheel_radius);
    add_to_theta("yaw_inertia", 0.5 * drive_.lever_arm * drive_.track_width * inertia / drive_.wheel_radius);
  }
  void add_damping(double damping) {
    const double along = damping / drive_.wheel_radius;
    for (const char* name : {"viscous_linear", "viscous_x", "viscous_y"}) {
      add_to_theta(name, along);
    }
    add_to_theta("viscous_yaw", 0.5 * drive_.lever_arm * drive_.track_width * along);
  }
  void grow_wheels(double factor) {
    improved_.wheel_radius *= factor;
    for (const char* name : {"viscous_linear", "viscous_x", "viscous_y", "viscous_yaw"}) {
      scale(name, 1.0 / (factor * factor));
    }
  }

  [[nodiscard]] double coefficient(std::size_t k) const { return cause_->coefficients[static_cast<Eigen::Index>(k)]; }
  [[nodiscard]] double shape(std::size_t k) const { return cause_->shape[k]; }
  // What the first shape makes of a coefficient at the right and at the left wheel (catalogue_parts: side,
  // side_or_opposite).
  [[nodiscard]] static Eigen::Vector2d sides(const FittedEffect& cause) {
    const double side = cause.shape.empty() ? 0.0 : cause.shape[0];
    return side > 1.5 ? Eigen::Vector2d(1.0, -1.0) : side < 0.5 ? Eigen::Vector2d(1.0, 0.0) : Eigen::Vector2d(0.0, 1.0);
  }
  void set(const std::string& parameter, double value) { effect_.parameters[parameter] = {value, value}; }

  // The linear parameter is `factor` times the k-th coefficient.
  void linear(const std::string& parameter, std::size_t k, double factor) {
    const auto law = std::ranges::find(law_->parameters_of(improved_.model), parameter, &EffectParameterLaw::name);
    const double value = factor * coefficient(k);
    if (value == 0.0 || value < law->lower || value > law->upper) {
      return;
    }
    double half = 0.0;
    if (k < intervals_->size()) {
      half = std::max(0.5 * kWider * std::abs(factor) * ((*intervals_)[k].upper - (*intervals_)[k].lower),
                      0.5 * std::abs(value));
      half = std::min({half, value - law->lower, law->upper - value});
    }
    effect_.parameters[parameter] = {value - half, value + half};
  }

  // Without any of its linear parameters an effect does nothing.
  [[nodiscard]] bool no_linear_left() const {
    const auto& parameters = law_->parameters_of(improved_.model);
    const auto is_linear = [](const EffectParameterLaw& p) { return p.linear; };
    return std::ranges::any_of(parameters, is_linear) && std::ranges::none_of(parameters, [&](const auto& p) {
             return p.linear && effect_.parameters.contains(p.name);
           });
  }

  bool convert() {
    const std::string& name = effect_.name;
    const double per_torque = 1.0 / unit_;  // efforts are `unit_` times torques
    const double k = axis() ? 1.0 : 2.0 * drive_.lever_arm / drive_.track_width;
    const auto& parameters = law_->parameters_of(improved_.model);
    const Eigen::Vector2d side = sides(*cause_);
    if (name == "coulomb" || name == "coulomb_asymmetric" || name == "torque_bias") {
      for (std::size_t j = 0; j < parameters.size(); ++j) {
        linear(parameters[j].name, j, per_torque);
      }
    } else if (name == "stribeck") {
      linear("c_s", 0, per_torque);
      set("omega_s", shape(0));
    } else if (name == "viscous_asymmetric") {
      linear("b", 0, per_torque * (side[0] - side[1]));
    } else if (name == "quadratic_drag") {
      linear("c", 0, per_torque);
      if (!axis()) {
        linear("c2", 1, per_torque / k);
      }
    } else if (times_mass(name)) {
      if (find("mass") == nullptr) {
        return refuse(name + " needs a model with the mass in it");
      }
      const double ratio = drive_.physical("mass") / improved_.nominal.at("mass");
      for (std::size_t j = 0; j < parameters.size(); ++j) {
        linear(parameters[j].name, j, ratio);
      }
    } else if (name == "caster_drag") {
      linear("c", 0, per_torque);
      set("p", shape(0));
    } else if (name == "lateral_scrub") {
      linear("mu", 0, per_torque / k);
    } else {
      return convert_fixed();
    }
    return true;
  }

  bool convert_fixed() {
    const std::string& name = effect_.name;
    const std::string first = law_->parameters_of(improved_.model).front().name;
    if (name == "actuator_lag" || name == "delay") {
      set(first, shape(0));
    } else if (name == "sensor_time_offset") {
      if (!(shape(0) > 0.0)) {
        return refuse("the speeds are early: a robot file can only have them late");
      }
      set(first, shape(0));
    } else if (name == "saturation") {
      set(first, shape(0) / unit_);
    } else if (name == "torque_deadzone" || name == "load_friction") {
      if (coefficient(0) > 0.0) {
        set(first, name == "load_friction" ? coefficient(0) : coefficient(0) / unit_);
      }
    } else if (name == "torque_gain_asymmetric") {
      set(first, (excess_[1] - excess_[0]) / (2.0 + excess_.sum()));
    } else if (name == "wheel_radius_asymmetric") {
      const Eigen::Vector2d e = coefficient(0) * sides(*cause_);
      set(first, (e[0] - e[1]) / (2.0 + e.sum()));
    } else if (name == "encoder_scale") {
      const Eigen::Vector2d e = coefficient(0) * sides(*cause_);
      set("s_R", -e[0] / (1.0 + e[0]));
      set("s_L", -e[1] / (1.0 + e[1]));
    } else if (name == "battery_sag") {
      convert_sag();
    } else if (name == "longitudinal_slip") {
      set(first, shape(0) / unit_);
    } else if (name == "wheel_out_of_round") {
      for (std::size_t j = 0; j < cause_->effect.parameters.size(); ++j) {
        if (!cause_->effect.parameters[j].beside) {
          set(cause_->effect.parameters[j].name, coefficient(j) / unit_);
        }
      }
    } else if (name == "friction_drift") {
      return convert_drift();
    } else if (name == "backlash") {
      return convert_backlash();
    } else {
      return refuse("there is no rule yet by which " + name + " becomes an effect of a robot file");
    }
    return true;
  }

  // Equal friction in the joints of unequal wheels turns the robot: Σ b ω_j/r_j has the cross term −2 b (e_R − e_L) D/2
  // /r² between forward and yaw, which is what viscous_asymmetric has; b = r θ_f1/2.
  bool keep_joints() {
    const double* const viscous = find("viscous_linear");
    const Eigen::Vector2d e = coefficient(0) * sides(*cause_);
    const double b = viscous != nullptr ? -drive_.wheel_radius * *viscous * (e[0] - e[1]) / unit_ : 0.0;
    // Inertia of the joints, J_R − J_L more at the right: −r m b = (J_R − J_L) D/(2 r), as of a centre of mass at b.
    const Eigen::Vector2d inertia = coefficient(1) * sides(*cause_);
    const double offset = find("mass") == nullptr
                              ? 0.0
                              : -(inertia[0] - inertia[1]) / unit_ * drive_.track_width /
                                    (2.0 * std::pow(drive_.wheel_radius, 2) * improved_.nominal.at("mass"));
    return put_also("viscous_asymmetric", b) && put_also("com_lateral", offset);
  }
  bool put_also(const std::string& name, double b) {
    if (b == 0.0) {
      return true;
    }
    effect_ = {name, {{"b", {b, b}}}};
    law_ = &effect_law(name);
    return put();
  }

  // k and R_b of the file's law, u (k t + R_b Σ|u|) at each joint for the command u, that come nearest to what was
  // fitted.
  void convert_sag() {
    const std::vector<Column> columns = cause_->effect.columns(drive_, cause_->shape);
    Eigen::VectorXd load = Eigen::VectorXd::Zero(drive_.rows());
    for (const JointSignals& joint : drive_.joints) {
      load += joint.smooth_effort.cwiseAbs();
    }
    const Eigen::VectorXd time = drive_.t.array() - drive_.t[0];
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < drive_.model.n(); ++i) {
      Eigen::VectorXd output = Eigen::VectorXd::Zero(drive_.rows());
      for (std::size_t j = 0; j < drive_.joints.size(); ++j) {
        output += drive_.model.input(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) *
                  drive_.joints[j].smooth_effort;
      }
      Eigen::MatrixX2d law(drive_.rows(), 2);
      law << output.cwiseProduct(time), output.cwiseProduct(load);
      A += law.transpose() * law;
      for (std::size_t k = 0; k < columns.size(); ++k) {
        b += coefficient(k) * (law.transpose() * columns[k].effort[i]);
      }
    }
    // What was not found (0) stays so.
    const bool both = coefficient(0) != 0.0 && coefficient(1) != 0.0;
    const Eigen::Vector2d found = both ? Eigen::Vector2d(LdltFactors(A).solve(Eigen::VectorXd(b)))
                                       : Eigen::Vector2d(b.cwiseQuotient(A.diagonal()));
    set("k", coefficient(0) != 0.0 ? found[0] : 0.0);
    set("R_b", coefficient(1) != 0.0 ? found[1] * unit_ : 0.0);
  }

  // The file's k is a share of all friction: the one that comes nearest to what was lost over the log, if it comes
  // near.
  bool convert_drift() {
    constexpr double kNear = 0.3;  // root mean square
    const double* const viscous = find("viscous_linear");
    const double slope = viscous != nullptr ? 0.5 * drive_.wheel_radius * *viscous : 0.0;
    const double dry = has_effect(improved_, "coulomb") ? unit_ * effect_value(improved_, "coulomb", "c")
                       : find("coulomb") != nullptr     ? *find("coulomb")
                                                        : 0.0;
    double both = 0.0, friction = 0.0, lost = 0.0;
    for (const JointSignals& joint : drive_.joints) {
      for (const double w : joint.smooth_speed) {
        const double whole = slope * w + std::copysign(dry, w);
        const double part = coefficient(0) * w + std::copysign(coefficient(1), w);
        both += whole * part;
        friction += whole * whole;
        lost += part * part;
      }
    }
    const double k = both / friction;
    if (!(friction > 0.0) || std::abs(k) > 1.0 || lost - k * both > kNear * kNear * lost) {
      return refuse(
          "friction_drift is a share of all of the robot's friction in a robot file, and what was lost is not");
    }
    set("k", k);
    set("T", shape(0));
    return true;
  }

  // What was found is the rotor's inertia times the play; the simulator's rotor has a set share of the wheel's load.
  bool convert_backlash() {
    if (find("mass") == nullptr) {
      return refuse("backlash needs a model with the mass in it");
    }
    const double rotor =
        kMotorShare * 0.5 * improved_.nominal.at("mass") * improved_.wheel_radius * improved_.wheel_radius;
    set("gap", std::min(shape(0) / unit_ / rotor, 1.0));
    return true;
  }

  bool put() {
    if (effect_.name == "coulomb" && has_effect(improved_, "coulomb_asymmetric")) {
      effect_ = {"coulomb_asymmetric", {{"c_R", effect_.parameters["c"]}, {"c_L", effect_.parameters["c"]}}};
      law_ = &effect_law(effect_.name);
    } else if (effect_.name == "coulomb_asymmetric" && has_effect(improved_, "coulomb")) {
      const auto same = std::ranges::find(improved_.effects, "coulomb", &RobotEffect::name);
      const Interval c = same->parameters["c"];
      *same = {"coulomb_asymmetric", {{"c_R", c}, {"c_L", c}}};
    }
    const auto there = std::ranges::find(improved_.effects, effect_.name, &RobotEffect::name);
    if (there == improved_.effects.end()) {
      improved_.effects.push_back(effect_);
      return true;
    }
    for (const auto& [name, value] : effect_.parameters) {
      const auto law = std::ranges::find(law_->parameters_of(improved_.model), name, &EffectParameterLaw::name);
      const auto [old, is_new] = there->parameters.emplace(name, value);
      if (is_new || old->second == value) {
        if (!is_new && adds_up(effect_.name, *law)) {
          old->second = {2.0 * value.lower, 2.0 * value.upper};
        }
        continue;
      }
      if (!adds_up(effect_.name, *law)) {
        return refuse("the robot has " + effect_.name + " already, with another " + name);
      }
      old->second = {old->second.lower + value.lower, old->second.upper + value.upper};
    }
    return true;
  }

  const Drive& drive_;
  Eigen::VectorXd theta_;
  Robot improved_;
  double unit_;
  Eigen::Vector2d excess_ = Eigen::Vector2d::Zero();  // of the commands, share of what θ asks for
  std::string why_not_;
  const FittedEffect* cause_ = nullptr;
  const std::vector<Interval>* intervals_ = nullptr;
  const EffectLaw* law_ = nullptr;
  RobotEffect effect_;
};

}  // namespace

Robot with_nominal(const Robot& robot, const Model& model, const Eigen::VectorXd& theta) {
  check::that(theta.size() == static_cast<Eigen::Index>(model.p()) && theta.allFinite(), "with_nominal theta",
              "p finite numbers");
  const std::vector<std::string> possible = possible_parameters(robot);
  Robot changed = robot;
  std::map<std::string, double> physical;
  for (std::size_t j = 0; j < model.p(); ++j) {
    const Parameter& parameter = model.parameters[j];
    const double value = theta[static_cast<Eigen::Index>(j)] / parameter.per_physical;
    physical[parameter.physical] = value;
    const bool of_effect = std::ranges::any_of(robot.effects, [&](const RobotEffect& effect) {
      return std::ranges::any_of(effect.parameters, [&](const auto& entry) {
        return physical_name(robot, effect.name, entry.first) == parameter.physical;
      });
    });
    if (of_effect || std::ranges::find(possible, parameter.physical) == possible.end()) {
      continue;
    }
    const bool friction = parameter.physical.starts_with("viscous") || parameter.physical == "coulomb";
    changed.nominal[parameter.physical] = friction ? std::max(value, 0.0) : value;
    if (const auto prior = changed.prior.find(parameter.physical);
        prior != changed.prior.end() && value > 0.0 && !prior->second.contains(value)) {
      prior->second = {std::min(prior->second.lower, 0.5 * value), std::max(prior->second.upper, 2.0 * value)};
    }
  }
  for (RobotEffect& effect : changed.effects) {
    for (const EffectParameterLaw& law : effect_law(effect.name).parameters_of(robot.model)) {
      const auto value = physical.find(physical_name(robot, effect.name, law.name));
      const auto entry = effect.parameters.find(law.name);
      if (!law.linear || value == physical.end() || entry == effect.parameters.end()) {
        continue;
      }
      const double number = value->second / (times_mass(effect.name) ? physical["mass"] : 1.0);
      if (std::isfinite(number) && number != 0.0 && number >= law.lower && number <= law.upper) {
        entry->second = {number, number};
      }
    }
  }
  return changed;
}

std::optional<Robot> improved_robot(const Robot& robot, const Drive& drive, const Eigen::VectorXd& theta,
                                    const std::vector<FittedEffect>& causes,
                                    const std::vector<std::vector<Interval>>& intervals, std::string& why_not) {
  check::that(theta.size() == static_cast<Eigen::Index>(drive.model.p()) && theta.allFinite(), "improved_robot theta",
              "p finite numbers");
  check::that(intervals.empty() || intervals.size() == causes.size(), "improved_robot intervals",
              "one list for each cause, or none");
  for (const FittedEffect& cause : causes) {
    check::that(cause.coefficients.size() == std::ssize(cause.effect.parameters) &&
                    cause.shape.size() == cause.effect.shapes.size(),
                "improved_robot causes: " + cause.effect.name, "a number for each parameter and shape");
  }
  Improvement improvement(robot, drive, theta);
  for (const FittedEffect& cause : causes) {
    improvement.change_parameters(cause);
  }
  bool possible = improvement.settle_nominal();
  // What others refer to comes first: a drift is a share of dry friction.
  for (const bool drift : {false, true}) {
    for (std::size_t k = 0; possible && k < causes.size(); ++k) {
      if ((causes[k].effect.name == "friction_drift") == drift) {
        possible = improvement.add_effect(causes[k], intervals.empty() ? std::vector<Interval>{} : intervals[k]);
      }
    }
  }
  if (!possible) {
    why_not = improvement.why_not();
    return std::nullopt;
  }
  try {
    static_cast<void>(make_model(improvement.robot()));
  } catch (const InvalidArgument& error) {
    why_not = error.what();
    return std::nullopt;
  }
  why_not.clear();
  return improvement.robot();
}

}  // namespace wheelwright
