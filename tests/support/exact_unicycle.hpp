// SPDX-License-Identifier: Apache-2.0
/// \file
/// A robot on two wheels that rolls without slip along arcs (speeds constant within a step) or clothoids (linear), with
/// pose sensors whose errors obey an error class in its worst ways. Shares no code with the library's filters and
/// simulators.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::testing_support {

/// Laws of the pose's errors, all within the bound and of the stated bias, deviation and correlation.
enum class PoseLaw {
  two_point,  ///< ± bound
  uniform,    ///<
  by_speed,   ///< ± bound while the robot moves fast, next to nothing else
  gambler,    ///< ± bound while the errors' sum is behind, next to nothing once it is ahead
  together,   ///< ± bound, the same within a correlation time
  alike,      ///< ± bound, and x, y and heading with the same sign
  ahead,      ///< ± bound along the heading and across it, to the side that follows from the heading's error
  spikes,     ///< ± bound now and then, so that the deviation is as stated, and nothing between
};

/// The robot, its drive and its sensors.
struct ExactUnicycle {
  double radius_right = 0.1, radius_left = 0.1, track = 0.5;  ///< m
  double rate = 100.0, seconds = 40.0;                        ///< Hz, s
  double position = 2e-3, heading = 3e-3;                     ///< bounds, m and rad
  double bias_share = 0.0;                                    ///< of the bounds
  double deviation_share = 0.0;                               ///< of the bounds; declared where it is > 0
  double correlation = 0.0;                                   ///< s
  double count = 1e-3;                                        ///< rad, resolution of the wheels' angles
  double jitter = 0.0;                                        ///< of the steps, relative
  double feedback = 0.0;  ///< rad/s of both wheels per rad and 0.1 m that the pose seems off
  bool clothoids = false;
  std::size_t hold = 1;  ///< rows with the same pose
  PoseLaw law = PoseLaw::two_point;
  std::uint64_t errors_seed = 0;  ///< > 0: errors are drawn apart from the drive
  // From fault_at on (s):
  double fault_at = 1e300;
  double slip_along = 0.0, slip_across = 0.0;  ///< m/s
  double radius_right_by = 0.0;                ///< share
  double track_by = 0.0;                       ///< share
  double encoder_right_by = 0.0;               ///< share: counts too many
};

/// The largest |dω/dt| of a wheel, rad/s²: of clothoids; arcs have none within a step.
inline constexpr double kClothoidAcceleration = 40.0;

