// SPDX-License-Identifier: Apache-2.0
/// \file
/// Seeded runs of a robot that breaks: what was promised for its motion beforehand, and what its detector then said.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "detector/detector.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/margins.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/online_model.hpp"
#include "detector/threshold.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::testing_support {

/// A robot, commissioned.
struct Commissioned {
  Scenario scenario;  ///< of the learning drive
  OnlineModel model;
};

/// Another robot for every seed: masses, rates, encoders, noise, holds, filters. The noise reaches its declared bounds;
/// for a third of the seeds it is never anywhere else.
inline Scenario random_robot(std::uint64_t seed) {
  Random random(seed);
  Scenario s = noisy_drive(seed, 12.0);
  s.parameters.mass = 8.0 + 40.0 * random.unit();
  s.parameters.yaw_inertia = s.parameters.mass * (0.02 + 0.05 * random.unit());
  s.parameters.viscous_x = s.parameters.viscous_y = 1.0 + 9.0 * random.unit();
  s.parameters.viscous_yaw = 0.1 + 1.2 * random.unit();
  s.rate = std::vector<double>{50.0, 100.0, 200.0}[random.below(3)];
  s.robot.hold = random.unit() < 0.5 ? Hold::zero_order : Hold::first_order;
  s.robot.filter.beta = 4.0 + 12.0 * random.unit();
  const double counts = std::vector<double>{2048.0, 8192.0, 32768.0}[random.below(3)];
  s.robot.encoder_counts_per_turn = counts;
  s.sensors.encoder_counts_per_turn = counts;
  s.robot.noise.effort.value = 0.01 + 0.04 * random.unit();
  s.sensors.effort = *s.robot.noise.effort.value;
  s.sensors.noise = kNoiseShapes[random.below(kNoiseShapes.size())];
  return s;
}

/// The robot of a seed and its model; throws where commissioning fails.
inline Commissioned commissioned_robot(std::uint64_t seed) {
  Commissioned c{random_robot(seed), {}};
  Simulation log(c.scenario);
  const Commissioning result = commission_robot(log, c.scenario.robot);
  if (result.status != Commissioning::Status::done) {
    throw InvalidArgument("seed " + std::to_string(seed) + ": " + result.message);
  }
  c.model = result.model;
  return c;
}

/// The same where efforts' errors average out, learnt from half a minute: its model has something at a stated risk.
inline Commissioned commissioned_at_risk(std::uint64_t seed) {
  Commissioned c{random_robot(seed), {}};
  c.scenario.duration = 30.0;
  c.scenario.robot.effort_changes = model::EffortChanges::at_samples;
  c.scenario.robot.noise.effort.bias = 0.0;
  Simulation log(c.scenario);
  const Commissioning result = commission_robot(log, c.scenario.robot);
  if (!result.model.at_risk) {
    throw InvalidArgument("seed " + std::to_string(seed) + ": nothing at a stated risk");
  }
  c.model = result.model;
  return c;
}

/// Realisation of a catalogue fault in a run.
struct Breakage {
  std::string fault;                            ///< of the catalogue
  std::optional<model::Fault::Kind> simulated;  ///< the simulator's, where the robot itself breaks
};

inline const std::vector<Breakage>& breakages() {
  static const std::vector<Breakage> all = {{"wheel_radius", model::Fault::Kind::wheel_radius},
                                            {"wheel_radius_right", model::Fault::Kind::wheel_radius_right},
                                            {"wheel_radius_left", model::Fault::Kind::wheel_radius_left},
                                            {"matched", model::Fault::Kind::matched},
                                            {"unmatched", model::Fault::Kind::unmatched},
                                            {"slip_yaw", model::Fault::Kind::slip_yaw},
                                            {"effort_loss_right", std::nullopt},
                                            {"effort_bias_left", std::nullopt},
                                            {"encoder_scale_right", std::nullopt},
                                            {"encoder_scale_left", std::nullopt}};
  return all;
}

/// One fault of one size in one drive.
struct FaultyRun {
  const Commissioned* robot;
  Scenario drive;  ///< without the fault
  FaultType fault;
  std::optional<model::Fault::Kind> simulated;
  double onset = 0.0;  ///< s, between two samples of the log
  double side = 1.0;
};

/// The log of a run with a fault of this magnitude (of FaultType), with or without the sensors' noise.
inline LogTable log_of(const FaultyRun& run, double magnitude, bool noisy) {
  Scenario s = run.drive;
  if (!noisy) {
    s.sensors.encoder_counts_per_turn.reset();
    s.sensors.effort = 0.0;
  }
  if (run.simulated) {
    const bool radius = *run.simulated <= model::Fault::Kind::wheel_radius_left;
    s.faults = {{.kind = *run.simulated,
                 .magnitude = magnitude * (radius ? s.robot.wheel_radius : 1.0),
                 .profile = {.onset = run.onset}}};
  }
  Simulation source(s);
  LogTable log = read_all(source);
  if (run.simulated) {
    return log;
  }
  const auto first = static_cast<std::size_t>(std::lower_bound(log.t.begin(), log.t.end(), run.onset) - log.t.begin());
  const double kappa = run.fault.kappa(magnitude);
  const bool right = run.fault.name.ends_with("_right");
  std::vector<double>& effort = log.column(right ? "tau_r" : "tau_l");
  std::vector<double>& angle = log.column(right ? "phi_r" : "phi_l");
  const double before = angle[first - 1];
  for (std::size_t k = first; k < log.rows(); ++k) {
    if (run.fault.name.starts_with("effort_loss")) {
      effort[k] *= 1.0 + kappa;
    } else if (run.fault.name.starts_with("effort_bias")) {
      effort[k] += kappa;
    } else {
      angle[k] = before + (1.0 + kappa) * (angle[k] - before);
    }
  }
  return log;
}

