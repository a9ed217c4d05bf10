// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/recorded_log.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/known_logger.hpp"
#include "formats/logs/wall_clock.hpp"

namespace wheelwright::logs {
namespace {

struct Row {
  std::string_view name, meaning, unit;
  double limit;
  std::string_view spellings;
};

/// A name that ends in '@' is two columns, _r and _l.
constexpr Row table[] = {
    {"t", "time", "s", 1e11,
     "time stamp timestamp time_stamp %time sec secs seconds time_s time_sec t_s t_sec elapsed elapsed_s elapsed_time "
     "header_stamp"},
    {"omega_@", "speed of the @ wheel", "rad/s", 1e4,
     "@_omega w_@ w@ omega@ omega_wheel_@ wheel_@_omega wheel_omega_@ wheel_@_vel wheel_@_velocity wheel_@_speed "
     "@_wheel_vel @_wheel_velocity @_wheel_speed wheel_vel_@ wheel_velocity_@ wheel_speed_@ @_wheel_angular_velocity"},
    {"phi_@", "angle of the @ wheel", "rad", 1e9,
     "@_phi phi@ angle_@ @_angle wheel_@_angle @_wheel_angle wheel_angle_@ wheel_@_pos wheel_@_position @_wheel_pos "
     "@_wheel_position wheel_pos_@ wheel_position_@"},
    {"tau_@", "torque at the @ wheel", "N·m", 1e6,
     "@_tau tau@ torque_@ @_torque wheel_@_torque @_wheel_torque wheel_torque_@ effort_@ @_effort wheel_@_effort "
     "@_wheel_effort wheel_effort_@"},
    {"current_@", "current of the @ motor", "A", 1e5,
     "@_current i_@ abs_current_@ current_abs_@ motor_current_@ @_motor_current motor_@_current wheel_@_current "
     "@_wheel_current"},
    {"voltage_@", "voltage of the @ motor", "V", 1e5,
     "@_voltage u_@ volt_@ motor_voltage_@ @_motor_voltage motor_@_voltage wheel_@_voltage @_wheel_voltage"},
    {"x", "pose, first coordinate", "m", 1e7, "pos_x position_x pose_x x_m pose_position_x pose_pose_position_x"},
    {"y", "pose, second coordinate", "m", 1e7, "pos_y position_y pose_y y_m pose_position_y pose_pose_position_y"},
    {"theta", "heading", "rad", 1e6, "yaw heading pose_theta pose_yaw orientation_yaw psi"},
    {"gyro_z", "measured yaw rate", "rad/s", 1e4,
     "gz yaw_rate angular_velocity_z imu_gyro_z imu_angular_velocity_z imu_wz"},
    {"accel_x", "measured forward acceleration", "m/s²", 1e5,
     "ax acc_x acceleration_x linear_acceleration_x imu_accel_x imu_acc_x imu_linear_acceleration_x"},
    {"position", "position of the axis", "m or rad", 1e9, "pos q joint_position axis_position"},
    {"velocity", "speed of the axis", "m/s or rad/s", 1e5, "vel dq qd joint_velocity axis_velocity"},
    {"effort", "force or torque of the axis", "N or N·m", 1e8, "force tau torque joint_effort axis_effort"},
    {"command_@", "commanded speed of the @ wheel", "rad/s", 1e4,
     "@_command cmd_@ @_cmd command_omega_@ omega_command_@ cmd_omega_@ omega_cmd_@ omega_ref_@ omega_@_cmd "
     "omega_@_ref wheel_@_command wheel_@_cmd @_wheel_command @_wheel_cmd wheel_command_@ wheel_cmd_@"},
};

std::string replace_side(std::string_view text, std::string_view side) {
  std::string out;
  for (const char c : text) {
    out += c == '@' ? std::string(side) : std::string(1, c);
  }
  return out;
}

struct Columns {
  std::vector<LogColumn> columns;
  std::vector<std::string> meanings;         ///< storage of the meanings that name a side
  std::map<std::string, std::size_t> known;  ///< plain spelling -> column

  Columns() {
    meanings.reserve(2 * std::size(table));
    for (const Row& row : table) {
      if (row.name.back() == '@') {
        add(row, "r", "right");
        add(row, "l", "left");
      } else {
        add(row, "", "");
      }
    }
  }

