// SPDX-License-Identifier: Apache-2.0
#include "results/scenario_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/place.hpp"
#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_keys.hpp"

namespace wheelwright::results {

using files::YamlPlace;

namespace {

constexpr std::size_t longest_scenario = std::size_t{1} << 20;
constexpr std::uint64_t largest_seed = std::uint64_t{1} << 53;

using Names = std::vector<std::string>;

double not_negative(const YamlPlace& place) {
  return place.number("a number >= 0", [](double value) { return value >= 0.0; });
}

Eigen::Vector3d pose_at(const YamlPlace& place) {
  const std::string expected = "three numbers [x, y, theta]";
  const auto elements = place.elements(expected);
  if (elements.size() != 3) {
    place.fail(expected);
  }
  return {elements[0].number(), elements[1].number(), elements[2].number()};
}

// The text of the mapping under the root's key `robot` alone, on the lines where it stands, so that messages name them.
std::string robot_text(std::string_view text, const YamlPlace& place) {
  const YAML::Node root = YAML::Load(std::string(text));
  const YAML::Node robot = root["robot"];
  if (!robot.IsMap()) {
    place.fail("a robot file, or the keys of one");
  }
  if (root.Style() == YAML::EmitterStyle::Flow) {
    return YAML::Dump(robot);
  }
  const YAML::Mark start = robot.Mark();
  int end = -1;  // line of the next key of the root
  for (const auto& member : root) {
    const int line = member.first.Mark().line;
    end = line > start.line && (end < 0 || line < end) ? line : end;
  }
  std::string out;
  int line = 0, column = 0;
  for (const char c : text) {
    if (line == end) {
      break;
    }
    if (c == '\n') {
      out += c;
      ++line;
      column = 0;
      continue;
    }
    out += line < start.line || (line == start.line && column < start.column) ? ' ' : c;
    ++column;
  }
  return out;
}

// Wheel-speed commands of a CSV file as body speeds; the table begins at time 0.
sim::SpeedTable read_commands(const std::filesystem::path& path, const DifferentialDrive& drive) {
  const std::vector<std::string> names = {"command_r", "command_l"};
  logs::CsvOptions options;
  options.only = names;
  options.min_rows = 2;
  CsvLog log({path}, options);
  logs::require_columns(log, names);
  const LogTable table = read_all(log);
  if (table.segment_starts.size() > 1) {
    throw InputError(path.string() + ": time has a gap or goes back before the row at " +
                     std::to_string(table.t[table.segment_starts[1]]) + " s: expected one drive, evenly sampled");
  }
  sim::SpeedTable speeds;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    speeds.t.push_back(table.t[k] - table.t.front());
    speeds.speed.push_back(drive.body_speed({table.column("command_r")[k], table.column("command_l")[k]}));
  }
  return speeds;
}

struct ScenarioReader {
  std::string_view text;
  const std::string& file;
  const std::filesystem::path& folder;
  std::vector<std::filesystem::path>* named = nullptr;
  Scenario scenario = {};
  std::optional<std::filesystem::path> commands = {};
  std::optional<YamlPlace> effects = {};

  void read() {
    const YamlPlace root = YamlPlace::parse(text, file);
    std::set<std::string> seen;
    for (const auto& [key, place] :
         root.members({"robot", "parameters", "trajectory", "controller", "start", "faults", "sensors", "duration",
                       "rate", "time_jitter", "gaps", "seed", "effects"})) {
      seen.insert(key);
      if (key == "effects") {
        effects = place;
      } else {
        read_part(key, place);
      }
    }
    for (const char* needed : {"robot", "parameters"}) {
      if (!seen.contains(needed)) {
        throw InputError(file + ": no key " + needed + ": expected it in a scenario");
      }
    }
    if (effects) {
      robots::read_effects(*effects, scenario.robot);
    }
    if (commands) {
      if (!(scenario.robot.wheel_radius > 0.0 && scenario.robot.track_width > 0.0)) {
        throw InputError(file +
                         ": trajectory of kind table: expected a robot of two wheels, with wheel_radius and "
                         "track_width");
      }
      scenario.trajectory.table = read_commands(*commands, sim::drive_of(scenario.robot));
      if (!seen.contains("duration")) {
        scenario.duration = scenario.trajectory.table.t.back();
      }
    }
    try {
      sim::validate(scenario);
    } catch (const InvalidArgument& error) {
      throw InputError(file + ": " + error.what());
    }
  }

