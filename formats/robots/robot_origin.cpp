// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/robot_origin.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_keys.hpp"
#include "formats/robots/wheel_geometry.hpp"

namespace wheelwright::robots {

using files::OriginNumber;

namespace {

constexpr double contradiction = 0.1;    // of the value: two sources that cannot both be meant
constexpr double difference = 1e-3;      // worth a word
constexpr double most_radius = 10.0;     // m, as in the robot file: beyond this a file means millimetres
constexpr double most_track = 100.0;     // m
constexpr double largest_offset = 0.01;  // of the track: a centre of mass that the basic model may leave out

struct Maker {
  const RobotTree* tree;
  const DriveFacts* controller;
  const RobotHints& hints;
  const DriveFacts* plugin = nullptr;
  std::optional<WheelJoints> wheels{};
  RobotWithOrigins out{};

  void make() {
    if (tree == nullptr && controller == nullptr) {
      throw InputError("no robot description and no controller: expected at least one");
    }
    if (tree != nullptr && !tree->plugins.empty()) {
      plugin = &tree->plugins.front();
      if (tree->plugins.size() > 1) {
        tree->plugins[1].place.fail("a second drive beside " + plugin->place.text() + ": expected one");
      }
    }
    if (tree != nullptr) {
      wheels = driven_wheels(*tree, named());
    }
    basics();
    geometry();
    if (tree != nullptr) {
      body();
      friction();
    } else {
      out.remarks.push_back(
          "nominal values: none, because a controller's parameters hold no masses; --urdf gives "
          "them");
    }
    const WheelJoints* const joints = wheels ? &*wheels : nullptr;
    add_effort(out, tree, joints);
    add_limits(out, joints, {controller, plugin});
    columns();
    what_files_do_not_have();
    for (const DriveFacts* facts : {controller, plugin}) {
      if (facts != nullptr) {
        out.remarks.insert(out.remarks.end(), facts->remarks.begin(), facts->remarks.end());
      }
    }
  }

  [[nodiscard]] NamedWheels named() const {
    if (!hints.left.empty() || !hints.right.empty()) {
      return {hints.left, hints.right, "--left and --right"};
    }
    for (const DriveFacts* facts : {controller, plugin}) {
      if (facts != nullptr && (!facts->left.empty() || !facts->right.empty())) {
        return {facts->left, facts->right, facts->place.text()};
      }
    }
    return {};
  }

  void basics() {
    Robot& robot = out.robot;
    if (hints.name) {
      robot.name = *hints.name;
      out.origins["name"] = "--name";
    } else if (tree != nullptr && !tree->name.empty()) {
      robot.name = tree->name;
      out.origins["name"] = tree->place.text();
    } else {
      out.origins["name"] = "default, because no file names the robot";
    }
    robot.model = "differential_drive";
    if (wheels) {
      out.origins["model"] =
          fmt::format("{}, left {}, right {}: {}",
                      wheels->others.empty() ? "one driven wheel a side" : "several driven wheels a side",
                      wheels->left.place.text(), wheels->right.place.text(), wheels->reason);
    } else {
      out.origins["model"] = controller->place.text();
      if (controller->left.size() != controller->right.size()) {
        controller->place.fail(fmt::format("names {} left and {} right wheels: expected as many on each side",
                                           controller->left.size(), controller->right.size()));
      }
    }
    out.origins["lever_arm"] = "default, because a wheel's force has the arm D/2";
    out.origins["friction"] = "default, because no such file knows friction along the world's axes";
  }

  // The first of `sources`; the others are compared with it.
  OriginNumber agreed(const std::vector<OriginNumber>& sources, const std::string& what, const std::string& option) {
    const OriginNumber& first = sources.front();
    for (const OriginNumber& other : sources) {
      const double apart = std::abs(other.value - first.value) / first.value;
      const std::string words = fmt::format("{} {:.6g} m: {}; but {:.6g} m: {}", what, first.value, first.place.text(),
                                            other.value, other.place.text());
      if (apart > contradiction) {
        throw InputError(fmt::format("{}: expected the same, or {} with the right one", words, option));
      }
      if (apart > difference) {
        out.remarks.push_back(words + "; the first is taken");
      }
    }
    return first;
  }

