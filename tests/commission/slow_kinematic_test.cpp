// SPDX-License-Identifier: Apache-2.0
// What is promised of the kinematic residual under declared noise, counted.
#include <cmath>
#include <cstdint>
#include <limits>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/watch/detector_walk.hpp"
#include "detector/online_model.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::commission::slow_kinematic_test {
namespace {

using testing_support::posed_drive;
using testing_support::straight_drive;
using testing_support::true_kinematics;

// Robots, noise, windows and ways of driving change with the seed.
Scenario varied_drive(std::uint64_t seed, double duration) {
  Scenario s = posed_drive(seed, duration);
  const auto vary = [&](std::uint64_t stride, double lowest, double highest) {
    return lowest + static_cast<double>((seed * stride) % 101) / 100.0 * (highest - lowest);
  };
  s.robot.wheel_radius = vary(7, 0.03, 0.2);
  s.robot.track_width = vary(11, 0.2, 0.8);
  s.sensors.position = s.robot.noise.position.value.emplace(vary(13, 0.0, 0.005));
  s.sensors.heading = s.robot.noise.heading.value.emplace(vary(17, 0.0, 0.01));
  s.robot.kinematic_window = vary(19, 0.2, 1.5);
  s.sensors.noise = testing_support::kNoiseShapes[seed / 2 % 3];
  s.trajectory.kind = seed % 3 == 0 ? sim::Trajectory::Kind::multi_sine : sim::Trajectory::Kind::commissioning;
  return s;
}

class SlowKinematicPart : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SlowKinematicPart, TheTruthIsInTheSetAndAHealthyRobotRaisesNoAlarm) {
  std::size_t instants = 0;
  for (std::uint64_t seed = 50 * GetParam(); seed < 50 * GetParam() + 50; ++seed) {
    Scenario s = varied_drive(seed, 15.0);
    Simulation learning(s);
    const Commissioning result = commission_robot(learning, s.robot);
    ASSERT_TRUE(result.model.kinematic.has_value()) << "seed " << seed << ": " << result.kinematic.message;
    ASSERT_FALSE(result.kinematic.declared_too_small) << "seed " << seed;
    const Eigen::VectorXd truth = true_kinematics(s.robot);
    for (const bounds::HalfSpace& facet : result.model.kinematic->facets) {
      ASSERT_LE(facet.a.dot(truth), facet.b) << "seed " << seed;
    }
    s.seed = seed + 10000;
    s.trajectory.kind = static_cast<sim::Trajectory::Kind>(seed % 6);
    Simulation drive(s);
    const Detection d = detect(drive, make_detector(*result.model.kinematic));
    ASSERT_TRUE(d.events.empty()) << "seed " << seed << ", output " << d.events.front().output << " at "
                                  << d.events.front().start << ", ratio " << d.events.front().peak_ratio;
    instants += d.instants;
  }
  EXPECT_GT(instants, 50u * 1000u);
}

INSTANTIATE_TEST_SUITE_P(Quarters, SlowKinematicPart, ::testing::Range<std::uint64_t>(0, 4));

// Slip across the heading on a straight line: never an alarm before its onset, and within one window of it wherever
// |ρ_U| W exceeds the width of the lateral threshold.
TEST(SlowKinematic, LateralSlipIsSeenWithinAWindowWhereItMustBe) {
  std::size_t certain = 0, seen = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const Scenario learn = varied_drive(seed, 15.0);
    Simulation learning(learn);
    const Commissioning result = commission_robot(learning, learn.robot);
    ASSERT_TRUE(result.model.kinematic.has_value());
    Scenario s = learn;
    s.trajectory = straight_drive(seed, 20.0).trajectory;
    s.seed = seed + 500;
    const double slip = (seed % 2 == 0 ? 1.0 : -1.0) * (0.005 + 0.001 * static_cast<double>(seed)), onset = 8.0;
    s.faults = {{.kind = model::Fault::Kind::unmatched, .magnitude = slip, .profile = {.onset = onset}}};
    Simulation log(s);
    ASSERT_TRUE(detect(log, make_detector(result.model)).events.empty()) << "torque, seed " << seed;
    const double window = result.model.kinematic->window;
    const Detection d = detect(log, make_detector(*result.model.kinematic));
    const OutputTrace& lateral = d.trace.outputs[1];
    double widest = 0.0;
    for (std::size_t k = 0; k < lateral.upper.size(); ++k) {
      if (d.trace.t[k] > onset && d.trace.t[k] < onset + window + 0.1) {
        widest = std::max(widest, lateral.upper[k] - lateral.lower[k]);
      }
    }
    double first = std::numeric_limits<double>::infinity();
    for (const detector::Event& e : d.events) {
      ASSERT_GT(e.start, onset) << "seed " << seed;
      first = e.output == 1 ? std::min(first, e.alarm) : first;
    }
    seen += std::isfinite(first) ? 1 : 0;
    // The robot is steered by its true pose: it crabs, turned by less than 0.1 against the line.
    if (std::abs(slip) * window * std::cos(0.1) > widest) {
      ++certain;
      ASSERT_LE(first, onset + window + 0.03) << "seed " << seed;
    }
  }
  EXPECT_GT(certain, 15u);
  EXPECT_GE(seen, certain);
}

}  // namespace
}  // namespace wheelwright::commission::slow_kinematic_test
