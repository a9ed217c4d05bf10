// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/controller_file.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "formats/files/bytes.hpp"
#include "formats/files/place.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::robots {

using files::OriginNumber;
using files::YamlPlace;

namespace {

constexpr std::size_t longest_parameters = std::size_t{1} << 20;
constexpr std::size_t deepest_group = 8;  // namespaces above a controller, groups below
constexpr std::size_t most_keys = 20000;  // aliases may multiply a small file

using Parameters = std::map<std::string, YamlPlace>;

/// A controller: its name and all its parameters by dotted name.
struct Controller {
  std::string name;
  Parameters parameters;
  files::FilePlace place;
};

struct ParameterWalk {
  std::size_t keys = 0;
  std::vector<Controller> controllers;
  std::vector<std::string> rates;  ///< remarks

  std::vector<std::pair<std::string, YamlPlace>> members(const YamlPlace& at) {
    auto out = at.members();
    keys += out.size();
    if (keys > most_keys) {
      at.say("holds too many keys: expected the parameters of controllers");
    }
    return out;
  }

  void flatten(const YamlPlace& at, const std::string& prefix, Parameters& out, std::size_t depth) {
    for (const auto& [key, place] : members(at)) {
      const std::string full = prefix.empty() ? key : prefix + "." + key;
      if (place.is_mapping() && depth < deepest_group) {
        flatten(place, full, out, depth + 1);
      } else if (!out.emplace(full, place).second) {
        place.say(full + " stands there twice, dotted and nested: expected it once");
      }
    }
  }

  void find(const YamlPlace& at, const std::string& name, std::size_t depth) {
    const auto inside = members(at);
    const bool drive = std::any_of(inside.begin(), inside.end(), [](const auto& member) {
      static const std::vector<std::string> own = {"wheel_separation", "left_wheel_names", "left_wheel",
                                                   "wheel_radius"};
      return std::find(own.begin(), own.end(), member.first) != own.end();
    });
    if (drive) {
      Controller found{name, {}, {at.where(), "controller " + files::shown(name)}};
      flatten(at, "", found.parameters, 0);
      controllers.push_back(std::move(found));
      return;
    }
    for (const auto& [key, place] : inside) {
      if (place.is_mapping() && depth < deepest_group) {
        find(place, key == "ros__parameters" ? name : key, depth + 1);
      } else if (key == "update_rate") {
        const double rate = place.positive();
        rates.push_back(
            fmt::format("control at {:.6g} Hz: {}: update_rate of {}", rate, place.where(), files::shown(name)));
      }
    }
  }
};

struct ControllerReader {
  const Controller& controller;

  [[nodiscard]] const YamlPlace* find(const std::string& name) const {
    const auto it = controller.parameters.find(name);
    return it == controller.parameters.end() ? nullptr : &it->second;
  }

  [[nodiscard]] std::optional<OriginNumber> positive(const std::string& name, const char* unit) const {
    const YamlPlace* at = find(name);
    if (at == nullptr) {
      return std::nullopt;
    }
    const double value = at->number(std::string("a number > 0") + unit, [](double number) { return number > 0.0; });
    return OriginNumber{value, {at->where(), name}};
  }

  /// A limit that a controller may leave open.
  [[nodiscard]] std::optional<OriginNumber> limit(const std::string& group, const std::string& kind) const {
    const YamlPlace* has = find(group + ".has_" + kind + "_limits");
    const std::string name = group + ".max_" + kind;
    const YamlPlace* at = find(name);
    if (at == nullptr || (has != nullptr && !has->boolean())) {
      return std::nullopt;
    }
    std::string word = at->text("a number");
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    if (word == ".nan" || word == "nan") {
      return std::nullopt;
    }
    return positive(name, "");
  }

