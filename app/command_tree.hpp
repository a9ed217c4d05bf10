// SPDX-License-Identifier: Apache-2.0
/// \file
/// The program's commands and options as plain data: what completions, manual pages and suggestions are made of; and
/// the scripts by which a shell completes them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace CLI {

class App;
class Option;

}  // namespace CLI

namespace wheelwright::app {

/// An option or a positional argument.
struct OptionWords {
  std::vector<std::string> names;    ///< "-h", "--help"; empty for a positional argument
  std::string value;                 ///< what it takes: "DIR"; empty for a flag; the name of a positional argument
  std::vector<std::string> choices;  ///< the words that it takes, where these are few
  std::string description;
  std::string otherwise;  ///< default value; empty: none
  bool required = false;
  bool repeated = false;  ///< may be given several times, or takes several values

  /// True if it stands on the command line without a name.
  [[nodiscard]] bool positional() const { return names.empty(); }
  /// What its values are, for a shell.
  [[nodiscard]] bool takes_directory() const { return value == "DIR"; }
  [[nodiscard]] bool takes_file() const;
};

/// A command, or the program itself.
struct CommandWords {
  std::string name;
  std::string description;
  std::vector<OptionWords> options;  ///< in the order of the help
  std::string footer;
};

/// Names of all options of `command`.
[[nodiscard]] std::vector<std::string> names_of(const CommandWords& command);

/// The program.
struct ProgramWords {
  CommandWords program;                ///< its own options and words
  std::vector<CommandWords> commands;  ///< in the order of the help

  /// The command called `name`; nullptr where there is none.
  [[nodiscard]] const CommandWords* find(const std::string& name) const;
};

/// The words of `program` as it is registered.
[[nodiscard]] ProgramWords words_of(const CLI::App& program);

/// The words of `option` as it is registered.
[[nodiscard]] OptionWords words_of(const CLI::Option& option);
/// What the options of a `command` that was parsed name to be read: files and directories, but for the places to write.
[[nodiscard]] std::vector<std::filesystem::path> files_read(const CLI::App& command);

/// The first sentence of a description without its end: "Looks for faults in a log with a commissioned model".
[[nodiscard]] std::string first_sentence(const std::string& description);

/// Suggestion for misspelt `words` (without the program's name): "did you mean '--model' instead of '--modle'?"; empty
/// where every word that begins with -- is an option and the first other one a command.
[[nodiscard]] std::string suggestion(const ProgramWords& program, const std::vector<std::string>& words);

/// A script for bash, zsh or fish (`shell`) that completes what `program` takes: commands, options, choices, files and
/// directories. Throws InputError for another shell.
[[nodiscard]] std::string completion(const ProgramWords& program, const std::string& shell);

}  // namespace wheelwright::app
