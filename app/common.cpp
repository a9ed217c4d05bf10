// SPDX-License-Identifier: Apache-2.0
#include "common.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <mutex>
#include <system_error>

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <wheelwright/files/bytes.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/logs/recorded_log.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/report/signals.hpp>

namespace wheelwright::app {

void write_text(std::FILE* stream, std::string_view text) {
  const std::string fit = files::printable(text);
  std::fwrite(fit.data(), 1, fit.size(), stream);
}

void say_json(const Json& result) {
  const std::string text = files::json_text(result) + "\n";
  std::fwrite(text.data(), 1, text.size(), stdout);
}

int finished(int code) {
  std::cout.flush();
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good()) {
    return code;
  }
  tell("wheelwright: standard output: cannot be written ({}): what stands there is not whole; expected room there\n",
       std::strerror(errno));
  return kBadInput;
}

logs::LogOptions reader_options(const CommonOptions& options) {
  logs::LogOptions reader;
  reader.msg_path = options.msg_path;
  reader.trust = options.trust;
  reader.map = options.columns;
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
    reader.map[name] = entry.substr(at + 1);
  }
  return reader;
}

logs::LogOptions robot_reader(const Robot& robot, const CommonOptions& options) {
  logs::LogOptions reader = reader_options(options);
  reader.only = robots::useful_columns(robot);
  return reader;
}

std::unique_ptr<logs::RecordedLog> open_robot_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                                  const CommonOptions& options) {
  return logs::open_log(paths, robot_reader(robot, options));
}

