// SPDX-License-Identifier: Apache-2.0
// Held commands that come into force at a moment of their own within a step, and later: the truth stays inside, and
// what may be late is not called guaranteed.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/contradictions.hpp"
#include "commission/evidence.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::commission::effort_moment_test {
namespace {

constexpr double kRadius = 0.1, kTrack = 0.4;

// Two wheels with viscous friction under commands of their own, each solved in closed form from one moment to the next.
struct World {
  double mass = 20.0, inertia = 1.0, friction = 8.0, yaw_friction = 0.6;
  double step = 0.01, seconds = 40.0;
  double moment = 0.5;                              // of a step, by which a command acts before its stamp
  bool scattered = false;                           // each at a moment of its own between 0 and 1
  int late = 0;                                     // rows, beside that
  double speed_noise = 0.01, effort_noise = 0.002;  // rad/s, N·m
};

struct Coordinate {
  double inertia, friction, speed = 0.0;
  void drive(double force, double time) {
    const double end = force / friction;
    speed = end + (speed - end) * std::exp(-friction / inertia * time);
  }
};

LogTable drive(const World& w, std::uint64_t seed) {
  testing_support::Random random(seed);
  std::array<double, 8> frequency{}, phase{};
  for (std::size_t i = 0; i < phase.size(); ++i) {
    frequency[i] = 0.1 + 0.35 * random.unit();
    phase[i] = std::numbers::pi * random.symmetric();
  }
  const auto wave = [&](double t, std::size_t first) {
    double sum = 0.0;
    for (std::size_t i = first; i < first + 4; ++i) {
      sum += std::sin(2.0 * std::numbers::pi * frequency[i] * t + phase[i]);
    }
    return sum / 4.0;
  };
  Coordinate along{w.mass, w.friction}, turning{w.inertia, w.yaw_friction};
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l"};
  log.columns.resize(4);
  std::array<double, 2> acting{};
  for (int k = 0; k * w.step < w.seconds; ++k) {
    const double t = k * w.step, moment = w.scattered ? random.unit() : w.moment;
    const double command_at = (k - w.late) * w.step;
    const auto force = [&](double at) {
      return std::array{w.friction * 1.5 * wave(at, 0) + w.mass * 0.8 * wave(1.9 * at, 2),
                        w.yaw_friction * 2.0 * wave(at, 4) + w.inertia * 1.5 * wave(1.7 * at, 3)};
    };
    const auto [push, twist] = force(t);
    for (const auto& [u, time] :
         {std::pair{acting, (1.0 - moment) * w.step}, {std::array{push, twist}, moment * w.step}}) {
      along.drive(u[0], time);
      turning.drive(u[1], time);
    }
    acting = {push, twist};
    const auto [logged, logged_twist] = force(command_at);
    log.t.push_back(t);
    for (const double side : {1.0, -1.0}) {
      const std::size_t c = side > 0.0 ? 0 : 1;
      log.columns[c].push_back((along.speed + side * 0.5 * kTrack * turning.speed) / kRadius +
                               w.speed_noise * random.symmetric());
      log.columns[2 + c].push_back(0.5 * kRadius * (logged + side * 2.0 * logged_twist / kTrack) +
                                   w.effort_noise * random.symmetric());
    }
  }
  return log;
}

Commissioning commissioned(const World& w, std::uint64_t seed, bool declared, bool in_time = false) {
  Robot robot;
  robot.wheel_radius = kRadius;
  robot.track_width = kTrack;
  robot.hold = Hold::zero_order;
  robot.effort_changes = model::EffortChanges::between;
  robot.parameters = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  robot.effort_time_origin = in_time ? model::EffortTimeOrigin::declared : model::EffortTimeOrigin::untold;
  if (declared) {
    robot.noise.wheel_speed.value = w.speed_noise;
    robot.noise.effort.value = w.effort_noise;
  }
  const LogTable table = drive(w, seed);
  TableSource log(table);
  CommissionOptions options;
  options.at_risk = CommissionOptions::AtRisk::nothing;
  return commission_robot(log, robot, options);
}

std::string described(const World& w, std::uint64_t seed, const Commissioning& c) {
  return fmt::format("mass {} step {} moment {} scattered {} late {} noise {} seed {}: {}", w.mass, w.step, w.moment,
                     w.scattered, w.late, w.speed_noise, seed, c.message);
}

bool holds_the_truth(const World& w, const Commissioning& c) {
  const std::array truth{w.mass, w.inertia, w.friction, w.yaw_friction};
  bool all = true;
  for (std::size_t j = 0; j < truth.size(); ++j) {
    all = all && Interval{c.parameters[j].lower, c.parameters[j].upper}.contains(kRadius * truth[j]);
  }
  return all;
}

core::AssumptionVerdict delay_verdict(const Commissioning& c) {
  return std::ranges::find(c.assumptions, "effort_delay", &core::Assumption::id)->verdict;
}

// s, by how much the best shift is more than any moment within a step makes.
double beyond(const World& w, const Commissioning& c) { return c.effort_shift.value_or(0.0) - w.step; }

constexpr World kSlow{}, kFast{.mass = 0.8, .inertia = 0.06};

TEST(EffortMoment, AnyWithinTheStepIsInsideBoundsOnLearntAndOnDeclaredNoise) {
  for (const World& robot : {kSlow, kFast}) {
    for (const double moment : {0.05, 0.5, 0.95, -1.0}) {  // -1: scattered
      for (const double step : {0.01, 0.025}) {
        for (const bool declared : {false, true}) {
          World w = robot;
          w.step = step;
          w.moment = moment;
          w.scattered = moment < 0.0;
          const Commissioning c = commissioned(w, 3, declared, true);
          ASSERT_TRUE(c.has_model()) << declared << ' ' << described(w, 3, c);
          EXPECT_TRUE(holds_the_truth(w, c)) << declared << ' ' << described(w, 3, c);
          EXPECT_EQ(c.parameters.front().warrant, declared ? core::Warrant::guaranteed : core::Warrant::extrapolated)
              << described(w, 3, c);
        }
      }
    }
  }
}

// By how much a shift is known goes with the noise: from told for certain to not told at all.
TEST(EffortMoment, BeyondTheStepTakesTheGuaranteeAsSoonAsTheLogShowsIt) {
  std::size_t doubted = 0, refused = 0;
  for (const double noise : {0.01, 0.05, 0.1, 0.2, 0.4, 0.8}) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      World w = kSlow;
      w.step = 0.025;
      w.moment = 0.6;
      w.late = 1;
      w.speed_noise = noise;
      w.effort_noise = 0.2 * noise;
      const Commissioning c = commissioned(w, seed, true);
      const std::string what = described(w, seed, c);
      EXPECT_TRUE(c.model.warrant != core::Warrant::guaranteed || !c.has_model() || holds_the_truth(w, c)) << what;
      EXPECT_TRUE(beyond(w, c) <= 0.25 * w.step || delay_verdict(c) != core::AssumptionVerdict::holds) << what;
      refused += c.has_model() ? 0 : 1;
      if (c.has_model() && delay_verdict(c) == core::AssumptionVerdict::fails) {
        EXPECT_EQ(c.model.warrant, core::Warrant::extrapolated) << what;
        ++doubted;
      }
    }
  }
  EXPECT_GT(refused, 0U);
  EXPECT_GT(doubted, 0U);
}