/// Its log (phi_r, phi_l, x, y, theta).
inline LogTable drive(const ExactUnicycle& a, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  auto draw = &random;
  const auto uniform = [&] { return std::ldexp(static_cast<double>((*draw)() >> 11), -53); };
  const auto sign = [&] { return uniform() < 0.5 ? -1.0 : 1.0; };
  LogTable log;
  log.names = {"phi_r", "phi_l", "x", "y", "theta"};
  log.columns.resize(5);
  const auto rows = static_cast<std::size_t>(a.rate * a.seconds);
  std::array<double, 4> phase{};
  for (double& p : phase) {
    p = 6.283185307179586 * uniform();
  }
  const double side = sign();
  double t = 0.0, x = 0.0, y = 0.0, theta = 6.283185307179586 * (uniform() - 0.5), until = -1.0;
  std::array<double, 2> phi{}, shown{}, speed{};
  std::array<double, 3> held{1.0, 1.0, 1.0}, sum{}, seen{};
  double correction = 0.0;
  std::mt19937_64 apart(a.errors_seed);
  for (std::size_t k = 0; k < rows; ++k) {
    // The pose that is seen now.
    draw = a.errors_seed > 0 ? &apart : &random;
    if (k % a.hold == 0) {
      const double free = 1.0 - a.bias_share;
      std::array<double, 3> e{};
      const double all = sign();
      const bool renew = t >= until;
      until = renew ? t + a.correlation * (1.0 + 1e-9) : until;
      for (std::size_t i = 0; i < 3; ++i) {
        const double s = sign();
        held[i] = renew ? s : held[i];
        switch (a.law) {
          case PoseLaw::two_point: e[i] = free * s; break;
          case PoseLaw::uniform: e[i] = free * (2.0 * uniform() - 1.0); break;
          case PoseLaw::by_speed: e[i] = (std::abs(speed[0] + speed[1]) > 10.0 ? free : 0.01 * free) * s; break;
          case PoseLaw::gambler: e[i] = (side * sum[i] < 3.0 * std::sqrt(a.rate) ? free : 0.01 * free) * s; break;
          case PoseLaw::together: e[i] = free * held[i]; break;
          case PoseLaw::alike:
          case PoseLaw::ahead: e[i] = free * all; break;
          case PoseLaw::spikes: e[i] = uniform() < std::pow(a.deviation_share / free, 2) ? free * s : 0.0; break;
        }
        sum[i] += e[i];
        e[i] += side * a.bias_share;
      }
      if (a.law == PoseLaw::ahead) {
        e[0] = all * (std::cos(theta) < 0.0 ? -1.0 : 1.0);
        e[1] = all * (std::sin(theta) < 0.0 ? -1.0 : 1.0);
      }
      const double heading = theta + a.heading * e[2];
      seen = {x + a.position * e[0], y + a.position * e[1],
              heading - 6.283185307179586 * std::round(heading / 6.283185307179586)};
      correction = a.feedback * (a.heading * e[2] + 10.0 * a.position * e[1]);
    }
    log.t.push_back(t);
    for (std::size_t w = 0; w < 2; ++w) {
      log.columns[w].push_back(std::round(shown[w] / a.count) * a.count);
    }
    for (std::size_t i = 0; i < 3; ++i) {
      log.columns[2 + i].push_back(seen[i]);
    }
    // To the next sample.
    draw = &random;
    const bool fault = t >= a.fault_at;
    const double h = (1.0 + a.jitter * (2.0 * uniform() - 1.0)) / a.rate;
    const auto wanted = [&](double at) {
      const double forward = 5.0 + 2.5 * std::sin(0.7 * at + phase[0]) + 1.5 * std::sin(0.23 * at + phase[1]);
      const double turning = 1.6 * std::sin(0.31 * at + phase[2]) + 1.0 * std::sin(0.9 * at + phase[3]);
      return std::array{forward + turning - correction, forward - turning + correction};
    };
    const std::array<double, 2> aim = a.clothoids ? wanted(t + h) : wanted(t);
    std::array<double, 2> ramp{};
    for (std::size_t w = 0; w < 2; ++w) {
      if (a.clothoids) {
        ramp[w] = std::clamp((aim[w] - speed[w]) / h, -kClothoidAcceleration, kClothoidAcceleration);
      } else {
        speed[w] = aim[w];
      }
    }
    const double right = a.radius_right * (1.0 + (fault ? a.radius_right_by : 0.0)), left = a.radius_left;
    const double track = a.track * (1.0 + (fault ? a.track_by : 0.0));
    const auto heading_at = [&](double s) {
      return theta +
             (right * (speed[0] * s + 0.5 * ramp[0] * s * s) - left * (speed[1] * s + 0.5 * ramp[1] * s * s)) / track;
    };
    const auto forward_at = [&](double s) {
      return 0.5 * (right * (speed[0] + ramp[0] * s) + left * (speed[1] + ramp[1] * s));
    };
    // Gauss and Legendre's rule of five points: exact to rounding for steps this short.
    constexpr std::array<double, 5> node{-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831,
                                         0.9061798459386640};
    constexpr std::array<double, 5> part{0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665,
                                         0.2369268850561891};
    for (std::size_t i = 0; i < 5; ++i) {
      const double s = 0.5 * h * (1.0 + node[i]), v = forward_at(s) + (fault ? a.slip_along : 0.0);
      const double across = fault ? a.slip_across : 0.0, c = std::cos(heading_at(s)), d = std::sin(heading_at(s));
      x += 0.5 * h * part[i] * (v * c - across * d);
      y += 0.5 * h * part[i] * (v * d + across * c);
    }
    theta = heading_at(h);
    for (std::size_t w = 0; w < 2; ++w) {
      const double by = speed[w] * h + 0.5 * ramp[w] * h * h;
      phi[w] += by;
      shown[w] += by * (fault && w == 0 ? 1.0 + a.encoder_right_by : 1.0);
      speed[w] += ramp[w] * h;
    }
    t += h;
  }
  return log;
}

}  // namespace wheelwright::testing_support