  std::filesystem::path file_at(const YamlPlace& place, std::string_view expected) const {
    std::filesystem::path out = folder / place.text(expected);
    if (named != nullptr) {
      named->push_back(out);
    }
    return out;
  }

  void read_part(const std::string& key, const YamlPlace& place) {
    if (key == "robot") {
      scenario.robot = place.is_scalar() ? read_robot(file_at(place, "a robot file, or its keys"))
                                         : robots::parse_robot(robot_text(text, place), file);
    } else if (key == "parameters") {
      read_parameters(place);
    } else if (key == "trajectory") {
      read_trajectory(place);
    } else if (key == "controller") {
      read_controller(place);
    } else if (key == "start") {
      for (const auto& [name, value] : place.members({"pose", "error"})) {
        (name == "pose" ? scenario.initial_pose : scenario.initial_pose_error) = pose_at(value);
      }
    } else if (key == "faults") {
      for (const YamlPlace& element : place.elements("a list of faults")) {
        scenario.faults.push_back(fault(element));
      }
    } else if (key == "sensors") {
      read_sensors(place);
    } else if (key == "gaps") {
      for (const YamlPlace& element : place.elements("a list of [from, to]")) {
        const auto ends = element.elements("two times [from, to]");
        if (ends.size() != 2) {
          element.fail("two times [from, to]");
        }
        scenario.gaps.push_back({not_negative(ends[0]), not_negative(ends[1])});
      }
    } else {
      read_timing(key, place);
    }
  }

  void read_timing(const std::string& key, const YamlPlace& place) {
    if (key == "duration") {
      scenario.duration = place.positive();
    } else if (key == "rate") {
      scenario.rate = place.positive();
    } else if (key == "time_jitter") {
      scenario.time_jitter =
          place.number("a share of the period in [0, 0.5)", [](double value) { return value >= 0.0 && value < 0.5; });
    } else if (key == "seed") {
      scenario.seed = place.whole(0, largest_seed);
    }
  }

  void read_parameters(const YamlPlace& place) {
    model::DriveParameters& p = scenario.parameters;
    std::set<std::string> seen;
    for (const auto& [name, value] :
         place.members({"mass", "yaw_inertia", "viscous_linear", "viscous_x", "viscous_y", "viscous_yaw"})) {
      seen.insert(name);
      if (name == "mass") {
        p.mass = value.positive();
      } else if (name == "yaw_inertia") {
        p.yaw_inertia = value.positive();
      } else if (name == "viscous_yaw") {
        p.viscous_yaw = not_negative(value);
      } else if (name == "viscous_linear") {
        p.viscous_x = p.viscous_y = not_negative(value);
      } else {
        (name == "viscous_x" ? p.viscous_x : p.viscous_y) = not_negative(value);
      }
    }
    for (const char* needed : {"mass", "yaw_inertia", "viscous_yaw"}) {
      if (!seen.contains(needed)) {
        place.fail(std::string("a key ") + needed);
      }
    }
    const bool both = seen.contains("viscous_x") && seen.contains("viscous_y");
    const bool either = seen.contains("viscous_x") || seen.contains("viscous_y");
    if (seen.contains("viscous_linear") ? either : !both) {
      place.fail("either viscous_linear, or viscous_x and viscous_y");
    }
  }

  void read_trajectory(const YamlPlace& place) {
    sim::Trajectory& trajectory = scenario.trajectory;
    for (const auto& [name, value] : place.members({"kind", "speed", "yaw_rate", "period", "file"})) {
      if (name == "file") {
        commands = file_at(value, "a CSV file with t, command_r, command_l");
      } else if (name == "kind") {
        trajectory.kind = static_cast<sim::Trajectory::Kind>(value.choice(
            {"straight", "circle", "figure_eight", "multi_sine", "spin", "stops", "commissioning", "table"}));
      } else if (name == "period") {
        trajectory.period = value.positive();
      } else {
        (name == "speed" ? trajectory.speed : trajectory.yaw_rate) = not_negative(value);
      }
    }
    if (commands.has_value() != (trajectory.kind == sim::Trajectory::Kind::table)) {
      place.fail(commands ? "kind: table beside a file" : "a key file beside kind: table");
    }
  }