// Noise that averages out leaves thin sets, and slow driving tells little of a shift.
TEST(EffortMoment, ShiftsThatTheLogLeavesOpenAreInTheBoundsUnlessTheRobotFileSaysThatEffortsAreInTime) {
  std::size_t taken_in = 0, guaranteed = 0;
  for (const double noise : {0.01, 0.03, 0.1, 0.3}) {
    for (const int late : {0, 1, 2}) {
      for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        World w = kSlow;
        w.moment = 0.5;
        w.late = late;
        w.speed_noise = noise;
        w.effort_noise = 0.2 * noise;
        const Commissioning c = commissioned(w, seed, true);
        const std::string what = described(w, seed, c);
        if (!c.has_model()) {
          continue;
        }
        EXPECT_TRUE(holds_the_truth(w, c)) << what;
        const model::Robot& robot = c.model.robot;
        if (robot.effort_time_origin == model::EffortTimeOrigin::found) {
          ++taken_in;
          EXPECT_EQ(c.model.warrant, core::Warrant::extrapolated) << what;
          EXPECT_TRUE(robot.effort_delay.contains(w.late * w.step)) << robot.effort_delay.upper << what;
        }
        if (late == 0) {
          const Commissioning in_time = commissioned(w, seed, true, true);
          EXPECT_EQ(in_time.model.robot.effort_delay, Interval{}) << what;
          guaranteed += in_time.model.warrant == core::Warrant::guaranteed && holds_the_truth(w, in_time) ? 1 : 0;
        }
      }
    }
  }
  EXPECT_GT(taken_in, 0U);
  EXPECT_EQ(guaranteed, 12U);
}

// A shift of 0.6 steps of 10 ms beyond what is allowed, known to `errors` standard errors.
EffortTiming shift_of(double errors, double left) {
  const double score = errors / 6.0;  // of what is certain
  return {.delay = 0.016,
          .standard_error = 0.006 / errors,
          .freedom = 1e3,
          .allowed = {0.0, 0.01},
          .residual_ratio = left,
          .mirror_ratio = 1.1,
          .score = score,
          .moved = 5.0};
}

TEST(EffortMoment, AShiftWeighsByWhatExplainsIt) {
  const auto explained = [](double doubt, double noise, double by_chance = 0.0) {
    return Explained{Eigen::VectorXd::Constant(5, doubt), Eigen::VectorXd::Constant(5, noise), by_chance};
  };
  constexpr double kStep = 0.01;
  EXPECT_EQ(weigh_shift(shift_of(2.0, 0.99), explained(0.0, 0.0), kStep), ShiftWeight::explained);
  EXPECT_EQ(weigh_shift(shift_of(4.0, 0.99), explained(0.0, 0.0), kStep), ShiftWeight::doubted);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.95), explained(0.0, 0.0), kStep), ShiftWeight::told);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.95), explained(0.0, 0.1), kStep), ShiftWeight::doubted);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.5), explained(0.0, 0.1), kStep), ShiftWeight::told);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.5), explained(0.1, 0.0), kStep), ShiftWeight::doubted);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.95), explained(0.1, 0.0, 0.1), kStep), ShiftWeight::explained);
  EXPECT_EQ(weigh_shift(shift_of(40.0, 0.5), explained(0.1, 0.0, 0.1), kStep), ShiftWeight::doubted);
}

}  // namespace
}  // namespace wheelwright::commission::effort_moment_test
