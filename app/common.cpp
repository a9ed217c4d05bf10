// SPDX-License-Identifier: Apache-2.0
#include "common.hpp"

#include <cstdio>
#include <system_error>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/files/atomic_file.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/logs/log_columns.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/report/signals.hpp>

namespace wheelwright::app {

LogOptions reader_options(const CommonOptions& options) {
  LogOptions reader;
  reader.msg_path = options.msg_path;
  for (const std::string& entry : options.map) {
    const std::size_t at = entry.find('=');
    if (at == std::string::npos || at == 0 || at + 1 == entry.size()) {
      throw InputError("--map '" + entry + "': expected NAME=COLUMN, e.g. --map omega_r=wheel_2");
    }
    const std::string name = entry.substr(0, at);
    if (find_log_column(name) == nullptr) {
      std::vector<std::string> names;
      for (const LogColumn& column : log_columns()) {
        names.push_back(column.name);
      }
      throw InputError("--map '" + entry + "': " + shown(name) + " is no column of a log: expected one of " +
                       listed(names) + did_you_mean(name, names));
    }
    reader.map[name] = entry.substr(at + 1);
  }
  return reader;
}

std::unique_ptr<RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                            const CommonOptions& options) {
  LogOptions reader = reader_options(options);
  reader.only = useful_columns(robot);
  return open_log(paths, reader);
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
    atomic_write(options.out / "report.html", report);
    write_json(options.out / name, result);
  }
  if (options.json) {
    const std::string text = json_text(result);
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fputc('\n', stdout);
  }
}

void print_log(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    fmt::print("log: {}\n", sentence);
  }
}

ReportContext report_context(const CommonOptions& options, const LogReport& data, LogSource& log) {
  ReportContext context;
  for (const LogFileReport& file : data.files) {
    context.log_files.push_back(file.path);
  }
  context.software = software();
  context.command_line = options.command_line;
  context.warnings = sentences(data);
  if (!options.out.empty()) {
    context.signals = report::raw_signals(log);
    context.rows = data.rows;
  }
  return context;
}

}  // namespace wheelwright::app
