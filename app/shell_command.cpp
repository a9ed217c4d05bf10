// SPDX-License-Identifier: Apache-2.0
// What the program says of itself: completion scripts and manual pages.
#include <memory>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "app/command_tree.hpp"
#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/manual.hpp"
#include "app/options.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "results/software.hpp"

namespace wheelwright::app {
namespace {

constexpr const char* kCompletionHelp =
    "Prints a script that completes commands, options and values in a shell. The script is made from the program's own "
    "options, so it is that of this version.";

constexpr const char* kCompletionExamples =
    "Examples:\n"
    "  source <(wheelwright completion bash)\n"
    "  wheelwright completion zsh > ~/.zfunc/_wheelwright\n"
    "  wheelwright completion fish > ~/.config/fish/completions/wheelwright.fish\n\n"
    "An installed program has them where shells look for them.";

constexpr const char* kManHelp =
    "Prints the manual page of the program or of a command, in roff. With --out all pages are written.";

constexpr const char* kManExamples =
    "Examples:\n"
    "  wheelwright man | man -l -\n"
    "  wheelwright man detect > wheelwright-detect.1\n"
    "  wheelwright man --out ~/.local/share/man/man1";

struct ManArguments {
  std::string command;
  CommonOptions common;
};

int write_pages(const ProgramWords& words, const CommonOptions& options) {
  std::vector<std::pair<std::filesystem::path, std::string>> pages = {
      {options.out / "wheelwright.1", manual_page(words, results::software())}};
  for (const CommandWords& command : words.commands) {
    pages.emplace_back(options.out / ("wheelwright-" + command.name + ".1"), manual_page(command, results::software()));
  }
  for (const auto& [place, page] : pages) {
    keep_existing(options, place, ".TH WHEELWRIGHT");
  }
  make_directory(options);
  for (const auto& [place, page] : pages) {
    files::atomic_write(place, page);
  }
  return kDone;
}

}  // namespace

Run add_completion(CLI::App& program) {
  auto shell = std::make_shared<std::string>();
  CLI::App& command = *program.add_subcommand("completion", kCompletionHelp);
  command.add_option("SHELL", *shell, "The shell")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  add_footer(command, kCompletionExamples);
  return [shell, &program](const std::string&) {
    say_lines(completion(words_of(program), *shell));
    return kDone;
  };
}

Run add_man(CLI::App& program) {
  auto a = std::make_shared<ManArguments>();
  CLI::App& command = *program.add_subcommand("man", kManHelp);
  command.add_option("COMMAND", a->command, "The command; without it, the program");
  command.add_option("--out", a->common.out, "Write all pages into this directory")->type_name("DIR");
  command.add_flag("--force", a->common.force, "Replace what is there and no manual page of wheelwright");
  add_footer(command, kManExamples);
  return [a, &program](const std::string&) {
    const ProgramWords words = words_of(program);
    if (!a->common.out.empty()) {
      return write_pages(words, a->common);
    }
    const CommandWords* one = words.find(a->command);
    if (one == nullptr && !a->command.empty()) {
      std::vector<std::string> names;
      for (const CommandWords& each : words.commands) {
        names.push_back(each.name);
      }
      throw InputError(fmt::format("man: there is no command {}: expected one of {}{}", files::shown(a->command),
                                   core::listed(names), files::did_you_mean(a->command, names)));
    }
    say_lines(one == nullptr ? manual_page(words, results::software()) : manual_page(*one, results::software()));
    return static_cast<int>(kDone);
  };
}

}  // namespace wheelwright::app
