// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/detector/fault_type.hpp>

#include <algorithm>
#include <numbers>

#include <wheelwright/core/check.hpp>

namespace wheelwright::detector {
namespace {

using std::numbers::pi;

constexpr double kDrift = 20.0;              // s, of a slow change of radius
constexpr double kDropout = 0.1;             // s
constexpr double kBump = 30.0 * pi / 180.0;  // rad of the wheel's turn
constexpr double kInspectedLength = 0.05, kInspectedLoss = 0.2;
constexpr double kMostRadius = 0.5;      // share of the radius
constexpr double kMostLost = 0.95;       // share of an effort or of counts
constexpr double kMostLostOfSign = 0.5;  // of counts where functions need a speed's sign: slower, it is in doubt

// What acts on one joint alone, seen in coordinates or outputs: A E_j A⁻¹.
Eigen::MatrixXd of_joint(const Eigen::MatrixXd& map, std::size_t joint) {
  const Eigen::MatrixXd inverse = core::pseudo_inverse(map);
  const auto j = static_cast<Eigen::Index>(joint);
  return map.col(j) * inverse.row(j);
}

struct WheelSide {
  std::size_t joint;
  std::string suffix, words;
};

std::vector<WheelSide> sides_of(const Model& model) {
  if (model.joints.size() == 2) {
    return {{0, "_right", "the right wheel's"}, {1, "_left", "the left wheel's"}};
  }
  std::vector<WheelSide> sides;
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    sides.push_back(
        {j, model.joints.size() == 1 ? std::string() : std::string("_").append(std::to_string(j + 1)), "the joint's"});
  }
  return sides;
}

void add_efforts(std::vector<FaultType>& all, const Model& model, const WheelSide& side, const std::string& unit) {
  const Eigen::MatrixXd own = of_joint(model.input, side.joint);
  FaultType loss{.name = "effort_loss" + side.suffix,
                 .sentence = side.words + " actuator delivers less than its effort says",
                 .unit = "1",
                 .range = {0.0, kMostLost},
                 .share_lost = true,
                 .effort = own,
                 .inspected = kInspectedLoss};
  all.push_back(loss);
  all.push_back({.name = "effort_bias" + side.suffix,
                 .sentence = side.words + " effort reads too much (negative: too little)",
                 .unit = unit,
                 .range = {-1e4, 1e4},
                 .offset = model.input.col(static_cast<Eigen::Index>(side.joint))});
  all.push_back({.name = "effort_stuck" + side.suffix,
                 .sentence = side.words + " effort stays at its value",
                 .unit = "1",
                 .range = {0.0, 1.0},
                 .whole = true,
                 .effort = -own,
                 .held_effort = true});
  all.push_back({.name = "effort_dead" + side.suffix,
                 .sentence = side.words + " effort reads zero",
                 .unit = "1",
                 .range = {0.0, 1.0},
                 .whole = true,
                 .effort = -own});
}

void add_encoders(std::vector<FaultType>& all, const Model& model, const WheelSide& side) {
  const bool functions = std::any_of(model.terms.begin(), model.terms.end(),
                                     [](const Term& term) { return term.kind == Term::Kind::function; });
  const double most_lost = functions ? kMostLostOfSign : kMostLost;
  const Eigen::MatrixXd own = of_joint(model.motion, side.joint);
  all.push_back({.name = "encoder_scale" + side.suffix,
                 .sentence = side.words + " encoder counts too much (negative: too little)",
                 .unit = "1",
                 .range = {-most_lost, 1.0},
                 .seen = own,
                 .inspected = kInspectedLength});
  all.push_back({.name = "encoder_frozen" + side.suffix,
                 .sentence = side.words + " encoder stands still",
                 .unit = "1",
                 .range = {0.0, 1.0},
                 .whole = true,
                 .seen = -own});
  all.push_back({.name = "encoder_dropout" + side.suffix,
                 .sentence = side.words + " encoder stands still for a tenth of a second and goes on from there",
                 .unit = "1",
                 .range = {0.0, 1.0},
                 .whole = true,
                 .seen = -own,
                 .profile = {.kind = FaultProfile::Kind::pulse, .rise = kDropout}});
}

void add_radii(std::vector<FaultType>& all, const Model& model, const WheelSide& side) {
  const Eigen::MatrixXd own = of_joint(model.motion, side.joint), ground = of_joint(model.input, side.joint);
  const Interval range{-kMostRadius, kMostRadius};
  all.push_back({.name = "wheel_radius" + side.suffix,
                 .sentence = side.words + " radius changes",
                 .unit = "1",
                 .range = range,
                 .motion = own,
                 .ground = ground,
                 .inspected = kInspectedLength});
  all.push_back({.name = "wheel_radius_bump" + side.suffix,
                 .sentence = side.words + " radius is larger once a turn, over 30°",
                 .unit = "1",
                 .range = range,
                 .motion = own,
                 .ground = ground,
                 .profile = {.kind = FaultProfile::Kind::bump, .arc = kBump, .joint = side.joint}});
  all.push_back({.name = "wheel_slip" + side.suffix,
                 .sentence = "slip takes a share of " + side.words + " way",
                 .unit = "1",
                 .range = {-1.0, 1.0},
                 .motion = -own});
}

}  // namespace

