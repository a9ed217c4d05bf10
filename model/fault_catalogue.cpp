// SPDX-License-Identifier: Apache-2.0
#include "core/linear_algebra.hpp"
#include "model/fault_type.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "core/check.hpp"

namespace wheelwright::model {
namespace {

using std::numbers::pi;

constexpr double kDrift = 20.0;              // s, of a slow change of radius
constexpr double kDropout = 0.1;             // s
constexpr double kBump = 30.0 * pi / 180.0;  // rad of the wheel's turn
constexpr double kInspectedLength = 0.05, kInspectedLoss = 0.2;
constexpr double kMostRadius = 0.5;      // share of the radius
constexpr double kMostLost = 0.95;       // share of an effort or of counts
constexpr double kMostLostOfSign = 0.5;  // of counts where functions need a speed's sign: slower, it is in doubt

// The robot and the joint that an entry's signature is asked for.
struct Subject {
  const Model& model;
  const Eigen::VectorXd& theta;
  EffortKind effort;
  std::size_t joint;
};

// What acts on the joint alone, seen in coordinates or outputs: A E_j A⁻¹.
Eigen::MatrixXd of_joint(const Eigen::MatrixXd& map, std::size_t joint) {
  const Eigen::MatrixXd inverse = core::pseudo_inverse(map);
  const auto j = static_cast<Eigen::Index>(joint);
  return map.col(j) * inverse.row(j);
}

auto mass_of(const Model& model) {
  return std::find_if(model.parameters.begin(), model.parameters.end(),
                      [](const Parameter& parameter) { return parameter.physical == "mass"; });
}

// Robots that have a fault.
bool any_robot(const Model&) { return true; }
bool on_wheels(const Model& model) { return model.on_two_wheels; }
bool on_wheels_alike(const Model& model) { return model.on_two_wheels && !model.heading_used; }
bool with_mass(const Model& model) { return mass_of(model) != model.parameters.end(); }

void both_radii(FaultType& fault, const Subject& of) {
  const auto c = static_cast<Eigen::Index>(of.model.coordinates.size());
  fault.range = {-kMostRadius, kMostRadius};
  fault.motion = fault.ground = Eigen::MatrixXd::Identity(c, c);
}

void one_radius(FaultType& fault, const Subject& of) {
  fault.range = {-kMostRadius, kMostRadius};
  fault.motion = of_joint(of.model.motion, of.joint);
  fault.ground = of_joint(of.model.input, of.joint);
}

void changed_radii(FaultType& fault, const Subject& of) {
  both_radii(fault, of);
  fault.inspected = kInspectedLength;
}

void drifting_radii(FaultType& fault, const Subject& of) {
  both_radii(fault, of);
  fault.profile = {.kind = FaultProfile::Kind::ramp, .rise = kDrift};
}

void changed_radius(FaultType& fault, const Subject& of) {
  one_radius(fault, of);
  fault.inspected = kInspectedLength;
}

void bump(FaultType& fault, const Subject& of) {
  one_radius(fault, of);
  fault.profile = {.kind = FaultProfile::Kind::bump, .arc = kBump, .joint = of.joint};
}

void lost_way(FaultType& fault, const Subject& of) {
  fault.range = {-1.0, 1.0};
  fault.motion = -of_joint(of.model.motion, of.joint);
}

void slip_along(FaultType& fault, const Subject&) {
  fault.range = {-10.0, 10.0};
  fault.slip = Eigen::Vector2d(1.0, 0.0);
}

void slip_across(FaultType& fault, const Subject&) {
  fault.range = {-10.0, 10.0};
  fault.lateral = -1.0;
}

void slip_about(FaultType& fault, const Subject&) {
  fault.range = {-10.0, 10.0};
  fault.slip = Eigen::Vector2d(0.0, 1.0);
}

void lost_effort(FaultType& fault, const Subject& of) {
  fault.range = {0.0, kMostLost};
  fault.share_lost = true;
  fault.effort = of_joint(of.model.input, of.joint);
  fault.inspected = kInspectedLoss;
}

void biased_effort(FaultType& fault, const Subject& of) {
  const std::string torque = of.model.output_units.empty() ? "" : of.model.output_units.front();
  fault.unit = of.effort == EffortKind::torque ? torque : of.effort == EffortKind::current ? "A" : "V";
  fault.range = {-1e4, 1e4};
  fault.offset = of.model.input.col(static_cast<Eigen::Index>(of.joint));
}

void dead_effort(FaultType& fault, const Subject& of) {
  fault.range = {0.0, 1.0};
  fault.whole = true;
  fault.effort = -of_joint(of.model.input, of.joint);
}

void stuck_effort(FaultType& fault, const Subject& of) {
  dead_effort(fault, of);
  fault.held_effort = true;
}

void scaled_encoder(FaultType& fault, const Subject& of) {
  const bool functions = std::any_of(of.model.terms.begin(), of.model.terms.end(),
                                     [](const Term& term) { return term.kind == Term::Kind::function; });
  fault.range = {functions ? -kMostLostOfSign : -kMostLost, 1.0};
  fault.seen = of_joint(of.model.motion, of.joint);
  fault.inspected = kInspectedLength;
}

void frozen_encoder(FaultType& fault, const Subject& of) {
  fault.range = {0.0, 1.0};
  fault.whole = true;
  fault.seen = -of_joint(of.model.motion, of.joint);
}

void encoder_pause(FaultType& fault, const Subject& of) {
  frozen_encoder(fault, of);
  fault.profile = {.kind = FaultProfile::Kind::pulse, .rise = kDropout};
}

// Where efforts are currents or voltages the mass is known in their unit only: its share is what can be said.
void lost_payload(FaultType& fault, const Subject& of) {
  const auto mass = mass_of(of.model);
  const auto at = mass - of.model.parameters.begin();
  const bool physical = of.effort == EffortKind::torque;
  const double known = std::max(of.theta[at] / mass->per_physical, 1e-3), whole = physical ? known : 1.0;
  fault.sentence = std::string(physical ? "mass " : "a share of the mass ") + fault.sentence;
  fault.unit = physical ? mass->physical_unit : "1";
  fault.range = {-10.0 * whole, whole};
  fault.theta = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(of.model.p()));
  fault.theta[at] = -mass->per_physical * known / whole;
}

enum class Place { robot, right_wheel, left_wheel, each_joint };

// One fault.
struct Entry {
  FaultKind kind;
  std::string_view name;
  std::string_view sentence;  // where it is of each joint, what follows "the joint's"
  std::string_view unit;      // empty: the signature says it
  Place place;
  bool (*exists)(const Model& model);                      // whether the robot can have it
  void (*signature)(FaultType& fault, const Subject& of);  // with range and profile; nullptr: it is simulated only
};

// In the order of a catalogue.
constexpr std::array entries{
    Entry{FaultKind::wheel_radius, "wheel_radius", "both wheels' radii change", "1", Place::robot, on_wheels,
          changed_radii},
    Entry{FaultKind::wheel_radius_drift, "wheel_radius_drift", "both wheels' radii change slowly, over 20 s", "1",
          Place::robot, on_wheels, drifting_radii},
    Entry{FaultKind::wheel_radius_right, "wheel_radius_right", "the right wheel's radius changes", "1",
          Place::right_wheel, on_wheels, changed_radius},
    Entry{FaultKind::wheel_radius_bump_right, "wheel_radius_bump_right",
          "the right wheel's radius is larger once a turn, over 30°", "1", Place::right_wheel, on_wheels, bump},
    Entry{FaultKind::wheel_slip_right, "wheel_slip_right", "slip takes a share of the right wheel's way", "1",
          Place::right_wheel, on_wheels, lost_way},
    Entry{FaultKind::wheel_radius_left, "wheel_radius_left", "the left wheel's radius changes", "1", Place::left_wheel,
          on_wheels, changed_radius},
    Entry{FaultKind::wheel_radius_bump_left, "wheel_radius_bump_left",
          "the left wheel's radius is larger once a turn, over 30°", "1", Place::left_wheel, on_wheels, bump},
    Entry{FaultKind::wheel_slip_left, "wheel_slip_left", "slip takes a share of the left wheel's way", "1",
          Place::left_wheel, on_wheels, lost_way},
    Entry{FaultKind::slip_x, "slip_x", "the robot slips along the world's x axis", "m/s", Place::robot, on_wheels,
          nullptr},
    Entry{FaultKind::slip_y, "slip_y", "the robot slips along the world's y axis", "m/s", Place::robot, on_wheels,
          nullptr},
    Entry{FaultKind::matched, "matched", "the robot slips along its heading (10)", "m/s", Place::robot, on_wheels,
          slip_along},
    Entry{FaultKind::unmatched, "unmatched", "the robot slips across its heading, to the right (11)", "m/s",
          Place::robot, on_wheels_alike, slip_across},
    Entry{FaultKind::slip_yaw, "slip_yaw", "the robot slips about the vertical", "rad/s", Place::robot, on_wheels,
          slip_about},
    Entry{FaultKind::effort_loss, "effort_loss", "actuator delivers less than its effort says", "1", Place::each_joint,
          any_robot, lost_effort},
    Entry{FaultKind::effort_bias, "effort_bias", "effort reads too much (negative: too little)", "", Place::each_joint,
          any_robot, biased_effort},
    Entry{FaultKind::effort_stuck, "effort_stuck", "effort stays at its value", "1", Place::each_joint, any_robot,
          stuck_effort},
    Entry{FaultKind::effort_dead, "effort_dead", "effort reads zero", "1", Place::each_joint, any_robot, dead_effort},
    Entry{FaultKind::encoder_scale, "encoder_scale", "encoder counts too much (negative: too little)", "1",
          Place::each_joint, any_robot, scaled_encoder},
    Entry{FaultKind::encoder_frozen, "encoder_frozen", "encoder stands still", "1", Place::each_joint, any_robot,
          frozen_encoder},
    Entry{FaultKind::encoder_dropout, "encoder_dropout",
          "encoder stands still for a tenth of a second and goes on from there", "1", Place::each_joint, any_robot,
          encoder_pause},
    Entry{FaultKind::payload_lost, "payload_lost", "is lost (negative: gained), in line with the axle", "",
          Place::robot, with_mass, lost_payload}};

constexpr const Entry* find_entry(FaultKind kind) {
  for (const Entry& entry : entries) {
    if (entry.kind == kind) {
      return &entry;
    }
  }
  return nullptr;
}

constexpr bool each_kind_has_one_entry() {
  for (std::size_t k = 0; k < fault_kinds; ++k) {
    if (find_entry(static_cast<FaultKind>(k)) == nullptr) {
      return false;
    }
  }
  return entries.size() == fault_kinds;
}
static_assert(each_kind_has_one_entry());

FaultType fault_of(const Entry& entry, const Subject& of) {
  FaultType fault{
      .name = std::string(entry.name), .sentence = std::string(entry.sentence), .unit = std::string(entry.unit)};
  if (entry.place == Place::each_joint) {
    const std::size_t joints = of.model.joints.size();
    const bool sides = joints == 2, right = of.joint == 0;
    fault.name += sides ? (right ? "_right" : "_left") : joints == 1 ? "" : "_" + std::to_string(of.joint + 1);
    fault.sentence = (sides ? (right ? "the right wheel's " : "the left wheel's ") : "the joint's ") + fault.sentence;
  }
  entry.signature(fault, of);
  return fault;
}

}  // namespace

