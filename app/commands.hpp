// SPDX-License-Identifier: Apache-2.0
/// \file
/// The commands. Each adds itself to the program and, when it was chosen, does its work and returns an exit code.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace wheelwright::app {

/// What does the work of a command that was added, and returns an exit code.
using Run = std::function<int(const std::string& command_line)>;

/// A command that was added to the program.
struct Command {
  std::string name;
  Run run;
};

/// Adds the commands of this program to `program`, in the order of its help. The program itself has all of them
/// (all_commands.cpp); that of the first half of the build says of those which it lacks what builds them
/// (first_commands.cpp).
[[nodiscard]] std::vector<Command> add_commands(CLI::App& program);

/// wheelwright check model.json LOG...
[[nodiscard]] Run add_check(CLI::App& program);
/// wheelwright choose LOG... --robot robot.yaml
[[nodiscard]] Run add_choose(CLI::App& program);
/// wheelwright commission LOG... --robot robot.yaml
[[nodiscard]] Run add_commission(CLI::App& program);
/// wheelwright completion bash|zsh|fish
[[nodiscard]] Run add_completion(CLI::App& program);
/// wheelwright compare BEFORE AFTER
[[nodiscard]] Run add_compare(CLI::App& program);
/// wheelwright convert IN... OUT
[[nodiscard]] Run add_convert(CLI::App& program);
/// wheelwright design --model model.json --for bounds
[[nodiscard]] Run add_design(CLI::App& program);
/// wheelwright detect LOG --model model.json [--follow]
[[nodiscard]] Run add_detect(CLI::App& program);
/// wheelwright doctor LOG... [--robot robot.yaml]
[[nodiscard]] Run add_doctor(CLI::App& program);
/// wheelwright export model.json --language c
[[nodiscard]] Run add_export(CLI::App& program);
/// wheelwright fleet DIR|LIST --robot robot.yaml
[[nodiscard]] Run add_fleet(CLI::App& program);
/// wheelwright gap LOG... --robot robot.yaml
[[nodiscard]] Run add_gap(CLI::App& program);
/// wheelwright identify LOG... --robot robot.yaml
[[nodiscard]] Run add_identify(CLI::App& program);
/// wheelwright man [COMMAND]
[[nodiscard]] Run add_man(CLI::App& program);
/// wheelwright margins LOG --model model.json
[[nodiscard]] Run add_margins(CLI::App& program);
/// wheelwright robot --urdf FILE | --ros2-control FILE
[[nodiscard]] Run add_robot(CLI::App& program);
/// wheelwright sensitivity STUDY.yaml
[[nodiscard]] Run add_sensitivity(CLI::App& program);
/// wheelwright simulate SCENARIO.yaml --out LOG
[[nodiscard]] Run add_simulate(CLI::App& program);
/// wheelwright try LOG... [--urdf FILE]
[[nodiscard]] Run add_try(CLI::App& program);

}  // namespace wheelwright::app