  [[nodiscard]] std::vector<std::string> joints(const std::vector<std::string>& keys) const {
    std::vector<std::string> out;
    for (const std::string& key : keys) {
      const YamlPlace* at = find(key);
      if (at == nullptr) {
        continue;
      }
      const std::vector<YamlPlace> places = at->is_scalar() ? std::vector{*at} : at->elements("the names of joints");
      for (const YamlPlace& place : places) {
        const std::string name = place.text("the name of a joint");
        if (name.find("$(") != std::string::npos || name.find("${") != std::string::npos) {
          place.say(
              fmt::format("{}: {}: is put in by a launch file: expected the name itself", key, files::shown(name)));
        }
        if (name.empty()) {
          place.fail("the name of a joint");
        }
        out.push_back(name);
      }
      return out;
    }
    return out;
  }

  void multiply(std::optional<OriginNumber>& number, const std::optional<OriginNumber>& factor) const {
    if (number && factor) {
      number->value *= factor->value;
      number->place.element += fmt::format(" times {} ({})", factor->place.element, factor->place.where);
      if (!(number->value > 0.0) || !std::isfinite(number->value)) {
        throw InputError(fmt::format("{}: {}: {}: expected a finite number > 0", number->place.where,
                                     number->place.element, number->value));
      }
    }
  }

  [[nodiscard]] DriveFacts read() const {
    DriveFacts out;
    out.place = controller.place;
    out.left = joints({"left_wheel_names", "left_wheel"});
    out.right = joints({"right_wheel_names", "right_wheel"});
    out.track_width = positive("wheel_separation", " in m");
    const auto multiplier = positive("wheel_separation_multiplier", "");
    multiply(out.track_width, multiplier);
    out.track_multiplier = multiplier ? multiplier->value : 1.0;
    out.wheel_radius = positive("wheel_radius", " in m");
    multiply(out.wheel_radius, positive("wheel_radius_multiplier", ""));
    const auto left = positive("left_wheel_radius_multiplier", "");
    const auto right = positive("right_wheel_radius_multiplier", "");
    if (left.has_value() != right.has_value() ||
        (left && std::abs(left->value - right->value) > 1e-5 * std::max(left->value, right->value))) {
      const OriginNumber& one = left ? *left : *right;
      throw InputError(fmt::format(
          "{}: {} {} against {}: expected one radius; give the mean of both as --wheel-radius and their difference in "
          "the "
          "robot file, effects: [{{effect: wheel_radius_asymmetric, epsilon: (r_R − r_L)/(r_R + r_L)}}]",
          one.place.where, one.place.element, one.value,
          left && right ? fmt::format("{} of the right", right->value) : std::string("1 of the other side")));
    }
    multiply(out.wheel_radius, left);
    out.speed = limit("linear.x", "velocity");
    out.yaw_rate = limit("angular.z", "velocity");
    out.acceleration = limit("linear.x", "acceleration");
    out.yaw_acceleration = limit("angular.z", "acceleration");
    if (const auto rate = positive("publish_rate", " in Hz")) {
      out.remarks.push_back(fmt::format("odometry at {:.6g} Hz: {}: publish_rate", rate->value, rate->place.where));
    }
    return out;
  }
};

}  // namespace

DriveFacts parse_ros2_control(std::string_view text, const std::string& file, const std::string& controller) {
  ParameterWalk walk;
  walk.find(YamlPlace::parse(text, file), "", 0);
  std::vector<std::string> names;
  for (const Controller& each : walk.controllers) {
    names.push_back(each.name);
  }
  const auto wanted =
      controller.empty() && names.size() == 1 ? names.begin() : std::find(names.begin(), names.end(), controller);
  if (names.empty()) {
    throw InputError(file +
                     ": no diff_drive_controller: expected one with wheel_separation, wheel_radius, "
                     "left_wheel_names, right_wheel_names");
  }
  if (controller.empty() && names.size() > 1) {
    throw InputError(fmt::format("{}: {} controllers of a drive: {}: expected one, or --controller NAME", file,
                                 names.size(), core::listed(names)));
  }
  if (wanted == names.end()) {
    throw InputError(fmt::format("--controller {}: {} has no such controller: expected one of {}{}",
                                 files::shown(controller), file, core::listed(names),
                                 files::did_you_mean(controller, names)));
  }
  const Controller& chosen = walk.controllers[static_cast<std::size_t>(wanted - names.begin())];
  DriveFacts out = ControllerReader{chosen}.read();
  out.remarks.insert(out.remarks.end(), walk.rates.begin(), walk.rates.end());
  return out;
}

