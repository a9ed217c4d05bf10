// SPDX-License-Identifier: Apache-2.0
#include "app/command_tree.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "core/error.hpp"
#include "formats/files/words.hpp"

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

}  // namespace

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

namespace {

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
  static const std::vector<std::string> files = {"FILE", "LOG",    "MODEL", "SCENARIO", "STUDY",
                                                 "LIST", "BEFORE", "AFTER", "IN OUT"};
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

std::vector<std::filesystem::path> files_read(const CLI::App& command) {
  static const std::vector<std::string> written = {"--out", "--out-file", "--series"};
  std::vector<std::filesystem::path> read;
  for (const CLI::Option* option : command.get_options()) {
    const OptionWords words = words_of(*option);
    const bool writes = std::ranges::any_of(
        words.names, [](const std::string& name) { return std::ranges::find(written, name) != written.end(); });
    if (!writes && (words.takes_file() || words.takes_directory())) {
      const std::vector<std::string> given = option->results();
      read.insert(read.end(), given.begin(), given.end());
    }
  }
  return read;
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

namespace {

std::vector<std::string> names_of(const ProgramWords& program) {
  std::vector<std::string> out;
  for (const CommandWords& command : program.commands) {
    out.push_back(command.name);
  }
  return out;
}

/// `text` with each of `characters` behind a backslash.
std::string escaped(const std::string& text, std::string_view characters) {
  std::string out;
  for (const char c : text) {
    if (characters.find(c) != std::string_view::npos) {
      out += '\\';
    }
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

/// `text` between single quotes for bash and zsh.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  }
  return out + "'";
}

// What bash offers for a value.
std::string bash_values(const OptionWords& option) {
  if (!option.choices.empty()) {
    return fmt::format("-W {}", quoted(core::listed(option.choices, " ")));
  }
  return option.takes_directory() ? "-d" : option.takes_file() ? "-f" : "";
}

std::string bash(const ProgramWords& program) {
  std::string values, options, positionals;
  const auto add = [&](const CommandWords& command, const std::string& name) {
    options += fmt::format("    {}) words={} ;;\n", quoted(name), quoted(core::listed(names_of(command), " ")));
    for (const OptionWords& option : command.options) {
      const std::string offer = bash_values(option);
      if (option.positional()) {
        if (!option.choices.empty()) {
          positionals += fmt::format("    {}) offer=({}) ;;\n", quoted(name), offer);
        }
      } else if (!option.value.empty()) {
        for (const std::string& word : option.names) {
          values += fmt::format("    {}) {} ;;\n", quoted(name + " " + word),
                                offer.empty() ? "return" : fmt::format("offer=({}) value=1", offer));
        }
      }
    }
  };
  add(program.program, "");
  for (const CommandWords& command : program.commands) {
    add(command, command.name);
  }
  return fmt::format(R"(# bash completion of wheelwright
_wheelwright() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} previous=${{COMP_WORDS[COMP_CWORD - 1]}}
  local command='' words='' value='' k
  local -a offer=()
  COMPREPLY=()
  for ((k = 1; k < COMP_CWORD; ++k)); do
    case ${{COMP_WORDS[k]}} in
    {0}) command=${{COMP_WORDS[k]}}; break ;;
    esac
  done
  case "$command $previous" in
{1}  esac
  if [[ -z $value ]]; then
    if [[ $current == -* ]]; then
      case $command in
{2}      esac
      offer=(-W "$words")
    elif [[ -z $command ]]; then
      offer=(-W {3})
    else
      offer=(-f)
      case $command in
{4}      esac
    fi
  fi
  if [[ ${{offer[0]}} != -W ]]; then
    compopt -o filenames 2> /dev/null
  fi
  mapfile -t COMPREPLY < <(compgen "${{offer[@]}}" -- "$current")
}}
complete -F _wheelwright wheelwright
)",
                     core::listed(names_of(program), " | "), values, options,
                     quoted(core::listed(names_of(program), " ")), positionals);
}

