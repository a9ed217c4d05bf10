// SPDX-License-Identifier: Apache-2.0
#include "gap/rollout.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>

#include "core/check.hpp"
#include "core/for_all.hpp"
#include "model/effect_law.hpp"
#include "model/sim/drivetrain.hpp"
#include "model/sim/plant.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kLagsOfMemory = 8.0;      // time constants after which a lag has forgotten
constexpr double kMemoryOfBacklash = 0.2;  // s
constexpr int kBootstrapDraws = 1000;

using Signals = std::vector<Eigen::VectorXd>;

model::DriveParameters parameters_of(const Robot& robot) {
  const auto value = [&robot](const std::string& name) {
    const auto found = robot.nominal.find(name);
    check::that(found != robot.nominal.end(), "rollouts robot.nominal", "a value for " + name);
    return found->second;
  };
  // The plant's inertia is that of a data sheet, whatever the model's lever arm.
  const double arms = robot.lever_arm_is_track ? 2.0 : 1.0;
  const bool two = robot.anisotropic_friction;
  return {.mass = value("mass"),
          .yaw_inertia = value("yaw_inertia") / arms,
          .viscous_x = value(two ? "viscous_x" : "viscous_linear"),
          .viscous_y = value(two ? "viscous_y" : "viscous_linear"),
          .viscous_yaw = value("viscous_yaw") / arms};
}

sim::DriveEffects effects_of(const Robot& robot) {
  sim::DriveEffects effects(robot);
  const auto coulomb = robot.nominal.find("coulomb");
  if (coulomb != robot.nominal.end() && coulomb->second > 0.0 && !model::has_effect(robot, "coulomb") &&
      !model::has_effect(robot, "coulomb_asymmetric")) {
    effects.coulomb.array() += coulomb->second;
    effects.forces = true;
  }
  return effects;
}

// The log as a robot's simulator is compared with it.
struct Seen {
  Signals speed, angle, effort;  // of the joints
  Eigen::VectorXd heading, x, y;
};

Eigen::VectorXd smoothed(const Drive& drive, const Eigen::VectorXd& signal) {
  Eigen::VectorXd value(signal.size()), slope(signal.size());
  for (std::size_t s = 0; signal.size() > 0 && s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    const auto n = static_cast<std::size_t>(last - first);
    smooth_quadratic({signal.data() + first, n}, drive.window, {value.data() + first, n}, {slope.data() + first, n});
  }
  return value;
}

Seen seen(const Drive& drive) {
  Seen s;
  for (const JointSignals& joint : drive.joints) {
    s.speed.push_back(joint.smooth_speed);
    s.angle.push_back(joint.angle);
    s.effort.push_back(joint.held_effort.size() > 0 ? joint.held_effort : joint.effort);
  }
  s.heading = smoothed(drive, drive.heading);
  s.x = smoothed(drive, drive.x);
  s.y = smoothed(drive, drive.y);
  return s;
}

double at(const Eigen::VectorXd& signal, double row) {
  const auto before = std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(row)), 0, signal.size() - 2);
  return signal[before] + (row - static_cast<double>(before)) * (signal[before + 1] - signal[before]);
}

Eigen::Vector2d both(const Signals& signals, double row) { return {at(signals[0], row), at(signals[1], row)}; }

// What is compared at a horizon.
struct Shown {
  Eigen::Vector2d speed = Eigen::Vector2d::Zero();  // v1, v2
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
};

// Odometry of the wheels' angles from a pose of zeros.
struct Odometry {
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
  void move(const Eigen::Vector2d& body) {
    const double middle = pose[2] + 0.5 * body[1];
    pose += Eigen::Vector3d(body[0] * std::cos(middle), body[0] * std::sin(middle), body[1]);
  }
};

