// SPDX-License-Identifier: Apache-2.0
/// \file
/// A linear axis, driven by held efforts and solved in closed form, with sensors whose errors obey an error class in
/// its worst ways. Shares no code with the library's filters and simulators.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::testing_support {

/// Laws of the efforts' errors, all within the bound and of the stated bias and correlation.
enum class ErrorLaw {
  two_point,  ///< ± bound, and the bias on one side
  uniform,    ///<
  by_speed,   ///< ± bound while the axis moves fast, next to nothing else
  gambler,    ///< ± bound while the errors' sum is behind, next to nothing once it is ahead
  together,   ///< ± bound, the same within a correlation time
  spikes,     ///< ± bound now and then, so that the deviation is as stated, and nothing between
  skewed,     ///< the bound now and then, a little to the other side between: mean 0, the deviation as stated
  follower,   ///< ± bound, and the bias on the side to which the last errors were
  echo,       ///< ± bound while errors have been unlike those before them, next to nothing once they have been alike
};

/// Laws of the position's errors, all within half a count.
enum class PositionLaw {
  rounded,    ///< to whole counts
  two_point,  ///< ± half a count
  square,     ///< half a count to one side and then to the other, a second each
};

/// An axis m v̇ = u − f v, its drive and its sensors.
struct ExactAxis {
  double mass = 20.0, viscous = 4.0;
  double rate = 100.0, seconds = 60.0;  ///< Hz, s
  double bound = 2.0, bias = 0.0;       ///< of the effort, N
  double correlation = 0.0;             ///< s
  double deviation = 0.0;               ///< N, of spikes and skewed; declared where it is > 0
  double count = 1e-4;                  ///< m, resolution of the position
  PositionLaw position = PositionLaw::rounded;
  double jitter = 0.0;    ///< of the steps, relative
  double feedback = 0.0;  ///< N s/m, on the measured speed: errors act on the motion
  ErrorLaw law = ErrorLaw::two_point;
  double fault_at = 1e300, fault_bias = 0.0;  ///< s, N: a bias of the efforts' readings
};

/// Position and speed of m v̇ = u − f v.
struct AxisMotion {
  double position = 0.0, speed = 0.0;  ///< m, m/s
  /// Lets `u` act for `h` s.
  void advance(double mass, double viscous, double u, double h) {
    const double e = std::exp(-viscous / mass * h), end = u / viscous;
    position += end * h + (speed - end) * (1.0 - e) * mass / viscous;
    speed = end + (speed - end) * e;
  }
};

inline constexpr double kRecent = 0.1;  ///< s, memory of ErrorLaw::follower and echo

/// Its log (position, effort).
inline LogTable drive(const ExactAxis& a, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
  LogTable log;
  log.names = {"position", "effort"};
  log.columns.resize(2);
  const auto rows = static_cast<std::size_t>(a.rate * a.seconds);
  AxisMotion motion;
  const double &x = motion.position, &v = motion.speed;
  double t = 0.0, measured = 0.0, before = 0.0, sum = 0.0, held = 1.0;
  double until = -1.0, recent = 0.0, alike = 0.0;
  double phase[4];
  for (double& p : phase) {
    p = 6.283185307179586 * uniform();
  }
  const double side = uniform() < 0.5 ? -1.0 : 1.0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double h = (1.0 + a.jitter * (2.0 * uniform() - 1.0)) / a.rate;
    before = measured;
    switch (a.position) {
      case PositionLaw::rounded: measured = std::round(x / a.count) * a.count; break;
      case PositionLaw::two_point: measured = x + (uniform() < 0.5 ? -0.5 : 0.5) * a.count; break;
      case PositionLaw::square: measured = x + (std::fmod(t, 2.0) < 1.0 ? -0.5 : 0.5) * a.count; break;
    }
    const double speed = k > 0 ? (measured - before) * a.rate : 0.0;
    double u = 0.0;
    const double frequencies[4] = {0.11, 0.23, 0.41, 0.83};
    for (int i = 0; i < 4; ++i) {
      u += 12.0 * std::sin(6.283185307179586 * frequencies[i] * t + phase[i]);
    }
    u -= a.feedback * speed;
    const double free = a.bound - a.bias;
    double lean = side;
    const double sign = uniform() < 0.5 ? -1.0 : 1.0;
    double error = 0.0;
    switch (a.law) {
      case ErrorLaw::two_point: error = free * sign; break;
      case ErrorLaw::uniform: error = free * (2.0 * uniform() - 1.0); break;
      case ErrorLaw::by_speed: error = (std::abs(v) > 0.5 ? free : 0.01 * free) * sign; break;
      case ErrorLaw::gambler: error = (side * sum < 3.0 * free * std::sqrt(a.rate) ? free : 0.01 * free) * sign; break;
      case ErrorLaw::spikes: error = uniform() < std::pow(a.deviation / free, 2) ? free * sign : 0.0; break;
      case ErrorLaw::skewed: {
        const double often = a.deviation * a.deviation / (free * free + a.deviation * a.deviation);
        error = side * (uniform() < often ? free : -free * often / (1.0 - often));
        break;
      }
      case ErrorLaw::follower:
        error = free * sign;
        lean = recent >= 0.0 ? 1.0 : -1.0;
        break;
      case ErrorLaw::echo: error = (alike < 3.0 * free * free * std::sqrt(a.rate) ? free : 0.01 * free) * sign; break;
      case ErrorLaw::together:
        if (t >= until) {
          held = sign;
          until = t + a.correlation;
        }
        error = free * held;
        break;
    }
    sum += error;
    alike += recent * error;
    recent += (error + lean * a.bias - recent) / (1.0 + kRecent * a.rate);
    log.t.push_back(t);
    log.columns[0].push_back(measured);
    log.columns[1].push_back(u + error + lean * a.bias + (t >= a.fault_at ? a.fault_bias : 0.0));
    motion.advance(a.mass, a.viscous, u, h);
    t += h;
  }
  return log;
}

/// The robot file of such an axis.
inline Robot robot_of(const ExactAxis& a) {
  Robot robot;
  robot.name = "axis";
  robot.model = "single_axis";
  robot.hold = Hold::zero_order;
  robot.effort_changes = model::EffortChanges::at_samples;
  robot.noise.effort = {.value = a.bound, .bias = a.bias, .correlation = a.correlation};
  if (a.deviation > 0.0) {
    robot.noise.effort.deviation = a.deviation;
  }
  robot.noise.position = {.value = 0.5 * a.count, .bias = 0.5 * a.count};
  return robot;
}

}  // namespace wheelwright::testing_support