/// Promise for a motion: the smallest certain magnitude within `window` s of the onset, and the largest one that stays
/// hidden for noise of `share` times its bounds.
struct Promise {
  double certain = 0.0, hidden = 0.0;
};

/// The promise for the motion of a run in which the fault has this magnitude already (it changes the motion), or for
/// the healthy motion where it is the reading of a sensor that breaks.
inline Promise promise(const FaultyRun& run, double magnitude, double window, double share) {
  const OnlineModel& m = run.robot->model;
  FaultyRun reference = run;
  const LogTable table = log_of(reference, run.simulated ? magnitude : 0.0, false);
  TableSource log(table);
  detector::ReferenceMotion motion =
      detector::read_reference(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  // One onset: the first instant that the fault has reached.
  const auto onset = static_cast<std::size_t>(
      std::lower_bound(motion.instant.begin(), motion.instant.end(), run.onset) - motion.instant.begin());
  for (std::size_t k = 0; k < motion.instants(); ++k) {
    motion.settled[k] = k == onset;
  }
  const detector::ThresholdRule rule(Polytope(m.facets, m.box), m.estimate);
  const auto margins = detector::margins_along(
      motion, {run.fault}, rule,
      [&](const FaultType& fault) { return std::make_unique<detector::FaultFilter>(fault, m.model, m.filter, motion); },
      {.windows = {window}, .noise_share = share});
  for (const detector::FaultMargins& each : margins) {
    if (each.side == run.side && each.onsets.size() == 1 && each.onsets[0].certain.size() == 1) {
      return {each.onsets[0].certain[0], each.onsets[0].hidden};
    }
  }
  throw InvalidArgument("the window runs past the end of the drive");
}

/// Decisions of the detector in a run.
struct Outcome {
  bool early = false;                                      ///< an alarm before the onset
  double first = std::numeric_limits<double>::infinity();  ///< first alarm from the onset on, s after it
};

inline Outcome watch(const FaultyRun& run, double magnitude) {
  const LogTable table = log_of(run, magnitude, true);
  TableSource log(table);
  Detector detector = make_detector(run.robot->model);
  std::vector<std::size_t> pick;
  for (const auto& name : run.robot->model.measurement.columns()) {
    pick.push_back(log.find(name).value());
  }
  Outcome outcome;
  std::vector<double> sample(pick.size());
  for (std::size_t k = 0; k < table.rows(); ++k) {
    for (std::size_t c = 0; c < pick.size(); ++c) {
      sample[c] = table.columns[pick[c]][k];
    }
    if (detector.step(table.t[k], sample).fault) {
      if (table.t[k] < run.onset) {
        outcome.early = true;
      } else {
        outcome.first = std::min(outcome.first, table.t[k] - run.onset);
      }
    }
  }
  return outcome;
}

/// A run of a robot that breaks at a random time of a random drive.
inline FaultyRun random_run(const Commissioned& robot, std::uint64_t seed, const Breakage& breakage) {
  Random random(seed);
  FaultyRun run{.robot = &robot, .drive = robot.scenario, .fault = {}, .simulated = breakage.simulated};
  run.drive.seed = seed;
  const std::vector<sim::Trajectory::Kind> kinds = {sim::Trajectory::Kind::multi_sine,
                                                    sim::Trajectory::Kind::figure_eight,
                                                    sim::Trajectory::Kind::commissioning, sim::Trajectory::Kind::stops};
  run.drive.trajectory.kind = kinds[random.below(kinds.size())];
  run.drive.trajectory.period = 4.0 + 6.0 * random.unit();
  run.drive.trajectory.speed = 0.4 + 0.4 * random.unit();
  run.drive.trajectory.yaw_rate = 0.6 + 1.0 * random.unit();
  run.drive.duration = 10.0;
  run.onset = (std::floor((4.0 + 3.0 * random.unit()) * run.drive.rate) + 0.01) / run.drive.rate;
  for (const FaultType& fault : model::fault_catalogue(robot.model.model, robot.model.estimate)) {
    if (fault.name == breakage.fault) {
      run.fault = fault;
    }
  }
  run.side = run.fault.range.lower < 0.0 && random.unit() < 0.5 ? -1.0 : 1.0;
  return run;
}

}  // namespace wheelwright::testing_support
