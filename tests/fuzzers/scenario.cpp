// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "core/error.hpp"
#include "model/sim/simulation.hpp"
#include "results/scenario_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

constexpr double kMostRows = 500.0;  // that are simulated

}  // namespace

// A scenario that is read is one that can be simulated, and where it is short its log is clean.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    Scenario scenario = results::parse_scenario(fuzz::text_of(data, size, fuzz::kLongestYaml), "scenario.yaml");
    fuzz::require(std::isfinite(scenario.duration) && std::isfinite(scenario.rate) && scenario.rate > 0.0);
    if (scenario.duration * scenario.rate > kMostRows) {
      return;
    }
    fuzz::promised([&] {
      LogTable table;
      try {
        table = sim::simulate(scenario);
      } catch (const Error&) {
        return;  // a drive that no robot follows, say
      }
      const core::TableSource checked(table);
    });
  });
}