  void geometry() {
    std::vector<OriginNumber> radii, tracks;
    std::string no_radius =
        controller != nullptr ? controller->place.text() + ": has no wheel_radius: give --wheel-radius" : "";
    // A robot that scrubs turns like a wider one: a multiplier that makes the wheels' own distance the controller's
    // goes before it.
    bool scrubs = false;
    if (tree != nullptr) {
      const Axle line = axle(*tree, *wheels);
      const auto like = [&](double track) {
        return std::abs(track / controller->track_width->value - 1.0) <= contradiction;
      };
      scrubs = controller != nullptr && controller->track_width && !like(line.track_width) &&
               like(line.track_width * controller->track_multiplier);
      tracks.push_back(scrubs ? *controller->track_width : OriginNumber{line.track_width, {"", line.origin}});
      out.remarks.insert(out.remarks.end(), line.remarks.begin(), line.remarks.end());
      // A radius that is given settles what the shapes leave open, and shapes that contradict each other.
      if (!hints.wheel_radius) {
        const WheelRadius wheel = wheel_radius(*tree, *wheels);
        if (wheel.value) {
          radii.push_back({*wheel.value, {"", wheel.origin}});
        } else {
          no_radius = wheel.origin;
        }
      }
    }
    for (const DriveFacts* facts : {controller, plugin}) {
      if (facts != nullptr && facts->wheel_radius) {
        radii.push_back(*facts->wheel_radius);
      }
      if (facts != nullptr && facts->track_width && !(scrubs && facts == controller)) {
        tracks.push_back(*facts->track_width);
      }
    }
    settle("wheel_radius", "--wheel-radius", hints.wheel_radius, radii, no_radius, out.robot.wheel_radius);
    settle("track_width", "--track-width", hints.track_width, tracks,
           controller != nullptr ? controller->place.text() + ": has no wheel_separation: give --track-width" : "",
           out.robot.track_width);
  }

  static void require_metres(double value, const std::string& key, const std::string& from) {
    const double largest = key == "wheel_radius" ? most_radius : most_track;
    if (!(value > 0.0 && value <= largest)) {
      throw InputError(fmt::format("{}: {} {}: expected metres, > 0 and at most {}", from, key, value, largest));
    }
  }

  void settle(const std::string& key, const std::string& option, const std::optional<double>& given,
              const std::vector<OriginNumber>& sources, const std::string& missing, double& value) {
    if (given) {
      require_metres(*given, key, option);
      value = *given;
      out.origins[key] = option;
      return;
    }
    if (sources.empty()) {
      throw InputError(missing);
    }
    const OriginNumber chosen = agreed(sources, key, option);
    require_metres(chosen.value, key, chosen.place.text());
    value = chosen.value;
    out.origins[key] = chosen.place.text();
  }

  void body() {
    Robot& robot = out.robot;
    const Axle line = axle(*tree, *wheels);
    const LumpedBody lump = lumped_body(*tree, *wheels, line, hints.massless);
    const double r = robot.wheel_radius, d = robot.track_width;
    robot.nominal["mass"] = lump.lumped_mass(r);
    robot.nominal["yaw_inertia"] = lump.lumped_yaw_inertia(r, d);
    out.origins["nominal.mass"] = fmt::format(
        "{}: {:.6g} kg of {} links + (J_R + J_L)/r² = {:.6g} kg, with J_R + J_L = {:.6g} kg·m² of the wheels' "
        "spin",
        tree->place.text(), lump.mass, lump.links, robot.nominal["mass"] - lump.mass, lump.spin);
    out.origins["nominal.yaw_inertia"] =
        fmt::format("{}: {:.6g} kg·m² of {} links about the middle of the axle + (J_R + J_L) D²/(4r²) = {:.6g} kg·m²",
                    tree->place.text(), lump.yaw_inertia, lump.links, robot.nominal["yaw_inertia"] - lump.yaw_inertia);
    if (!lump.massless.empty()) {
      out.remarks.push_back("links without a mass: " + core::listed(lump.massless));
    }
    if (!lump.moving.empty()) {
      out.remarks.push_back("joints that may move, taken at zero: " + core::listed(lump.moving));
    }
    offset("com_longitudinal", "a", lump.ahead, lump.ahead < 0.0 ? "behind" : "before");
    offset("com_lateral", "b", lump.left, lump.left < 0.0 ? "right of" : "left of");
  }

