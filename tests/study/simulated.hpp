// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robots of a fleet that drive in the simulator.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include "study/examine_robot.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::testing_support {

/// A log of the robot with mass `mass`, 12 s, named after its seed.
inline study::FleetLog driven(double mass, std::uint64_t seed, double when = 0.0) {
  return {.name = "log_" + std::to_string(seed), .when = when, .open = [mass, seed] {
            Scenario scenario = noisy_drive(seed);
            scenario.parameters.mass = mass;
            Robot robot = scenario.robot;
            return study::OpenedLog{std::make_unique<Simulation>(std::move(scenario)), std::move(robot)};
          }};
}

/// A log that cannot be opened.
inline study::FleetLog broken(const std::string& why, double when = 0.0) {
  return {.name = "broken", .when = when, .open = [why]() -> study::OpenedLog { throw std::runtime_error(why); }};
}

}  // namespace wheelwright::testing_support