  void add(const Row& row, std::string_view letter, std::string_view word) {
    meanings.push_back(replace_side(row.meaning, word));
    columns.push_back({replace_side(row.name, letter), meanings.back(), row.unit, row.limit, row.spellings});
    const std::size_t index = columns.size() - 1;
    known[columns.back().name] = index;
    std::size_t begin = 0;
    while (begin < row.spellings.size()) {
      const std::size_t end = std::min(row.spellings.find(' ', begin), row.spellings.size());
      const std::string_view spelling = row.spellings.substr(begin, end - begin);
      known.emplace(replace_side(spelling, letter), index);
      known.emplace(replace_side(spelling, word), index);
      begin = end + 1;
    }
    if (!letter.empty()) {
      known.emplace(replace_side(row.name, word), index);
    }
  }
};

const Columns& all() {
  static const Columns columns;
  return columns;
}

/// Drops "[unit]" or "(unit)" at the end of `text` and returns the unit; empty where there is none.
std::string_view take_unit(std::string_view& text) {
  while (!text.empty() && text.back() == ' ') {
    text.remove_suffix(1);
  }
  if (text.empty() || (text.back() != ']' && text.back() != ')')) {
    return {};
  }
  const std::size_t open = text.find_last_of(text.back() == ']' ? '[' : '(');
  if (open == std::string_view::npos) {
    return {};
  }
  const std::string_view unit = text.substr(open + 1, text.size() - open - 2);
  text = text.substr(0, open);
  return unit;
}

bool same_unit(std::string_view written, std::string_view expected) {
  const auto plain = [](std::string_view unit) {
    std::string out;
    for (const char c : unit) {
      if (c != ' ' && c != '*' && c != '.' && c != '^') {
        out += c;
      }
    }
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"·", ""}, {"²", "2"}}) {
      for (std::size_t at = out.find(from); at != std::string::npos; at = out.find(from)) {
        out.replace(at, from.size(), to);
      }
    }
    return out;
  };
  const std::string unit = plain(written);
  std::size_t begin = 0;
  while (begin <= expected.size()) {
    const std::size_t end = std::min(expected.find(" or ", begin), expected.size());
    if (unit == plain(expected.substr(begin, end - begin))) {
      return true;
    }
    begin = end + 4;
  }
  return false;
}

/// Words of a name: split at what is no letter, and before a capital behind a small letter.
std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> words(1);
  char before = '_';
  for (const char c : name) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalpha(u) == 0) {
      words.emplace_back();
    } else {
      if (std::isupper(u) != 0 && std::islower(static_cast<unsigned char>(before)) != 0) {
        words.emplace_back();
      }
      words.back() += static_cast<char>(std::tolower(u));
    }
    before = c;
  }
  std::erase(words, "");
  return words;
}

bool has_word(const std::vector<std::string>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

/// Parts of "/joint_states/left_wheel_joint/velocity", as PlotJuggler writes fields of messages.
std::vector<std::string> path_parts(std::string_view text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == '/') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  std::erase(parts, "");
  return parts;
}

/// The column that a path of at least three parts names by its last ones; empty where it names none.
std::string column_of_path(std::string_view text) {
  const std::vector<std::string> parts = path_parts(text);
  if (parts.size() < 3) {
    return {};
  }
  const std::string& last = parts.back();
  const std::string& before = parts[parts.size() - 2];
  if ((before == "position" || before == "orientation") && parts[parts.size() - 3] == "pose") {
    return before == "orientation" ? (last == "yaw" ? "theta" : "") : last == "x" || last == "y" ? last : "";
  }
  if (before == "angular_velocity" || before == "linear_acceleration") {
    return before == "angular_velocity" ? (last == "z" ? "gyro_z" : "") : last == "x" ? "accel_x" : "";
  }
  const std::string side = side_of_joint(before);
  const std::string quantity = last == "position"   ? "phi_"
                               : last == "velocity" ? "omega_"
                               : last == "effort"   ? "tau_"
                                                    : "";
  return side.empty() || quantity.empty() || plain_name(before).find("wheel") == std::string::npos ? ""
                                                                                                   : quantity + side;
}

}  // namespace

std::span<const LogColumn> log_columns() { return all().columns; }

std::vector<std::string> log_column_names() {
  std::vector<std::string> names;
  for (const LogColumn& column : log_columns()) {
    names.push_back(column.name);
  }
  return names;
}

const LogColumn* find_log_column(std::string_view name) {
  const auto columns = log_columns();
  const auto it = std::find_if(columns.begin(), columns.end(), [&](const LogColumn& c) { return c.name == name; });
  return it == columns.end() ? nullptr : &*it;
}

