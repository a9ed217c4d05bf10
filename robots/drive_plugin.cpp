// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/drive_plugin.hpp>

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

#include <wheelwright/files/suggest.hpp>

namespace wheelwright {
namespace {

std::string lower_letters(const XmlPlace& plugin) {
  std::string out;
  for (const char c : plugin.attribute("filename").value_or("") + " " + plugin.attribute("name").value_or("")) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return out;
}

struct PluginReader {
  const XmlPlace& plugin;

  /// The values of the first of `names` that is there.
  [[nodiscard]] std::vector<XmlPlace> all(const std::vector<std::string>& names) const {
    for (const std::string& name : names) {
      if (std::vector<XmlPlace> found = plugin.children(name); !found.empty()) {
        return found;
      }
    }
    return {};
  }

  [[nodiscard]] std::vector<std::string> joints(const std::vector<std::string>& names) const {
    std::vector<std::string> out;
    for (const XmlPlace& place : all(names)) {
      if (place.text().empty()) {
        place.fail("is empty: expected the name of a joint");
      }
      out.push_back(place.text());
    }
    return out;
  }

  [[nodiscard]] std::optional<OriginNumber> number(const std::vector<std::string>& names, double factor = 1.0) const {
    const std::vector<XmlPlace> found = all(names);
    if (found.empty()) {
      return std::nullopt;
    }
    if (found.size() > 1) {
      found[1].fail("stands there twice: expected it once");
    }
    const double value = found.front().number();
    if (!(value > 0.0)) {
      found.front().fail(fmt::format("{}: expected a number > 0", shown(found.front().text())));
    }
    return OriginNumber{factor * value, found.front().place()};
  }
};

}  // namespace

std::optional<DriveFacts> read_drive_plugin(const XmlPlace& plugin) {
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

}  // namespace wheelwright
