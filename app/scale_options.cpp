// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>

#include "app/options.hpp"

namespace wheelwright::app {

void add_scale_options(CLI::App& command, ScaleOptions& options) {
  command
      .add_option_function<std::string>(
          "--shard",
          [&options](const std::string& text) {
            options.shard = shard_of(text);
            if (!options.shard) {
              throw CLI::ValidationError("--shard '" + text + "': expected I/N with 1 <= I <= N, e.g. 3/7",
                                         CLI::ExitCodes::ValidationError);
            }
          },
          "Evaluate the Ith of N parts only, into its own file in --out; --merge takes the parts together")
      ->type_name("I/N");
  command.add_flag("--merge", options.merge, "Take together what the shards in --out evaluated; evaluate nothing");
  command.add_flag("--fresh", options.fresh,
                   "Throw away what an earlier run left in --out, instead of going on with it");
}

}  // namespace wheelwright::app
