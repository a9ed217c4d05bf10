// SPDX-License-Identifier: Apache-2.0
#include "gap/improved_robot.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "core/check.hpp"
#include "core/error.hpp"
#include "core/linear_algebra.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::gap {

using model::EffectParameterLaw;
using model::RobotEffect;

namespace {

constexpr double kWider = 3.0;        // times a 95 % interval's half width: a prior
constexpr double kMotorShare = 0.01;  // of a wheel's share of the mass, as the simulator's backlash has it

class Improvement {
 public:
  Improvement(const Robot& robot, const Drive& drive, const Eigen::VectorXd& theta)
      : drive_(drive), theta_(theta), improved_(robot) {}

  // What changes θ and the geometry.
  void change_parameters(const FittedEffect& cause) {
    const Way* const way = way_of(cause.effect.name);
    if (way != nullptr && way->change != nullptr && !cause.effect.free_form) {
      cause_ = &cause;
      way->change(*this);
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
    if (cause.effect.free_form) {
      return refuse("a robot file has " + name + " by one law, and what was found follows another one");
    }
    const Way* const way = way_of(name);
    if (way != nullptr && way->convert == nullptr) {
      return true;
    }
    const auto& laws = model::effect_laws();
    const std::string becomes = way != nullptr && way->becomes != nullptr ? way->becomes : name;
    const auto law = std::ranges::find(laws, becomes, &model::EffectLaw::name);
    if (law == laws.end() || law->parameters_of(improved_).empty()) {
      return refuse("a robot file has no effect called " + name);
    }
    if (way == nullptr && !same_parameters(cause.effect, *law)) {
      return refuse("there is no rule by which " + name + " becomes an effect of a robot file");
    }
    cause_ = &cause;
    intervals_ = &intervals;
    law_ = &*law;
    effect_ = {becomes, {}};
    if (way != nullptr ? !way->convert(*this) : !as_law()) {
      return false;
    }
    if (!effect_.parameters.empty() && !no_linear_left() && !put()) {
      return false;
    }
    return way == nullptr || way->beside == nullptr || way->beside(*this);
  }

  // Whether the effect `name` is a share of others.
  [[nodiscard]] static bool is_of_others(const std::string& name) {
    const Way* const way = way_of(name);
    return way != nullptr && way->of_others;
  }

  [[nodiscard]] const Robot& robot() const { return improved_; }
  [[nodiscard]] const std::string& why_not() const { return why_not_; }

 private:
  // How a cause of one name changes the robot.
  struct Way {
    void (*change)(Improvement& robot) = nullptr;   // θ and the geometry
    bool (*convert)(Improvement& robot) = nullptr;  // into an effect of the robot file; nothing: it is no effect there
    bool adds_up = false;  // its parameters add up when it is there twice, to first order where they are not linear
    bool (*beside)(Improvement& robot) = nullptr;  // what comes along with the effect
    const char* becomes = nullptr;                 // the effect of the file; nothing: that of its own name
    bool of_others = false;                        // it is a share of other effects, which have to be there
  };
  static const std::map<std::string, Way>& ways();
  static const Way* way_of(const std::string& name) {
    const auto found = ways().find(name);
    return found != ways().end() ? &found->second : nullptr;
  }

  // Whether they are as effects_by_law() makes them.
  [[nodiscard]] bool same_parameters(const Effect& effect, const model::EffectLaw& law) const {
    std::vector<std::string> of_effect, of_law;
    for (const bool is_linear : {true, false}) {
      for (const EffectParameterLaw& parameter : law.parameters_of(improved_)) {
        if (parameter.linear == is_linear) {
          of_law.push_back(parameter.name);
        }
      }
    }
    std::ranges::transform(effect.parameters, std::back_inserter(of_effect), &EffectParameter::name);
    std::ranges::transform(effect.shapes, std::back_inserter(of_effect), &ShapeParameter::name);
    return of_effect == of_law &&
           (!std::ranges::any_of(law.parameters_of(improved_), &EffectParameterLaw::times_mass) ||
            improved_.nominal.contains("mass"));
  }
  [[nodiscard]] bool axis() const { return !model::on_two_wheels(improved_); }
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
    for (const model::Parameter& parameter : drive_.model.parameters) {
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
  // Of viscous friction what acts in the joints as the cause has it, times `factor`; what acts on the body stays.
  void scale_joint_friction(std::string_view name, double factor) {
    const double on_body = catalogue::friction_on_body(cause_->effect, cause_->shape);
    scale(name, on_body + (1.0 - on_body) * factor);
  }
  void grow_wheels(double factor) {
    improved_.wheel_radius *= factor;
    for (const char* name : {"viscous_linear", "viscous_x", "viscous_y", "viscous_yaw"}) {
      scale_joint_friction(name, 1.0 / (factor * factor));
    }
  }

  [[nodiscard]] double coefficient(std::size_t k) const { return cause_->coefficients[static_cast<Eigen::Index>(k)]; }
  [[nodiscard]] double shape(std::size_t k) const { return cause_->shape[k]; }
  [[nodiscard]] static Eigen::Vector2d sides(const FittedEffect& cause) { return catalogue::side_factors(cause.shape); }
  void set(const std::string& parameter, double value) { effect_.parameters[parameter] = {value, value}; }

  // The linear parameter is `factor` times the k-th coefficient.
  void linear(const std::string& parameter, std::size_t k, double factor) {
    const auto law = std::ranges::find(law_->parameters_of(improved_), parameter, &EffectParameterLaw::name);
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
    const auto& parameters = law_->parameters_of(improved_);
    const auto is_linear = [](const EffectParameterLaw& p) { return p.linear; };
    return std::ranges::any_of(parameters, is_linear) && std::ranges::none_of(parameters, [&](const auto& p) {
             return p.linear && effect_.parameters.contains(p.name);
           });
  }

  [[nodiscard]] const std::vector<EffectParameterLaw>& known() const { return law_->parameters_of(improved_); }
  // k of effect_law.hpp.
  [[nodiscard]] double arm_ratio() const { return axis() ? 1.0 : 2.0 * drive_.lever_arm / drive_.track_width; }
  // The coefficient k; 0 where the fit has none.
  [[nodiscard]] double fitted(Eigen::Index k) const {
    return k < cause_->coefficients.size() ? cause_->coefficients[k] : 0.0;
  }
  void set_first(double value) { set(known().front().name, value); }
  bool linear_all(double factor) {
    for (std::size_t j = 0; j < known().size(); ++j) {
      linear(known()[j].name, j, factor);
    }
    return true;
  }
  // Coefficients and shapes are the law's own parameters (effects_by_law).
  bool as_law() {
    std::size_t linear_one = 0, fixed_one = 0;
    for (const EffectParameterLaw& law : known()) {
      if (law.linear) {
        const double mass = law.times_mass ? drive_.physical("mass") / improved_.nominal.at("mass") : 1.0;
        linear(law.name, linear_one++, mass);
      } else {
        set(law.name, shape(fixed_one++));
      }
    }
    return true;
  }
  bool first_shape(double factor) {
    set_first(factor * shape(0));
    return true;
  }
  bool first_if_positive(double factor) {
    if (coefficient(0) > 0.0) {
      set_first(factor * coefficient(0));
    }
    return true;
  }
  bool linear_per_mass() {
    if (find("mass") == nullptr) {
      return refuse(effect_.name + " needs a model with the mass in it");
    }
    return linear_all(drive_.physical("mass") / improved_.nominal.at("mass"));
  }
  bool out_of_round() {
    for (std::size_t j = 0; j < cause_->effect.parameters.size(); ++j) {
      if (!cause_->effect.parameters[j].beside) {
        set(cause_->effect.parameters[j].name, coefficient(j));
      }
    }
    return true;
  }

  // Equal friction in the joints of unequal wheels turns the robot: Σ b ω_j/r_j has the cross term −2 b (e_R − e_L) D/2
  // /r² between forward and yaw, which is what viscous_asymmetric has; b = r θ_f1/2.
  bool keep_joints() {
    const double* const viscous = find("viscous_linear");
    const Eigen::Vector2d e = coefficient(0) * sides(*cause_);
    const double in_joints = 1.0 - catalogue::friction_on_body(cause_->effect, cause_->shape);
    const double b = viscous != nullptr ? -drive_.wheel_radius * in_joints * *viscous * (e[0] - e[1]) : 0.0;
    // Inertia of the joints, J_R − J_L more at the right: −r m b = (J_R − J_L) D/(2 r), as of a centre of mass at b.
    const Eigen::Vector2d inertia = coefficient(1) * sides(*cause_);
    const double offset = find("mass") == nullptr
                              ? 0.0
                              : -(inertia[0] - inertia[1]) * drive_.track_width /
                                    (2.0 * std::pow(drive_.wheel_radius, 2) * improved_.nominal.at("mass"));
    return put_also("viscous_asymmetric", b) && put_also("com_lateral", offset);
  }
  bool put_also(const std::string& name, double b) {
    if (b == 0.0) {
      return true;
    }
    effect_ = {name, {{"b", {b, b}}}};
    law_ = &model::effect_law(name);
    return put();
  }

  // k and R_b of the file's law, u (k t + R_b Σ|u|) at each joint for the command u, that come nearest to what was
  // fitted.
  bool convert_sag() {
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
    const Eigen::Vector2d found = both ? Eigen::Vector2d(core::LdltFactors(A).solve(Eigen::VectorXd(b)))
                                       : Eigen::Vector2d(b.cwiseQuotient(A.diagonal()));
    set("k", coefficient(0) != 0.0 ? found[0] : 0.0);
    set("R_b", coefficient(1) != 0.0 ? found[1] : 0.0);
    return true;
  }

  // The file's k is a share of all friction: the one that comes nearest to what was lost over the log, if it comes
  // near.
  bool convert_drift() {
    constexpr double kNear = 0.3;  // root mean square
    const double* const viscous = find("viscous_linear");
    const double slope = viscous != nullptr ? 0.5 * drive_.wheel_radius * *viscous : 0.0;
    const double dry = model::has_effect(improved_, "coulomb") ? model::effect_value(improved_, "coulomb", "c")
                       : find("coulomb") != nullptr            ? *find("coulomb")
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
    set("gap", std::min(shape(0) / rotor, 1.0));
    return true;
  }

  // The same value at the right and at the left wheel.
  [[nodiscard]] RobotEffect of_each_wheel(const RobotEffect& effect) const {
    RobotEffect each{model::effect_law(effect.name).of_each_wheel, {}};
    for (const EffectParameterLaw& parameter : model::effect_law(each.name).parameters_of(improved_)) {
      each.parameters[parameter.name] = effect.parameters.begin()->second;
    }
    return each;
  }

  bool put() {
    if (model::has_effect(improved_, law_->of_each_wheel)) {
      effect_ = of_each_wheel(effect_);
      law_ = &model::effect_law(effect_.name);
    }
    for (RobotEffect& same : improved_.effects) {
      if (model::effect_law(same.name).of_each_wheel == effect_.name) {
        same = of_each_wheel(same);
      }
    }
    const auto there = std::ranges::find(improved_.effects, effect_.name, &RobotEffect::name);
    if (there == improved_.effects.end()) {
      improved_.effects.push_back(effect_);
      return true;
    }
    const Way* const way = way_of(effect_.name);
    for (const auto& [name, value] : effect_.parameters) {
      const auto law = std::ranges::find(law_->parameters_of(improved_), name, &EffectParameterLaw::name);
      const bool adds_up = law->linear || (way != nullptr && way->adds_up);
      const auto [old, is_new] = there->parameters.emplace(name, value);
      if (is_new || old->second == value) {
        if (!is_new && adds_up) {
          old->second = {2.0 * value.lower, 2.0 * value.upper};
        }
        continue;
      }
      if (!adds_up) {
        return refuse("the robot has " + effect_.name + " already, with another " + name);
      }
      old->second = {old->second.lower + value.lower, old->second.upper + value.upper};
    }
    return true;
  }

  const Drive& drive_;
  Eigen::VectorXd theta_;
  Robot improved_;
  Eigen::Vector2d excess_ = Eigen::Vector2d::Zero();  // of the commands, share of what θ asks for
  std::string why_not_;
  const FittedEffect* cause_ = nullptr;
  const std::vector<Interval>* intervals_ = nullptr;
  const model::EffectLaw* law_ = nullptr;
  RobotEffect effect_;
};

const std::map<std::string, Improvement::Way>& Improvement::ways() {
  using I = Improvement;
  static const std::map<std::string, Way> all = {
      {"payload",
       {.change =
            [](I& r) {
              r.add(r.axis() ? "inertia" : "mass", r.fitted(0));
              r.add("yaw_inertia", r.fitted(1));
            }}},
      {"payload_offset",
       {.change =
            [](I& r) {
              r.add("mass", r.fitted(0));
              r.add("yaw_inertia", r.fitted(1));
            },
        .convert =
            [](I& r) {
              r.linear("a", 2, 1.0 / r.improved_.nominal.at("mass"));
              return true;
            },
        .becomes = "com_longitudinal"}},
      {"viscous",
       {.change =
            [](I& r) {
              r.add(r.axis() ? "viscous" : "viscous_linear", r.fitted(0));
              r.add("viscous_yaw", r.fitted(1));
            }}},
      {"armature", {.change = [](I& r) { r.add_armature(2.0 * r.fitted(0)); }}},
      {"torque_gain", {.change = [](I& r) { r.theta_ += r.fitted(0) * r.drive_.theta; }}},
      {"wheel_radius",
       {.change =
            [](I& r) {
              r.grow_wheels(1.0 + r.fitted(0));
              r.add_armature(2.0 * r.fitted(1));
            }}},
      {"track_width",
       {.change =
            [](I& r) {
              r.improved_.track_width *= 1.0 + r.fitted(0);
              r.scale_joint_friction("viscous_yaw", std::pow(1.0 + r.fitted(0), 2));
              r.add("yaw_inertia", r.fitted(1) * r.drive_.physical("yaw_inertia"));
            }}},
      {"coulomb", {.convert = [](I& r) { return r.linear_all(1.0); }}},
      {"coulomb_asymmetric", {.convert = [](I& r) { return r.linear_all(1.0); }}},
      {"torque_bias", {.convert = [](I& r) { return r.linear_all(1.0); }}},
      {"stribeck",
       {.convert =
            [](I& r) {
              r.linear("c_s", 0, 1.0);
              r.set("omega_s", r.shape(0));
              return true;
            }}},
      {"viscous_asymmetric",
       {.change = [](I& r) { r.add_damping(r.fitted(0) * sides(*r.cause_).sum()); },
        .convert =
            [](I& r) {
              const Eigen::Vector2d side = sides(*r.cause_);
              r.linear("b", 0, side[0] - side[1]);
              return true;
            }}},
      {"quadratic_drag",
       {.convert =
            [](I& r) {
              r.linear("c", 0, 1.0);
              if (!r.axis()) {
                r.linear("c2", 1, 1.0 / r.arm_ratio());
              }
              return true;
            }}},
      {"com_longitudinal",
       {.change = [](I& r) { r.add("yaw_inertia", r.fitted(1) * r.drive_.physical("yaw_inertia")); },
        .convert = [](I& r) { return r.linear_per_mass(); }}},
      {"com_lateral", {.convert = [](I& r) { return r.linear_per_mass(); }}},
      {"slope", {.convert = [](I& r) { return r.linear_per_mass(); }}},
      {"caster_drag",
       {.convert =
            [](I& r) {
              r.linear("c", 0, 1.0);
              r.set("p", r.shape(0));
              return true;
            }}},
      {"lateral_scrub",
       {.convert =
            [](I& r) {
              r.linear("mu", 0, 1.0 / r.arm_ratio());
              return true;
            }}},
      {"torque_gain_asymmetric",
       {.change =
            [](I& r) {
              r.excess_ = r.fitted(0) * r.inertia_ratio() * sides(*r.cause_);
              r.theta_ *= 2.0 * (1.0 + r.excess_[0]) * (1.0 + r.excess_[1]) / (2.0 + r.excess_.sum());
            },
        .convert =
            [](I& r) {
              r.set_first((r.excess_[1] - r.excess_[0]) / (2.0 + r.excess_.sum()));
              return true;
            },
        .adds_up = true}},
      {"actuator_lag", {.convert = [](I& r) { return r.first_shape(1.0); }, .adds_up = true}},
      {"delay", {.convert = [](I& r) { return r.first_shape(1.0); }, .adds_up = true}},
      {"sensor_time_offset",
       {.convert =
            [](I& r) {
              return r.shape(0) > 0.0 ? r.first_shape(1.0)
                                      : r.refuse("the speeds are early: a robot file can only have them late");
            },
        .adds_up = true}},
      {"saturation",
       {.convert =
            [](I& r) {
              r.set_first(r.shape(0));
              return true;
            }}},
      {"torque_deadzone",
       {.convert =
            [](I& r) {
              if (r.coefficient(0) > 0.0) {
                r.set_first(r.coefficient(0));
              }
              return true;
            },
        .adds_up = true}},
      {"load_friction", {.convert = [](I& r) { return r.first_if_positive(1.0); }, .adds_up = true}},
      {"wheel_radius_asymmetric",
       {.change =
            [](I& r) {
              const double both = sides(*r.cause_).sum();
              r.grow_wheels(1.0 + 0.5 * r.fitted(0) * both);
              r.add_armature(r.fitted(1) * both);
            },
        .convert =
            [](I& r) {
              const Eigen::Vector2d e = r.coefficient(0) * sides(*r.cause_);
              r.set_first((e[0] - e[1]) / (2.0 + e.sum()));
              return true;
            },
        .adds_up = true,
        .beside = [](I& r) { return r.keep_joints(); }}},
      {"encoder_scale",
       {.convert =
            [](I& r) {
              const Eigen::Vector2d e = r.coefficient(0) * sides(*r.cause_);
              r.set("s_R", -e[0] / (1.0 + e[0]));
              r.set("s_L", -e[1] / (1.0 + e[1]));
              return true;
            },
        .adds_up = true}},
      {"battery_sag", {.convert = [](I& r) { return r.convert_sag(); }, .adds_up = true}},
      {"longitudinal_slip", {.convert = [](I& r) { return r.first_shape(1.0); }}},
      {"wheel_out_of_round", {.convert = [](I& r) { return r.out_of_round(); }, .adds_up = true}},
      {"friction_drift", {.convert = [](I& r) { return r.convert_drift(); }, .of_others = true}},
      {"backlash", {.convert = [](I& r) { return r.convert_backlash(); }}},
  };
  return all;
}

}  // namespace

Robot with_nominal(const Robot& robot, const Model& model, const Eigen::VectorXd& theta) {
  check::that(theta.size() == static_cast<Eigen::Index>(model.p()) && theta.allFinite(), "with_nominal theta",
              "p finite numbers");
  const std::vector<std::string> possible = model::possible_parameters(robot);
  Robot changed = robot;
  std::map<std::string, double> physical;
  for (std::size_t j = 0; j < model.p(); ++j) {
    const model::Parameter& parameter = model.parameters[j];
    const double value = theta[static_cast<Eigen::Index>(j)] / parameter.per_physical;
    physical[parameter.physical] = value;
    const bool of_effect = std::ranges::any_of(robot.effects, [&](const RobotEffect& effect) {
      return std::ranges::any_of(
          model::effect_law(effect.name).parameters_of(robot), [&](const EffectParameterLaw& law) {
            return law.linear && law.physical == parameter.physical && effect.parameters.contains(law.name);
          });
    });
    if (of_effect || std::ranges::find(possible, parameter.physical) == possible.end()) {
      continue;
    }
    const bool friction = parameter.physical.starts_with("viscous") || parameter.dry_friction;
    changed.nominal[parameter.physical] = friction ? std::max(value, 0.0) : value;
    if (const auto prior = changed.prior.find(parameter.physical);
        prior != changed.prior.end() && value > 0.0 && !prior->second.contains(value)) {
      prior->second = {std::min(prior->second.lower, 0.5 * value), std::max(prior->second.upper, 2.0 * value)};
    }
  }
  for (RobotEffect& effect : changed.effects) {
    for (const EffectParameterLaw& law : model::effect_law(effect.name).parameters_of(robot)) {
      const auto value = physical.find(law.physical);
      const auto entry = effect.parameters.find(law.name);
      if (!law.linear || value == physical.end() || entry == effect.parameters.end()) {
        continue;
      }
      const double number = value->second / (law.times_mass ? physical["mass"] : 1.0);
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
  check::that(robot.effort == model::EffortKind::torque, "improved_robot robot.effort", "torques");
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
  for (const bool of_others : {false, true}) {
    for (std::size_t k = 0; possible && k < causes.size(); ++k) {
      if (Improvement::is_of_others(causes[k].effect.name) == of_others) {
        possible = improvement.add_effect(causes[k], intervals.empty() ? std::vector<Interval>{} : intervals[k]);
      }
    }
  }
  if (!possible) {
    why_not = improvement.why_not();
    return std::nullopt;
  }
  try {
    static_cast<void>(model::make_model(improvement.robot()));
  } catch (const InvalidArgument& error) {
    why_not = error.what();
    return std::nullopt;
  }
  why_not.clear();
  return improvement.robot();
}

}  // namespace wheelwright::gap
