// SPDX-License-Identifier: Apache-2.0
#include "common.hpp"

#include <charconv>
#include <cstdio>
#include <map>
#include <system_error>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <wheelwright/io/atomic_file.hpp>
#include <wheelwright/io/log_columns.hpp>
#include <wheelwright/io/suggest.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/report/raw_signals.hpp>

namespace wheelwright::app {

void add_common(CLI::App& command, CommonOptions& options) {
  command.add_option("--out", options.out, "Write results and report.html into this directory")->type_name("DIR");
  command.add_flag("--json", options.json, "Print the result as JSON on standard output, and nothing else there");
  command.add_option("--threads", options.threads, "Use at most N threads; results do not depend on it")
      ->type_name("N")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  command.add_option("--seed", options.seed, "Seed of everything random")->type_name("N")->capture_default_str();
  command.add_flag("--quiet", options.quiet, "No progress and no summary; errors are still told");
}

void add_footer(CLI::App& command, const char* text) { command.footer(text); }

void add_map(CLI::App& command, CommonOptions& options) {
  command
      .add_option(
          "--map", options.map,
          "Read the log column NAME from the file's column COLUMN, or from a bag's TOPIC.FIELD (repeatable), e.g. "
          "--map omega_r=wheel_2 or --map omega_r=/joint_states.velocity[right_wheel]")
      ->type_name("NAME=COLUMN")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command
      .add_option("--msg-path", options.msg_path,
                  "Directory with definitions of messages (PKG/msg/TYPE.msg), for bags that do not bring their own "
                  "(repeatable)")
      ->type_name("DIR")
      ->expected(1)
      ->allow_extra_args(false)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_persistence(CLI::App& command, std::optional<Persistence>& persistence, const std::string& otherwise) {
  command
      .add_option_function<std::string>(
          "--persistence",
          [&persistence](const std::string& text) {
            Persistence rule;
            const char* const end = text.data() + text.size();
            const auto k = std::from_chars(text.data(), end, rule.k);
            const bool slash = k.ec == std::errc() && k.ptr != end && *k.ptr == '/';
            const auto n = std::from_chars(slash ? k.ptr + 1 : end, end, rule.n);
            if (!slash || n.ec != std::errc() || n.ptr != end || rule.k < 1 || rule.k > rule.n || rule.n > 64) {
              throw CLI::ValidationError("--persistence '" + text + "': expected K/N with 1 <= K <= N <= 64, e.g. 3/5",
                                         CLI::ExitCodes::ValidationError);
            }
            persistence = rule;
          },
          "Raise an alarm when K of the last N instants are outside (default: " + otherwise + ")")
      ->type_name("K/N");
}

void add_set(CLI::App& command, ParameterSetKind& set) {
  command.add_option("--set", set, "Threshold from the feasible set itself (polytope) or from its box")
      ->transform(CLI::CheckedTransformer(std::map<std::string, ParameterSetKind>{
                                              {"polytope", ParameterSetKind::polytope}, {"box", ParameterSetKind::box}})
                      .description("{polytope,box}"))
      ->type_name("SET");
}

void add_test(CLI::App& command, Test& test) {
  command.add_option("--test", test, "Compare with [l, u] (two_sided) or with rho as the paper does (symmetric)")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, Test>{{"two_sided", Test::two_sided}, {"symmetric", Test::symmetric}})
                      .description("{two_sided,symmetric}"))
      ->type_name("TEST");
}

std::string software() { return std::string("wheelwright ") + WHEELWRIGHT_VERSION; }

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

namespace {

const std::string& effort_column(const Robot& robot, const Joint& joint) {
  return robot.effort == EffortKind::torque    ? joint.torque
         : robot.effort == EffortKind::current ? joint.current
                                               : joint.voltage;
}

}  // namespace

std::vector<std::string> useful_columns(const Robot& robot) {
  std::vector<std::string> names = {"t", "x", "y", "theta", "gyro_z", "command_r", "command_l"};
  for (const Joint& joint : make_model(robot).joints) {
    names.insert(names.end(), {joint.angle, joint.speed, effort_column(robot, joint)});
  }
  return names;
}

std::unique_ptr<RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                            const CommonOptions& options) {
  LogOptions reader = reader_options(options);
  reader.only = useful_columns(robot);
  return open_log(paths, reader);
}

std::vector<std::string> needed_columns(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : make_model(robot).joints) {
    names.insert(names.end(), {joint.speed + "|" + joint.angle, effort_column(robot, joint)});
  }
  return names;
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