std::string_view to_string(FaultKind kind) {
  const Entry* entry = find_entry(kind);
  check::that(entry != nullptr, "FaultKind", "one of its enumerators");
  return entry->name;
}

std::vector<FaultType> fault_catalogue(const Model& model, const Eigen::VectorXd& theta, EffortKind effort) {
  check::that(static_cast<std::size_t>(theta.size()) == model.p(), "theta", "one value for each parameter");
  std::vector<FaultType> all;
  const auto add = [&](const Entry& entry, std::size_t joint) {
    if (entry.signature != nullptr && entry.exists(model)) {
      all.push_back(fault_of(entry, {model, theta, effort, joint}));
    }
  };
  for (auto from = entries.begin(); from != entries.end();) {
    if (from->place != Place::each_joint) {
      add(*from, from->place == Place::left_wheel ? 1 : 0);
      ++from;
      continue;
    }
    const auto to = std::find_if(from, entries.end(), [](const Entry& e) { return e.place != Place::each_joint; });
    for (std::size_t j = 0; j < model.joints.size(); ++j) {
      std::for_each(from, to, [&](const Entry& entry) { add(entry, j); });
    }
    from = to;
  }
  return all;
}

const FaultType& find_fault(const std::vector<FaultType>& catalogue, const std::string& name) {
  const auto at =
      std::find_if(catalogue.begin(), catalogue.end(), [&](const FaultType& fault) { return fault.name == name; });
  std::string known;
  for (const FaultType& fault : catalogue) {
    known += (known.empty() ? "" : ", ") + fault.name;
  }
  check::that(at != catalogue.end(), "fault '" + name + "'", "one of " + known);
  return *at;
}

}  // namespace wheelwright::model
