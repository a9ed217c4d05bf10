// SPDX-License-Identifier: Apache-2.0
#include "gap/write_back.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "core/check.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::gap {

using model::NotExpressed;
using model::SimulatorChange;

namespace {

// What to do about an effect that is no number of a body or joint.
struct Remedy {
  const char* why;
  const char* instead;
};
const std::map<std::string_view, Remedy>& remedies() {
  constexpr const char* kFriction = "a joint has dry and viscous friction only";
  constexpr const char* kCommand = "it lies between the command and the joint";
  constexpr const char* kContact = "it is a property of the contacts, whose laws differ from engine to engine";
  constexpr const char* kReading = "it is in what the sensors say, not in the robot";
  static const std::map<std::string_view, Remedy> all = {
      {"stribeck",
       {kFriction, "add c_s exp(-(w/omega_s)^2) sgn(w) against each wheel's speed w where torques are set"}},
      {"quadratic_drag",
       {kFriction, "take c v|v| from the sum of the torques where they are set, v the robot's speed"}},
      {"load_friction",
       {kFriction, "take the share k of each torque from it where torques are set, against the motion"}},
      {"friction_drift", {"a file has no time", "write the friction of a warm robot, or change it while it runs"}},
      {"caster_drag", {kContact, "give the castor's contact the friction force c/r, at the distance p from the axle"}},
      {"lateral_scrub", {kContact, "give the wheels' contacts torsional friction (MuJoCo: condim 4)"}},
      {"torque_bias", {kCommand, "take b_R and b_L from the torques where they are set"}},
      {"actuator_lag",
       {kCommand,
        "pass the commands through a lag of T (MuJoCo: a <general> actuator with dyntype=\"filter\" and dynprm)"}},
      {"delay", {kCommand, "hold every command back by T_d where torques are set"}},
      {"sensor_time_offset", {kReading, "stamp the simulated speeds later by dt"}},
      {"torque_deadzone", {kCommand, "take b from the size of each torque where torques are set, down to 0"}},
      {"backlash",
       {"it needs a body and a joint more",
        "put the rotor on a joint of its own that meets the wheel at the ends of a narrow range"}},
      {"battery_sag", {kCommand, "multiply torques by 1 - k t - R_b (|tau_R| + |tau_L|) where they are set"}},
      {"longitudinal_slip",
       {kContact, "soften the wheels' contacts along the rolling direction (Gazebo: slip1, slip2)"}},
      {"turning_slip", {kContact, "lower the wheels' friction sideways (Gazebo: mu2; MuJoCo: friction of the geoms)"}},
      {"curve_slip", {kContact, "lower the wheels' friction sideways (Gazebo: mu2; MuJoCo: friction of the geoms)"}},
      {"wheel_out_of_round", {"a wheel is a round shape", "move the wheels' shapes off their axles, or use meshes"}},
      {"encoder_scale", {kReading, "scale the angle and speed of that wheel where the simulation is logged"}},
      {"slope",
       {"the ground is the world's", "tilt the ground, or take g_x and g_y from the gravity's x and y components"}},
  };
  return all;
}

class Changes {
 public:
  Changes(const Robot& robot, const Drive& drive, const Diagnosis& found)
      : drive_(drive), found_(found), unit_(model::effort_per_torque(robot)) {}

  void take(const FittedEffect& cause) {
    cause_ = &cause;
    const std::string& name = cause.effect.name;
    const auto rule = rules().find(name);
    if (rule == rules().end() || cause.effect.free_form) {
      not_expressed(name);
    } else if (rule->second.torque && !unit_) {
      tell(name, "the log's efforts are no torques, and the robot file has no motor constants",
           "give the robot file `motor:` with torque_constant, gear_ratio (and resistance), and run again");
    } else if (!has(rule->second.parameters) || !rule->second.apply(*this)) {
      not_expressed(name);
    }
  }

  void not_expressed(const std::string& name) {
    const auto remedy = remedies().find(name);
    if (remedy != remedies().end()) {
      tell(name, remedy->second.why, remedy->second.instead);
    } else {
      tell(name, "there is no rule by which it becomes a number of a simulator's file",
           "program it where torques are set");
    }
  }

  SimulatorChange result() && { return std::move(change_); }

 private:
  // How a cause of one name, whose parameters begin with these, becomes numbers; false where it cannot.
  struct Rule {
    std::vector<std::string_view> parameters;
    bool (*apply)(Changes& changes);
    bool torque = false;  // or a mass: known only where efforts are torques
  };
  static const std::map<std::string, Rule>& rules();

