// SPDX-License-Identifier: Apache-2.0
// Assumptions that statistics of a log contradict, one broken at a time, on logs of a robot that shares no code with
// the toolkit's own simulator: the word guaranteed goes where one is broken, and stays where none is.
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "commission/assumptions.hpp"
#include "commission/commission.hpp"
#include "core/error.hpp"

namespace wheelwright::commission::premises_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using Kind = LogContradiction::Kind;
using Verdict = core::AssumptionVerdict;

// A robot of two wheels, its driver and its sensors.
struct World {
  double mass = 24.0, inertia = 1.3, viscous = 6.0, viscous_yaw = 0.7, coulomb = 0.0;
  double rate = 100.0, seconds = 60.0;
  double counts = 4096.0;  // of the encoders, a turn
  double effort_error = 0.05;
  bool both_ways = true, turns = false;
  // What may be broken.
  double mass_gained = 0.0;  // a share, half-way
  double offset = 0.0;       // of the right effort
  double drag = 0.0;         // N·m·s²/rad² at each wheel
  std::uint32_t seed = 1;
};

constexpr double kRadius = 0.085, kTrack = 0.40;

struct Pair {
  double v = 0.0, w = 0.0;
};

Pair reference(const World& world, double t) {
  const double s = static_cast<double>(world.seed);
  const double fade = std::clamp(t - 1.0, 0.0, 1.0) * std::clamp(world.seconds - 1.0 - t, 0.0, 1.0);
  Pair p;
  for (int k = 0; k < 5; ++k) {
    p.v += 0.19 * std::sin((0.35 + 0.47 * k) * t + s * (k + 1));
    p.w += 0.38 * std::sin((2.4 - 0.41 * k) * t + 2.0 * s + k);
  }
  if (!world.both_ways) {
    p.v = 0.7 + 0.4 * std::tanh(p.v);
    p.w *= 0.4;
  }
  if (world.turns) {
    p = {0.3 * p.v, 3.0 * p.w};
  }
  return {p.v * fade, p.w * fade};
}

// Midpoint steps of half a millisecond; torques are held from sample to sample.
LogTable log_of(const World& world) {
  std::mt19937 dice(world.seed);
  std::uniform_real_distribution<double> error(-0.8 * world.effort_error, 0.8 * world.effort_error);
  const auto round_to = [&](double angle) {
    const double unit = 2.0 * std::numbers::pi / world.counts;
    return world.counts > 0.0 ? unit * std::round(angle / unit) : angle;
  };
  LogTable table;
  table.names = {"phi_r", "phi_l", "tau_r", "tau_l"};
  table.columns.resize(4);
  const auto samples = static_cast<int>(world.seconds * world.rate);
  const int steps = std::max(2, static_cast<int>(std::lround(2000.0 / world.rate)));
  const double h = 1.0 / (world.rate * steps);
  std::array<double, 2> speed{}, angle{}, sum{}, torque{};
  for (int k = 0; k < samples; ++k) {
    const double t = k / world.rate, dt = 0.5 / world.rate;
    const Pair now = reference(world, t), next = reference(world, t + dt), before = reference(world, t - dt);
    const double force = 24.0 * (next.v - before.v) * world.rate + 6.0 * now.v;
    const double turn = (1.3 * (next.w - before.w) * world.rate + 0.7 * now.w) / (0.5 * kTrack);
    const std::array<double, 2> wanted = {(now.v + 0.5 * kTrack * now.w) / kRadius,
                                          (now.v - 0.5 * kTrack * now.w) / kRadius};
    for (std::size_t j = 0; j < 2; ++j) {
      const double side = j == 0 ? 1.0 : -1.0, off = wanted[j] - speed[j];
      sum[j] += 1.0 * off / world.rate;
      torque[j] =
          0.5 * kRadius * (force + side * turn) + world.coulomb * std::tanh(5.0 * wanted[j]) + 0.5 * off + sum[j];
    }
    table.t.push_back(t);
    table.columns[0].push_back(round_to(angle[0]));
    table.columns[1].push_back(round_to(angle[1]));
    table.columns[2].push_back(torque[0] + error(dice) + world.offset);
    table.columns[3].push_back(torque[1] + error(dice));
    const double mass = world.mass * (t >= 0.5 * world.seconds ? 1.0 + world.mass_gained : 1.0);
    const auto accelerations = [&](const std::array<double, 2>& w) -> std::array<double, 2> {
      std::array<double, 2> f{};
      for (std::size_t j = 0; j < 2; ++j) {
        f[j] = (torque[j] - world.coulomb * std::tanh(50.0 * w[j]) - world.drag * w[j] * std::abs(w[j])) / kRadius;
      }
      const double v = 0.5 * kRadius * (w[0] + w[1]), yaw = kRadius * (w[0] - w[1]) / kTrack;
      const double dv = (f[0] + f[1] - world.viscous * v) / mass;
      const double dyaw = (0.5 * kTrack * (f[0] - f[1]) - world.viscous_yaw * yaw) / world.inertia;
      return {(dv + 0.5 * kTrack * dyaw) / kRadius, (dv - 0.5 * kTrack * dyaw) / kRadius};
    };
    for (int i = 0; i < steps; ++i) {
      const std::array<double, 2> first = accelerations(speed);
      const std::array<double, 2> middle = {speed[0] + 0.5 * h * first[0], speed[1] + 0.5 * h * first[1]};
      const std::array<double, 2> second = accelerations(middle);
      for (std::size_t j = 0; j < 2; ++j) {
        angle[j] += h * middle[j];
        speed[j] += h * second[j];
      }
    }
  }
  return table;
}