const LogColumn* recognise_log_column(std::string_view text) {
  const std::string_view unit = take_unit(text);
  const auto it = all().known.find(plain_name(text));
  if (it == all().known.end()) {
    return find_log_column(column_of_path(text));
  }
  const LogColumn& column = all().columns[it->second];
  return unit.empty() || same_unit(unit, column.unit) ? &column : nullptr;
}

int row_weight(std::string_view name) {
  const auto begins = [&](std::initializer_list<std::string_view> words) {
    return std::ranges::any_of(words, [&](std::string_view word) { return name.starts_with(word); });
  };
  return begins({"tau", "current", "voltage", "effort"})    ? 10000
         : begins({"omega", "phi", "position", "velocity"}) ? 100
                                                            : 1;
}

namespace {

// What names of joints call the sides: parts of a name, and whole words of it.
constexpr std::array<std::string_view, 16> right_parts = {"right",  "rechte", "rechts", "droit", "derech", "direit",
                                                          "destra", "destro", "dcho",   "dcha",  "prawy",  "prawe",
                                                          "prawa",  "прав",   "右",     "오른"};
constexpr std::array<std::string_view, 15> left_parts = {"left",    "linke",   "links", "gauche", "izquierd",
                                                         "esquerd", "sinistr", "izdo",  "izda",   "lewy",
                                                         "lewe",    "lewa",    "лев",   "左",     "왼"};
constexpr std::array<std::string_view, 9> right_words = {"r", "fr", "rr", "br", "mr", "rf", "dx", "rwheel", "rmotor"};
constexpr std::array<std::string_view, 11> left_words = {"l",  "fl", "rl", "bl",     "ml",    "lf",
                                                         "lr", "lb", "sx", "lwheel", "lmotor"};

}  // namespace

std::string side_of_joint(const std::string& name) {
  const std::vector<std::string> words = words_of(name);
  const std::string plain = plain_name(name);
  const auto has_part = [&](std::string_view part) { return plain.find(part) != std::string::npos; };
  const auto is_word = [&](std::string_view word) { return has_word(words, word); };
  bool right = std::ranges::any_of(right_parts, has_part), left = std::ranges::any_of(left_parts, has_part);
  if (!right && !left) {  // only then letters count: they may be those of a robot's name
    right = std::ranges::any_of(right_words, is_word);
    left = std::ranges::any_of(left_words, is_word);
  }
  return right == left ? "" : right ? "r" : "l";
}

bool names_wheel(const std::string& plain) {
  constexpr std::array<std::string_view, 9> parts = {"wheel", "whl",  "rueda", "roue", "ruota",
                                                     "roda_", "wiel", "колес", "轮"};
  const std::vector<std::string> words = words_of(plain);
  return std::ranges::any_of(parts, [&](std::string_view part) { return plain.find(part) != std::string::npos; }) ||
         has_word(words, "rad") || has_word(words, "kolo") || has_word(words, "roda");
}

std::string plain_name(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const bool gap = c == ' ' || c == '-' || c == '.' || c == '/' || c == '_';
    if (!gap) {
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    } else if (!out.empty() && out.back() != '_') {
      out += '_';
    }
  }
  if (!out.empty() && out.back() == '_') {
    out.pop_back();
  }
  return out;
}

std::string clock_time(const LogFileReport& file, double t) {
  return is_since_1970(file.time_origin) && std::isfinite(t)
             ? moment_text(static_cast<std::int64_t>(file.time_origin), t, file.time_zone)
             : std::string();
}

std::vector<core::ColumnError> interpolation_errors(const LogReport& report) {
  std::vector<core::ColumnError> errors;
  for (const LogFileReport& file : report.files) {
    for (const Interpolation& of : file.interpolated) {
      errors.push_back({of.column, of.error});
    }
  }
  return errors;
}

