// SPDX-License-Identifier: Apache-2.0
/// \file
/// Options that several commands have.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "app/command_tree.hpp"
#include "app/common.hpp"
#include "detector/detector_options.hpp"

namespace CLI {
class App;
class Option;
class Validator;
}  // namespace CLI

namespace wheelwright::app {

struct ScaleOptions;

/// Adds the common options to `command`.
void add_common(CLI::App& command, CommonOptions& options);
/// Text below the options in the help of `command`.
void add_footer(CLI::App& command, const char* text);

/// Takes the key `columns` of a robot file or model.json, unless `file` is empty, for the logs of a run.
void take_columns(const std::filesystem::path& file, CommonOptions& options);

/// The end of every registration: the common options, the examples, and what runs the command. `Arguments` has a member
/// `common`.
template <typename Arguments>
[[nodiscard]] Run finish(CLI::App& command, std::shared_ptr<Arguments> arguments, const char* examples,
                         int (*run)(const Arguments&)) {
  add_common(command, arguments->common);
  add_footer(command, examples);
  return [arguments, run, &command](const std::string& command_line) {
    arguments->common.command_line = command_line;
    arguments->common.read = files_read(command);
    if constexpr (requires { arguments->robot.native(); }) {
      take_columns(arguments->robot, arguments->common);
    }
    if constexpr (requires { arguments->model.native(); }) {
      take_columns(arguments->model, arguments->common);
    }
    return run(*arguments);
  };
}
/// Adds --map and --msg-path to a command that reads logs.
void add_map(CLI::App& command, CommonOptions& options);
/// Adds --despite to a command that opens logs by open_sound_log().
void add_despite(CLI::App& command, CommonOptions& options);

/// `option`, which may be given several times, with one value each; what follows the value is no further one.
CLI::Option& repeatable(CLI::Option& option);

/// Adds --residual d1|d2.
void add_residual(CLI::App& command, detector::Residual& residual);

/// Adds --persistence K/N; `persistence` stays empty where it is not given. `otherwise` says what holds then.
void add_persistence(CLI::App& command, std::optional<detector::Persistence>& persistence,
                     const std::string& otherwise);

/// Adds --set polytope|box.
void add_set(CLI::App& command, detector::ParameterSetKind& set);
/// Adds --test two_sided|symmetric.
void add_test(CLI::App& command, detector::Test& test);

/// Makes an option take quantities with units: what the option itself converts is the number in `unit` (quantity()).
[[nodiscard]] CLI::Validator in_unit(const std::string& unit);

/// Makes all options of the commands of `program` refuse an empty value, as of a variable that is not set, and those
/// that take a number N a sign and more than 64 bits.
void refuse_mistaken_values(CLI::App& program);
/// Throws CLI::ValidationError where one of `words` is --OPTION= without a value, whose value would be the next word.
void refuse_lost_values(const std::vector<std::string>& words);

/// Adds --shard I/N, --merge and --fresh.
void add_scale_options(CLI::App& command, ScaleOptions& options);

}  // namespace wheelwright::app
