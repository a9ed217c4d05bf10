// SPDX-License-Identifier: Apache-2.0
/// \file
/// The built program, run as a user runs it.
#pragma once

#include <sys/wait.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/bytes.hpp"
#include "formats/files/json.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::testing {

/// Outcome of a run.
struct Outcome {
  int code = -1;    ///< exit code; −1 where a signal ended the program
  std::string out;  ///< standard output
  std::string err;  ///< standard error
};

/// Lines of `text` without their ends.
inline std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    lines.push_back(line);
  }
  return lines;
}

/// A test that runs the program inside its own directory, with the shipped robot (`robot.yaml`) and log at hand.
class ProgramTest : public ScratchTest {
 protected:
  ProgramTest() { std::filesystem::copy_file(examples() / "robot.yaml", path("robot.yaml")); }

  static std::filesystem::path examples() { return std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "examples"; }

  /// `wheelwright ARGUMENTS < INPUT`; names are relative to the directory of the test. `before` goes in front, for
  /// limits of the shell.
  Outcome run(const std::string& arguments, const std::string& input = "/dev/null",
              const std::string& before = "") const {
    const std::filesystem::path io = directory_.string() + ".streams";
    std::filesystem::create_directories(io);
    const std::string command =
        fmt::format("cd '{}' && {} '{}' {} < '{}' > '{}' 2> '{}'", directory_.string(), before, WHEELWRIGHT_PROGRAM,
                    arguments, input, (io / "out").string(), (io / "err").string());
    const int status = std::system(command.c_str());
    Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytes(io / "out"), bytes(io / "err")};
    std::filesystem::remove_all(io);
    return outcome;
  }

  /// The shipped log, unpacked, line by line; the header is the first.
  static std::vector<std::string> healthy_lines() {
    return lines_of(files::read_bytes(examples() / "healthy.csv.gz", std::size_t{1} << 26));
  }

  /// Puts `lines` into a file.
  std::filesystem::path put_lines(std::string_view name, const std::vector<std::string>& lines) const {
    std::string text;
    for (const std::string& line : lines) {
      text += line + "\n";
    }
    return put(name, text);
  }

  /// model.json of the shipped log in the directory `model`.
  void commission_shipped() const {
    const Outcome done =
        run("commission '" + (examples() / "healthy.csv.gz").string() + "' --robot robot.yaml --out model --quiet");
    ASSERT_EQ(done.code, 0) << done.err;
  }

  /// Drives one of the example scenarios and writes its log.
  void simulate(const std::string& scenario, const std::string& log) const {
    const Outcome done = run("simulate '" + (examples() / "scenarios" / scenario).string() + "' --out " + log);
    ASSERT_EQ(done.code, 0) << done.err;
  }

  /// Names of the files in a directory of the test, in order.
  std::vector<std::string> names_in(const std::string& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path(folder))) {
      names.push_back(entry.path().filename());
    }
    std::sort(names.begin(), names.end());
    return names;
  }

  /// Whether FILE fits results/SCHEMA, as an independent validator sees it; its complaints, or nothing where it fits.
  std::string misfit(const std::string& schema, const std::string& file) const {
    const std::string complaints = (directory_ / "complaints").string();
    const std::string command = "/usr/bin/python3 '" WHEELWRIGHT_SOURCE_DIR "/tests/app/validate.py' '" +
                                (std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "results" / schema).string() + "' '" +
                                path(file).string() + "' > '" + complaints + "' 2>&1";
    return std::system(command.c_str()) == 0 ? "" : "does not fit: " + bytes(complaints);
  }

  static bool has_validator() { return std::system("/usr/bin/python3 -c 'import jsonschema' 2> /dev/null") == 0; }
};

}  // namespace wheelwright::testing
