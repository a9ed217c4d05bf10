// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/known_logger.hpp"

#include <algorithm>
#include <cstddef>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "formats/files/words.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::logs {

std::string known_logger(const std::vector<std::string>& fields) {
  const auto ending = [&](std::string_view name) {
    const auto found = std::ranges::find_if(fields, [&](const std::string& field) { return field.ends_with(name); });
    return found == fields.end() ? std::string() : *found;
  };
  if (const std::string speed = ending("erpm"); !speed.empty() && !ending("ms_today").empty()) {
    return fmt::format(
        "; this is a log of VESC Tool, of one motor: as one axis it is read with columns: {{t: {}*0.001, velocity: "
        "{}*F, effort: {}*K}} in the robot file, where F is the number 0.10472/(pole pairs · gear ratio) and K torque "
        "constant · gear ratio; for a robot on two wheels join the logs of both motors by time first "
        "(docs/use/formats.md)",
        ending("ms_today"), speed, ending("q_axis_current"));
  }
  const std::string right = ending("axis0.encoder.vel_estimate"), left = ending("axis1.encoder.vel_estimate");
  const std::string right_current = ending("axis0.motor.current_control.Iq_measured"),
                    left_current = ending("axis1.motor.current_control.Iq_measured");
  if (!right.empty() && !left.empty()) {
    return fmt::format(
        "; this is a log of an ODrive, in turns/s of the motors: where axis0 is the right wheel it is read with "
        "columns: "
        "{{omega_r: {}*F, omega_l: {}*F{}}} in the robot file, where F is the number 6.2832/(gear ratio); a motor that "
        "turns backwards when the robot drives ahead has -F, and *-1 behind its current (docs/use/formats.md)",
        right, left,
        right_current.empty() || left_current.empty()
            ? ""
            : fmt::format(", current_r: {}, current_l: {}", right_current, left_current));
  }
  if (!ending("%time").empty() && !ending("field.velocity0").empty()) {
    return "; this is what `rostopic echo -p` writes of a JointState: where field.name1 holds the right wheel it is "
           "read "
           "with --map omega_r=field.velocity1 --map tau_r=field.effort1, and the left one likewise";
  }
  return {};
}

std::string headerless_logger(const std::vector<std::string>& fields, const std::string& file) {
  constexpr std::size_t stamp = 3;  // s, ns, frame
  const std::string record =
      "; `ros2 topic echo --csv` writes such tables: a recording (`ros2 bag record TOPIC`) has the names, too";
  const std::size_t joints = fields.size() > stamp ? (fields.size() - stamp) / 4 : 0;
  if (joints < 2 || fields.size() != stamp + 4 * joints) {
    return record;
  }
  std::string names = "t", format = "%d.%09d", values = "$1,$2";
  for (std::size_t k = 0; k < joints; ++k) {
    const std::string& joint = fields[stamp + k];
    const std::string side = files::to_number(joint) ? std::string() : side_of_joint(joint);
    for (const auto& [quantity, part] : {std::pair("phi_", 1), std::pair("omega_", 2), std::pair("tau_", 3)}) {
      const std::size_t at = stamp + static_cast<std::size_t>(part) * joints + k;
      if (side.empty() || !files::to_number(fields[at])) {
        continue;
      }
      names += fmt::format(",{}{}", quantity, side);
      format += ",%s";
      values += fmt::format(",${}", at + 1);
    }
  }
  const std::size_t wheels = static_cast<std::size_t>(std::ranges::count(names, ',')) / 3;
  return wheels != 2 ? record
                     : fmt::format(
                           "; it looks like `ros2 topic echo --csv` of a JointState: (echo \"{}\"; awk -F, '{{printf "
                           "\"{}\\n\", {}}}' {}) > with_names.csv makes a table of it",
                           names, format, values, file);
}

}  // namespace wheelwright::logs
