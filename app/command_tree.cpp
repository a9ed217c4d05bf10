// SPDX-License-Identifier: Apache-2.0
#include "command_tree.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <wheelwright/files/words.hpp>

namespace wheelwright::app {
namespace {

// "TEXT:{bounds,detection}" -> bounds, detection; "{box->1,polytope->0}" -> box, polytope.
std::vector<std::string> choices_in(const std::string& type) {
  std::vector<std::string> out;
  const std::size_t open = type.find('{'), close = type.find('}', open);
  if (open == std::string::npos || close == std::string::npos) {
    return out;
  }
  for (const std::string& word : CLI::detail::split(type.substr(open + 1, close - open - 1), ',')) {
    out.push_back(word.substr(0, word.find("->")));
  }
  return out;
}

OptionWords words_of(const CLI::Option& option) {
  OptionWords out;
  for (const std::string& name : option.get_snames()) {
    out.names.push_back("-" + name);
  }
  for (const std::string& name : option.get_lnames()) {
    out.names.push_back("--" + name);
  }
  const std::string type = option.get_type_name();
  out.choices = choices_in(type);
  if (option.get_positional()) {
    out.value = option.get_name(true);
  } else if (option.get_items_expected_max() > 0) {
    out.value = type.substr(0, type.find(':'));
  }
  out.description = option.get_description();
  out.otherwise = option.get_default_str();
  out.required = option.get_required();
  out.repeated =
      option.get_items_expected_max() > 1 || option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  return out;
}

CommandWords words_of_one(const CLI::App& app) {
  CommandWords out{app.get_name(), app.get_description(), {}, app.get_footer()};
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) {
      out.options.push_back(words_of(*option));
    }
  }
  std::stable_partition(out.options.begin(), out.options.end(), [](const auto& option) { return option.positional(); });
  return out;
}

}  // namespace

std::vector<std::string> names_of(const CommandWords& command) {
  std::vector<std::string> out;
  for (const OptionWords& option : command.options) {
    out.insert(out.end(), option.names.begin(), option.names.end());
  }
  return out;
}

bool OptionWords::takes_file() const {
  static const std::vector<std::string> files = {"FILE", "LOG", "MODEL", "SCENARIO", "STUDY", "LIST", "IN", "OUT"};
  return choices.empty() && std::find(files.begin(), files.end(), value) != files.end();
}

const CommandWords* ProgramWords::find(const std::string& name) const {
  const auto found = std::find_if(commands.begin(), commands.end(), [&](const auto& c) { return c.name == name; });
  return found == commands.end() ? nullptr : &*found;
}

ProgramWords words_of(const CLI::App& program) {
  ProgramWords out{words_of_one(program), {}};
  out.program.name = "wheelwright";
  for (const CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) {
    out.commands.push_back(words_of_one(*command));
  }
  return out;
}

std::string first_sentence(const std::string& description) {
  std::size_t end = std::min({description.size(), description.find(": "), description.find("; ")});
  // The point of "e.g." ends no sentence: what follows does not begin with a capital.
  for (std::size_t at = description.find('.'); at < end; at = description.find('.', at + 1)) {
    const std::size_t next = description.find_first_not_of(" \n", at + 1);
    if (next == std::string::npos ||
        (next > at + 1 && std::isupper(static_cast<unsigned char>(description[next])) != 0)) {
      end = at;
    }
  }
  std::string out = description.substr(0, end);
  while (!out.empty() && (out.back() == '.' || out.back() == '\n')) {
    out.pop_back();
  }
  return out;
}

std::string suggestion(const ProgramWords& program, const std::vector<std::string>& words) {
  const CommandWords* command = nullptr;
  for (const std::string& word : words) {
    if (word == "--") {
      break;
    }
    const bool option = word.size() > 2 && word.starts_with("--");
    if (!option && command != nullptr) {
      continue;
    }
    const std::string name = word.substr(0, option ? word.find('=') : std::string::npos);
    std::vector<std::string> known;
    if (option) {
      known = names_of(command == nullptr ? program.program : *command);
    } else if (!word.starts_with("-")) {
      command = program.find(name);
      for (const CommandWords& each : program.commands) {
        known.push_back(each.name);
      }
    } else {
      continue;
    }
    if (std::find(known.begin(), known.end(), name) != known.end()) {
      continue;
    }
    if (const std::string nearest = files::nearest_name(name, known); !nearest.empty()) {
      return fmt::format("did you mean {} instead of {}?", files::shown(nearest), files::shown(name));
    }
    if (!option) {
      return fmt::format("there is no command {}: expected one of {}", files::shown(name), core::listed(known));
    }
  }
  return {};
}

}  // namespace wheelwright::app
