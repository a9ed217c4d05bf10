// SPDX-License-Identifier: Apache-2.0
#include "common.hpp"

#include <cstdio>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/files/bytes.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/logs/recorded_log.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/report/signals.hpp>

namespace wheelwright::app {

logs::LogOptions reader_options(const CommonOptions& options) {
  logs::LogOptions reader;
  reader.msg_path = options.msg_path;
  for (const std::string& entry : options.map) {
    const std::size_t at = entry.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == entry.size()) {
      throw InputError("--map '" + entry + "': expected NAME=COLUMN, e.g. --map omega_r=wheel_2");
    }
    const std::string name = entry.substr(0, at);
    if (logs::find_log_column(name) == nullptr) {
      std::vector<std::string> names;
      for (const logs::LogColumn& column : logs::log_columns()) {
        names.push_back(column.name);
      }
      throw InputError("--map '" + entry + "': " + files::shown(name) + " is no column of a log: expected one of " +
                       core::listed(names) + files::did_you_mean(name, names));
    }
    reader.map[name] = entry.substr(at + 1);
  }
  return reader;
}

std::unique_ptr<logs::RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                                  const CommonOptions& options) {
  logs::LogOptions reader = reader_options(options);
  reader.only = robots::useful_columns(robot);
  return logs::open_log(paths, reader);
}

void make_directory(const CommonOptions& options) {
  if (options.out.empty()) {
    return;
  }
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error || !std::filesystem::is_directory(options.out)) {
    throw InputError("--out " + options.out.string() + ": cannot make this directory" +
                     (error ? " (" + error.message() + ")" : "") + ": expected a place where files can be written");
  }
}

void publish(const CommonOptions& options, const Json& result, const std::string& name, const std::string& report) {
  if (!options.out.empty()) {
    files::atomic_write(options.out / "report.html", report);
    files::write_json(options.out / name, result);
  }
  if (options.json) {
    const std::string text = files::json_text(result);
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fputc('\n', stdout);
  }
}

void print_log(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    fmt::print("log: {}\n", sentence);
  }
}

report::ReportContext report_context(const CommonOptions& options, const logs::LogReport& data, LogSource& log) {
  report::ReportContext context;
  for (const logs::LogFileReport& file : data.files) {
    context.log_files.push_back(file.path);
  }
  context.software = results::software();
  context.command_line = options.command_line;
  context.warnings = logs::sentences(data);
  if (!options.out.empty()) {
    context.signals = report::raw_signals(log);
    context.rows = data.rows;
  }
  return context;
}

}  // namespace wheelwright::app
