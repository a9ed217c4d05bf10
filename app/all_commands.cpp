// SPDX-License-Identifier: Apache-2.0
#include "app/commands.hpp"

namespace wheelwright::app {

std::vector<Command> add_commands(CLI::App& program) {
  return {{"try", add_try(program)},
          {"commission", add_commission(program)},
          {"detect", add_detect(program)},
          {"doctor", add_doctor(program)},
          {"check", add_check(program)},
          {"compare", add_compare(program)},
          {"identify", add_identify(program)},
          {"margins", add_margins(program)},
          {"sensitivity", add_sensitivity(program)},
          {"export", add_export(program)},
          {"design", add_design(program)},
          {"simulate", add_simulate(program)},
          {"choose", add_choose(program)},
          {"gap", add_gap(program)},
          {"fleet", add_fleet(program)},
          {"convert", add_convert(program)},
          {"robot", add_robot(program)},
          {"completion", add_completion(program)},
          {"man", add_man(program)}};
}

}  // namespace wheelwright::app
