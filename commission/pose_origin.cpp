// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/pose_origin.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright::commission {
namespace {

constexpr std::size_t kFewestPoseWindows = 8;
constexpr double kExactHeading = 1e-6;  // rad
constexpr double kExactWay = 1e-5;      // m
constexpr double kLeastChange = 1e-2;   // rad or m, rms in a window: less says nothing
constexpr double kOfTheCounts = 1.0 / 3.0;
constexpr double kOfTheRounding = 1.2;
constexpr double kWholeTurn = 2.0 * std::numbers::pi;

// The coarsest decimal unit of which all values are multiples, as they are or wrapped into a turn; 0 where there is
// none.
class Decimals {
 public:
  void add(double value) {
    for (std::size_t k = 0; k < plain_.size(); ++k) {
      plain_[k] = plain_[k] && whole(value, k);
      wrapped_[k] = wrapped_[k] && whole(std::remainder(value, kWholeTurn), k);
    }
  }
  [[nodiscard]] double quantum() const {
    for (std::size_t k = 0; k < plain_.size(); ++k) {
      if (plain_[k] || wrapped_[k]) {
        return std::pow(10.0, -static_cast<double>(k));
      }
    }
    return 0.0;
  }

 private:
  static bool whole(double value, std::size_t decimals) {
    const double scaled = value * std::pow(10.0, static_cast<double>(decimals));
    return std::abs(scaled - std::round(scaled)) < 1e-6;
  }
  std::array<bool, 8> plain_ = filled(), wrapped_ = filled();
  static std::array<bool, 8> filled() {
    std::array<bool, 8> all{};
    all.fill(true);
    return all;
  }
};

// What a combination of two columns leaves of a third, rms; nothing where that hardly varies.
class Combination {
 public:
  void add(double right, double left, double value) {
    const Eigen::Vector2d x(right, left);
    gram_ += x * x.transpose();
    moment_ += value * x;
    square_ += value * value;
    rows_.push_back({right, left, value});
  }
  [[nodiscard]] std::optional<double> rest() const {
    const auto n = static_cast<double>(rows_.size());
    if (rows_.size() < kFewestPoseWindows || std::sqrt(square_ / n) < kLeastChange) {
      return std::nullopt;
    }
    const Eigen::Vector2d c = core::minimum_norm_solution(gram_, moment_);
    double sum = 0.0;
    for (const auto& [right, left, value] : rows_) {
      const double e = value - c[0] * right - c[1] * left;
      sum += e * e;
    }
    return std::sqrt(sum / n);
  }

 private:
  struct Row {
    double right, left, value;
  };
  Eigen::Matrix2d gram_ = Eigen::Matrix2d::Zero();
  Eigen::Vector2d moment_ = Eigen::Vector2d::Zero();
  double square_ = 0.0;
  std::vector<Row> rows_;
};

// Wheel angles since the window began, by three rules of integration (angles: all alike).
using Turned = std::array<std::array<double, 2>, 3>;

}  // namespace

PoseOrigin pose_origin(LogSource& log, const filter::OdometryMeasurement& m, double window, double counts_per_turn) {
  PoseOrigin origin;
  if (!m.heading || m.held_pose) {
    return origin;
  }
  const std::array<std::size_t, 2> wheel = {*log.find(m.motion_columns[0]), *log.find(m.motion_columns[1])};
  const std::size_t theta = *log.find("theta");
  const std::size_t x = m.position ? *log.find("x") : theta, y = m.position ? *log.find("y") : theta;
  std::array<Combination, 3> headings, ways;
  Decimals decimals;
  Turned turned{};
  double heading = 0.0, way = 0.0, begin = 0.0, before = 0.0;
  std::array<double, 2> motion{};
  double theta_before = 0.0, x_before = 0.0, y_before = 0.0;
  const auto restart = [&](double t) {
    begin = t;
    heading = way = 0.0;
    turned = {};
  };
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    const double t = block.t[k];
    const std::array<double, 2> now = {block.columns[wheel[0]][k], block.columns[wheel[1]][k]};
    const double theta_now = block.columns[theta][k], x_now = block.columns[x][k], y_now = block.columns[y][k];
    decimals.add(theta_now);
    if (starts) {
      restart(t);
    } else {
      const double h = t - before;
      double along = 0.0;
      for (std::size_t j = 0; j < 2; ++j) {
        const bool angle = m.motion == MotionKind::angle;
        const std::array<double, 3> steps = {angle ? now[j] - motion[j] : h * 0.5 * (now[j] + motion[j]),
                                             angle ? now[j] - motion[j] : h * motion[j],
                                             angle ? now[j] - motion[j] : h * now[j]};
        for (std::size_t rule = 0; rule < 3; ++rule) {
          turned[rule][j] += steps[rule];
        }
        along += steps[0];
      }
      heading += std::remainder(theta_now - theta_before, kWholeTurn);
      way += std::copysign(std::hypot(x_now - x_before, y_now - y_before), along);
      if (t - begin >= window) {
        for (std::size_t rule = 0; rule < 3; ++rule) {
          headings[rule].add(turned[rule][0], turned[rule][1], heading);
          ways[rule].add(turned[rule][0], turned[rule][1], way);
        }
        restart(t);
      }
    }
    before = t;
    motion = now;
    theta_before = theta_now;
    x_before = x_now;
    y_before = y_now;
  });
  const auto least = [](const std::array<Combination, 3>& fits) {
    std::optional<double> best;
    for (const Combination& fit : fits) {
      if (const auto rest = fit.rest(); rest && (!best || *rest < *best)) {
        best = rest;
      }
    }
    return best;
  };
  if (const auto rest = least(headings)) {
    origin.heading_rest = *rest;
    const double count = m.count > 0.0           ? m.count * m.nominal_step
                         : counts_per_turn > 0.0 ? kWholeTurn / counts_per_turn
                                                 : 0.0;
    // Half a count at both ends of a window and both wheels, times a gain that is about a third: an independent
    // heading.
    const double by_counts = count / (3.0 * std::sqrt(3.0));
    const double rounding = decimals.quantum() / std::sqrt(6.0);
    origin.heading_repeats =
        *rest < kExactHeading || (*rest <= kOfTheRounding * rounding && *rest < kOfTheCounts * by_counts);
  }
  if (const auto rest = m.position ? least(ways) : std::nullopt) {
    origin.position_rest = *rest;
    origin.position_repeats = origin.heading_repeats || *rest < kExactWay;
  }
  if (origin.heading_repeats) {
    origin.sentence = fmt::format(
        "{} wheel odometry over again, not measured independently: a combination of the wheel angles leaves {:.2g} rad "
        "of "
        "the heading over {:.3g} s, less than any sensor of its own would",
        m.position ? "the pose is" : "the heading is", origin.heading_rest, window);
  } else if (origin.position_repeats) {
    origin.sentence = fmt::format(
        "x and y are wheel odometry over again, not measured independently: the wheel angles leave {:.2g} m of the way "
        "over {:.3g} s, less than any sensor of its own would",
        origin.position_rest, window);
  }
  return origin;
}

}  // namespace wheelwright::commission
