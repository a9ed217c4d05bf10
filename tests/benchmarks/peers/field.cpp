// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/peers/field.hpp"

#include <cmath>
#include <numbers>
#include <string>

#include "detector/faults/fault_rows.hpp"
#include "detector/faults/margins.hpp"
#include "detector/faults/reference_motion.hpp"
#include "identify/least_squares.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::peers {
namespace {

using testing_support::Random;

constexpr double kUncertainty = 0.2;  // of θ, as in the paper
constexpr double kBias = 0.01;        // of the efforts' noise, declared, as a share of its bound
constexpr double kFirstOnset = 3.0;   // s
constexpr double kLastOnset = 1.5;    // s before the end of a drive

sim::Trajectory trajectory(Driving driving, Random& random) {
  const auto between = [&](double low, double high) { return low + (high - low) * random.unit(); };
  sim::Trajectory r;
  r.kind = random.unit() < 0.5 ? sim::Trajectory::Kind::figure_eight : sim::Trajectory::Kind::multi_sine;
  switch (driving) {
    case Driving::gentle:
      r.speed = between(0.25, 0.35);
      r.yaw_rate = between(0.3, 0.5);
      r.period = between(18.0, 26.0);
      break;
    case Driving::varied:
      r.speed = between(0.6, 0.9);
      r.yaw_rate = between(1.0, 1.4);
      r.period = between(8.0, 12.0);
      break;
    case Driving::hard:
      r.kind = sim::Trajectory::Kind::multi_sine;
      r.speed = between(0.8, 1.0);
      r.yaw_rate = between(1.6, 2.2);
      r.period = between(3.5, 5.0);
      break;
  }
  return r;
}

// Standard deviation of noise of the bound 1.
double deviation(sim::NoiseShape shape) {
  switch (shape) {
    case sim::NoiseShape::uniform: return 1.0 / std::numbers::sqrt3;
    case sim::NoiseShape::truncated_gaussian: return 1.0 / 3.0;  // before it is cut
    case sim::NoiseShape::two_point: break;
  }
  return 1.0;
}

// Variance of what a least-squares fit leaves of each output of `log`.
std::array<double, kOutputs> residual_variance(LogSource& log, const OnlineModel& m) {
  TorqueRows stream(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  const RegressionBlock rows = read_all(stream);
  identify::LeastSquares squares(m.model.p());
  squares.add(rows);
  const Eigen::VectorXd e = rows.y - rows.Y * squares.solve().estimate;
  std::array<double, kOutputs> variance{};
  for (Eigen::Index k = 0; k < e.size(); ++k) {
    variance[static_cast<std::size_t>(k) % kOutputs] += e[k] * e[k] / static_cast<double>(rows.instants());
  }
  return variance;
}

}  // namespace

std::string_view to_string(Driving driving) {
  constexpr std::array<std::string_view, 3> names = {"gentle", "varied", "hard"};
  return names.at(static_cast<std::size_t>(driving));
}

Subject make_subject(std::uint64_t seed, Regime regime) {
  Subject s;
  s.regime = regime;
  s.scenario = testing_support::random_robot(seed);
  s.scenario.sensors.encoder_counts_per_turn = s.scenario.robot.encoder_counts_per_turn;
  s.scenario.sensors.effort = *s.scenario.robot.noise.effort.value;
  s.torque_sd = s.scenario.sensors.effort * deviation(s.scenario.sensors.noise);
  s.scenario.robot.noise.effort.bias = kBias * s.scenario.sensors.effort;
  s.scenario.robot.noise.effort.deviation = s.torque_sd;
  s.angle_sd = 2.0 * std::numbers::pi / *s.scenario.sensors.encoder_counts_per_turn / std::sqrt(12.0);

  Scenario learning = s.scenario;
  learning.seed = seed + 1'000'000;
  learning.duration = 60.0;
  learning.trajectory = {.kind = sim::Trajectory::Kind::commissioning, .speed = 1.0, .yaw_rate = 2.0, .period = 6.0};
  Simulation log(learning);
  const Commissioning result = commission_robot(log, learning.robot);
  if (result.status != Commissioning::Status::done) {
    throw InvalidArgument("robot " + std::to_string(seed) + ": " + result.message);
  }
  if (!result.model.at_risk) {
    throw InvalidArgument("robot " + std::to_string(seed) + ": nothing is said at a stated risk");
  }
  s.learning = learning;
  s.model = result.model;
  commission::CommissionOptions options;
  options.noise_mode = filter::NoiseMode::statistical;
  const Commissioning statistical = commission_robot(log, learning.robot, options);
  if (statistical.status != Commissioning::Status::done) {
    throw InvalidArgument("robot " + std::to_string(seed) + ", statistical bounds: " + statistical.message);
  }
  s.statistical = statistical.model;
  // As confident over all samples of the study as the set is over those of its log.
  s.statistical.errors = filter::propagate(
      s.model.model, s.model.filter, s.model.measurement,
      {.motion = std::numbers::pi / *s.scenario.sensors.encoder_counts_per_turn, .effort = s.scenario.sensors.effort},
      {.mode = filter::NoiseMode::statistical,
       .confidence = options.confidence,
       .rows = 1e7,
       .largest_step = 1.0 / s.scenario.rate});
  s.variance = residual_variance(log, s.model);
  s.covariance = result.estimators.best().covariance;
  if (regime == Regime::identified) {
    return s;
  }
  Random random(seed + 2'000'000);
  const Eigen::VectorXd nominal = sim::true_parameters(s.scenario, s.model.model);
  s.model.facets.clear();
  s.model.box.sides.clear();
  s.covariance = Eigen::MatrixXd::Zero(nominal.size(), nominal.size());
  for (Eigen::Index j = 0; j < nominal.size(); ++j) {
    s.model.box.sides.push_back({(1.0 - kUncertainty) * nominal[j], (1.0 + kUncertainty) * nominal[j]});
    s.model.estimate[j] = nominal[j] * (1.0 + kUncertainty * random.symmetric());
    s.covariance(j, j) = std::pow(kUncertainty * nominal[j], 2) / 3.0;
  }
  s.statistical.facets.clear();
  s.statistical.box = s.model.box;
  s.model.at_risk->facets.clear();
  s.model.at_risk->box = s.model.box;
  return s;
}

Scenario make_drive(const Subject& subject, Driving driving, std::uint64_t seed, double duration) {
  Random random(seed);
  Scenario s = subject.scenario;
  s.seed = seed;
  s.trajectory = trajectory(driving, random);
  s.duration = duration;
  s.sensors.speeds = s.sensors.pose = s.sensors.commands = false;
  if (subject.regime == Regime::uncertain) {
    const auto change = [&](double& value) { value *= 1.0 + kUncertainty * random.symmetric(); };
    change(s.parameters.mass);
    change(s.parameters.yaw_inertia);
    change(s.parameters.viscous_x);
    s.parameters.viscous_y = s.parameters.viscous_x;
    change(s.parameters.viscous_yaw);
  }
  return s;
}

std::uint64_t drive_seed(std::uint64_t robot, Driving driving, std::uint64_t number) {
  return robot * 100'000 + static_cast<std::uint64_t>(driving) * 10'000 + number;
}

std::array<std::vector<testing_support::FaultyRun>, kDriving.size()> make_runs(const Subject& subject,
                                                                               std::uint64_t robot, std::size_t count) {
  Random random(robot + 3'000'000);
  std::array<std::vector<testing_support::FaultyRun>, kDriving.size()> runs;
  for (const Driving driving : kDriving) {
    for (std::size_t k = 0; k < count; ++k) {
      testing_support::FaultyRun run{.robot = nullptr, .drive = {}, .fault = {}, .simulated = std::nullopt};
      const double onset = kFirstOnset + 9.0 * random.unit();
      run.drive = make_drive(subject, driving, drive_seed(robot, driving, 5'000 + k), onset + kPatience + 0.2);
      run.onset = (std::floor(onset * run.drive.rate) + 0.01) / run.drive.rate;
      run.side = random.unit() < 0.5 ? -1.0 : 1.0;
      runs[static_cast<std::size_t>(driving)].push_back(run);
    }
  }
  return runs;
}

std::vector<LogTable> usual_logs(const Subject& subject, std::uint64_t robot, double samples) {
  constexpr std::uint64_t drives = 12;
  std::vector<LogTable> logs;
  for (std::uint64_t k = 0; k < drives; ++k) {
    logs.push_back(sim::simulate(make_drive(subject, Driving::varied, drive_seed(robot, Driving::varied, 7'000 + k),
                                            samples / static_cast<double>(drives) / subject.scenario.rate)));
  }
  return logs;
}

std::vector<TriedFault> tried_faults(const Subject& subject, Driving driving, std::uint64_t seed) {
  const OnlineModel& m = subject.model;
  const std::vector<FaultType> catalogue = model::fault_catalogue(m.model, m.estimate);
  std::vector<TriedFault> tried;
  std::vector<FaultType> types;
  for (const char* name : {"wheel_radius", "wheel_radius_right", "matched", "unmatched", "slip_yaw",
                           "effort_loss_right", "effort_bias_left", "encoder_scale_right"}) {
    for (const FaultType& type : catalogue) {
      if (type.name == name) {
        types.push_back(type);
      }
    }
    for (const auto& breakage : testing_support::breakages()) {
      if (breakage.fault == name) {
        tried.push_back({types.back(), breakage.simulated, {}});
      }
    }
  }
  std::vector<detector::FaultMargins> pooled;
  for (std::uint64_t k = 0; k < 3; ++k) {
    Scenario drive = make_drive(subject, driving, seed + k, 30.0);
    drive.parameters = subject.scenario.parameters;
    drive.sensors.encoder_counts_per_turn.reset();
    drive.sensors.effort = 0.0;
    Simulation log(drive);
    detector::ReferenceMotion motion =
        detector::read_reference(log, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
    for (std::size_t i = 0; i < motion.instants(); ++i) {
      motion.settled[i] = motion.settled[i] && motion.t[i] >= kFirstOnset && motion.t[i] <= drive.duration - kLastOnset;
    }
    std::vector<detector::FaultMargins> each =
        detector::margins_along(motion, types, subject.rule(),
                                [&](const FaultType& fault) {
                                  return std::make_unique<detector::FaultFilter>(fault, m.model, m.filter, motion);
                                },
                                {.windows = {1.0}, .onset_step = 1.0});
    if (k == 0) {
      pooled = std::move(each);
      continue;
    }
    for (std::size_t i = 0; i < pooled.size(); ++i) {
      pooled[i].onsets.insert(pooled[i].onsets.end(), each[i].onsets.begin(), each[i].onsets.end());
    }
  }
  for (TriedFault& fault : tried) {
    for (const detector::FaultMargins& margins : pooled) {
      if (margins.fault.name == fault.type.name) {
        fault.certain[margins.side > 0.0 ? 0 : 1] = detector::summarise(margins, 0).median;
      }
    }
  }
  return tried;
}

}  // namespace wheelwright::peers