DriveFacts read_ros2_control(const std::filesystem::path& path, const std::string& controller) {
  return parse_ros2_control(files::read_bytes(path, longest_parameters), path.string(), controller);
}

namespace {

std::string lower_letters(const files::XmlPlace& plugin) {
  std::string out;
  for (const char c : plugin.attribute("filename").value_or("") + " " + plugin.attribute("name").value_or("")) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

struct PluginReader {
  const files::XmlPlace& plugin;

  /// The values of the first of `names` that is there.
  [[nodiscard]] std::vector<files::XmlPlace> all(const std::vector<std::string>& names) const {
    for (const std::string& name : names) {
      if (std::vector<files::XmlPlace> found = plugin.children(name); !found.empty()) {
        return found;
      }
    }
    return {};
  }

  [[nodiscard]] std::vector<std::string> joints(const std::vector<std::string>& names) const {
    std::vector<std::string> out;
    for (const files::XmlPlace& place : all(names)) {
      if (place.text().empty()) {
        place.fail("is empty: expected the name of a joint");
      }
      out.push_back(place.text());
    }
    return out;
  }

  [[nodiscard]] std::optional<OriginNumber> number(const std::vector<std::string>& names, double factor = 1.0) const {
    const std::vector<files::XmlPlace> found = all(names);
    if (found.empty()) {
      return std::nullopt;
    }
    if (found.size() > 1) {
      found[1].fail("stands there twice: expected it once");
    }
    const double value = found.front().number();
    if (!(value > 0.0)) {
      found.front().fail(fmt::format("{}: expected a number > 0", files::shown(found.front().text())));
    }
    return OriginNumber{factor * value, found.front().place()};
  }
};

}  // namespace

std::optional<DriveFacts> read_drive_plugin(const files::XmlPlace& plugin) {
  const std::string who = lower_letters(plugin);
  if (who.find("skidsteer") != std::string::npos || who.find("mecanum") != std::string::npos) {
    plugin.fail("drives more than two wheels: there is no model of such a robot yet; expected a differential drive");
  }
  if (who.find("diffdrive") == std::string::npos && who.find("differentialdrive") == std::string::npos) {
    return std::nullopt;
  }
  const PluginReader read{plugin};
  DriveFacts out;
  out.place = plugin.place();
  out.left = read.joints({"left_joint", "leftJoint"});
  out.right = read.joints({"right_joint", "rightJoint"});
  out.track_width = read.number({"wheel_separation", "wheelSeparation"});
  out.wheel_radius = read.number({"wheel_radius", "wheelRadius"});
  if (const auto half = read.number({"wheel_diameter", "wheelDiameter"}, 0.5); half && !out.wheel_radius) {
    out.wheel_radius = half;
    out.wheel_radius->place.element = "half of " + half->place.element;
  }
  out.speed = read.number({"max_linear_velocity"});
  out.yaw_rate = read.number({"max_angular_velocity"});
  out.acceleration = read.number({"max_linear_acceleration"});
  out.yaw_acceleration = read.number({"max_angular_acceleration"});
  out.wheel_effort = read.number({"max_wheel_torque", "torque", "wheelTorque"});
  for (const char* name : {"update_rate", "updateRate", "odom_publish_frequency"}) {
    if (const auto rate = read.number({name})) {
      out.remarks.push_back(fmt::format("odometry at {:.6g} Hz: {}", rate->value, rate->place.text()));
    }
  }
  return out;
}

}  // namespace wheelwright::robots
