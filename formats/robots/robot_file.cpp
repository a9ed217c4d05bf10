// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/robot_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <nlohmann/json.hpp>

#include "formats/files/bytes.hpp"
#include "formats/files/place.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_keys.hpp"

namespace wheelwright::robots {

std::vector<std::string> useful_columns(const Robot& robot) {
  std::vector<std::string> names = {"t", "x", "y", "theta", "gyro_z", "command_r", "command_l"};
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.insert(names.end(), {joint.angle, joint.speed, model::effort_column(joint, robot.effort)});
  }
  return names;
}

std::vector<std::string> needed_columns(const Robot& robot) {
  std::vector<std::string> names;
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.insert(names.end(), {joint.speed + "|" + joint.angle, model::effort_column(joint, robot.effort)});
  }
  return names;
}

using files::YamlPlace;

namespace {

constexpr std::size_t longest_robot_file = std::size_t{1} << 20;
constexpr double longest_radius = 10.0;  // m: beyond this the file means millimetres
constexpr double longest_track = 100.0;  // m
constexpr double longest_delay = 1.0;    // s: beyond this the file means milliseconds

using Names = std::vector<std::string>;

/// A file is read key by key; what depends on the model is read once that is known.
struct RobotReader {
  YamlPlace root;
  Robot robot;
  Names physical;

  static bool drive(const Robot& robot) { return robot.model == "differential_drive"; }