class Roller {
 public:
  Roller(const Drive& drive, const Robot& robot)
      : drive_(drive),
        robot_(robot),
        geometry_(model::drive_geometry(robot)),
        parameters_(parameters_of(robot)),
        effects_(effects_of(robot)),
        late_(model::effect_value(robot, "sensor_time_offset", "dt") / drive.step),
        margin_(static_cast<Eigen::Index>(std::ceil(rollout_margin(robot) / drive.step - 1e-9))),
        held_(drive.joints[0].held_effort.size() > 0) {}

  // What the simulator shows `steps` rows after `start`, in one run.
  [[nodiscard]] std::vector<Shown> simulated(const Seen& log, Eigen::Index start,
                                             const std::vector<Eigen::Index>& steps) const {
    sim::Plant plant(sim::drive_of(robot_), parameters_, {}, effects_);
    sim::Drivetrain drivetrain(robot_, parameters_, false);
    Eigen::Index k = start - margin_;
    plant.reset(state_at(log, static_cast<double>(k)), time(k));
    for (; k < start; ++k) {
      step(log, plant, drivetrain, k);
    }
    plant.reset(state_at(log, static_cast<double>(start)), time(start));
    std::vector<Shown> shown;
    Odometry odometry;
    Eigen::Vector2d angle = encoder(plant.state().wheel_angle);
    for (const Eigen::Index n : steps) {
      for (; k < start + n; ++k) {
        step(log, plant, drivetrain, k);
        const Eigen::Vector2d now = encoder(plant.state().wheel_angle);
        odometry.move(body(now - angle));
        angle = now;
      }
      shown.push_back({body(encoder(plant.wheel_speed())), plant.state().pose});
      replace_by_odometry(shown.back(), odometry);
    }
    return shown;
  }

  // What the log shows there.
  [[nodiscard]] std::vector<Shown> logged(const Seen& log, Eigen::Index start,
                                          const std::vector<Eigen::Index>& steps) const {
    std::vector<Shown> shown;
    Odometry odometry;
    Eigen::Index k = start;
    for (const Eigen::Index n : steps) {
      for (; k < start + n; ++k) {
        const double row = static_cast<double>(k) + late_;
        odometry.move(0.5 * drive_.step * body(both(log.speed, row) + both(log.speed, row + 1.0)));
      }
      Shown s;
      s.speed = body(both(log.speed, static_cast<double>(k) + late_));
      if (drive_.has_pose()) {
        s.pose.head<2>() = Eigen::Vector2d(log.x[k], log.y[k]);
      }
      if (drive_.has_heading()) {
        s.pose[2] = log.heading[k];
      }
      replace_by_odometry(s, odometry);
      shown.push_back(s);
    }
    return shown;
  }

 private:
  [[nodiscard]] double time(Eigen::Index k) const { return drive_.t[k] - drive_.t[0]; }
  [[nodiscard]] Eigen::Vector2d encoder(const Eigen::Vector2d& wheels) const {
    return wheels.cwiseProduct(geometry_.encoder_scale);
  }
  // v1, v2 (or their increments) as the drive's own geometry reads the wheels.
  [[nodiscard]] Eigen::Vector2d body(const Eigen::Vector2d& joints) const { return drive_.model.motion * joints; }

  void replace_by_odometry(Shown& shown, const Odometry& odometry) const {
    if (!drive_.has_pose()) {
      shown.pose.head<2>() = odometry.pose.head<2>();
    }
    if (!drive_.has_heading()) {
      shown.pose[2] = odometry.pose[2];
    }
  }

  [[nodiscard]] Eigen::Vector2d torque(const Seen& log, Eigen::Index k) const {
    return both(log.effort, static_cast<double>(k));
  }

