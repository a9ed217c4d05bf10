// SPDX-License-Identifier: Apache-2.0
#include <array>

#include <nlohmann/json.hpp>

#include <wheelwright/files/atomic_file.hpp>
#include <wheelwright/robots/robot_file.hpp>

namespace wheelwright {
namespace {

Json noise_bound(const NoiseBound& bound) { return bound.value ? Json(*bound.value) : Json("estimate"); }

Json noise_of(const SensorNoise& noise) {
  return {{"wheel_speed", noise_bound(noise.wheel_speed)},
          {"wheel_angle", noise_bound(noise.wheel_angle)},
          {"effort", noise_bound(noise.effort)},
          {"position", noise_bound(noise.position)},
          {"heading", noise_bound(noise.heading)}};
}

Json filter_of(const FilterWish& filter) {
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

Json motor_of(const Motor& motor) {
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

Json effects_of(const std::vector<RobotEffect>& effects) {
  Json out = Json::array();
  for (const RobotEffect& effect : effects) {
    Json entry = {{"effect", effect.name}};
    for (const auto& [name, known] : effect.parameters) {
      entry[name] = known.lower == known.upper ? Json(known.lower) : Json::array({known.lower, known.upper});
    }
    out.push_back(std::move(entry));
  }
  return out;
}

/// A key of a YAML file and its value: JSON on one line is YAML's flow style.
std::string yaml_line(const std::string& key, const Json& value) { return key + ": " + json_text(value, -1) + "\n"; }

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
                   {"changes", changes[static_cast<std::size_t>(robot.effort_changes)]},
                   {"delay", Json::array({robot.effort_delay.lower, robot.effort_delay.upper})}};
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
  out["speed_source"] = sources[static_cast<std::size_t>(robot.speed_source)];
  for (const auto& [name, value] : robot.limits) {
    out["limits"][name] = value;
  }
  if (robot.kinematic_window) {
    out["kinematic"] = {{"window", *robot.kinematic_window}};
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

void write_robot(const std::filesystem::path& path, const Robot& robot) { atomic_write(path, robot_yaml(robot)); }

}  // namespace wheelwright
