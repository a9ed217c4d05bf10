// SPDX-License-Identifier: Apache-2.0
// What is called guaranteed, attacked: robots solved exactly, sensors that keep to their bounds, timing that is what
// the robot file says, or for the last group is not. Each test is a failure that was once found.
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/guarantee/dice.hpp"
#include "tests/guarantee/judge.hpp"

namespace wheelwright::guarantee_test {
namespace {

using namespace guarantee;

// Sanitizers look at code, of which the first robots run as much as all.
#ifdef __SANITIZE_ADDRESS__
constexpr std::uint64_t kRobots = 3;
#else
constexpr std::uint64_t kRobots = 20;
#endif

// A robot of some kilograms with a time constant of about a second, and sensors that are fine.
Case ordinary(std::uint64_t seed, double rate, double bandwidth) {
  Dice dice(seed);
  Case c;
  c.seed = dice.bits();
  c.rate = rate;
  c.truth = {.axis = seed % 3 == 0,
             .radius = dice.uniform(0.05, 0.15),
             .track = dice.uniform(0.3, 0.6),
             .mass = dice.decade(3.0, 100.0)};
  c.truth.yaw_inertia = c.truth.mass * c.truth.track * c.truth.track * dice.uniform(0.15, 0.35);
  c.truth.viscous_linear = c.truth.mass / dice.uniform(0.5, 5.0);
  c.truth.viscous_yaw = c.truth.yaw_inertia / dice.uniform(0.5, 5.0);
  c.motion_bound = 1e-4;
  c.learn.bandwidth = bandwidth;
  c.learn.seed = dice.bits();
  reach_for(c.truth, 0.3, c.learn);
  c.watch = c.learn;
  c.watch.seed = dice.bits();
  c.effort_bound = 0.005 * c.learn.reach[0];
  c.rows = 1500;
  c.watch_rows = 3000;
  c.noise = c.noise_watch = Noise::uniform;
  return c;
}

// The robot of examples/robot.yaml.
Case example(std::uint64_t seed, double rate, double bandwidth) {
  Case c = ordinary(seed, rate, bandwidth);
  c.truth = {.axis = false,
             .radius = 0.0975,
             .track = 0.381,
             .mass = 21.0,
             .yaw_inertia = 0.9,
             .viscous_linear = 4.0,
             .viscous_yaw = 0.5};
  reach_for(c.truth, 0.3, c.learn);
  reach_for(c.truth, 0.3, c.watch);
  c.effort_bound = 0.02;
  return c;
}

// An encoder that rounds and no other error to speak of; a filter whose memory is long against a step.
Case rounding_encoder(std::uint64_t seed, double rate) {
  Case c = ordinary(seed, rate, 1.0);
  c.sense = Sense::encoder;
  c.counts = 4096.0;
  c.motion_bound = std::numbers::pi / 4096.0;
  c.beta = 5.0;
  c.effort_bound = 1e-4 * c.learn.reach[0];
  c.rows = static_cast<std::size_t>(15.0 * rate);
  c.watch_rows = 2 * c.rows;
  return c;
}

void drive_faster(Case& c, double bandwidth) {
  c.watch.bandwidth = bandwidth;
  reach_for(c.truth, 0.3, c.watch);
}

void dry(Case& c, double share) {
  c.truth.coulomb = share * c.learn.reach[0];
  reach_for(c.truth, 0.3, c.learn);
  reach_for(c.truth, 0.3, c.watch);
}

void fine_sensors(Case& c) {
  c.motion_bound = 1e-5;
  c.effort_bound = 0.001 * c.learn.reach[0];
}

// Every robot of `make`: counts, and none of them a broken promise.
template <typename Make>
void expect_kept(const std::string& what, Make make) {
  std::size_t guaranteed = 0, empty = 0, refused = 0, outside = 0, alarmed = 0, alarms = 0, decisions = 0, broken = 0;
  for (std::uint64_t seed = 1; seed <= kRobots; ++seed) {
    const Case c = make(seed);
    const Verdict v = judge(c);
    guaranteed += v.end == Verdict::End::guaranteed ? 1 : 0;
    empty += v.end == Verdict::End::empty ? 1 : 0;
    refused +=
        v.end == Verdict::End::refused || v.end == Verdict::End::learnt || v.end == Verdict::End::intervals ? 1 : 0;
    if (v.end == Verdict::End::guaranteed) {
      outside += v.truth_outside() ? 1 : 0;
      alarmed += v.alarms > 0 ? 1 : 0;
      alarms += v.alarms;
      decisions += v.decisions;
    }
    if (v.violation(c.broken == Broken::none)) {
      ++broken;
      ADD_FAILURE() << what << ", robot " << seed << ": " << name(v.end) << ", outside '" << v.outside << "', "
                    << v.alarms << " alarms: " << v.message;
    }
  }
  const std::string counts = fmt::format(
      "{}: of {} robots {} guaranteed, {} empty, {} no guarantee; truth outside {}, false alarms in {} ({} of {} "
      "instants)",
      what, kRobots, guaranteed, empty, refused, outside, alarmed, alarms, decisions);
  ::testing::Test::RecordProperty("counts", counts);
  fmt::print("{}\n", counts);
  EXPECT_EQ(broken, 0u) << counts;
}

// Every robot of `make`, broken: faults of a size that margins call certain are seen, and stay among what is possible.
template <typename Make>
void expect_faults(const std::string& what, Make make) {
  FaultTally all;
  for (std::uint64_t seed = 1; seed <= kRobots; ++seed) {
    const Verdict v = judge(make(seed), {.faults = true});
    for (const FaultTally& each : v.faults) {
      all.certain += each.certain;
      all.isolated += each.isolated;
    }
    EXPECT_EQ(v.missed(), 0u) << what << ", robot " << seed;
    EXPECT_EQ(v.excluded(), 0u) << what << ", robot " << seed;
  }
  fmt::print("{}: {} certain faults, {} alarms looked into\n", what, all.certain, all.isolated);
  EXPECT_GE(all.certain, 4 * kRobots) << what;
  EXPECT_GE(all.isolated, kRobots) << what;
}

// ---- the simulator itself ------------------------------------------------------------------------------------------

// Coulomb friction of two wheels by small steps.
TEST(Plant, AgreesWithSmallSteps) {
  const Truth t{.axis = false,
                .radius = 0.1,
                .track = 0.4,
                .mass = 20.0,
                .yaw_inertia = 0.3,
                .viscous_linear = 15.0,
                .viscous_yaw = 0.6,
                .coulomb = 0.4};
  const auto effort = [](double s) { return Pair{2.0 * std::sin(3.0 * s), 1.2 * std::sin(5.0 * s + 1.0)}; };
  constexpr double kPiece = 0.001;
  constexpr int kPieces = 3000, kSmall = 50, kSweeps = 12;
  Plant plant(t);
  const double a = 0.5 * t.radius * t.radius * t.mass, fa = 0.5 * t.radius * t.radius * t.viscous_linear;
  const double yaw = 2.0 * t.radius * t.radius / (t.track * t.track);
  const double b = yaw * t.yaw_inertia, fb = yaw * t.viscous_yaw;
  Pair speed{0.0, 0.0}, angle{0.0, 0.0};
  for (int k = 0; k < kPieces; ++k) {
    const double start = k * kPiece;
    const Pair from = effort(start), to = effort(start + kPiece);
    const Pair slope{(to[0] - from[0]) / kPiece, (to[1] - from[1]) / kPiece};
    plant.advance(kPiece, from, slope);
    for (int i = 0; i < kSmall; ++i) {
      constexpr double h = kPiece / kSmall;
      const double s = i * h;
      // Time stepping with impulses (Moreau): friction is what stops a wheel, or its limit.
      const Pair drive{from[0] + slope[0] * s, from[1] + slope[1] * s};
      Pair friction{0.0, 0.0};
      Pair next{};
      for (int sweep = 0; sweep < kSweeps; ++sweep) {
        for (std::size_t j = 0; j < 2; ++j) {
          const auto free = [&](double mine) {
            Pair net{drive[0] - friction[0], drive[1] - friction[1]};
            net[j] = drive[j] - mine;
            const double p = speed[0] + speed[1], q = speed[0] - speed[1];
            const double p1 = p + h * (net[0] + net[1] - fa * p) / a;
            const double q1 = q + h * (net[0] - net[1] - fb * q) / b;
            return Pair{0.5 * (p1 + q1), 0.5 * (p1 - q1)};
          };
          const double gain = 0.5 * h * (1.0 / a + 1.0 / b);
          const double stopping = free(0.0)[j] / gain;
          friction[j] = std::max(-t.coulomb, std::min(t.coulomb, stopping));
          next = free(friction[j]);
        }
      }
      angle = {angle[0] + h * next[0], angle[1] + h * next[1]};
      speed = next;
    }
    ASSERT_NEAR(plant.speed()[0], speed[0], 2e-3) << "at " << start;
    ASSERT_NEAR(plant.speed()[1], speed[1], 2e-3) << "at " << start;
  }
  EXPECT_NEAR(plant.angle()[0], angle[0], 1e-3);
  EXPECT_NEAR(plant.angle()[1], angle[1], 1e-3);
}

// However a piece is cut, the motion is the same, for time constants from far below to far above the piece.
TEST(Plant, PiecesMayBeCut) {
  for (const double constant : {1e-4, 1e-2, 1.0, 1e4}) {
    for (const double coulomb : {0.0, 0.3}) {
      const Truth t{.axis = false,
                    .radius = 0.1,
                    .track = 0.4,
                    .mass = 20.0,
                    .yaw_inertia = 0.3,
                    .viscous_linear = 20.0 / constant,
                    .viscous_yaw = 0.5 / constant,
                    .coulomb = coulomb};
      Plant whole(t), parts(t);
      const Pair effort{1.0, -2.0}, slope{-3.0, 9.0};
      whole.advance(0.7, effort, slope);
      for (int k = 0; k < 7; ++k) {
        parts.advance(0.1, {effort[0] + slope[0] * 0.1 * k, effort[1] + slope[1] * 0.1 * k}, slope);
      }
      for (std::size_t j = 0; j < 2; ++j) {
        EXPECT_NEAR(whole.speed()[j], parts.speed()[j], 1e-9 * (1.0 + std::abs(parts.speed()[j]))) << constant;
        EXPECT_NEAR(whole.angle()[j], parts.angle()[j], 1e-9 * (1.0 + std::abs(parts.angle()[j]))) << constant;
      }
    }
  }
}

// ---- assumptions kept ----------------------------------------------------------------------------------------------

TEST(BetweenSamples, TheExampleRobotInAMultiSineAtTwentyHertz) {
  expect_kept("example robot, 20 Hz", [](std::uint64_t seed) { return example(seed, 20.0, 6.0); });
}

TEST(BetweenSamples, TheSameAtFiftyHertz) {
  expect_kept("example robot, 50 Hz", [](std::uint64_t seed) { return example(seed, 50.0, 17.0); });
}

TEST(BetweenSamples, TheSameAtAHundredHertzWithFinerSensors) {
  expect_kept("example robot, 100 Hz, finer sensors", [](std::uint64_t seed) {
    Case c = example(seed, 100.0, 35.0);
    c.motion_bound = 1e-5;
    c.effort_bound = 0.002;
    return c;
  });
}

TEST(BetweenSamples, LearntGentlyAndWatchedInFastDriving) {
  for (const double rate : {20.0, 50.0, 100.0}) {
    expect_kept(fmt::format("learnt gently, watched fast, {:g} Hz", rate), [rate](std::uint64_t seed) {
      Case c = example(seed, rate, 0.02 * rate);
      c.motion_bound = 1e-5;
      c.effort_bound = 0.001 * c.learn.reach[0];
      drive_faster(c, 0.3 * rate);
      return c;
    });
  }
}

TEST(UnevenSteps, FourHundredHertzFromATickOfAMillisecond) {
  expect_kept("400 Hz from a 1 kHz tick, encoder merely rounding", [](std::uint64_t seed) {
    Case c = rounding_encoder(seed, 400.0);
    c.stamps = Stamps::two_three;
    return c;
  });
}

TEST(UnevenSteps, ThirtyPercentWithHeldCommands) {
  expect_kept("steps ±30 %, held commands", [](std::uint64_t seed) {
    Case c = rounding_encoder(seed, 400.0);
    c.stamps = Stamps::jittered;
    c.jitter = 0.3;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

TEST(UnevenSteps, TenPercentWithHeldCommands) {
  expect_kept("steps ±10 %, held commands, worst signs", [](std::uint64_t seed) {
    Case c = rounding_encoder(seed, 1000.0);
    c.sense = Sense::angle;
    c.stamps = Stamps::jittered;
    c.jitter = 0.1;
    c.noise_watch = seed % 2 == 0 ? Noise::against_heavy : Noise::against_light;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

TEST(UnevenSteps, EveryTenthDoubled) {
  expect_kept("every tenth step doubled", [](std::uint64_t seed) {
    Case c = rounding_encoder(seed, 1000.0);
    c.stamps = Stamps::tenth_twice;
    return c;
  });
}

TEST(UnevenSteps, JitterWithTheWorstSigns) {
  expect_kept("jitter ±20 %, worst signs", [](std::uint64_t seed) {
    Case c = rounding_encoder(seed, 400.0);
    c.sense = Sense::angle;
    c.stamps = Stamps::jittered;
    c.jitter = 0.2;
    c.noise_watch = seed % 2 == 0 ? Noise::against_heavy : Noise::against_light;
    return c;
  });
}

TEST(LostRows, OneInAHundred) {
  expect_kept("1 % of rows lost", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 5.0);
    c.lost = 0.01;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

// Alone and in bursts, for every sensor, at every rate, with efforts held and linear.
TEST(LostRows, UpToOneInTen) {
  constexpr std::array<double, 4> kRates{10.0, 50.0, 100.0, 500.0};
  constexpr std::array<double, 3> kLost{0.01, 0.03, 0.1};
  constexpr std::array<Sense, 4> kSenses{Sense::angle, Sense::encoder, Sense::speed, Sense::mean_speed};
  for (const int burst : {1, 3}) {
    expect_kept(fmt::format("1 to 10 % of rows lost, {} at once", burst), [&](std::uint64_t seed) {
      const double rate = kRates[seed % kRates.size()];
      Case c = ordinary(seed, rate, std::min(5.0, 0.1 * rate));
      c.sense = kSenses[(seed / 4) % kSenses.size()];
      c.lost = kLost[(seed / 2) % kLost.size()] / burst;
      c.burst = burst;
      c.changes = seed % 3 == 0 ? Changes::linear : Changes::at_samples;
      if (c.sense == Sense::encoder || c.sense == Sense::mean_speed) {
        c.counts = 4096.0;
        c.motion_bound = std::numbers::pi / 4096.0;
      } else if (c.sense == Sense::speed) {
        c.speed_source = model::SpeedSource::measured;
        c.motion_bound = 0.01;
      }
      c.learn.motion = c.watch.motion = c.changes == Changes::linear ? Motion::multisine : Motion::random_steps;
      return c;
    });
  }
}

TEST(LostRows, OneInAThousand) {
  expect_kept("0.1 % of rows lost", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 5.0);
    c.lost = 0.001;
    c.rows = 4000;
    c.watch_rows = 8000;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

TEST(FastRobots, FifteenMillisecondsAtFiftyHertz) {
  expect_kept("m/f = 15 ms at 50 Hz, commands change at samples", [](std::uint64_t seed) {
    Case c = ordinary(seed, 50.0, 25.0);
    c.sense = Sense::speed;
    c.speed_source = model::SpeedSource::measured;
    c.motion_bound = 0.01;
    c.truth.viscous_linear = c.truth.mass / 0.015;
    c.truth.viscous_yaw = c.truth.yaw_inertia / 0.015;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    reach_for(c.truth, 0.3, c.learn);
    reach_for(c.truth, 0.3, c.watch);
    c.effort_bound = 0.001 * c.learn.reach[0];
    return c;
  });
}

TEST(CommandsBetweenSamples, OfATwentyOneHertzController) {
  expect_kept("commands of 21 Hz, log of 100 Hz", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 5.0);
    c.changes = Changes::between;
    c.controller_rate = 21.0;
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

TEST(DryFriction, ReversalsBetweenSamples) {
  expect_kept("dry friction, reversals", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 10.0);
    dry(c, 0.3);
    fine_sensors(c);
    return c;
  });
}

TEST(Faults, OfAnAxisWithDryFriction) {
  expect_faults("broken axes with dry friction", [](std::uint64_t seed) {
    Case c = ordinary(3 * seed, 100.0, 5.0);
    dry(c, 0.2);
    c.sense = seed % 2 == 0 ? Sense::speed : Sense::angle;
    c.motion_bound = c.sense == Sense::speed ? 1e-3 : 1e-5;
    c.effort_bound = 0.001 * c.learn.reach[0];
    return c;
  });
}

TEST(Faults, WhereCommandsChangeBetweenSamples) {
  expect_faults("broken robots whose commands change between samples", [](std::uint64_t seed) {
    Case c = ordinary(seed, 200.0, 1.0);
    c.changes = Changes::between;
    c.controller_rate = 60.0;
    fine_sensors(c);
    return c;
  });
}

TEST(Faults, OfLogsWithUnevenSteps) {
  expect_faults("broken robots with uneven steps", [](std::uint64_t seed) {
    Case c = ordinary(seed, 50.0, 1.0);
    c.stamps = seed % 2 == 0 ? Stamps::jittered : Stamps::two_three;
    c.jitter = seed % 2 == 0 ? 0.2 : 0.0;
    fine_sensors(c);
    return c;
  });
}

// Found by the campaign: signs of speeds that a scale leaves alone, what an onset leaves in the smoothing of angles.
TEST(Faults, OfTheCampaignsCasesThatWereExcludedOnce) {
  for (const auto& [seed, number] :
       std::vector<std::pair<std::uint64_t, std::uint64_t>>{{3, 156}, {3, 813}, {3, 1086}, {4, 1068}}) {
    Case c = random_case(seed, number);
    c.watch_rows = 5000;
    const Verdict v = judge(c, {.faults = true});
    EXPECT_GT(v.faults[2].isolated, 0u) << seed << ", " << number;
    EXPECT_EQ(v.excluded() + v.missed(), 0u) << seed << ", " << number;
  }
}

// Set so wide that it holds robots without inertia: the motion that was seen in the log is no bound of a livelier one.
TEST(BetweenSamples, NoThresholdIsGuaranteedWhereDynamicsBoundNothing) {
  const Verdict v = judge(random_case(3, 393));
  EXPECT_EQ(v.end, Verdict::End::intervals) << name(v.end);
}

TEST(WholeTurnsAMinute, AreNoEncoder) {
  expect_kept("speeds in whole rpm", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 0.2);
    c.sense = Sense::whole_rpm;
    c.learn.motion = c.watch.motion = Motion::staircase;
    c.motion_bound = std::numbers::pi / 60.0 * (1.0 + 1e-12);
    reach_for(c.truth, 15.0, c.learn);
    reach_for(c.truth, 15.0, c.watch);
    c.beta = 2.0;
    c.rows = 4000;
    c.effort_bound = 1e-4 * c.learn.reach[0];
    return c;
  });
}

TEST(HeavyRobots, BeyondTenTonnes) {
  expect_kept("robots of 20 to 90 t", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 1.0);
    const double times = Dice(seed).uniform(2e4, 9e4) / c.truth.mass;
    c.truth.mass *= times;
    c.truth.yaw_inertia *= times;
    c.truth.viscous_linear *= 0.1 * times;
    c.truth.viscous_yaw *= 0.1 * times;
    reach_for(c.truth, 0.3, c.learn);
    reach_for(c.truth, 0.3, c.watch);
    c.effort_bound = 0.005 * c.learn.reach[0];
    return c;
  });
}

TEST(LateEfforts, WithinTheDeclaredDelay) {
  for (const double delay : {0.002, 0.01, 0.02}) {
    expect_kept(fmt::format("efforts {:g} ms late, declared", 1e3 * delay), [delay](std::uint64_t seed) {
      Case c = ordinary(seed, 100.0, 2.0);
      c.changes = Changes::smooth;
      c.delay = delay;
      c.delay_declared = true;
      return c;
    });
  }
}

// ---- assumptions broken: the truth inside, or no guarantee ---------------------------------------------------------

Case broken_case(std::uint64_t seed, Broken broken, double bandwidth) {
  Case c = ordinary(seed, 100.0, bandwidth);
  c.broken = broken;
  c.motion_bound = 1e-3;
  c.effort_bound = 0.02 * c.learn.reach[0];
  return c;
}

TEST(BrokenAssumptions, EffortsLateWithoutAWord) {
  for (const double delay : {0.002, 0.005, 0.01, 0.02}) {
    expect_kept(fmt::format("efforts {:g} ms late, not declared", 1e3 * delay), [delay](std::uint64_t seed) {
      Case c = broken_case(seed, Broken::late_efforts, 2.0);
      c.changes = Changes::smooth;
      c.delay = delay;
      return c;
    });
  }
}

TEST(BrokenAssumptions, TorqueOneSampleLate) {
  expect_kept("torque one sample late", [](std::uint64_t seed) { return broken_case(seed, Broken::torque_late, 2.0); });
}

TEST(BrokenAssumptions, SpeedsDifferencedBackward) {
  expect_kept("backward-differenced speeds", [](std::uint64_t seed) {
    Case c = broken_case(seed, Broken::backward_speeds, 2.0);
    c.sense = Sense::mean_speed;
    c.counts = 4096.0;
    c.motion_bound = std::numbers::pi / 4096.0;
    c.effort_bound = 0.01 * c.learn.reach[0];
    return c;
  });
}

TEST(BrokenAssumptions, StampsOffByTwoMilliseconds) {
  expect_kept("stamps off by ±2 ms", [](std::uint64_t seed) {
    Case c = broken_case(seed, Broken::stamps_off, 2.0);
    c.delay = 0.002;
    return c;
  });
}

TEST(BrokenAssumptions, HeldCommandsCalledLinear) {
  expect_kept("held commands called linear", [](std::uint64_t seed) {
    Case c = broken_case(seed, Broken::hold_wrong, 25.0);
    c.motion_bound = 1e-4;
    c.effort_bound = 0.002 * c.learn.reach[0];
    c.learn.motion = c.watch.motion = Motion::random_steps;
    return c;
  });
}

TEST(BrokenAssumptions, CommandsThatNoRowShows) {
  expect_kept("commands of 250 Hz, log of 100 Hz", [](std::uint64_t seed) {
    Case c = ordinary(seed, 100.0, 20.0);
    c.broken = Broken::unlogged_commands;
    c.controller_rate = 250.0;
    c.learn.motion = c.watch.motion = Motion::speed_loop;
    c.learn.bandwidth = c.watch.bandwidth = 5.0;
    c.learn.gain = c.watch.gain =
        60.0 * (c.truth.axis ? c.truth.mass : 0.25 * c.truth.radius * c.truth.radius * c.truth.mass);
    return c;
  });
}

TEST(BrokenAssumptions, AnglesWrappedAtATurn) {
  expect_kept("angles wrapped at a turn",
              [](std::uint64_t seed) { return broken_case(seed, Broken::wrapped_angles, 2.0); });
}

TEST(BrokenAssumptions, DryFrictionThatTheModelLacks) {
  expect_kept("dry friction that the model lacks", [](std::uint64_t seed) {
    Case c = broken_case(seed, Broken::hidden_friction, 2.0);
    dry(c, 0.05);
    return c;
  });
}

TEST(BrokenAssumptions, ATorqueSensorAtTheEndOfItsRange) {
  expect_kept("torque sensor clipped",
              [](std::uint64_t seed) { return broken_case(seed, Broken::clipped_effort, 2.0); });
}

}  // namespace
}  // namespace wheelwright::guarantee_test