  void offset(const std::string& effect, const std::string& parameter, double value, const std::string& side) {
    const std::string words = fmt::format("centre of mass {:.4g} m {} the middle of the axle", std::abs(value), side);
    if (std::abs(value) > largest_offset * out.robot.track_width) {
      out.robot.effects.push_back({effect, {{parameter, Interval{value, value}}}});
      out.origins["effects." + effect] = fmt::format(
          "{}: {}, more than a hundredth of the track; the log decides between a third and three times of it",
          tree->place.text(), words);
    } else {
      out.remarks.push_back(words + ": left out, because it is less than a hundredth of the track");
    }
  }

  void friction() {
    Robot& robot = out.robot;
    const TreeJoint &right = wheels->right, &left = wheels->left;
    const double r = robot.wheel_radius, half = 0.5 * robot.track_width;
    require_both(right.damping, left.damping, "damping");
    require_both(right.friction, left.friction, "friction");
    if (right.damping) {
      const double c = right.damping->value + left.damping->value;
      robot.nominal["viscous_linear"] = c / (r * r);
      robot.nominal["viscous_yaw"] = c * half * half / (r * r);
      const std::string from = fmt::format("{} and {}: c_R + c_L = {:.6g} N·m·s/rad", right.damping->place.text(),
                                           left.damping->place.text(), c);
      out.origins["nominal.viscous_linear"] = from + "; (c_R + c_L)/r²";
      out.origins["nominal.viscous_yaw"] = from + "; (c_R + c_L) D²/(4r²)";
      tell_difference(*right.damping, *left.damping, "viscous_asymmetric");
    } else {
      out.remarks.push_back("nominal viscous friction: none, because the wheels' joints have no damping in the file");
    }
    if (right.friction) {
      robot.nominal["coulomb"] = 0.5 * (right.friction->value + left.friction->value);
      out.origins["nominal.coulomb"] =
          fmt::format("{} and {}", right.friction->place.text(), left.friction->place.text());
      tell_difference(*right.friction, *left.friction, "coulomb_asymmetric");
      if (robot.nominal["coulomb"] > 0.0) {
        robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw", "coulomb"};
        out.origins["parameters"] = "the basic ones and coulomb, because the wheels' joints have dry friction";
      }
    }
  }

  static void require_both(const std::optional<OriginNumber>& right, const std::optional<OriginNumber>& left,
                           const char* what) {
    if (right.has_value() != left.has_value()) {
      (right ? *right : *left).place.fail(fmt::format("the other wheel has no {}: expected both or none", what));
    }
  }

  void tell_difference(const OriginNumber& right, const OriginNumber& left, const std::string& effect) {
    if (std::abs(right.value - left.value) > difference * std::max(right.value, left.value)) {
      out.remarks.push_back(fmt::format("{} is {:.6g} and {} is {:.6g}: their mean is taken; the effect {} has both",
                                        right.place.text(), right.value, left.place.text(), left.value, effect));
    }
  }

  // Joints of a JointState, so that casters and arms beside them are not asked.
  void columns() {
    std::vector<std::string> right, left;
    if (wheels) {
      right = {wheels->right.name};
      left = {wheels->left.name};
      for (const TreeJoint& other : wheels->others) {
        (2.0 * other.origin.y() < wheels->right.origin.y() + wheels->left.origin.y() ? right : left)
            .push_back(other.name);
      }
      out.origins["columns"] = wheels->reason + "; these joints of a JointState are read, and no others";
    } else {
      right = controller->right;
      left = controller->left;
      out.origins["columns"] = controller->place.text() + "; these joints of a JointState are read, and no others";
    }
    const char* const effort = out.robot.effort == model::EffortKind::current   ? "current_"
                               : out.robot.effort == model::EffortKind::voltage ? "voltage_"
                                                                                : "tau_";
    for (const auto& [side, joints] : {std::pair("r", &right), {"l", &left}}) {
      if (!joints->empty()) {
        out.columns["phi_" + std::string(side)] = fmt::format("position[{}]", fmt::join(*joints, ","));
        out.columns["omega_" + std::string(side)] = fmt::format("velocity[{}]", fmt::join(*joints, ","));
        out.columns[std::string(effort) + side] = fmt::format("effort[{}]", fmt::join(*joints, ","));
      }
    }
  }