  bool scale_radius(const Eigen::Vector2d& factor) {
    change_.radius_factor = change_.radius_factor.cwiseProduct(factor);
    because("radius_factor");
    return true;
  }
  bool scale_track(double narrowing) {
    if (!(narrowing < 1.0)) {
      return false;
    }
    change_.track_factor /= 1.0 - narrowing;
    because("track_factor");
    return true;
  }
  // A command's excess e makes the gain 1/(1 + e).
  bool lower_gain(const Eigen::Vector2d& excess) {
    if (!((1.0 + excess.array()).minCoeff() > 0.0)) {
      return false;
    }
    change_.gain.array() /= 1.0 + excess.array();
    because("gain");
    return true;
  }
  bool move_centre(double SimulatorChange::*moment, const char* member) {
    change_.*moment += c(0) * drive_.physical("mass");
    because(member);
    if (cause_->coefficients.size() > 1 && c(1) != 0.0) {
      change_.yaw_inertia += c(1) * drive_.physical("yaw_inertia");
      because("yaw_inertia");
    }
    return true;
  }
  bool add_torques(Eigen::Vector2d SimulatorChange::*of, const char* member, const Eigen::Vector2d& torques) {
    change_.*of += torques;
    because(member);
    return true;
  }

  bool add_payload(double moment) {
    change_.mass += c(0);
    change_.yaw_inertia += c(1);
    because("mass");
    because("yaw_inertia");
    if (moment != 0.0) {
      change_.moment_ahead += moment;
      because("moment_ahead");
    }
    return true;
  }

  // f1 = 2c/r² and f3 = c D²/(2r²) ask for a damping c each.
  bool add_viscous() {
    const double r2 = drive_.wheel_radius * drive_.wheel_radius, d2 = drive_.track_width * drive_.track_width;
    const Eigen::Array2d per(0.5 * r2, 2.0 * r2 / d2);
    const Eigen::Array2d wanted = per * Eigen::Array2d(c(0), c(1));
    const Eigen::Array2d half = per * Eigen::Array2d(half_width("viscous_linear"), half_width("viscous_yaw"));
    const bool weighed = half.minCoeff() > 0.0;
    const Eigen::Array2d weight = weighed ? Eigen::Array2d(half.square().inverse()) : Eigen::Array2d(1.0, 1.0);
    const double damping = (weight * wanted).sum() / weight.sum();
    change_.damping.array() += damping;
    because("damping");
    if (weighed && ((wanted - damping).abs() > half).any()) {
      tell("viscous", "friction straight ahead and in turns do not fit one damping of the wheels' joints",
           fmt::format(
               "straight ahead {:.4g} and in turns {:.4g} N·m·s/rad at each wheel were found, {:.4g} was written: "
               "what is left is friction of the ground or of castors",
               wanted[0], wanted[1], damping));
    }
    return true;
  }
  bool limit_effort() {
    if (!cause_->effect.unit_coefficient || cause_->shape.size() != 1) {
      return false;
    }
    change_.effort_limit = cause_->shape[0] / *unit_;
    because("effort_limit");
    return true;
  }

  [[nodiscard]] bool has(const std::vector<std::string_view>& names) const {
    std::size_t k = 0;
    return cause_->effect.parameters.size() >= names.size() &&
           cause_->coefficients.size() == std::ssize(cause_->effect.parameters) &&
           std::ranges::all_of(names, [&](std::string_view n) { return cause_->effect.parameters[k++].name == n; });
  }
  [[nodiscard]] double c(Eigen::Index k) const { return cause_->coefficients[k]; }
  // A coefficient in N·m (per unit of speed or acceleration).
  [[nodiscard]] double torque(Eigen::Index k) const { return c(k) / *unit_; }
  [[nodiscard]] Eigen::Vector2d sides() const { return catalogue::side_factors(cause_->shape); }
  [[nodiscard]] double half_width(std::string_view parameter) const {
    for (const GapCause& cause : found_.causes) {
      if (cause.effect == cause_->effect.name) {
        for (const GapEstimate& number : cause.parameters) {
          if (number.name == parameter) {
            return 0.5 * (number.upper - number.lower);
          }
        }
      }
    }
    return 0.0;
  }
  [[nodiscard]] std::string numbers(const std::string& effect) const {
    std::string out;
    for (const GapCause& cause : found_.causes) {
      for (const GapEstimate& number : cause.parameters) {
        if (cause.effect == effect) {
          out += fmt::format("{}{} = {:.4g}{}", out.empty() ? "" : ", ", number.name, number.estimate,
                             number.unit.empty() || number.unit == "1" ? "" : " " + number.unit);
        }
      }
    }
    return out;
  }

