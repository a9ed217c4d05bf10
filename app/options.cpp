// SPDX-License-Identifier: Apache-2.0
#include "app/options.hpp"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <limits>
#include <map>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "app/run_items.hpp"
#include "app/units.hpp"
#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::app {
namespace {

constexpr int kMostThreads = 1024;

}  // namespace

void add_common(CLI::App& command, CommonOptions& options) {
  options.command = command.get_name();
  command.add_option("--out", options.out, "Write results and report.html into this directory")->type_name("DIR");
  command.add_flag("--force", options.force, "Replace what is there, also what another command or you wrote");
  command.add_flag("--json", options.json, "Print the result as JSON on standard output, and nothing else there");
  // Of the processors that this process may use, so that ranks that are bound to one have one.
  options.threads = std::clamp(static_cast<int>(std::thread::hardware_concurrency()), 1, kMostThreads);
  command.add_option("--threads", options.threads, "Use at most N threads; results do not depend on it")
      ->type_name("N")
      ->check(CLI::Range(1, kMostThreads))
      ->default_str("all processors");
  command.add_option("--seed", options.seed, "Seed of everything random")->type_name("N")->capture_default_str();
  command.add_flag("--quiet", options.quiet, "No progress and no summary; errors are still told");
}

void take_columns(const std::filesystem::path& file, CommonOptions& options) {
  if (!file.empty()) {
    options.columns = robots::read_columns(file, logs::log_column_names());
  }
}

void add_footer(CLI::App& command, const char* text) { command.footer(text); }

CLI::Option& repeatable(CLI::Option& option) {
  return *option.expected(1)->allow_extra_args(false)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_map(CLI::App& command, CommonOptions& options) {
  repeatable(
      *command
           .add_option(
               "--map", options.map,
               "Read the log column NAME from the file's column COLUMN, or from a bag's TOPIC.FIELD (repeatable), e.g. "
               "--map omega_r=wheel_2 or --map omega_r=/joint_states.velocity[right_wheel]; COLUMN*FACTOR multiplies, "
               "for other units (rpm: *0.10472), and *FACTOR alone what is read without --map")
           ->type_name("NAME=COLUMN"));
  repeatable(*command
                  .add_option("--msg-path", options.msg_path,
                              "Directory with definitions of messages (PKG/msg/TYPE.msg), for bags that do not bring "
                              "their own (repeatable)")
                  ->type_name("DIR"));
  command.add_flag("--trust", options.trust,
                   "Read also what a log reaches for outside of itself and its directory: links, HDF5's external and "
                   "virtual datasets, very large journals and packed files");
}

void add_despite(CLI::App& command, CommonOptions& options) {
  repeatable(*command
                  .add_option("--despite", options.despite,
                              "Go on despite this finding of `wheelwright doctor`, e.g. units.effort (repeatable)")
                  ->type_name("NAME"));
}

void add_persistence(CLI::App& command, std::optional<detector::Persistence>& persistence,
                     const std::string& otherwise) {
  command
      .add_option_function<std::string>(
          "--persistence",
          [&persistence](const std::string& text) {
            detector::Persistence rule;
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

void add_set(CLI::App& command, detector::ParameterSetKind& set) {
  command.add_option("--set", set, "Threshold from the feasible set itself (polytope) or from its box")
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, detector::ParameterSetKind>{
                          {"polytope", detector::ParameterSetKind::polytope}, {"box", detector::ParameterSetKind::box}})
                      .description("{polytope,box}"))
      ->type_name("SET");
}

void add_residual(CLI::App& command, detector::Residual& residual) {
  command
      .add_option("--residual", residual,
                  "Decide by D1, the time-varying threshold of the feasible set, or by D2, the model's constant "
                  "thresholds by experiment, without guarantee")
      ->transform(CLI::CheckedTransformer(std::map<std::string, detector::Residual>{{"d1", detector::Residual::d1},
                                                                                    {"d2", detector::Residual::d2}})
                      .description("{d1,d2}"))
      ->type_name("RESIDUAL");
}

void add_test(CLI::App& command, detector::Test& test) {
  command.add_option("--test", test, "Compare with [l, u] (two_sided) or with rho as the paper does (symmetric)")
      ->transform(
          CLI::CheckedTransformer(std::map<std::string, detector::Test>{{"two_sided", detector::Test::two_sided},
                                                                        {"symmetric", detector::Test::symmetric}})
              .description("{two_sided,symmetric}"))
      ->type_name("TEST");
}

namespace {

std::string if_empty(const OptionWords& option, const std::string& value) {
  if (!value.empty()) {
    return {};
  }
  return std::string("is empty: expected ") + (option.takes_directory() ? "a directory"
                                               : option.takes_file()    ? "a file"
                                                                        : "a value");
}

std::string if_no_count(const std::string& value) {
  std::uint64_t count = 0;
  const char* const end = value.data() + value.size();
  const auto read = std::from_chars(value.data(), end, count);
  return read.ec == std::errc() && read.ptr == end
             ? std::string()
             : fmt::format("{}: expected a whole number from 0 to {}", files::shown(value),
                           std::numeric_limits<std::uint64_t>::max());
}

}  // namespace

void refuse_mistaken_values(CLI::App& program) {
  for (CLI::App* command : program.get_subcommands([](CLI::App*) { return true; })) {
    for (CLI::Option* option : command->get_options()) {
      const OptionWords words = words_of(*option);
      if (words.value.empty()) {
        continue;
      }
      option->transform(CLI::Validator([words](std::string& value) { return if_empty(words, value); }, ""));
      if (words.value == "N") {
        option->check(if_no_count);
      }
    }
  }
}

void refuse_lost_values(const std::vector<std::string>& words) {
  for (const std::string& word : words) {
    if (word == "--") {
      return;
    }
    if (word.size() > 3 && word.starts_with("--") && word.find('=') == word.size() - 1) {
      throw CLI::ValidationError(word.substr(0, word.size() - 1), "is empty: expected a value");
    }
  }
}

CLI::Validator in_unit(const std::string& unit) {
  CLI::Validator out(
      [unit](std::string& text) {
        try {
          text = files::number_text(quantity(text, unit));
          return std::string();
        } catch (const InputError& error) {
          return std::string(error.what());
        }
      },
      "", "unit");
  return out;
}

}  // namespace wheelwright::app
