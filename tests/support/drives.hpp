// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulated drives that the tests of several modules share, and the filtered rows they give.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "commission/commission.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/row_stream.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::testing_support {

/// The four parameters of (20).
inline const std::vector<std::string> kFour = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};

/// All shapes of noise; two_point is at its bound in every sample.
inline constexpr std::array kNoiseShapes{sim::NoiseShape::uniform, sim::NoiseShape::truncated_gaussian,
                                         sim::NoiseShape::two_point};

/// Motion columns of a drive's log.
enum class Shown {
  angles,       ///< wheel angles at the stamp
  speeds,       ///< wheel speeds at the stamp
  mean_speeds,  ///< angle differences over sampling intervals, stamped at their middle
};

/// A commissioning drive without noise of the robot of the examples, 20 s at 100 Hz, of which exactly `shown` is
/// logged.
inline Scenario exact_drive(Shown shown, Hold hold) {
  Scenario s;
  s.robot.wheel_radius = 0.0975;
  s.robot.track_width = 0.381;
  s.robot.hold = hold;
  s.robot.effort_changes = model::EffortChanges::at_samples;
  s.robot.parameters = kFour;
  s.robot.filter.beta = 8.0;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  s.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 0.6, .yaw_rate = 1.2, .period = 4.0};
  s.duration = 20.0;
  s.rate = 100.0;
  s.sensors.angles = shown == Shown::angles;
  s.sensors.speeds = shown != Shown::angles;
  s.sensors.pose = s.sensors.commands = false;
  if (shown == Shown::mean_speeds) {
    s.sensors.sampling = sim::Sampling::interval;
    s.robot.speed_source = model::SpeedSource::encoder_difference;
  }
  return s;
}

/// A drive with noise inside bounds that the robot declares: 4096 counts a turn and 0.02 N·m.
inline Scenario noisy_drive(std::uint64_t seed, double duration = 12.0) {
  Scenario s = exact_drive(Shown::angles, Hold::zero_order);
  s.trajectory.period = duration / 5.0;
  s.duration = duration;
  s.sensors.encoder_counts_per_turn = 4096.0;
  s.sensors.effort = 0.02;
  s.robot.encoder_counts_per_turn = 4096.0;
  s.robot.noise.effort.value = 0.02;
  s.seed = seed;
  return s;
}

/// The filter that the scenario's robot asks for on its own log, with the bounds `errors` on its rows.
inline RegressorFilter filter_of(const Scenario& scenario, filter::SignalErrors errors = {}, int order = 2) {
  Simulation log(scenario);
  const Model model = model::make_model(scenario.robot);
  const double beta = scenario.robot.filter.beta.value_or(8.0);
  return RegressorFilter(model, {.order = order, .alpha = beta, .beta = beta},
                         filter::find_measurement(log, scenario.robot, model, order), std::move(errors));
}

}  // namespace wheelwright::testing_support