  void because(const std::string& member) {
    std::string& names = change_.because[member];
    if (names.find(cause_->effect.name) == std::string::npos) {
      names += (names.empty() ? "" : ", ") + cause_->effect.name;
    }
  }
  void tell(const std::string& name, const std::string& why, const std::string& instead) {
    const bool there = std::ranges::any_of(change_.not_expressed,
                                           [&](const NotExpressed& n) { return n.cause == name && n.why == why; });
    if (!there) {
      const std::string with = numbers(name);
      change_.not_expressed.push_back({name, why, with.empty() ? instead : instead + " (" + with + ")"});
    }
  }

  const Drive& drive_;
  const Diagnosis& found_;
  std::optional<double> unit_;
  const FittedEffect* cause_ = nullptr;
  SimulatorChange change_;
};

const std::map<std::string, Changes::Rule>& Changes::rules() {
  using C = Changes;
  using Both = Eigen::Vector2d;
  constexpr auto kDry = &SimulatorChange::dry_friction, kDamping = &SimulatorChange::damping,
                 kArmature = &SimulatorChange::armature;
  static const std::map<std::string, Rule> all = {
      {"wheel_radius", {{"epsilon"}, [](C& o) { return o.scale_radius(Both::Constant(1.0 + o.c(0))); }}},
      {"wheel_radius_asymmetric",
       {{"epsilon"}, [](C& o) { return o.scale_radius(Both::Ones() + o.c(0) * o.sides()); }}},
      {"track_width", {{"narrowing"}, [](C& o) { return o.scale_track(o.c(0)); }}},
      {"torque_gain", {{"command_excess"}, [](C& o) { return o.lower_gain(Both::Constant(o.c(0))); }}},
      {"torque_gain_asymmetric", {{"command_excess"}, [](C& o) { return o.lower_gain(o.c(0) * o.sides()); }}},
      {"payload", {{"mass_kg", "yaw_inertia"}, [](C& o) { return o.add_payload(0.0); }, true}},
      {"payload_offset", {{"mass_kg", "yaw_inertia", "moment"}, [](C& o) { return o.add_payload(o.c(2)); }, true}},
      {"com_longitudinal",
       {{"a"}, [](C& o) { return o.move_centre(&SimulatorChange::moment_ahead, "moment_ahead"); }, true}},
      {"com_lateral", {{"b"}, [](C& o) { return o.move_centre(&SimulatorChange::moment_left, "moment_left"); }, true}},
      {"coulomb",
       {{"c"},
        [](C& o) {
          return o.cause_->coefficients.size() == 1 && o.add_torques(kDry, "dry_friction", Both::Constant(o.torque(0)));
        },
        true}},
      {"coulomb_asymmetric",
       {{"c_R", "c_L"},
        [](C& o) {
          return o.add_torques(kDry, "dry_friction", {o.torque(0), o.torque(1)});
        },
        true}},
      {"viscous", {{"viscous_linear", "viscous_yaw"}, [](C& o) { return o.add_viscous(); }, true}},
      {"viscous_asymmetric",
       {{"damping"}, [](C& o) { return o.add_torques(kDamping, "damping", o.torque(0) * o.sides()); }, true}},
      {"armature",
       {{"armature"}, [](C& o) { return o.add_torques(kArmature, "armature", Both::Constant(o.torque(0))); }, true}},
      {"saturation", {{}, [](C& o) { return o.limit_effort(); }, true}},
  };
  return all;
}

}  // namespace

SimulatorChange simulator_change(const Robot& robot, const Drive& drive, const Diagnosis& found) {
  check::that(drive.two_wheels(), "simulator_change drive", "a robot on two driven wheels");
  Changes changes(robot, drive, found);
  for (const FittedEffect& cause : found.fitted) {
    changes.take(cause);
  }
  for (const GapCause& cause : found.causes) {
    const bool fitted = std::ranges::any_of(
        found.fitted, [&](const FittedEffect& effect) { return effect.effect.name == cause.effect; });
    if (!fitted) {
      changes.not_expressed(cause.effect);
    }
  }
  return std::move(changes).result();
}

}  // namespace wheelwright::gap