  void read_controller(const YamlPlace& place) {
    sim::ControllerGains& gains = scenario.controller;
    for (const auto& [name, value] :
         place.members({"along", "across", "heading", "speed", "integral", "torque_limit"})) {
      if (name == "torque_limit") {
        scenario.torque_limit = value.positive();
        continue;
      }
      double& gain = name == "along"     ? gains.along
                     : name == "across"  ? gains.across
                     : name == "heading" ? gains.heading
                     : name == "speed"   ? gains.speed
                                         : gains.integral;
      gain = not_negative(value);
    }
  }

  static model::Fault fault(const YamlPlace& place) {
    model::Fault fault;
    bool kind = false, magnitude = false;
    for (const auto& [name, value] : place.members({"kind", "magnitude", "onset", "shape", "rise_time", "end"})) {
      if (name == "kind") {
        kind = true;
        const std::vector<model::FaultKind> kinds = model::simulated_faults();
        Names names;
        std::ranges::transform(kinds, std::back_inserter(names),
                               [](model::FaultKind k) { return std::string(to_string(k)); });
        fault.kind = kinds.at(value.choice(names));
      } else if (name == "magnitude") {
        magnitude = true;
        fault.magnitude = value.number();
      } else if (name == "onset") {
        fault.profile.onset = value.number();
      } else if (name == "shape") {
        constexpr std::array shapes = {FaultProfile::Kind::step, FaultProfile::Kind::ramp, FaultProfile::Kind::smooth};
        fault.profile.shape = shapes.at(value.choice({"step", "ramp", "smooth"}));
      } else if (name == "rise_time") {
        fault.profile.rise_time = not_negative(value);
      } else {
        fault.profile.end = value.number();
      }
    }
    if (!kind || !magnitude) {
      place.fail("the keys kind and magnitude");
    }
    return fault;
  }

  void read_sensors(const YamlPlace& place) {
    sim::Sensors& sensors = scenario.sensors;
    for (const auto& [name, value] : place.members({"sampling", "noise", "wheel_speed", "wheel_angle", "effort",
                                                    "position", "heading", "encoder_counts_per_turn", "log"})) {
      if (name == "sampling") {
        sensors.sampling = static_cast<sim::Sampling>(value.choice({"instant", "interval"}));
      } else if (name == "noise") {
        sensors.noise = static_cast<sim::NoiseShape>(value.choice({"uniform", "truncated_gaussian", "two_point"}));
      } else if (name == "encoder_counts_per_turn") {
        sensors.encoder_counts_per_turn = value.positive();
      } else if (name == "log") {
        read_columns(value);
      } else {
        double& bound = name == "wheel_speed"   ? sensors.wheel_speed
                        : name == "wheel_angle" ? sensors.wheel_angle
                        : name == "effort"      ? sensors.effort
                        : name == "position"    ? sensors.position
                                                : sensors.heading;
        bound = not_negative(value);
      }
    }
  }

  void read_columns(const YamlPlace& place) {
    const Names groups = {"angles", "speeds", "pose", "commands"};
    std::array<bool, 4> wanted{};
    for (const YamlPlace& element : place.elements("a list of angles, speeds, pose, commands")) {
      wanted.at(element.choice(groups)) = true;
    }
    sim::Sensors& sensors = scenario.sensors;
    sensors.angles = wanted[0];
    sensors.speeds = wanted[1];
    sensors.pose = wanted[2];
    sensors.commands = wanted[3];
  }
};

}  // namespace

Scenario parse_scenario(std::string_view text, const std::string& file, const std::filesystem::path& folder,
                        std::vector<std::filesystem::path>* read) {
  ScenarioReader reader{text, file, folder, read};
  reader.read();
  return reader.scenario;
}

Scenario read_scenario(const std::filesystem::path& path, std::vector<std::filesystem::path>* read) {
  return parse_scenario(files::read_bytes(path, longest_scenario), path.string(), path.parent_path(), read);
}

}  // namespace wheelwright::results