std::vector<std::string> sentences(const LogReport& report) {
  std::vector<std::string> out;
  const auto say = [&](const Occurrences& met, std::string_view one, std::string_view many, std::string_view rest) {
    if (met.count > 0) {
      out.push_back(fmt::format("{} {} {} (first at {})", met.count, met.count == 1 ? one : many, rest, met.first));
    }
  };
  say(report.empty, "row", "rows", "dropped: a field that is needed is empty");
  say(report.not_finite, "row", "rows", "dropped: a value that is needed is NaN or infinite");
  say(report.uncovered, "row", "rows", "dropped: another topic that is used has no samples around their time");
  say(report.duplicates, "row", "rows", "dropped: the same time stamp as the row before");
  say(report.leaps, "row", "rows", "left out, as if lost: a value leaps away and back");
  say(report.truncated, "row", "rows", "dropped: the last line of the file is cut off");
  say(report.resets, "new segment", "new segments", "where time goes backwards");
  say(report.gaps, "new segment", "new segments",
      fmt::format("at gaps longer than 5 x the median step of {:.6g} s", report.median_step));
  say(report.jumps, "new segment", "new segments",
      "where a wheel angle jumps as no wheel turns: it was set back, or is wrapped at another value than 2π");
  say(report.wraps, "jump", "jumps", "of theta by more than π undone, as of a heading in rad that is wrapped at 2π");
  say(report.angle_wraps, "jump", "jumps", "of a wheel angle by a whole turn undone: it was wrapped at 2π");
  for (const LogFileReport& file : report.files) {
    if (file.time_origin != 0.0) {
      const std::string clock = clock_time(file, 0.0);
      out.push_back(fmt::format("{}: times are counted from {:.0f} s of its own clock{}{}", file.path, file.time_origin,
                                clock.empty() ? "" : ", ", clock));
    }
    for (const Interpolation& of : file.interpolated) {
      out.push_back(fmt::format("{}: {} was interpolated between the samples of {}, with an error of at most {:.3g}{}",
                                file.path, of.column, of.topic, of.error,
                                of.error > 0.0 ? ", which is added to a noise bound that the robot file gives" : ""));
    }
    for (const std::string& note : file.notes) {
      out.push_back(note.starts_with(file.path) ? note : fmt::format("{}: {}", file.path, note));
    }
  }
  return out;
}

namespace {

std::vector<std::string> alternatives_of(std::string_view name) {
  std::vector<std::string> out;
  for (std::size_t begin = 0; begin <= name.size();) {
    const std::size_t end = std::min(name.find('|', begin), name.size());
    out.emplace_back(name.substr(begin, end - begin));
    begin = end + 1;
  }
  return out;
}

std::string with_meaning(const std::string& name) {
  const LogColumn* column = find_log_column(name);
  return column == nullptr ? name : fmt::format("{} ({}, {})", name, column->meaning, column->unit);
}

}  // namespace

void require_columns(const LogSource& source, const std::vector<std::string>& names, std::string_view file,
                     const std::vector<std::string>& header) {
  std::vector<std::string> has = header;
  if (has.empty()) {
    has = source.columns();
    has.insert(has.begin(), "t");
  }
  std::string missing, hint;
  for (const std::string& name : names) {
    const auto alternatives = alternatives_of(name);
    if (std::any_of(alternatives.begin(), alternatives.end(),
                    [&](const auto& n) { return n == "t" || source.find(n); })) {
      continue;
    }
    std::string wanted;
    for (const std::string& alternative : alternatives) {
      wanted += (wanted.empty() ? "" : " or ") + with_meaning(alternative);
    }
    missing += (missing.empty() ? "" : "; ") + wanted;
    for (const std::string& alternative : alternatives) {
      const std::string nearest = files::nearest_name(alternative, has);
      if (!nearest.empty() && !source.find(nearest)) {
        hint += fmt::format("; did you mean {}? Then add --map {}={}", files::shown(nearest), alternative, nearest);
        break;
      }
    }
  }
  if (!missing.empty()) {
    throw InputError(fmt::format("{}: no column for {}: the file has {}{}", file, missing, core::listed(has), hint) +
                     known_logger(has));
  }
}

void require_columns(const RecordedLog& log, const std::vector<std::string>& names) {
  const auto demand = [&](const LogFileReport& file) {
    try {
      require_columns(log, names, file.path, file.header);
    } catch (const InputError& error) {
      std::string ways_out;
      for (const std::string& note : file.notes) {
        ways_out += note.find("--map") != std::string::npos ? "; " + note : "";
      }
      throw InputError(error.what() + ways_out);
    }
  };
  for (const LogFileReport& file : log.report().files) {
    const bool lacks = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      const auto alternatives = alternatives_of(name);
      return std::none_of(alternatives.begin(), alternatives.end(), [&](const std::string& alternative) {
        return std::any_of(file.header.begin(), file.header.end(), [&](const std::string& field) {
          const LogColumn* column = recognise_log_column(field);
          return field == alternative || (column != nullptr && column->name == alternative);
        });
      });
    });
    if (lacks) {
      demand(file);
    }
  }
  demand(log.report().files.front());
}

}  // namespace wheelwright::logs
