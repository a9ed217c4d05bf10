// SPDX-License-Identifier: Apache-2.0
#include "app/log_files.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "app/common.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"

namespace wheelwright::app {

logs::LogOptions reader_options(const CommonOptions& options) {
  logs::LogOptions reader;
  reader.leaps = false;
  reader.msg_path = options.msg_path;
  reader.trust = options.trust;
  reader.map = options.columns;
  for (const auto& [name, column] : options.columns) {
    reader.or_by_name.push_back(name);
  }
  for (const std::string& entry : options.map) {
    const std::size_t at = entry.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == entry.size()) {
      throw InputError("--map '" + entry + "': expected NAME=COLUMN, e.g. --map omega_r=wheel_2");
    }
    const std::string name = entry.substr(0, at);
    if (logs::find_log_column(name) == nullptr) {
      const std::vector<std::string> names = logs::log_column_names();
      throw InputError("--map '" + entry + "': " + files::shown(name) + " is no column of a log: expected one of " +
                       core::listed(names) + files::did_you_mean(name, names));
    }
    std::string column = entry.substr(at + 1);
    if (const auto declared = reader.map.find(name); declared != reader.map.end()) {
      if (const auto factor = logs::factor_alone(column)) {  // of what the robot file names
        const auto [field, own] = logs::split_factor(declared->second);
        column = fmt::format("{}*{:.17g}", field, own * *factor);
      }
    }
    reader.map[name] = column;
    std::erase(reader.or_by_name, name);
  }
  return reader;
}

logs::LogOptions robot_reader(const Robot& robot, const CommonOptions& options) {
  logs::LogOptions reader = reader_options(options);
  reader.only = robots::useful_columns(robot);
  reader.heading_offset = robot.heading_offset;
  reader.clock = robot.clock;
  return reader;
}

std::unique_ptr<logs::RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                                  const CommonOptions& options) {
  return logs::open_log(paths, robot_reader(robot, options));
}

std::unique_ptr<logs::LogWriter> create_output(const std::filesystem::path& out, const std::vector<std::string>& names,
                                               const logs::LogWriteOptions& options) {
  return is_stream(out) && !out.has_extension() ? logs::create_csv(out, names) : logs::create_log(out, names, options);
}

void print_log(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    say("log: {}\n", sentence);
  }
}

}  // namespace wheelwright::app
