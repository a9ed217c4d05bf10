// SPDX-License-Identifier: Apache-2.0
// The commands of the first half of the build, and the names of the others.
#include <array>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "app/commands.hpp"
#include "core/error.hpp"

namespace wheelwright::app {
namespace {

struct LaterCommand {
  const char* name;
  const char* purpose;  // as its own help begins
};

constexpr std::array<LaterCommand, 10> kLater{{
    {"try", "From a recording to an answer, without a robot file."},
    {"compare", "Compares two commissioned models."},
    {"identify",
     "What a log of fault-free driving says about the robot's parameters, how sure that is, and what to drive next."},
    {"margins",
     "Says beforehand which faults a commissioned robot's detector is certain to see, from what size on, how soon, "
     "and in which manoeuvre."},
    {"sensitivity",
     "What would a better sensor, another filter or a longer drive buy? Commissions the robot of a study file at many "
     "settings of its inputs and says how bounds, thresholds and the smallest faults that are certainly seen depend on "
     "them."},
    {"export",
     "Writes the detector of a commissioned model as one self-contained source file, with the model's numbers "
     "inside, for a controller that has neither this program nor its library."},
    {"design",
     "Designs a drive within limits of speed, acceleration, effort, space and time, and writes it as a table of "
     "wheel-speed commands."},
    {"choose",
     "Chooses the filter's order, α and β and the decision rule for the faults that are to be seen, under a "
     "stated promise about false alarms, and says what every other choice costs."},
    {"gap", "Diagnoses the gap between the model of a robot and a log of it."},
    {"fleet", "Commissions and checks the logs of many robots."},
}};

// Whatever is asked of a later command, its help too, is answered by what builds it.
Command add_later(CLI::App& program, const LaterCommand& later) {
  CLI::App& command = *program.add_subcommand(later.name, later.purpose);
  command.group("Not built yet, run ./examples/commission.sh again");
  command.set_help_flag();
  command.allow_extras();
  return {later.name, [name = later.name](const std::string&) -> int {
            throw InputError(fmt::format(
                "{}: not built yet: this program is the first half of wheelwright, which commissions, detects and "
                "checks: run ./examples/commission.sh again in the folder of its sources, which builds the rest",
                name));
          }};
}

}  // namespace

std::vector<Command> add_commands(CLI::App& program) {
  program.footer(
      "Start with:  wheelwright commission LOG --robot robot.yaml --out result\n"
      "Each command has its own --help.");
  std::vector<Command> commands = {{"commission", add_commission(program)},
                                   {"detect", add_detect(program)},
                                   {"doctor", add_doctor(program)},
                                   {"check", add_check(program)},
                                   {"simulate", add_simulate(program)},
                                   {"convert", add_convert(program)},
                                   {"robot", add_robot(program)},
                                   {"completion", add_completion(program)},
                                   {"man", add_man(program)}};
  for (const LaterCommand& later : kLater) {
    commands.push_back(add_later(program, later));
  }
  return commands;
}

}  // namespace wheelwright::app
