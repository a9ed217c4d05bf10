// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/kinematic_rows.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright::gap {
namespace {

using Signal = Eigen::VectorXd;

// ∫ signal dt from the first row, trapezoidal; only differences within a segment mean anything.
Signal integral(const Drive& drive, const Signal& signal) {
  Signal sum(signal.size());
  sum[0] = 0.0;
  for (Eigen::Index k = 1; k < signal.size(); ++k) {
    sum[k] = sum[k - 1] + 0.5 * drive.step * (signal[k - 1] + signal[k]);
  }
  return sum;
}

Signal differences(const Windows& windows, const Signal& signal) {
  Signal result(static_cast<Eigen::Index>(windows.size()));
  for (std::size_t k = 0; k < windows.size(); ++k) {
    result[static_cast<Eigen::Index>(k)] = signal[windows.last[k]] - signal[windows.first[k]];
  }
  return result;
}

// Differences of a position, turned into the frame of the heading at each window's middle.
void turn(const Drive& drive, const Windows& windows, const Signal& x, const Signal& y, Increments& to) {
  const Signal dx = differences(windows, x), dy = differences(windows, y);
  to.forward.resize(dx.size());
  to.lateral.resize(dx.size());
  for (Eigen::Index k = 0; k < dx.size(); ++k) {
    const double heading = drive.heading[windows.middle[static_cast<std::size_t>(k)]];
    const double c = std::cos(heading), s = std::sin(heading);
    to.forward[k] = c * dx[k] + s * dy[k];
    to.lateral[k] = c * dy[k] - s * dx[k];
  }
}

bool sees_yaw(const Drive& drive) { return drive.two_wheels() && (drive.has_heading() || drive.gyro.size() > 0); }

// Standard deviation of white noise on a smooth signal: median of |third differences|, whose variance is 20 σ².
double noise_of(const Drive& drive, const Signal& signal) {
  std::vector<double> size;
  double resolution = 0.0;  // smallest step that occurs
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first + 3; k < last; ++k) {
      size.push_back(std::abs(signal[k] - 3.0 * signal[k - 1] + 3.0 * signal[k - 2] - signal[k - 3]));
      const double step = std::abs(signal[k] - signal[k - 1]);
      if (step > 1e-9 * std::max(1.0, std::abs(signal[k])) && (resolution == 0.0 || step < resolution)) {
        resolution = step;
      }
    }
  }
  if (size.empty()) {
    return 0.0;
  }
  return std::max(core::median(std::move(size)) / (0.6744897501960817 * std::sqrt(20.0)), resolution / std::sqrt(12.0));
}

double rms_of(const Signal& signal) {
  return signal.size() > 0 ? std::sqrt(signal.squaredNorm() / static_cast<double>(signal.size())) : 0.0;
}

}  // namespace

Windows make_windows(const Drive& drive, double length) {
  check::positive(length, "window");
  const auto steps = std::max<Eigen::Index>(2, std::lround(length / drive.step));
  Windows windows;
  std::vector<double> t;
  for (std::size_t s = 0; s < drive.segment_starts.size(); ++s) {
    const auto [first, last] = drive.segment(s);
    for (Eigen::Index k = first; k + steps < last; k += steps) {
      windows.first.push_back(k);
      windows.middle.push_back(k + steps / 2);
      windows.last.push_back(k + steps);
      t.push_back(drive.t[k + steps / 2]);
    }
  }
  windows.t = Eigen::Map<const Signal>(t.data(), static_cast<Eigen::Index>(t.size()));
  return windows;
}

Increments pose_gap(const Drive& drive, const Windows& windows) {
  Increments gap;
  if (!sees_yaw(drive)) {
    return gap;
  }
  const Signal& v1 = drive.coordinates[0].smooth_speed;
  const Signal& v2 = drive.coordinates[1].smooth_speed;
  if (drive.has_pose()) {
    const auto heading = drive.heading.array();
    turn(drive, windows, drive.x - integral(drive, (v1.array() * heading.cos()).matrix()),
         drive.y - integral(drive, (v1.array() * heading.sin()).matrix()), gap);
  }
  const Signal seen = drive.has_heading() ? drive.heading : integral(drive, drive.gyro);
  gap.yaw = differences(windows, seen - integral(drive, v2));
  return gap;
}

