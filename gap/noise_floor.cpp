// SPDX-License-Identifier: Apache-2.0
#include "gap/noise_floor.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>
#include <vector>

#include "core/statistics.hpp"
#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {
namespace {

// Robust standard deviation of white noise in `signal`, by third differences (1, −3, 3, −1: variance 20 σ²).
double by_third_differences(const Drive& drive, const Eigen::VectorXd& signal) {
  std::vector<double> sizes;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 3; k < last; ++k) {
      sizes.push_back(std::abs(signal[k] - 3.0 * signal[k - 1] + 3.0 * signal[k - 2] - signal[k - 3]));
    }
  }
  if (sizes.empty()) {
    return 0.0;
  }
  constexpr double kMedianOfNormal = 0.6744897501960817;
  return core::median(std::move(sizes)) / kMedianOfNormal / std::sqrt(20.0);
}

// Energies of impulse responses: what unit white noise becomes.
struct Energies {
  double effort;        // of f₂ * u
  double speed;         // of f₂ * u for the noise of a speed
  double acceleration;  // of f₂ * u̇ for the noise of a speed
};

Energies energies(const Drive& drive, double beta, bool counted) {
  const double step = drive.step;
  Drive impulse;
  impulse.step = step;
  impulse.model.outputs = {"one"};
  impulse.model.input = Eigen::MatrixXd::Ones(1, 1);
  impulse.joints.resize(1);
  const auto n = static_cast<Eigen::Index>(std::ceil(40.0 / (beta * step))) + 8;
  impulse.t = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  impulse.segment_starts = {0};
  Eigen::VectorXd one = Eigen::VectorXd::Zero(n);
  one[3] = 1.0;
  impulse.joints[0].effort = one;
  if (drive.joints.front().held_effort.size() > 0) {
    impulse.joints[0].held_effort = one;
  }
  Eigen::VectorXd speed = one;
  if (counted) {
    // An error of one angle is in two speeds, with opposite signs; a speed's variance is that of two angles.
    speed[3] = std::sqrt(0.5);
    speed[4] = -std::sqrt(0.5);
  }
  return {filtered_outputs(impulse, beta).front().squaredNorm(), filtered(impulse, beta, speed).squaredNorm(),
          filtered_rate(impulse, beta, speed).squaredNorm()};
}

double root_mean_square(const Eigen::VectorXd& signal, const Mask& use) {
  double sum = 0.0;
  for (Eigen::Index k = 0; k < signal.size(); ++k) {
    sum += use[k] ? signal[k] * signal[k] : 0.0;
  }
  return std::sqrt(sum / std::max(1.0, static_cast<double>(use.count())));
}

// h² ü; 0 at the ends of segments.
Eigen::VectorXd second_difference(const Drive& drive, const Eigen::VectorXd& signal) {
  Eigen::VectorXd difference = Eigen::VectorXd::Zero(signal.size());
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 1; k + 1 < last; ++k) {
      difference[k] = signal[k + 1] - 2.0 * signal[k] + signal[k - 1];
    }
  }
  return difference;
}

// A signal that is taken as linear between its instants lacks h²/12 of its second derivative, in the mean over a step.
// The motion lacks it too, so that the rows are wrong by as much as that makes of the efforts.
Eigen::VectorXd step_errors(const Drive& drive, double beta) {
  const auto n = static_cast<Eigen::Index>(drive.model.n());
  const Mask use = settled(drive, beta) && moving(drive, beta);
  Eigen::VectorXd errors(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Eigen::VectorXd output = Eigen::VectorXd::Zero(drive.rows());
    for (std::size_t j = 0; j < drive.joints.size(); ++j) {
      output += drive.model.input(i, static_cast<Eigen::Index>(j)) * drive.joints[j].effort;
    }
    errors[i] = root_mean_square(filtered(drive, beta, second_difference(drive, output)), use) / 12.0;
  }
  return errors;
}

// Likewise of odometry over a window: h²/12 of the change of acceleration from its one end to the other by the
// trapezoidal rule, and half as much again where speeds are means over their step.
IncrementNoise step_errors(const Drive& drive) {
  const double share = drive.step * drive.step / 8.0 * std::sqrt(2.0);
  const Mask all = Mask::Constant(drive.rows(), true);
  const CoordinateSignals &forward = drive.coordinates[0], &turn = drive.coordinates[1];
  IncrementNoise errors;
  errors.forward = share * root_mean_square(forward.smooth_acceleration, all);
  errors.lateral = share * root_mean_square(forward.smooth_speed.cwiseProduct(turn.smooth_speed), all);
  errors.yaw = share * root_mean_square(turn.smooth_acceleration, all);
  return errors;
}

void add(double& noise, double further) {
  if (noise > 0.0) {
    noise = std::hypot(noise, further);
  }
}

}  // namespace

