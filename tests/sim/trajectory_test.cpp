// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::sim::trajectory_test {
namespace {

using Kind = Trajectory::Kind;
constexpr std::array all_kinds = {Kind::straight, Kind::circle, Kind::figure_eight, Kind::multi_sine,
                                  Kind::spin,     Kind::stops,  Kind::commissioning};

TEST(Trajectory, AccelerationIsTheDerivativeOfSpeed) {
  for (const Kind kind : all_kinds) {
    const Trajectory trajectory{.kind = kind};
    constexpr double h = 1e-5;
    for (double t = 0.0123; t < 60.0; t += 0.0917) {
      const Eigen::Vector2d difference =
          (reference_speed(trajectory, t + h).speed - reference_speed(trajectory, t - h).speed) / (2.0 * h);
      // Speeds are once continuously differentiable: h times a jump of the second derivative at worst.
      EXPECT_LT((difference - reference_speed(trajectory, t).acceleration).norm(), 1e-4)
          << static_cast<int>(kind) << " at " << t;
    }
  }
}

TEST(Trajectory, StartsFromRestAndKeepsToItsLimits) {
  for (const Kind kind : all_kinds) {
    const Trajectory trajectory{.kind = kind, .speed = 0.6, .yaw_rate = 1.7, .period = 12.0};
    EXPECT_EQ(reference_speed(trajectory, 0.0).speed, Eigen::Vector2d::Zero());
    double v1 = 0.0, v2 = 0.0;
    for (double t = 0.0; t < 120.0; t += 0.01) {
      const Eigen::Vector2d v = reference_speed(trajectory, t).speed;
      v1 = std::max(v1, std::abs(v[0]));
      v2 = std::max(v2, std::abs(v[1]));
    }
    EXPECT_LE(v1, 0.6 * (1.0 + 1e-12)) << static_cast<int>(kind);
    EXPECT_LE(v2, 1.7 * (1.0 + 1e-12)) << static_cast<int>(kind);
  }
}

TEST(Trajectory, CircleIsACircle) {
  const Trajectory trajectory{.kind = Kind::circle, .speed = 0.5, .yaw_rate = 0.8};
  Eigen::Vector3d pose(1.0, 2.0, 0.3);
  double t = 5.0;  // past the soft start
  for (int i = 0; i < 500; ++i, t += 0.03) {
    pose = advance_reference(trajectory, pose, t, 0.03);
    const double turned = 0.8 * 0.03 * (i + 1);
    EXPECT_NEAR(pose[0], 1.0 + 0.5 / 0.8 * (std::sin(0.3 + turned) - std::sin(0.3)), 1e-12);
    EXPECT_NEAR(pose[1], 2.0 - 0.5 / 0.8 * (std::cos(0.3 + turned) - std::cos(0.3)), 1e-12);
  }
}

TEST(Trajectory, FigureEightCloses) {
  const Trajectory trajectory{.kind = Kind::figure_eight, .speed = 0.5, .period = 10.0};
  const Eigen::Vector3d start(1.0, 2.0, 0.3);
  Eigen::Vector3d pose = start;
  constexpr int steps = 100000;
  for (int i = 0; i < steps; ++i) {
    pose = advance_reference(trajectory, pose, 10.0 + 10.0 * i / steps, 10.0 / steps);
  }
  EXPECT_LT((pose - start).norm(), 1e-8);
}

Trajectory table(std::vector<double> t, std::vector<Eigen::Vector2d> speed) {
  return {.kind = Kind::table, .table = {std::move(t), std::move(speed)}};
}

TEST(Trajectory, TableIsLinearBetweenItsRowsAndAtRestOutside) {
  const Trajectory trajectory = table({1.0, 2.0, 4.0}, {{0.0, 1.0}, {0.5, -1.0}, {0.1, 0.0}});
  EXPECT_NO_THROW(validate(trajectory));
  const auto speed = [&](double t) { return reference_speed(trajectory, t).speed; };
  const auto acceleration = [&](double t) { return reference_speed(trajectory, t).acceleration; };
  EXPECT_EQ(speed(0.5), Eigen::Vector2d(0.0, 0.0));
  EXPECT_EQ(speed(1.0), Eigen::Vector2d(0.0, 1.0));
  EXPECT_EQ(speed(1.5), Eigen::Vector2d(0.25, 0.0));
  EXPECT_EQ(acceleration(1.5), Eigen::Vector2d(0.5, -2.0));
  EXPECT_NEAR((speed(3.0) - Eigen::Vector2d(0.3, -0.5)).norm(), 0.0, 1e-15);
  EXPECT_EQ(speed(4.0), Eigen::Vector2d(0.1, 0.0));
  EXPECT_EQ(speed(4.1), Eigen::Vector2d(0.0, 0.0));
  EXPECT_EQ(acceleration(4.1), Eigen::Vector2d(0.0, 0.0));
}

TEST(Trajectory, RefusesTablesThatAreNone) {
  EXPECT_THROW(validate(table({}, {})), InvalidArgument);
  EXPECT_THROW(validate(table({0.0}, {{0.0, 0.0}})), InvalidArgument);
  EXPECT_THROW(validate(table({0.0, 1.0}, {{0.0, 0.0}})), InvalidArgument);
  EXPECT_THROW(validate(table({0.0, 0.0}, {{0.0, 0.0}, {1.0, 0.0}})), InvalidArgument);
  EXPECT_THROW(validate(table({0.0, 1.0}, {{0.0, 0.0}, {std::nan(""), 0.0}})), InvalidArgument);
}

TEST(Trajectory, RefusesWhatIsNone) {
  EXPECT_THROW(validate(Trajectory{.speed = -0.1}), InvalidArgument);
  EXPECT_THROW(validate(Trajectory{.yaw_rate = std::nan("")}), InvalidArgument);
  EXPECT_THROW(validate(Trajectory{.period = 0.0}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::sim::trajectory_test