Increments increments_of(const Drive& drive, const Windows& windows, const Column& column) {
  Increments increments;
  if (drive.two_wheels() && drive.has_pose() && (column.forward.size() > 0 || column.lateral.size() > 0)) {
    const Eigen::ArrayXd c = drive.heading.array().cos(), s = drive.heading.array().sin();
    Eigen::ArrayXd x = Eigen::ArrayXd::Zero(drive.rows()), y = x;
    if (column.forward.size() > 0) {
      x += column.forward.array() * c;
      y += column.forward.array() * s;
    }
    if (column.lateral.size() > 0) {
      x -= column.lateral.array() * s;
      y += column.lateral.array() * c;
    }
    turn(drive, windows, integral(drive, x.matrix()), integral(drive, y.matrix()), increments);
  }
  if (sees_yaw(drive) && column.yaw.size() > 0) {
    increments.yaw = differences(windows, integral(drive, column.yaw));
  }
  return increments;
}

IncrementNoise pose_noise(const Drive& drive) {
  IncrementNoise noise;
  const double of_two = std::sqrt(2.0);
  if (drive.has_pose()) {
    const double position = std::hypot(noise_of(drive, drive.x), noise_of(drive, drive.y)) / of_two;
    noise.forward = noise.lateral = of_two * position;
  }
  if (drive.has_heading()) {
    noise.yaw = of_two * noise_of(drive, drive.heading);
  }
  return noise;
}

IncrementNoise repeatability(const Drive& drive, const Windows& windows, const Increments& gap, std::size_t fewest) {
  if (gap.yaw.size() == 0 || windows.size() < fewest) {
    return {};
  }
  constexpr double kNear = 0.05;
  constexpr std::size_t kMostWindows = 2000;
  constexpr Eigen::Index kApart = 4;  // neighbours share a pose, and their errors
  const std::size_t stride = windows.size() / kMostWindows + 1;
  const auto count = static_cast<Eigen::Index>((windows.size() + stride - 1) / stride);
  Eigen::Matrix<double, 6, Eigen::Dynamic> motion(6, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const std::size_t at = static_cast<std::size_t>(k) * stride;
    Eigen::Index row = 0;
    for (const std::size_t c : {0, 1}) {
      const Signal& v = drive.coordinates[c].smooth_speed;
      const double unit = std::max(rms_of(v), 1e-12);
      for (const auto* place : {&windows.first, &windows.middle, &windows.last}) {
        motion(row++, k) = v[(*place)[at]] / unit;
      }
    }
  }
  IncrementNoise sum;
  std::size_t pairs = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    double nearest = 6.0 * kNear * kNear;
    Eigen::Index other = -1;
    for (Eigen::Index k = kApart; k <= count - kApart; ++k) {
      const Eigen::Index j = (i + k) % count;  // from i onwards: equals pair with another one each
      const double distance = (motion.col(i) - motion.col(j)).squaredNorm();
      if (distance < nearest) {
        nearest = distance;
        other = j;
      }
    }
    if (other < 0) {
      continue;
    }
    const auto a = i * static_cast<Eigen::Index>(stride), b = other * static_cast<Eigen::Index>(stride);
    const auto half_square = [a, b](const Signal& g) { return g.size() > 0 ? 0.5 * std::pow(g[a] - g[b], 2) : 0.0; };
    sum.forward += half_square(gap.forward);
    sum.lateral += half_square(gap.lateral);
    sum.yaw += half_square(gap.yaw);
    ++pairs;
  }
  if (pairs < fewest) {
    return {};
  }
  const auto root = [pairs](double squares) { return std::sqrt(squares / static_cast<double>(pairs)); };
  return {root(sum.forward), root(sum.lateral), root(sum.yaw)};
}

}  // namespace wheelwright::gap