SignalNoise signal_noise(const Drive& drive) {
  SignalNoise noise;
  const auto joints = static_cast<Eigen::Index>(drive.joints.size());
  noise.effort.resize(joints);
  noise.speed.resize(joints);
  noise.counted = drive.count > 0.0;
  for (Eigen::Index j = 0; j < joints; ++j) {
    const JointSignals& joint = drive.joints[static_cast<std::size_t>(j)];
    noise.effort[j] = by_third_differences(drive, joint.held_effort.size() > 0 ? joint.held_effort : joint.effort);
    noise.speed[j] = noise.counted ? drive.count * std::sqrt(2.0 / 12.0) : by_third_differences(drive, joint.speed);
  }
  return noise;
}

NoiseFloor noise_floor(const Drive& drive, const SignalNoise& noise, double beta, double window) {
  const Energies energy = energies(drive, beta, noise.counted);
  NoiseFloor floor;
  const auto n = static_cast<Eigen::Index>(drive.model.n());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < noise.effort.size(); ++j) {
      variance[i] += std::pow(drive.model.input(i, j) * noise.effort[j], 2) * energy.effort;
      double rate = 0.0, speed = 0.0;
      for (const Term& term : drive.model.terms) {
        if (static_cast<Eigen::Index>(term.output) != i || term.kind == Term::Kind::function) {
          continue;
        }
        const double weight = term.scale * drive.theta[static_cast<Eigen::Index>(term.parameter)] *
                              drive.model.motion(static_cast<Eigen::Index>(term.coordinate), j);
        (term.kind == Term::Kind::acceleration ? rate : speed) += weight;
      }
      variance[i] += std::pow(noise.speed[j], 2) * (rate * rate * energy.acceleration + speed * speed * energy.speed);
    }
  }
  floor.efforts = (variance + step_errors(drive, beta).cwiseAbs2()).cwiseSqrt();
  floor.increments = pose_noise(drive, make_windows(drive, window).reach);
  if (drive.two_wheels()) {
    const IncrementNoise errors = step_errors(drive);
    add(floor.increments.forward, errors.forward);
    add(floor.increments.lateral, errors.lateral);
    add(floor.increments.yaw, errors.yaw);
  }
  if (noise.counted && drive.two_wheels()) {
    // Errors of two wheels' angles at both ends of a window.
    const double rim = drive.wheel_radius * drive.count * drive.step / std::sqrt(12.0);
    const double forward = rim;  // √(4·(rim/2)²)
    const double yaw = 2.0 * rim / drive.track_width;
    floor.increments.forward = std::hypot(floor.increments.forward, forward);
    floor.increments.yaw = std::hypot(floor.increments.yaw, yaw);
  }
  return floor;
}

void draw_effort_noise(Drive& drive, const SignalNoise& noise, const NoiseFloor& floor, double beta,
                       std::uint64_t seed) {
  constexpr double kNegligible = 0.02, kFloorKnown = 1.25;  // of the floors' squares
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    Eigen::VectorXd& draw = drive.joints[j].effort_noise;
    draw.resize(drive.has_efforts ? drive.rows() : 0);
    for (double& value : draw) {
      value = noise.effort[static_cast<Eigen::Index>(j)] * normal(generator);
    }
  }
  if (!drive.has_efforts) {
    return;
  }
  const std::vector<Eigen::VectorXd> without = filtered_outputs(drive, beta),
                                     with = filtered_outputs(with_effort_noise(drive), beta);
  const Mask use = settled(drive, beta);
  double share = 0.0;
  for (std::size_t i = 0; i < with.size(); ++i) {
    const double ratio = root_mean_square(with[i] - without[i], use) / floor.efforts[static_cast<Eigen::Index>(i)];
    share += ratio * ratio / static_cast<double>(with.size());
  }
  for (JointSignals& joint : drive.joints) {
    joint.effort_noise *= std::sqrt(std::min(1.0, kFloorKnown / share));
    if (!(share > kNegligible)) {
      joint.effort_noise.resize(0);
    }
  }
}

double attenuation(const Drive& drive, const SignalNoise& noise, double beta) {
  const Energies energy = energies(drive, beta, noise.counted);
  const Mask use = settled(drive, beta);
  double largest = 0.0;
  for (std::size_t c = 0; c < drive.coordinates.size(); ++c) {
    const Eigen::VectorXd rate = filtered_rate(drive, beta, drive.coordinates[c].speed);
    double sum = 0.0, count = 0.0, variance = 0.0;
    for (Eigen::Index k = 0; k < rate.size(); ++k) {
      if (use[k]) {
        sum += rate[k] * rate[k];
        count += 1.0;
      }
    }
    for (Eigen::Index j = 0; j < noise.speed.size(); ++j) {
      variance +=
          std::pow(drive.model.motion(static_cast<Eigen::Index>(c), j) * noise.speed[j], 2) * energy.acceleration;
    }
    if (sum > 0.0) {
      largest = std::max(largest, variance * count / sum);
    }
  }
  return largest;
}

double choose_gap_beta(const Drive& drive, const SignalNoise& noise, double wish, double tolerated) {
  for (const double beta : {20.0, 14.0, 10.0, 7.0, 5.0, 3.0}) {
    if (beta <= wish && attenuation(drive, noise, beta) < tolerated) {
      return beta;
    }
  }
  return 2.0;
}

}  // namespace wheelwright::gap