std::vector<FaultType> fault_catalogue(const Model& model, const Eigen::VectorXd& theta, model::EffortKind effort) {
  check::that(static_cast<std::size_t>(theta.size()) == model.p(), "theta", "one value for each parameter");
  std::vector<FaultType> all;
  const auto c = static_cast<Eigen::Index>(model.coordinates.size());
  const bool drive = model.on_two_wheels;
  if (drive) {
    FaultType both{.name = "wheel_radius",
                   .sentence = "both wheels' radii change",
                   .unit = "1",
                   .range = {-kMostRadius, kMostRadius},
                   .motion = Eigen::MatrixXd::Identity(c, c),
                   .ground = Eigen::MatrixXd::Identity(c, c),
                   .inspected = kInspectedLength};
    all.push_back(both);
    both.inspected = 0.0;
    both.name = "wheel_radius_drift";
    both.sentence = "both wheels' radii change slowly, over 20 s";
    both.profile = {.kind = FaultProfile::Kind::drift, .rise = kDrift};
    all.push_back(both);
    for (const WheelSide& side : sides_of(model)) {
      add_radii(all, model, side);
    }
    all.push_back({.name = "matched",
                   .sentence = "the robot slips along its heading (10)",
                   .unit = "m/s",
                   .range = {-10.0, 10.0},
                   .slip = Eigen::Vector2d(1.0, 0.0)});
    if (!model.heading_used) {
      all.push_back({.name = "unmatched",
                     .sentence = "the robot slips across its heading, to the right (11)",
                     .unit = "m/s",
                     .range = {-10.0, 10.0},
                     .lateral = -1.0});
    }
    all.push_back({.name = "slip_yaw",
                   .sentence = "the robot slips about the vertical",
                   .unit = "rad/s",
                   .range = {-10.0, 10.0},
                   .slip = Eigen::Vector2d(0.0, 1.0)});
  }
  const std::string torque = model.output_units.empty() ? "" : model.output_units.front();
  const std::string unit = effort == model::EffortKind::torque    ? torque
                           : effort == model::EffortKind::current ? "A"
                                                                  : "V";
  for (const WheelSide& side : sides_of(model)) {
    add_efforts(all, model, side, unit);
    add_encoders(all, model, side);
  }
  const auto mass = std::find_if(model.parameters.begin(), model.parameters.end(),
                                 [](const model::Parameter& parameter) { return parameter.physical == "mass"; });
  if (mass != model.parameters.end()) {
    // Where efforts are currents or voltages the mass is known in their unit only: its share is what can be said.
    const bool physical = effort == model::EffortKind::torque;
    const auto at = mass - model.parameters.begin();
    const double known = std::max(theta[at] / mass->per_physical, 1e-3), whole = physical ? known : 1.0;
    Eigen::VectorXd lost = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.p()));
    lost[at] = -mass->per_physical * known / whole;
    all.push_back({.name = "payload_lost",
                   .sentence = std::string(physical ? "mass" : "a share of the mass") +
                               " is lost (negative: gained), in line with the axle",
                   .unit = physical ? mass->physical_unit : "1",
                   .range = {-10.0 * whole, whole},
                   .theta = lost});
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

}  // namespace wheelwright::detector