Robot robot_of(const World& world, double bias = -1.0) {
  Robot robot;
  robot.wheel_radius = kRadius;
  robot.track_width = kTrack;
  robot.wheel_directions_checked = true;
  robot.effort_time_origin = model::EffortTimeOrigin::declared;
  robot.hold = Hold::zero_order;
  robot.effort_changes = model::EffortChanges::at_samples;
  robot.parameters = std::vector<std::string>{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  if (world.coulomb > 0.0) {
    robot.parameters->emplace_back("coulomb");
  }
  robot.noise.effort.value = world.effort_error;
  if (bias >= 0.0) {
    robot.noise.effort.bias = bias;
  }
  robot.encoder_counts_per_turn = world.counts;
  return robot;
}

Commissioning commissioned(const World& world, const Robot& robot,
                           CommissionOptions::AtRisk at_risk = CommissionOptions::AtRisk::nothing) {
  const LogTable table = log_of(world);
  TableSource log(table);
  CommissionOptions options;
  options.at_risk = at_risk;
  return commission_robot(log, robot, options);
}

const core::Assumption& of(const Commissioning& c, const std::string& id) {
  const auto found = std::ranges::find(c.assumptions, id, &core::Assumption::id);
  if (found == c.assumptions.end()) {
    throw Error("no assumption " + id);
  }
  return *found;
}

std::string failing(const Commissioning& c) {
  std::string text = c.message;
  for (const core::Assumption& a : c.assumptions) {
    text += a.verdict == Verdict::fails ? "\n" + a.id + ": " + a.detail : "";
  }
  return text;
}

const LogContradiction* find(const Commissioning& c, Kind kind) {
  const auto found = std::ranges::find(c.contradictions, kind, &LogContradiction::kind);
  return found == c.contradictions.end() ? nullptr : &*found;
}

// Rates, encoders and dry friction of an honest robot.
std::vector<World> honest_worlds() {
  std::vector<World> worlds;
  std::uint32_t seed = 10;
  for (const double rate : {20.0, 100.0, 250.0}) {
    for (const double counts : {512.0, 4096.0}) {
      for (const double coulomb : {0.0, 0.3}) {
        World world;
        world.rate = rate;
        world.counts = counts;
        world.coulomb = coulomb;
        world.both_ways = seed % 3 != 0;
        world.seed = ++seed;
        worlds.push_back(world);
      }
    }
  }
  return worlds;
}

TEST(Premises, AreKeptByHonestLogs) {
  for (const World& world : honest_worlds()) {
    const Commissioning c = commissioned(world, robot_of(world));
    ASSERT_TRUE(c.has_model()) << c.message;
    EXPECT_EQ(c.model.warrant, core::Warrant::guaranteed)
        << world.rate << " Hz, " << world.counts << " counts, " << world.coulomb << " N·m\n"
        << failing(c);
  }
}

// Declared bounds hold either mass in every row.
TEST(Premises, AMassThatGrowsHalfWayIsToldWithItsTime) {
  for (const double gained : {0.01, 0.03}) {
    for (const double coulomb : {0.0}) {
      World world;
      world.mass_gained = gained;
      world.coulomb = coulomb;
      const Commissioning c = commissioned(world, robot_of(world));
      const LogContradiction* found = find(c, Kind::halves_disagree);
      ASSERT_NE(found, nullptr) << gained << " " << c.message;
      EXPECT_EQ(found->subject, "mass");
      EXPECT_NEAR(found->value, 24.0 * gained, 0.3 * 24.0 * gained);
      EXPECT_EQ(of(c, "constant_parameters").verdict, Verdict::fails);
      EXPECT_NE(c.model.warrant, core::Warrant::guaranteed);
      EXPECT_THAT(c.message, HasSubstr("nothing is called guaranteed"));
    }
  }
}

// A change shows where the robot speeds up: the first drive hardly does from 27 to 36 s, so that only a range of times
// can be told. Most tell it to a few blocks of 0.08 s, since the filter's delay is taken out.
TEST(Premises, AChangeIsDatedAsWellAsTheDriveShowsIt) {
  const auto number_after = [](const std::string& text, const std::string& word) {
    const std::size_t at = text.find(word);
    return at == std::string::npos ? -1.0 : std::stod(text.substr(at + word.size()));
  };
  constexpr double kTruth = 30.0, kTwoBlocks = 0.16;
  std::vector<double> errors;
  for (std::uint32_t seed = 1; seed <= 7; ++seed) {
    World world;
    world.mass_gained = 0.03;
    world.seed = seed;
    const Commissioning c = commissioned(world, robot_of(world));
    const LogContradiction* found = find(c, Kind::halves_disagree);
    ASSERT_NE(found, nullptr) << c.message;
    const double best = number_after(found->sentence, "fits best at ");
    const double first = number_after(found->sentence, " from "), last = number_after(found->sentence, " to ");
    EXPECT_GE(kTruth, first - kTwoBlocks) << found->sentence;
    EXPECT_LE(kTruth, last + kTwoBlocks) << found->sentence;
    EXPECT_LE(first, best);
    EXPECT_LE(best, last);
    EXPECT_LT(last - first, 15.0) << found->sentence;
    errors.push_back(std::abs(best - kTruth));
  }
  std::ranges::sort(errors);
  EXPECT_LT(errors[errors.size() / 2], 0.3);
}

TEST(Premises, AnOffsetIsHeldAgainstTheDeclaredBias) {
  World world;
  const double bias = 0.002;
  const auto verdict = [&](double times) {
    world.offset = times * bias;
    return commissioned(world, robot_of(world, bias));
  };
  EXPECT_EQ(of(verdict(0.9), "effort_offset").verdict, Verdict::holds) << failing(verdict(0.9));
  for (const double times : {5.0, 10.0}) {
    const Commissioning c = verdict(times);
    EXPECT_EQ(of(c, "effort_offset").verdict, Verdict::fails) << of(c, "effort_offset").detail;
    EXPECT_EQ(find(c, Kind::effort_offset)->subject, "tau_r");
    EXPECT_NEAR(find(c, Kind::effort_offset)->value, times * bias, bias);
    EXPECT_NE(c.model.warrant, core::Warrant::guaranteed);
  }
  // Nothing but the bound is declared, which holds it.
  const Commissioning bound = commissioned(world, robot_of(world));
  EXPECT_NE(of(bound, "effort_offset").verdict, Verdict::fails) << of(bound, "effort_offset").detail;
}

TEST(Premises, FrictionOfAnotherShapeIsTold) {
  World world;
  world.drag = 0.005;
  const Commissioning c = commissioned(world, robot_of(world));
  EXPECT_EQ(of(c, "friction_shape").verdict, Verdict::fails) << of(c, "friction_shape").detail;
  EXPECT_NE(c.model.warrant, core::Warrant::guaranteed);
}

// What the log could not have contradicted does not hold.
TEST(Premises, HoldOnlyWhereAViolationWouldHaveShown) {
  World world;
  // An offset of the efforts as large as the bound looks like viscous friction where the halves drive differently.
  EXPECT_EQ(of(commissioned(world, robot_of(world)), "constant_parameters").verdict, Verdict::not_tested);
  const Commissioning rich = commissioned(world, robot_of(world, 0.002));
  EXPECT_EQ(of(rich, "constant_parameters").verdict, Verdict::holds) << of(rich, "constant_parameters").detail;
  EXPECT_THAT(of(rich, "constant_parameters").detail, HasSubstr("would have shown"));
  EXPECT_EQ(of(rich, "effort_gain").verdict, Verdict::not_tested);
  // Eight seconds of motion under large errors.
  World poor = world;
  poor.seconds = 8.0;
  poor.effort_error = 1.0;
  poor.counts = 256.0;
  const Commissioning c = commissioned(poor, robot_of(poor));
  for (const char* id : {"constant_parameters", "friction_shape"}) {
    EXPECT_EQ(of(c, id).verdict, Verdict::not_tested) << id << ": " << of(c, id).detail;
  }
}

// Priors of a mass of 24 kg: wider than what the rows leave, narrower, and elsewhere.
TEST(Premises, AWeighedMassTellsAGainOfTheEfforts) {
  const World world;
  const auto weighed = [&](Interval mass) {
    Robot robot = robot_of(world);
    robot.prior["mass"] = mass;
    return commissioned(world, robot);
  };
  for (const Interval mass : {Interval{22.0, 26.0}, Interval{23.0, 25.0}, Interval{23.8, 24.3}}) {
    const Commissioning c = weighed(mass);
    EXPECT_EQ(of(c, "effort_gain").verdict, Verdict::holds) << of(c, "effort_gain").detail;
    EXPECT_TRUE(c.little.why.empty()) << c.message;
    EXPECT_EQ(c.model.warrant, core::Warrant::guaranteed) << failing(c);
  }
  const Commissioning vague = weighed({12.0, 48.0});
  EXPECT_EQ(of(vague, "effort_gain").verdict, Verdict::not_tested) << of(vague, "effort_gain").detail;
  for (const Interval mass : {Interval{26.0, 28.0}, Interval{24.6, 26.0}}) {
    const Commissioning c = weighed(mass);
    EXPECT_EQ(of(c, "effort_gain").verdict, Verdict::fails) << of(c, "effort_gain").detail;
    EXPECT_NE(c.model.warrant, core::Warrant::guaranteed);
  }
}

TEST(Premises, ARobotThatMostlyTurnsWithoutAGyroMayHaveAMirroredWheel) {
  World world;
  world.turns = true;
  Robot unseen = robot_of(world);
  unseen.wheel_directions_checked = false;
  const Commissioning c = commissioned(world, unseen);
  EXPECT_EQ(of(c, "wheel_directions").verdict, Verdict::fails);
  EXPECT_NE(c.model.warrant, core::Warrant::guaranteed);
  EXPECT_THAT(of(c, "wheel_directions").detail, HasSubstr("wheel_directions: checked"));
  EXPECT_EQ(of(commissioned(world, robot_of(world)), "wheel_directions").verdict, Verdict::not_tested);
  world.turns = false;
  EXPECT_EQ(of(commissioned(world, unseen), "wheel_directions").verdict, Verdict::not_tested);
}

// Whatever makes sums stand out, friction, change and lengths may be it.
TEST(Premises, ErrorsThatDoNotAverageTakeTheWordGuaranteedAway) {
  World world;
  world.seconds = 30.0;
  Commissioning c = commissioned(world, robot_of(world, 0.002));
  ASSERT_EQ(c.model.warrant, core::Warrant::guaranteed) << failing(c);
  withdraw_what_averages_would_hide(c, "sums stand out");
  for (const char* id : {"friction_shape", "constant_parameters", "geometry"}) {
    EXPECT_EQ(of(c, id).verdict, Verdict::fails);
    EXPECT_THAT(of(c, id).detail, HasSubstr("sums stand out"));
  }
  EXPECT_EQ(c.model.warrant, core::Warrant::extrapolated);
  EXPECT_EQ(c.model.assumptions, c.assumptions);
}

// A command that may change anywhere between two samples of a quarter of a second.
TEST(Premises, WhereLittleIsLearntTheRemedyIsNamedWithWhatItBrings) {
  World world;
  world.rate = 4.0;
  Robot robot = robot_of(world);
  robot.effort_changes = model::EffortChanges::between;
  const Commissioning c = commissioned(world, robot);
  ASSERT_TRUE(c.has_model()) << c.message;
  ASSERT_FALSE(c.little.why.empty()) << c.message;
  EXPECT_THAT(c.message, AllOf(HasSubstr("little was learned"), HasSubstr("changes: at_samples"), HasSubstr("mass ± "),
                               HasSubstr("higher rate"), Not(HasSubstr("commissioned"))));
}

}  // namespace
}  // namespace wheelwright::commission::premises_test
