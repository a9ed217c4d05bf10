// SPDX-License-Identifier: Apache-2.0
#include <set>

#include "formats/robots/fleet_list.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// Robots of a list have names of their own, logs that commission or a finding that says why not, and a key.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto path = fuzz::on_disk(fuzz::text_of(data, size), ".fleet.csv");
  return fuzz::clean([&] {
    std::set<std::string> names;
    for (const robots::FleetListRobot& robot : robots::read_fleet(path)) {
      fuzz::require(!robot.name.empty() && names.insert(robot.name).second);
      fuzz::require(!robot.commission.empty() || !robot.findings.empty());
      fuzz::require(!robots::key_of(robot).empty());
    }
    fuzz::require(!names.empty());
  });
}
