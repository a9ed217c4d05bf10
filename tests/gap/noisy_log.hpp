// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulated logs with noise, and what the gap analysis selects on them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gap/causes/selection.hpp"
#include "gap/prepared.hpp"
#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::gap_example {

inline constexpr double kCounts = 16384.0;  // per turn

/// plain_robot() with its encoders.
inline Robot counted_robot() {
  Robot robot = plain_robot();
  robot.encoder_counts_per_turn = kCounts;
  return robot;
}

/// The same with one effect of the simulator.
inline Robot robot_with(const std::string& effect, const std::map<std::string, double>& parameters) {
  Robot robot = counted_robot();
  model::RobotEffect has{effect, {}};
  for (const auto& [name, value] : parameters) {
    has.parameters[name] = {value, value};
  }
  robot.effects = {has};
  return robot;
}

/// 40 s of `world` with encoder counts and noise of torque and pose.
inline Scenario noisy_scenario(const Robot& world, std::uint64_t seed, double rate = 50.0) {
  Scenario s = simulated_drive(world, 40.0, rate);
  s.sensors.sampling = sim::Sampling::interval;
  s.sensors.encoder_counts_per_turn = kCounts;
  s.sensors.effort = 0.05;
  s.sensors.position = 0.002;
  s.sensors.heading = 0.003;
  s.seed = seed;
  return s;
}

/// The healthy log that goes with it.
inline Scenario healthy_scenario(const Scenario& real) {
  Scenario s = noisy_scenario(counted_robot(), real.seed + 5000, real.rate);
  return s;
}

inline PreparedGap prepared_log(const Scenario& real, bool with_baseline, const DiagnoseOptions& options = {}) {
  Simulation log(real), healthy(healthy_scenario(real));
  return prepare_gap(log, with_baseline ? &healthy : nullptr, counted_robot(), options);
}

/// The problem of `prepared` with its Gram matrices.
struct Problem {
  GapProblem problem;
  std::unique_ptr<BlockGram> gram;

  explicit Problem(const PreparedGap& prepared, const BlockOptions& blocks = {})
      : problem(make_problem(prepared.drive, prepared.floor, prepared.healthy, prepared.trusted, prepared.catalogue,
                             all_shapes(prepared.catalogue, prepared.drive), prepared.row_options)),
        gram(std::make_unique<BlockGram>(problem.rows.spaces, blocks)) {
    problem.table.gram = gram.get();
  }
  [[nodiscard]] Selection select() const {
    CandidateTable table = problem.table;
    table.spaces = &problem.rows.spaces;
    return select_causes(table, problem.kinds, true, 1.0);
  }
};

/// The effects called `names` out of the catalogue.
inline std::vector<Effect> only(const std::vector<std::string>& names) {
  std::vector<Effect> effects;
  for (const std::string& name : names) {
    effects.push_back(effect_called(name));
  }
  return effects;
}

}  // namespace wheelwright::gap::gap_example