  void read() {
    const auto members = root.members({"name",           "model",
                                       "wheel_radius",   "track_width",
                                       "footprint",      "lever_arm",
                                       "friction",       "parameters",
                                       "effort",         "nominal",
                                       "prior",          "noise",
                                       "filter",         "encoder_counts_per_turn",
                                       "speed_source",   "speed_filter",
                                       "speed_cut",      "pose_source",
                                       "heading_offset", "limits",
                                       "kinematic",      "motor",
                                       "effects",        "columns",
                                       "clock",          "wheel_directions",
                                       "thresholds"});
    for (const auto& [key, place] : members) {
      read_basics(key, place);
    }
    physical = !drive(robot) ? Names{"inertia", "viscous", "coulomb", "offset"}
               : robot.anisotropic_friction
                   ? Names{"mass", "yaw_inertia", "viscous_x", "viscous_y", "viscous_yaw", "coulomb"}
                   : Names{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw", "coulomb"};
    for (const auto& [key, place] : members) {
      read_geometry(key, place);
      read_knowledge(key, place);
      read_measurement(key, place);
    }
    demand_geometry();
  }

  void read_basics(const std::string& key, const YamlPlace& place) {
    if (key == "name") {
      robot.name = place.text();
      if (files::one_line(robot.name) != robot.name) {
        place.fail("a name without line ends and control characters");
      }
    } else if (key == "model") {
      const Names models = {"differential_drive", "single_axis"};
      robot.model = models[place.choice(models)];
    } else if (key == "friction") {
      robot.anisotropic_friction = place.choice({"isotropic", "anisotropic"}) == 1;
    }
  }

  void read_geometry(const std::string& key, const YamlPlace& place) {
    const bool geometry =
        key == "wheel_radius" || key == "track_width" || key == "footprint" || key == "lever_arm" || key == "friction";
    if (geometry && !drive(robot)) {
      place.say(key + ": the model single_axis has no " + key + ": expected it with differential_drive only");
    }
    if (key == "wheel_radius") {
      robot.wheel_radius = place.number("metres, > 0 and at most 10",
                                        [](double value) { return value > 0.0 && value <= longest_radius; });
    } else if (key == "track_width") {
      robot.track_width = place.number("metres, > 0 and at most 100",
                                       [](double value) { return value > 0.0 && value <= longest_track; });
    } else if (key == "footprint") {
      for (const auto& [name, value] : place.members({"radius"})) {
        robot.footprint_radius = value.number("metres, > 0 and at most 100",
                                              [](double number) { return number > 0.0 && number <= longest_track; });
      }
      if (!robot.footprint_radius) {
        place.fail("the key radius");
      }
    } else if (key == "lever_arm") {
      robot.lever_arm_is_track = place.choice({"half_track", "track"}) == 1;
    }
  }

  static double physical_value(const std::string& name, const YamlPlace& place, std::string_view expected) {
    return name == "offset" ? place.number("a number", [](double) { return true; })
                            : place.number(expected, [](double value) { return value >= 0.0; });
  }

  void read_knowledge(const std::string& key, const YamlPlace& place) {
    if (key == "nominal") {
      for (const auto& [name, value] : place.members(physical)) {
        const bool inert = name == "mass" || name == "yaw_inertia" || name == "inertia";
        robot.nominal[name] = inert ? value.positive() : physical_value(name, value, "a number >= 0");
      }
    } else if (key == "prior") {
      for (const auto& [name, value] : place.members(physical)) {
        const std::string expected =
            name == "offset" ? "two numbers [lo, hi] with lo <= hi" : "two numbers [lo, hi] with 0 <= lo <= hi";
        const auto ends = value.elements(expected);
        if (ends.size() != 2) {
          value.fail(expected);
        }
        const Interval interval{physical_value(name, ends[0], expected), physical_value(name, ends[1], expected)};
        if (interval.lower > interval.upper) {
          ends[1].fail(expected);
        }
        robot.prior[name] = interval;
      }
    } else if (key == "parameters") {
      robot.parameters.emplace();
      for (const YamlPlace& element : place.elements("a list of " + core::listed(physical))) {
        const std::string name = physical[element.choice(physical)];
        if (std::find(robot.parameters->begin(), robot.parameters->end(), name) != robot.parameters->end()) {
          element.fail("each name once");
        }
        robot.parameters->push_back(name);
      }
      if (robot.parameters->empty()) {
        place.fail("at least one of " + core::listed(physical));
      }
    } else if (key == "kinematic") {
      for (const auto& [name, value] : place.members({"window"})) {
        robot.kinematic_window = value.positive();
      }
    } else if (key == "thresholds") {
      const Names outputs =
          drive(robot) ? Names{"sum", "difference", "longitudinal", "lateral", "yaw", "gyro_yaw"} : Names{"effort"};
      for (const auto& [name, value] : place.members(outputs)) {
        robot.thresholds[name] = value.positive();
      }
    } else if (key == "limits") {
      for (const auto& [name, value] : place.members({"effort", "speed", "acceleration"})) {
        robot.limits[name] = value.positive();
      }
    } else if (key == "motor") {
      read_motor(place);
    } else if (key == "effects") {
      read_effects(place, robot);
    }
  }

  void read_motor(const YamlPlace& place) {
    model::Motor motor;
    for (const auto& [name, value] : place.members({"torque_constant", "resistance", "back_emf", "gear_ratio"})) {
      const double number = value.positive();
      if (name == "torque_constant") {
        motor.torque_constant = number;
      } else if (name == "resistance") {
        motor.resistance = number;
      } else if (name == "back_emf") {
        motor.back_emf = number;
      } else {
        motor.gear_ratio = number;
      }
    }
    robot.motor = motor;
  }

  void read_measurement(const std::string& key, const YamlPlace& place) {
    if (key == "effort") {
      for (const auto& [name, value] : place.members({"kind", "hold", "unsigned", "changes", "delay", "smoothing"})) {
        if (name == "kind") {
          robot.effort = static_cast<model::EffortKind>(value.choice({"torque", "current", "voltage"}));
        } else if (name == "hold") {
          robot.hold = static_cast<Hold>(value.choice({"zero_order", "first_order"}));
        } else if (name == "changes") {
          robot.effort_changes = static_cast<model::EffortChanges>(value.choice({"between", "at_samples"}));
        } else if (name == "delay") {
          robot.effort_delay = delay(value);
          robot.effort_time_origin = model::EffortTimeOrigin::declared;
        } else if (name == "smoothing") {
          robot.effort_smoothing = delay(value, 0.0);
        } else {
          robot.effort_unsigned = value.boolean();
        }
      }
    } else if (key == "clock") {
      read_clock(place);
    } else if (key == "noise") {
      read_noise(place);
    } else if (key == "filter") {
      read_filter(place);
    } else if (key == "encoder_counts_per_turn") {
      robot.encoder_counts_per_turn = place.positive();
    } else if (key == "speed_source") {
      robot.speed_source = static_cast<model::SpeedSource>(place.choice({"auto", "encoder_difference", "measured"}));
    } else if (key == "speed_filter") {
      read_speed_filter(place);
    } else if (key == "speed_cut") {
      model::SpeedCut cut;
      for (const auto& [name, value] : place.members({"unit", "towards"})) {
        if (name == "unit") {
          cut.unit = value.positive();
        } else {
          cut.down = value.choice({"zero", "below"}) == 1;
        }
      }
      if (!(cut.unit > 0.0)) {
        place.fail("the key unit");
      }
      robot.speed_cut = cut;
    } else if (key == "pose_source") {
      robot.pose_source = static_cast<model::PoseSource>(place.choice({"auto", "independent"}));
    } else if (key == "wheel_directions") {
      robot.wheel_directions_checked = place.choice({"unknown", "checked"}) == 1;
    } else if (key == "heading_offset") {
      robot.heading_offset =
          place.number("an angle in rad, between -3.2 and 3.2", [](double value) { return std::abs(value) <= 3.2; });
    }
  }

  void read_speed_filter(const YamlPlace& place) {
    constexpr std::string_view expected = "seconds > 0 and at most 1, or two such numbers [lo, hi] with lo <= hi";
    const auto seconds = [&](const YamlPlace& end) {
      return end.number(expected, [](double value) { return value > 0.0 && value <= longest_delay; });
    };
    model::SpeedFilter filter;
    for (const auto& [name, value] : place.members({"kind", "order", "time", "found"})) {
      if (name == "kind") {
        filter.kind = static_cast<model::SpeedFilterKind>(value.choice({"exponential", "lag", "mean"}));
      } else if (name == "order") {
        filter.order = 1 + static_cast<int>(value.choice({"1", "2"}));
      } else if (name == "found") {
        filter.found = value.boolean();
      } else if (value.is_scalar()) {
        filter.time.lower = filter.time.upper = seconds(value);
      } else {
        const auto ends = value.elements(expected);
        if (ends.size() != 2) {
          value.fail(expected);
        }
        filter.time = {seconds(ends[0]), seconds(ends[1])};
        if (filter.time.lower > filter.time.upper) {
          ends[1].fail(expected);
        }
      }
    }
    if (!(filter.time.lower > 0.0)) {
      place.fail("the key time");
    }
    if (filter.order == 2 && filter.kind != model::SpeedFilterKind::exponential) {
      place.fail("order 1, or kind exponential");
    }
    robot.speed_filter = filter;
  }

  static Interval delay(const YamlPlace& place, double least = -longest_delay) {
    const std::string expected =
        fmt::format("seconds between {:g} and {:g}, or two such numbers [lo, hi] with lo <= hi", least, longest_delay);
    const auto seconds = [&](const YamlPlace& end) {
      return end.number(expected, [&](double value) { return value >= least && value <= longest_delay; });
    };
    if (place.is_scalar()) {
      const double both = seconds(place);
      return {both, both};
    }
    const auto ends = place.elements(expected);
    if (ends.size() != 2) {
      place.fail(expected);
    }
    const Interval interval{seconds(ends[0]), seconds(ends[1])};
    if (interval.lower > interval.upper) {
      ends[1].fail(expected);
    }
    return interval;
  }

  void read_clock(const YamlPlace& place) {
    robot.clock.emplace();
    if (place.is_scalar()) {
      place.demand("stamps");
      return;
    }
    for (const auto& [name, value] : place.members({"step", "drift"})) {
      if (name == "step") {
        robot.clock->step = value.positive();
      } else {
        robot.clock->drift =
            value.number("a share >= 0 and below 0.1", [](double share) { return share >= 0.0 && share < 0.1; });
      }
    }
    if (!(robot.clock->step > 0.0)) {
      place.fail("the key step (s)");
    }
  }

  void read_noise(const YamlPlace& place) {
    if (place.is_scalar()) {
      place.demand("estimate");
      return;
    }
    for (const auto& [name, value] :
         place.members({"wheel_speed", "wheel_angle", "effort", "position", "heading", "gyro"})) {
      model::NoiseBound& bound = name == "wheel_speed"   ? robot.noise.wheel_speed
                                 : name == "wheel_angle" ? robot.noise.wheel_angle
                                 : name == "effort"      ? robot.noise.effort
                                 : name == "position"    ? robot.noise.position
                                 : name == "heading"     ? robot.noise.heading
                                                         : robot.noise.gyro;
      if (value.is_mapping()) {
        read_error_class(value, bound);
      } else if (!(value.is_scalar() && value.text() == "estimate")) {
        bound.value = value.number("a bound >= 0, or estimate", [](double number) { return number >= 0.0; });
      }
    }
  }

  static void read_error_class(const YamlPlace& place, model::NoiseBound& bound) {
    const auto not_negative = [](double number) { return number >= 0.0; };
    for (const auto& [name, value] : place.members({"bound", "bias", "correlation", "deviation"})) {
      if (name == "bound") {
        bound.value = value.number("a bound >= 0", not_negative);
      } else if (name == "bias") {
        bound.bias = value.number("a bias >= 0", not_negative);
      } else if (name == "deviation") {
        bound.deviation = value.number("a root mean square > 0", [](double number) { return number > 0.0; });
      } else {
        bound.correlation =
            value.number("a time from 0 to 600 s", [](double time) { return time >= 0.0 && time <= 600.0; });
      }
    }
    if (!bound.value || !bound.bias || *bound.bias > *bound.value || bound.deviation.value_or(0.0) > *bound.value) {
      place.fail(
          "{bound: B, bias: b, deviation: s, correlation: seconds} with 0 <= b <= B and 0 < s <= B (deviation and "
          "correlation may be left out)");
    }
  }

  void read_filter(const YamlPlace& place) {
    if (place.is_scalar()) {
      place.demand("auto");
      return;
    }
    for (const auto& [name, value] : place.members({"order", "alpha", "beta"})) {
      if (value.is_scalar() && value.text() == "auto") {
        continue;
      }
      if (name == "order") {
        robot.filter.order = static_cast<int>(
            value.number("1, 2 or auto", [](double number) { return number == 1.0 || number == 2.0; }));
      } else {
        const double rate = value.number("a rate > 0 in 1/s, or auto", [](double number) { return number > 0.0; });
        (name == "alpha" ? robot.filter.alpha : robot.filter.beta) = rate;
      }
    }
  }

  void demand_geometry() const {
    if (drive(robot) && robot.wheel_radius == 0.0) {
      root.say("no key wheel_radius: expected it (m) for the model differential_drive");
    }
    if (drive(robot) && robot.track_width == 0.0) {
      root.say("no key track_width: expected it (m) for the model differential_drive");
    }
  }
};

/// A key of a YAML file and its value: JSON on one line is YAML's flow style.
std::string yaml_line(const std::string& key, const Json& value) {
  return key + ": " + files::json_text(value, -1) + "\n";
}

Robot read_from(const YamlPlace& root) {
  RobotReader reader{root, {}, {}};
  reader.read();
  return reader.robot;
}

}  // namespace

Robot parse_robot(std::string_view text, const std::string& file) { return read_from(YamlPlace::parse(text, file)); }

Robot read_robot(const std::filesystem::path& path) {
  return parse_robot(files::read_bytes(path, longest_robot_file), path.string());
}

ColumnMap read_columns(const std::filesystem::path& path, const std::vector<std::string>& names) {
  const std::string text = files::read_bytes(path, longest_model_file);
  std::optional<YamlPlace> columns;
  try {
    if (files::is_json_object(text)) {
      const Json robot = files::parse_json(text, path.string()).at("robot");
      if (robot.contains("columns")) {
        columns = YamlPlace::parse(files::json_text(robot["columns"], -1), path.string() + ": /robot/columns");
      }
    } else if (text.size() <= longest_robot_file) {  // else read_robot() refuses it
      for (const auto& [key, place] : YamlPlace::parse(text, path.string()).members()) {
        if (key == "columns") {
          columns = place;
        }
      }
    }
  } catch (const InputError&) {
  } catch (const Json::exception&) {
  }
  ColumnMap map;
  if (columns) {
    for (const auto& [name, column] : columns->members(names)) {
      map[name] = column.text();
    }
  }
  return map;
}

std::string columns_yaml(const ColumnMap& columns) { return columns.empty() ? "" : yaml_line("columns", columns); }

Robot robot_from_json(const Json& object, const std::string& where) {
  // JSON is YAML: one reader, one set of rules.
  return read_from(YamlPlace::parse(files::json_text(object), where, false));
}

namespace {

Json noise_bound(const model::NoiseBound& bound) {
  if (!bound.value || !bound.bias) {
    return bound.value ? Json(*bound.value) : Json("estimate");
  }
  Json out = {{"bound", *bound.value}, {"bias", *bound.bias}};
  if (bound.correlation > 0.0) {
    out["correlation"] = bound.correlation;
  }
  if (bound.deviation) {
    out["deviation"] = *bound.deviation;
  }
  return out;
}

Json noise_of(const model::SensorNoise& noise) {
  Json out = {{"wheel_speed", noise_bound(noise.wheel_speed)},
              {"wheel_angle", noise_bound(noise.wheel_angle)},
              {"effort", noise_bound(noise.effort)},
              {"position", noise_bound(noise.position)},
              {"heading", noise_bound(noise.heading)}};
  if (noise.gyro.value) {
    out["gyro"] = noise_bound(noise.gyro);
  }
  return out;
}

Json filter_of(const model::FilterWish& filter) {
  Json out = Json::object();
  if (filter.order) {
    out["order"] = *filter.order;
  }
  if (filter.alpha) {
    out["alpha"] = *filter.alpha;
  }
  if (filter.beta) {
    out["beta"] = *filter.beta;
  }
  return out.empty() ? Json("auto") : out;
}

Json motor_of(const model::Motor& motor) {
  Json out = {{"gear_ratio", motor.gear_ratio}};
  if (motor.torque_constant) {
    out["torque_constant"] = *motor.torque_constant;
  }
  if (motor.resistance) {
    out["resistance"] = *motor.resistance;
  }
  if (motor.back_emf) {
    out["back_emf"] = *motor.back_emf;
  }
  return out;
}

Json effects_of(const std::vector<model::RobotEffect>& effects) {
  Json out = Json::array();
  for (const model::RobotEffect& effect : effects) {
    Json entry = {{"effect", effect.name}};
    for (const auto& [name, known] : effect.parameters) {
      entry[name] = known.lower == known.upper ? Json(known.lower) : Json::array({known.lower, known.upper});
    }
    out.push_back(std::move(entry));
  }
  return out;
}

}  // namespace

Json to_json(const Robot& robot) {
  constexpr std::array efforts = {"torque", "current", "voltage"};
  constexpr std::array holds = {"zero_order", "first_order"};
  constexpr std::array changes = {"between", "at_samples"};
  constexpr std::array sources = {"auto", "encoder_difference", "measured"};
  Json out = {{"name", robot.name}, {"model", robot.model}};
  if (robot.model == "differential_drive") {
    out["wheel_radius"] = robot.wheel_radius;
    out["track_width"] = robot.track_width;
    if (robot.footprint_radius) {
      out["footprint"] = {{"radius", *robot.footprint_radius}};
    }
    out["lever_arm"] = robot.lever_arm_is_track ? "track" : "half_track";
    out["friction"] = robot.anisotropic_friction ? "anisotropic" : "isotropic";
  }
  if (robot.parameters) {
    out["parameters"] = *robot.parameters;
  }
  out["effort"] = {{"kind", efforts[static_cast<std::size_t>(robot.effort)]},
                   {"hold", holds[static_cast<std::size_t>(robot.hold)]},
                   {"unsigned", robot.effort_unsigned},
                   {"changes", changes[static_cast<std::size_t>(robot.effort_changes)]}};
  if (robot.effort_time_origin != model::EffortTimeOrigin::untold || robot.effort_delay != Interval{}) {
    out["effort"]["delay"] = Json::array({robot.effort_delay.lower, robot.effort_delay.upper});
  }
  if (robot.effort_smoothing != Interval{}) {
    out["effort"]["smoothing"] = Json::array({robot.effort_smoothing.lower, robot.effort_smoothing.upper});
  }
  for (const auto& [name, value] : robot.nominal) {
    out["nominal"][name] = value;
  }
  for (const auto& [name, bounds] : robot.prior) {
    out["prior"][name] = Json::array({bounds.lower, bounds.upper});
  }
  out["noise"] = noise_of(robot.noise);
  out["filter"] = filter_of(robot.filter);
  if (robot.encoder_counts_per_turn) {
    out["encoder_counts_per_turn"] = *robot.encoder_counts_per_turn;
  }
  if (robot.clock) {
    out["clock"] =
        robot.clock->step > 0.0 ? Json{{"step", robot.clock->step}, {"drift", robot.clock->drift}} : Json("stamps");
  }
  out["speed_source"] = sources[static_cast<std::size_t>(robot.speed_source)];
  if (robot.speed_filter) {
    constexpr std::array filters = {"exponential", "lag", "mean"};
    const model::SpeedFilter& filter = *robot.speed_filter;
    out["speed_filter"] = {{"kind", filters[static_cast<std::size_t>(filter.kind)]},
                           {"order", filter.order},
                           {"time", Json::array({filter.time.lower, filter.time.upper})},
                           {"found", filter.found}};
  }
  if (robot.speed_cut) {
    out["speed_cut"] = {{"unit", robot.speed_cut->unit}, {"towards", robot.speed_cut->down ? "below" : "zero"}};
  }
  if (robot.pose_source == model::PoseSource::independent) {
    out["pose_source"] = "independent";
  }
  if (robot.wheel_directions_checked) {
    out["wheel_directions"] = "checked";
  }
  if (robot.heading_offset != 0.0) {
    out["heading_offset"] = robot.heading_offset;
  }
  for (const auto& [name, value] : robot.limits) {
    out["limits"][name] = value;
  }
  if (robot.kinematic_window) {
    out["kinematic"] = {{"window", *robot.kinematic_window}};
  }
  for (const auto& [name, value] : robot.thresholds) {
    out["thresholds"][name] = value;
  }
  if (robot.motor) {
    out["motor"] = motor_of(*robot.motor);
  }
  if (!robot.effects.empty()) {
    out["effects"] = effects_of(robot.effects);
  }
  return out;
}

std::string robot_yaml(const Robot& robot) {
  std::string text;
  const Json object = to_json(robot);
  for (const auto& member : object.items()) {
    text += yaml_line(member.key(), member.value());
  }
  return text;
}

void write_robot(const std::filesystem::path& path, const Robot& robot) {
  files::atomic_write(path, robot_yaml(robot));
}

}  // namespace wheelwright::robots