  [[nodiscard]] sim::DriveState state_at(const Seen& log, double row) const {
    const Eigen::Vector2d wheels = both(log.speed, row + late_).cwiseQuotient(geometry_.encoder_scale);
    const Eigen::Vector2d torque = both(log.effort, row);
    const Eigen::Vector2d slip = sim::slip_share(effects_, torque.cwiseQuotient(geometry_.radius), wheels);
    const Eigen::Vector2d rim = wheels.cwiseProduct(geometry_.radius).array() / (1.0 + slip.array());
    sim::DriveState state;
    state.forward_speed = 0.5 * (rim[0] + rim[1]);
    state.yaw_rate = (rim[0] - rim[1]) / geometry_.track_width;
    state.wheel_angle = both(log.angle, row + late_).cwiseQuotient(geometry_.encoder_scale);
    if (drive_.has_pose()) {
      state.pose.head<2>() = Eigen::Vector2d(at(log.x, row), at(log.y, row));
    }
    if (drive_.has_heading()) {
      state.pose[2] = at(log.heading, row);
    }
    return state;
  }

  void step(const Seen& log, sim::Plant& plant, sim::Drivetrain& drivetrain, Eigen::Index k) const {
    const Eigen::Vector2d first = torque(log, k);
    drivetrain.advance(plant, first, held_ ? first : torque(log, k + 1), drive_.step);
  }

  const Drive& drive_;
  const Robot& robot_;
  model::DriveGeometry geometry_;
  model::DriveParameters parameters_;
  sim::DriveEffects effects_;
  double late_;  // rows by which the sensors are late
  Eigen::Index margin_;
  bool held_;
};

std::vector<Eigen::Index> steps_of(const Drive& drive, const std::vector<double>& horizons) {
  std::vector<Eigen::Index> steps;
  for (const double horizon : horizons) {
    steps.push_back(std::max<Eigen::Index>(1, std::lround(check::positive(horizon, "horizon") / drive.step)));
  }
  check::that(!steps.empty() && std::ranges::is_sorted(steps), "RolloutOptions::horizons", "times in ascending order");
  return steps;
}

std::vector<RolloutErrors> empty_errors(const Drive& drive, const std::vector<Eigen::Index>& steps,
                                        std::size_t windows) {
  const auto n = static_cast<Eigen::Index>(windows);
  std::vector<RolloutErrors> errors;
  for (const Eigen::Index s : steps) {
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(n);
    errors.push_back({static_cast<double>(s) * drive.step, none, none, none, none});
  }
  return errors;
}

void write(RolloutErrors& errors, std::size_t window, const Shown& simulated, const Shown& logged) {
  const auto k = static_cast<Eigen::Index>(window);
  errors.velocity[k] = simulated.speed[0] - logged.speed[0];
  errors.yaw_rate[k] = simulated.speed[1] - logged.speed[1];
  errors.position[k] = (simulated.pose.head<2>() - logged.pose.head<2>()).norm();
  errors.heading[k] = std::remainder(simulated.pose[2] - logged.pose[2], 2.0 * std::numbers::pi);
}

void check_robot(const Drive& drive, const Robot& robot) {
  check::that(drive.two_wheels() && model::on_two_wheels(robot), "rollouts", "a robot on two driven wheels");
  check::that(robot.effort == model::EffortKind::torque, "rollouts robot.effort", "torques");
}

}  // namespace

double rollout_margin(const Robot& robot) {
  const double before = model::effect_value(robot, "delay", "T_d") +
                        kLagsOfMemory * model::effect_value(robot, "actuator_lag", "T") +
                        (model::has_effect(robot, "backlash") ? kMemoryOfBacklash : 0.0);
  return std::max(before, model::effect_value(robot, "sensor_time_offset", "dt"));
}

std::vector<Eigen::Index> rollout_starts(const Drive& drive, const RolloutOptions& options, double margin) {
  const Eigen::Index length = steps_of(drive, options.horizons).back();
  const Eigen::Index beyond = static_cast<Eigen::Index>(std::ceil(margin / drive.step - 1e-9)) + 1;
  const double duration = drive.step * static_cast<double>(drive.rows());
  const double every =
      std::clamp((duration - options.horizons.back()) / static_cast<double>(std::max<std::size_t>(options.fewest, 1)),
                 std::min(options.closest, options.every), options.every);
  const auto apart = std::max<Eigen::Index>(1, std::lround(every / drive.step));
  std::vector<Eigen::Index> starts;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + beyond; k + length + beyond < last; k += apart) {
      starts.push_back(k);
    }
  }
  return starts;
}

