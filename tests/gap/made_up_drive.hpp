// SPDX-License-Identifier: Apache-2.0
/// \file
/// A drive filled by hand: no simulator, no reader.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "gap/rows/drive.hpp"

namespace wheelwright::gap::gap_example {

/// A robot on two wheels (r = 0.1 m, D = 0.4 m) that drives in incommensurate sines, stands still for 2 s in every 20,
/// and has a pose.
inline Drive made_up_drive(double seconds, double step = 0.01) {
  Drive d;
  d.wheel_radius = 0.1;
  d.track_width = 0.4;
  d.lever_arm = 0.2;
  d.step = step;
  d.segment_starts = {0};
  d.model.coordinates = {"v1", "v2"};
  d.joints.resize(2);
  d.coordinates.resize(2);
  const auto n = static_cast<Eigen::Index>(std::lround(seconds / step));
  d.t = Eigen::VectorXd::LinSpaced(n, 0.0, step * static_cast<double>(n - 1));
  for (CoordinateSignals& c : d.coordinates) {
    c.smooth_speed.resize(n);
    c.smooth_acceleration = Eigen::VectorXd::Zero(n);
  }
  for (JointSignals& j : d.joints) {
    j.smooth_speed.resize(n);
    j.angle = Eigen::VectorXd::Zero(n);
    j.smooth_effort.resize(n);
    j.resting = Mask::Constant(n, false);
  }
  d.heading = d.x = d.y = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double t = d.t[k];
    const bool rest = std::fmod(t, 20.0) < 2.0;
    const double v1 = rest ? 0.0 : 0.5 * std::sin(0.61 * t) + 0.3 * std::sin(1.73 * t + 1.0);
    const double v2 = rest ? 0.0 : 0.7 * std::sin(0.43 * t + 0.5) + 0.5 * std::sin(1.31 * t);
    d.coordinates[0].smooth_speed[k] = v1;
    d.coordinates[1].smooth_speed[k] = v2;
    for (std::size_t i = 0; i < 2; ++i) {
      JointSignals& j = d.joints[i];
      j.smooth_speed[k] = (v1 + (i == 0 ? 0.2 : -0.2) * v2) / d.wheel_radius;
      j.resting[k] = rest;
      j.angle[k] = k == 0 ? 0.0 : j.angle[k - 1] + step * j.smooth_speed[k];
    }
    d.heading[k] = k == 0 ? 0.0 : d.heading[k - 1] + step * v2;
    d.x[k] = k == 0 ? 0.0 : d.x[k - 1] + step * v1 * std::cos(d.heading[k]);
    d.y[k] = k == 0 ? 0.0 : d.y[k - 1] + step * v1 * std::sin(d.heading[k]);
  }
  for (std::size_t c = 0; c < 2; ++c) {
    Eigen::VectorXd& a = d.coordinates[c].smooth_acceleration;
    const Eigen::VectorXd& v = d.coordinates[c].smooth_speed;
    a.segment(1, n - 2) = (v.tail(n - 2) - v.head(n - 2)) / (2.0 * step);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    const Eigen::VectorXd acceleration = d.coordinates[0].smooth_acceleration;
    d.joints[i].smooth_effort = acceleration + 0.05 * d.joints[i].smooth_speed;
  }
  return d;
}

/// White noise behind the filter of an analysis, of standard deviation `sd` on this stretch in the mean.
inline Eigen::VectorXd noise_like(const Drive& drive, double beta, double sd, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Eigen::VectorXd white(drive.rows());
  for (double& x : white) {
    x = normal(generator);
  }
  // ∫ f₂² dt = β/4; white noise of variance 1 a step that is linear between instants has the density h.
  return filtered(drive, beta, white) * (sd / std::sqrt(0.25 * beta * drive.step));
}

}  // namespace wheelwright::gap::gap_example
