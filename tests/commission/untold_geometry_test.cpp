// SPDX-License-Identifier: Apache-2.0
// Bounds on wheel radii and yaw gains under noise that is estimated, from logs that do not show all of them: the true
// ones stay inside.
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::commission::untold_geometry_test {
namespace {

enum class Way { straight, circle, turning_on_the_spot, mostly_standing, steady_circle, everything };

// Unequal wheels on arcs of constant curvature over each step, a pose with noise in (−bound, bound).
struct World {
  double right, left, track;
  double position, heading;  // bounds of the noise, m and rad
  Way way;
};

LogTable drive(const World& w, std::uint64_t seed) {
  testing_support::Random random(seed);
  LogTable log;
  log.names = {"phi_r", "phi_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.resize(7);
  constexpr double h = 0.01, count = 2.0 * std::numbers::pi / 4096.0;
  double right = 1.0 + count * random.unit(), left = 2.0 + count * random.unit(), x = 0.0, y = 0.0, theta = 0.3;
  double v = 0.0, turning = 0.0, wanted = 0.0, wanted_turn = 0.0;
  for (int k = 0; k < 6000; ++k) {
    if (k % 150 == 0) {
      const bool drives = w.way != Way::mostly_standing || (k > 2000 && k < 2600);
      wanted = drives ? 0.6 * random.symmetric() : 0.0;
      wanted_turn = drives ? 1.5 * random.symmetric() : 0.0;
    }
    v += 0.05 * (wanted - v);
    turning += 0.05 * (wanted_turn - turning);
    switch (w.way) {
      case Way::straight: turning = 0.0; break;
      case Way::circle: turning = v; break;
      case Way::turning_on_the_spot: v = 0.0; break;
      case Way::steady_circle: v = turning = 0.5; break;
      case Way::mostly_standing:
      case Way::everything: break;
    }
    log.t.push_back(k * h);
    const std::array row{std::round(right / count) * count,
                         std::round(left / count) * count,
                         0.1 * random.symmetric(),
                         0.1 * random.symmetric(),
                         x + w.position * random.symmetric(),
                         y + w.position * random.symmetric(),
                         theta + w.heading * random.symmetric()};
    for (std::size_t c = 0; c < row.size(); ++c) {
      log.columns[c].push_back(row[c]);
    }
    const double angle = turning * h, chord = v * h * (angle == 0.0 ? 1.0 : std::sin(0.5 * angle) / (0.5 * angle));
    x += chord * std::cos(theta + 0.5 * angle);
    y += chord * std::sin(theta + 0.5 * angle);
    theta += angle;
    right += (v + 0.5 * w.track * turning) * h / w.right;
    left += (v - 0.5 * w.track * turning) * h / w.left;
  }
  return log;
}

TEST(UntoldGeometry, WhatADriveDoesNotShowIsNotKnownFromIt) {
  for (const Way way : {Way::straight, Way::circle, Way::turning_on_the_spot, Way::mostly_standing, Way::steady_circle,
                        Way::everything}) {
    for (const double noise : {0.001, 0.02}) {
      for (const std::uint64_t seed : {1U, 9U}) {  // on the circle of 9 the pose was taken for the wheels'
        const World w{0.0995, 0.0960, 0.39, noise, noise, way};
        const LogTable table = drive(w, seed);
        TableSource log(table);
        Robot robot;
        robot.wheel_radius = 0.0975;
        robot.track_width = 0.381;
        robot.encoder_counts_per_turn = 4096.0;
        CommissionOptions options;
        options.at_risk = CommissionOptions::AtRisk::nothing;
        const KinematicCommissioning c = commission_robot(log, robot, options).kinematic;
        const std::string what =
            fmt::format("way {} noise {} seed {}: {}", static_cast<int>(way), noise, seed, c.message);
        const std::array truth{w.right, w.left, w.right / w.track, w.left / w.track};
        for (std::size_t j = 0; j < c.parameters.size(); ++j) {
          EXPECT_LE(c.parameters[j].lower, truth[j]) << what << ", " << c.parameters[j].name;
          EXPECT_GE(c.parameters[j].upper, truth[j]) << what << ", " << c.parameters[j].name;
        }
        EXPECT_EQ(c.parameters.size(), 4U) << what;
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission::untold_geometry_test