  void what_files_do_not_have() {
    out.origins["noise"] = "estimate, because no such file holds it; a bound that is known goes here";
    out.origins["filter"] = "default, because the log decides";
    out.origins["speed_source"] = "default, because the log decides";
    if (tree != nullptr && tree->encoder_counts) {
      out.robot.encoder_counts_per_turn = tree->encoder_counts->value;
      out.origins["encoder_counts_per_turn"] =
          tree->encoder_counts->place.text() + ": taken for counts per turn of a wheel";
    } else {
      out.remarks.push_back("encoder_counts_per_turn: not given, because no file holds it; found from the log");
    }
  }
};

}  // namespace

RobotWithOrigins robot_from(const RobotTree* description, const DriveFacts* controller, const RobotHints& hints) {
  Maker maker{.tree = description, .controller = controller, .hints = hints};
  maker.make();
  for (const files::FilePlace* place :
       {description != nullptr ? &description->place : nullptr, controller != nullptr ? &controller->place : nullptr}) {
    if (place != nullptr) {
      maker.out.files.push_back(place->where.substr(0, place->where.rfind(':')));
    }
  }
  return maker.out;
}

namespace {

constexpr std::size_t widest = 112;

// Lines of a comment, `text` broken at blanks; what could end a comment becomes a blank.
std::string comment(std::string text, const std::string& indent) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char c) { return c < ' '; }, ' ');
  std::string out;
  std::size_t begin = 0;
  while (begin < text.size()) {
    std::size_t end = text.size();
    if (end - begin > widest) {
      end = text.rfind(' ', begin + widest);
      end = end == std::string::npos || end <= begin ? std::min(text.find(' ', begin + widest), text.size()) : end;
    }
    out += indent + (begin == 0 ? "# " : "#   ") + text.substr(begin, end - begin) + "\n";
    begin = end + 1;
  }
  return out;
}

// Keys whose values hold origins of their own.
bool is_group(const std::string& key) {
  return key == "effort" || key == "nominal" || key == "limits" || key == "motor";
}

}  // namespace

std::string robot_yaml(const RobotWithOrigins& robot) {
  const auto origin = [&](const std::string& key) {
    const auto it = robot.origins.find(key);
    return it == robot.origins.end() ? std::string("default") : it->second;
  };
  std::string out = comment(
      "A robot file made of " + core::listed(robot.files) + ". Above each value stands where it came from.", "");
  const Json object = to_json(robot.robot);
  for (const auto& member : object.items()) {
    if (is_group(member.key())) {
      out += member.key() + ":\n";
      for (const auto& inner : member.value().items()) {
        out += comment(origin(member.key() + "." + inner.key()), "  ");
        out += "  " + inner.key() + ": " + files::json_text(inner.value(), -1) + "\n";
      }
    } else if (member.key() == "effects") {
      out += "effects:\n";
      for (const Json& effect : member.value()) {
        out += comment(origin("effects." + effect.at("effect").get<std::string>()), "  ");
        out += "  - " + files::json_text(effect, -1) + "\n";
      }
    } else {
      out += comment(origin(member.key()), "") + member.key() + ": " + files::json_text(member.value(), -1) + "\n";
    }
  }
  if (!robot.columns.empty()) {
    out += comment(origin("columns"), "") + columns_yaml(robot.columns);
  }
  for (const std::string& remark : robot.remarks) {
    out += comment(remark, "");
  }
  return out;
}

Json to_json(const RobotWithOrigins& robot, const std::string& software) {
  Json keys = to_json(robot.robot);
  if (!robot.columns.empty()) {
    keys["columns"] = robot.columns;
  }
  return {{"schema", "wheelwright/robot-file/1"},
          {"software", software},
          {"files", robot.files},
          {"robot", std::move(keys)},
          {"origins", robot.origins},
          {"remarks", robot.remarks}};
}

}  // namespace wheelwright::robots
