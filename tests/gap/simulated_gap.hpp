// SPDX-License-Identifier: Apache-2.0
/// \file
/// Drives of a simulated robot whose file may have effects, as the gap analysis of the plain robot file looks at them.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/error.hpp"
#include "gap/effects/effect.hpp"
#include "gap/rows/block_gram.hpp"
#include "gap/rows/gap_rows.hpp"
#include "model/filter/measurement.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::gap::gap_example {

/// Viscous friction of the robot's yaw that its wheels' joints make: f1 (D/2)², N·m·s/rad.
inline constexpr double kYawFriction = 4.0 * 0.1905 * 0.1905;

/// The robot of the examples (r = 0.0975 m, D = 0.381 m, 21 kg) without effects, with its nominal values.
inline Robot plain_robot() {
  Robot robot;
  robot.wheel_radius = 0.0975;
  robot.track_width = 0.381;
  robot.nominal = {{"mass", 21.0}, {"yaw_inertia", 0.9}, {"viscous_linear", 4.0}, {"viscous_yaw", kYawFriction}};
  return robot;
}

/// A drive with reversals; efforts are linear between stamps, and without noise.
inline Scenario simulated_drive(const Robot& robot, double duration = 24.0, double rate = 100.0) {
  Scenario s;
  s.robot = robot;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = kYawFriction};
  s.trajectory = {.kind = sim::Trajectory::Kind::multi_sine, .speed = 0.8, .yaw_rate = 1.6, .period = 8.0};
  s.duration = duration;
  s.rate = rate;
  s.sensors.angles = s.sensors.commands = false;
  return s;
}

/// The log of `scenario` read by `robot`.
inline Drive drive_of_log(const LogTable& log, const Robot& robot, const DriveOptions& options = {}) {
  TableSource source(log);
  const Model model = model::make_model(robot);
  Drive drive = make_drive(log, robot, filter::find_measurement(source, robot, model, 2), options);
  Eigen::VectorXd theta(static_cast<Eigen::Index>(model.p()));
  for (std::size_t j = 0; j < model.p(); ++j) {
    theta[static_cast<Eigen::Index>(j)] =
        robot.nominal.at(model.parameters[j].physical) * model.parameters[j].per_physical;
  }
  predict_efforts(drive, theta);
  return drive;
}

/// The effect of the catalogue called `name`.
inline Effect effect_called(const std::string& name) {
  for (Effect& effect : effect_catalogue()) {
    if (effect.name == name) {
      return effect;
    }
  }
  throw InvalidArgument("no effect called " + name);
}

/// `effects` with coefficients fitted to `drive` beside θ: free, or held at drive.theta. θ is the first.
inline std::pair<Eigen::VectorXd, std::vector<FittedEffect>> fit_effects(const Drive& drive,
                                                                         std::vector<FittedEffect> effects,
                                                                         bool free_theta) {
  const GapRowOptions options{.beta = 10.0};
  NoiseFloor floor;
  floor.efforts = Eigen::Vector2d(0.02, 0.005);
  floor.increments = {1e-3, 1e-3, 1e-3};
  GapRows rows = make_gap_rows(drive, floor, {}, options);
  Subset subset;
  for (std::size_t j = 0; free_theta && j < drive.model.p(); ++j) {
    subset.columns.push_back(j);
  }
  for (const FittedEffect& effect : effects) {
    for (const Column& column : effect.effect.columns(drive, effect.shape)) {
      (effect.effect.unit_coefficient ? subset.fixed : subset.columns).push_back(rows.spaces.front().columns.size());
      std::vector<Eigen::VectorXd> part = rows_of(drive, rows, column, options);
      for (std::size_t s = 0; s < rows.spaces.size(); ++s) {
        rows.spaces[s].columns.push_back(std::move(part[s]));
      }
    }
  }
  Eigen::VectorXd theta = drive.theta;
  const Eigen::VectorXd found = BlockGram(rows.spaces, {.blocks = 8}).fit(subset).coefficients;
  Eigen::Index next = 0;
  if (free_theta) {
    theta += found.head(theta.size());
    next = theta.size();
  }
  for (FittedEffect& effect : effects) {
    const auto n = static_cast<Eigen::Index>(effect.effect.parameters.size());
    effect.coefficients = found.segment(next, n);
    next += n;
  }
  return {theta, effects};
}

/// The drive of plain_robot().
inline const Drive& plain_drive() {
  static const Drive drive = drive_of_log(sim::simulate(simulated_drive(plain_robot())), plain_robot());
  return drive;
}

/// The effect `name` of the catalogue with these numbers.
inline FittedEffect fitted(const std::string& name, std::vector<double> coefficients, std::vector<double> shape = {}) {
  return {effect_called(name), std::move(shape),
          Eigen::Map<const Eigen::VectorXd>(coefficients.data(), std::ssize(coefficients))};
}

}  // namespace wheelwright::gap::gap_example