std::vector<RolloutErrors> rollouts(const Drive& drive, const Robot& robot, const std::vector<Eigen::Index>& starts,
                                    const RolloutOptions& options) {
  check_robot(drive, robot);
  const std::vector<Eigen::Index> steps = steps_of(drive, options.horizons);
  std::vector<RolloutErrors> errors = empty_errors(drive, steps, starts.size());
  const Seen log = seen(drive);
  const Roller roller(drive, robot);
  core::for_all(starts.size(), options.threads, [&](std::size_t w) {
    const std::vector<Shown> simulated = roller.simulated(log, starts[w], steps);
    const std::vector<Shown> logged = roller.logged(log, starts[w], steps);
    for (std::size_t h = 0; h < steps.size(); ++h) {
      write(errors[h], w, simulated[h], logged[h]);
    }
  });
  return errors;
}

std::vector<RolloutErrors> rollout_noise(const Drive& drive, const Robot& robot,
                                         const std::vector<Eigen::Index>& starts,
                                         const std::vector<Eigen::VectorXd>& speed,
                                         const std::vector<Eigen::VectorXd>& effort, const RolloutOptions& options) {
  check_robot(drive, robot);
  const auto fits = [&drive](const Eigen::VectorXd& signal) { return signal.size() == drive.rows(); };
  check::that(
      speed.size() == 2 && effort.size() == 2 && std::ranges::all_of(speed, fits) && std::ranges::all_of(effort, fits),
      "rollout_noise", "two signals of speed and two of effort, one value per row");
  const std::vector<Eigen::Index> steps = steps_of(drive, options.horizons);
  std::vector<RolloutErrors> errors = empty_errors(drive, steps, starts.size());
  const Seen clean = seen(drive);
  Seen noisy = clean, noise = clean;
  for (std::size_t j = 0; j < 2; ++j) {
    noise.speed[j] = smoothed(drive, speed[j]);
    noisy.speed[j] += noise.speed[j];
    noisy.effort[j] += effort[j];
  }
  const Roller roller(drive, robot);
  core::for_all(starts.size(), options.threads, [&](std::size_t w) {
    const std::vector<Shown> with = roller.simulated(noisy, starts[w], steps);
    std::vector<Shown> without = roller.simulated(clean, starts[w], steps);
    for (std::size_t h = 0; h < steps.size(); ++h) {
      const Eigen::Index end = starts[w] + steps[h];
      without[h].speed += drive.model.motion * Eigen::Vector2d(noise.speed[0][end], noise.speed[1][end]);
      write(errors[h], w, with[h], without[h]);
    }
  });
  return errors;
}

RolloutRms rollout_rms(const Eigen::VectorXd& errors, std::uint64_t seed, std::size_t length) {
  RolloutRms result;
  const auto n = static_cast<std::size_t>(errors.size());
  if (n == 0) {
    return result;
  }
  result.rms = std::sqrt(errors.squaredNorm() / static_cast<double>(n));
  const std::size_t block = std::clamp<std::size_t>(length, 1, n);
  std::mt19937_64 generator(seed);
  std::vector<double> draws;
  for (int d = 0; d < kBootstrapDraws; ++d) {
    double sum = 0.0;
    for (std::size_t drawn = 0; drawn < n;) {
      const auto first = static_cast<std::size_t>(generator() % (n - block + 1));
      for (std::size_t k = first; k < first + block && drawn < n; ++k, ++drawn) {
        const double e = errors[static_cast<Eigen::Index>(k)];
        sum += e * e;
      }
    }
    draws.push_back(std::sqrt(sum / static_cast<double>(n)));
  }
  std::ranges::sort(draws);
  result.lower = draws[static_cast<std::size_t>(0.025 * (draws.size() - 1))];
  result.upper = draws[static_cast<std::size_t>(std::ceil(0.975 * static_cast<double>(draws.size() - 1)))];
  return result;
}

}  // namespace wheelwright::gap