namespace {

std::vector<std::filesystem::path>& made_directories() {
  static std::vector<std::filesystem::path> made;  // the innermost first
  return made;
}

std::mutex& made_mutex() {
  static std::mutex mutex;
  return mutex;
}

constexpr std::string_view kPage = "report.html";
constexpr std::string_view kHead = "<head>\n";
constexpr std::chrono::seconds kOneRun(10);  // between files that one run writes, when a directory is copied, too

constexpr std::string_view kGenerator = "<meta name=\"generator\" content=\"wheelwright ";

// Pipes, devices and what the program was started with ("/dev/stdout") are written to, whatever is there.
bool is_there(const std::filesystem::path& out) {
  std::error_code none;
  const std::filesystem::file_status there = std::filesystem::status(out, none);
  const bool own_stream =
      out.parent_path() == "/dev/fd" || std::filesystem::read_symlink(out, none).native().starts_with("/proc/self/fd/");
  return std::filesystem::exists(there) && !std::filesystem::is_other(there) && !own_stream;
}

std::string beginning(const std::filesystem::path& file) {
  constexpr std::streamsize kMarked = 1024;
  std::string text(kMarked, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(text.data(), kMarked);
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

// Empty where this command may replace the file `name` of its results, the first of which is `result`; else whose the
// file is.
std::string whose(const CommonOptions& options, const std::string& result, const std::string& name) {
  const std::filesystem::path place = options.out / name;
  const std::string text = beginning(place);
  const std::string command = "`wheelwright " + options.command + "`";
  if (name == kPage) {
    if (const std::size_t at = text.find(kGenerator); at != std::string::npos) {
      const std::size_t from = at + kGenerator.size();
      const std::string of = text.substr(from, text.find('"', from) - from);
      return of == options.command ? "" : "the page of `wheelwright " + of + "`";
    }
  }
  const auto made_here = [&](const std::string& of_result) {
    const std::string kind = std::filesystem::path(result).stem().string();
    return of_result.find("\"schema\": \"wheelwright/" + kind + "/") != std::string::npos;
  };
  if (name == result) {
    return made_here(text) ? "" : "no result of " + command;
  }
  if (!made_here(beginning(options.out / result))) {
    return "not written by " + command;
  }
  std::error_code error;
  const auto of_result = std::filesystem::last_write_time(options.out / result, error);
  return std::filesystem::last_write_time(place, error) > of_result + kOneRun ? "changed since " + command + " wrote it"
                                                                              : "";
}

}  // namespace

void remove_empty_directories() {
  std::error_code none;
  const std::lock_guard<std::mutex> lock(made_mutex());
  for (const std::filesystem::path& made : made_directories()) {
    if (std::filesystem::is_directory(made, none)) {
      std::filesystem::remove(made, none);  // fails where something is in it
    }
  }
}

void keep_existing(const CommonOptions& options, const std::filesystem::path& out, std::string_view mark) {
  if (!options.force && is_there(out) && (mark.empty() || beginning(out).find(mark) == std::string::npos)) {
    throw InputError(out.string() + ": is there already: expected a new name, or --force");
  }
}

void keep_inputs(const std::filesystem::path& out, const std::vector<std::filesystem::path>& read) {
  for (const std::filesystem::path& path : read) {
    std::error_code neither;
    if (std::filesystem::equivalent(out, path, neither)) {
      throw InputError(out.string() + ": is what is read: expected another name");
    }
  }
}

void make_directory(const CommonOptions& options, const std::vector<std::string>& files) {
  if (options.out.empty()) {
    return;
  }
  std::vector<std::string> names = files;
  if (!names.empty()) {
    names.emplace_back(kPage);
  }
  for (const std::string& name : names) {
    if (const std::filesystem::path place = options.out / name; is_there(place) && !options.force) {
      if (const std::string other = whose(options, files.front(), name); !other.empty()) {
        throw InputError(fmt::format("{}: is there already, {}: expected another --out, or --force to replace it",
                                     place.string(), other));
      }
    }
  }
  const std::lock_guard<std::mutex> lock(made_mutex());
  std::error_code error;
  std::vector<std::filesystem::path>& made = made_directories();
  for (std::filesystem::path at = options.out; !at.empty() && !std::filesystem::exists(at, error);
       at = at.parent_path()) {
    made.push_back(at);
  }
  error.clear();
  std::filesystem::create_directories(options.out, error);
  if (error || !std::filesystem::is_directory(options.out)) {
    throw InputError("--out " + options.out.string() + ": cannot make this directory" +
                     (error ? " (" + error.message() + ")" : "") + ": expected a place where files can be written");
  }
}

void write_page(const CommonOptions& options, std::string page) {
  if (!options.out.empty()) {
    if (const std::size_t head = page.find(kHead); head != std::string::npos) {
      page.insert(head + kHead.size(), fmt::format("{}{}\">\n", kGenerator, options.command));
    }
    files::atomic_write(options.out / kPage, page);
  }
}

void publish(const CommonOptions& options, const Json& result, const std::string& name, const std::string& report) {
  if (!options.out.empty()) {
    write_page(options, report);
    files::write_json(options.out / name, result);
  }
  if (options.json) {
    say_json(result);
  }
}

void print_log(const std::vector<std::string>& sentences) {
  for (const std::string& sentence : sentences) {
    say("log: {}\n", sentence);
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

namespace {

constexpr double first_line = 0.5;      // s
constexpr double between_lines = 0.1;   // s
constexpr double earliest_guess = 2.0;  // s
constexpr double least_share = 0.05;

bool rewrites_lines() {
  const char* const terminal = std::getenv("TERM");
  return isatty(STDERR_FILENO) == 1 && terminal != nullptr && std::string_view(terminal) != "dumb";
}

std::string duration(double seconds) {
  const double whole = std::round(seconds);
  if (whole < 60.0) {
    return fmt::format("{:.0f} s", whole);
  }
  const double minutes = std::round(seconds / 60.0);
  return minutes < 60.0 ? fmt::format("{:.0f} min", minutes)
                        : fmt::format("{:.0f} h {:.0f} min", std::floor(minutes / 60.0), std::fmod(minutes, 60.0));
}

}  // namespace

std::string progress_line(std::string_view stage, double share, double seconds) {
  const double done = std::clamp(share, 0.0, 1.0);
  std::string left;
  if (done >= least_share && done < 1.0 && seconds >= earliest_guess) {
    left = fmt::format(", about {} left", duration(seconds * (1.0 - done) / done));
  }
  return fmt::format("{:3.0f} %  {} ({}{})", 100.0 * done, stage, duration(seconds), left);
}

Progress::Progress(bool quiet) : active_(!quiet && rewrites_lines()) {}

Progress::~Progress() {
  if (shown_) {
    fmt::print(stderr, "\r\033[K");
  }
}

void Progress::tell(std::string_view stage, double share) {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  if (!active_ || seconds < first_line || (stage == stage_ && seconds < last_ + between_lines)) {
    return;
  }
  shown_ = true;
  stage_ = stage;
  last_ = seconds;
  fmt::print(stderr, "\r\033[K{}", progress_line(stage, share, seconds));
  std::fflush(stderr);
}

}  // namespace wheelwright::app