// An argument of _arguments: '--out[words]:DIR:_files -/'.
std::string zsh_argument(const OptionWords& option, const std::string& name) {
  const std::string action = !option.choices.empty()    ? fmt::format("({})", core::listed(option.choices, " "))
                             : option.takes_directory() ? "_files -/"
                             : option.takes_file()      ? "_files"
                                                        : " ";
  const std::string value = option.value.empty() ? "" : fmt::format(":{}:{}", escaped(option.value, ":[]"), action);
  if (option.positional()) {
    return quoted(fmt::format("{}:{}:{}", option.repeated ? "*" : "", escaped(option.value, ":"),
                              option.choices.empty() ? "_files" : action));
  }
  return quoted(fmt::format("{}{}[{}]{}", option.repeated ? "*" : "", name,
                            escaped(first_sentence(option.description), "[]:\\"), value));
}

std::string zsh_arguments(const CommandWords& command, const std::string& indent) {
  std::string out;
  for (const OptionWords& option : command.options) {
    if (option.positional()) {
      out += " \\\n" + indent + zsh_argument(option, "");
    }
    for (const std::string& name : option.names) {
      out += " \\\n" + indent + zsh_argument(option, name);
    }
  }
  return out;
}

std::string zsh(const ProgramWords& program) {
  std::string commands, cases;
  for (const CommandWords& command : program.commands) {
    commands += fmt::format("    {}\n", quoted(command.name + ":" + first_sentence(command.description)));
    cases += fmt::format("      {})\n        _arguments{}\n        ;;\n", command.name,
                         zsh_arguments(command, "          "));
  }
  return fmt::format(R"(#compdef wheelwright
_wheelwright() {{
  local context state state_descr line
  typeset -A opt_args
  local -a commands=(
{0}  )
  _arguments -C{1} \
    '1:command:->command' \
    '*::argument:->argument'
  case $state in
  command) _describe command commands ;;
  argument)
    case $words[1] in
{2}    esac
    ;;
  esac
}}
if [ "$funcstack[1]" = _wheelwright ]; then
  _wheelwright "$@"
else
  compdef _wheelwright wheelwright
fi
)",
                     commands, zsh_arguments(program.program, "    "), cases);
}

std::string fish_option(const OptionWords& option, const std::string& condition) {
  std::string out;
  for (const std::string& name : option.names) {
    out += fmt::format("complete -c wheelwright -n {} -{} {}", condition, name.starts_with("--") ? "l" : "s",
                       name.substr(name.find_first_not_of('-')));
    if (!option.choices.empty()) {
      out += fmt::format(" -x -a '{}'", core::listed(option.choices, " "));
    } else if (option.takes_directory()) {
      out += " -x -a '(__fish_complete_directories)'";
    } else if (!option.value.empty()) {
      out += option.takes_file() ? " -r -F" : " -x";
    }
    out += fmt::format(" -d '{}'\n", escaped(first_sentence(option.description), "'\\"));
  }
  return out;
}

std::string fish(const ProgramWords& program) {
  std::string out = "# fish completion of wheelwright\ncomplete -c wheelwright -f\n";
  for (const OptionWords& option : program.program.options) {
    out += fish_option(option, "__fish_use_subcommand");
  }
  for (const CommandWords& command : program.commands) {
    out += fmt::format("complete -c wheelwright -n __fish_use_subcommand -a {} -d '{}'\n", command.name,
                       escaped(first_sentence(command.description), "'\\"));
    const std::string condition = fmt::format("'__fish_seen_subcommand_from {}'", command.name);
    for (const OptionWords& option : command.options) {
      if (option.positional()) {
        out += fmt::format("complete -c wheelwright -n {} {}\n", condition,
                           option.choices.empty() ? "-F" : fmt::format("-a '{}'", core::listed(option.choices, " ")));
      } else {
        out += fish_option(option, condition);
      }
    }
  }
  return out;
}

}  // namespace

std::string completion(const ProgramWords& program, const std::string& shell) {
  if (shell == "bash") {
    return bash(program);
  }
  if (shell == "zsh") {
    return zsh(program);
  }
  if (shell == "fish") {
    return fish(program);
  }
  throw InputError("completion: " + files::shown(shell) + ": expected one of bash, zsh, fish");
}

}  // namespace wheelwright::app
