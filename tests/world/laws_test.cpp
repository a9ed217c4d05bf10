// SPDX-License-Identifier: Apache-2.0
// Each law against its closed form, and every effect under every law in the world.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "core/error.hpp"
#include "tests/world/case.hpp"

namespace wheelwright::reality::laws_test {
namespace {

constexpr double step = 1e-3;

TEST(Lugre, SteadyMotionFollowsItsStribeckCurve) {
  const auto level = [](double speed) { return 1.0 + 0.7 * std::exp(-speed * speed / 0.04); };
  for (const double speed : std::vector<double>{0.01, 0.1, 0.3, 2.0, -0.2, -5.0}) {
    Friction friction = lugre(level, 300.0, 2.0);
    double force = 0.0;
    for (int k = 0; k < 20000; ++k) {
      force = friction(speed, step);
    }
    EXPECT_NEAR(force, std::copysign(level(std::abs(speed)), speed), 1e-9) << speed;
  }
}

TEST(Lugre, IsASpringOnPresliding) {
  Friction friction = lugre([](double) { return 1.0; }, 300.0, 0.0);
  const double moved = 1e-5;
  EXPECT_NEAR(friction(moved / step, step), 300.0 * moved, 0.01 * 300.0 * moved);
}

// With exponent 1 the closed loop of amplitude X has the area 4 c (X − tanh(kX)/k), k = σ/c.
TEST(Dahl, LoopAreaIsTheClosedForm) {
  const double c = 2.0;
  const double k = 40.0;
  const double amplitude = 0.03;
  Friction friction = dahl(c, k * c, 1.0);
  double area = 0.0;
  double last = 0.0;
  constexpr int turn = 40000;
  for (int n = 0; n < 4 * turn; ++n) {
    const double phase = 2.0 * std::numbers::pi * n / turn;
    const double next = phase + 2.0 * std::numbers::pi / turn;
    const double moved = amplitude * (std::sin(next) - std::sin(phase));
    const double force = friction(moved / step, step);
    area += n >= 3 * turn ? 0.5 * (force + last) * moved : 0.0;
    last = force;
  }
  EXPECT_NEAR(area, 4.0 * c * (amplitude - std::tanh(k * amplitude) / k), 1e-6);
}

TEST(Dahl, DoesNotDependOnTheStep) {
  for (const double exponent : std::vector<double>{0.5, 1.0, 1.5}) {
    Friction once = dahl(1.0, 50.0, exponent);
    Friction often = dahl(1.0, 50.0, exponent);
    for (const double speed : std::vector<double>{3.0, -7.0, 1.0}) {
      const double whole = once(speed, 0.01);
      double force = 0.0;
      for (int k = 0; k < 10; ++k) {
        force = often(speed, 0.001);
      }
      EXPECT_NEAR(force, whole, 1e-12) << exponent;
      EXPECT_LE(std::abs(whole), 1.0);
    }
  }
}

TEST(PlayOperator, WidthIsTwiceItsHalf) {
  PlayOperator play{0.2};
  EXPECT_DOUBLE_EQ(play(1.0), 0.8);
  EXPECT_DOUBLE_EQ(play(0.7), 0.8) << "still within";
  EXPECT_DOUBLE_EQ(play(0.6), 0.8) << "just met";
  EXPECT_DOUBLE_EQ(play(0.5), 0.7);
  // The loop between ±1 encloses 2·half times the way of the output.
  double area = 0.0;
  double last = 0.0;
  for (int n = 0; n < 8000; ++n) {
    const double input = std::sin(2.0 * std::numbers::pi * n / 4000.0);
    const double before = play.state;
    const double output = play(input);
    area += n >= 4000 ? 0.5 * (input + last) * (output - before) : 0.0;
    last = input;
  }
  EXPECT_NEAR(area, 2.0 * 0.2 * 2.0 * 0.8, 1e-3);
}

TEST(MagicFormula, PeakAndSlope) {
  const MagicFormula formula{8.0, 1.6, 3.0, 0.0};
  const double peak = std::tan(std::numbers::pi / (2.0 * formula.c)) / formula.b;
  EXPECT_NEAR(formula(peak), formula.d, 1e-12);
  EXPECT_LT(formula(1.1 * peak), formula.d);
  EXPECT_LT(formula(0.9 * peak), formula.d);
  EXPECT_NEAR(formula(1e-6) / 1e-6, formula.b * formula.c * formula.d, 1e-3);
  EXPECT_DOUBLE_EQ(formula(-0.05), -formula(0.05));
}

TEST(BrushTyre, SlidesAtThreeTimesLimitOverStiffness) {
  const BrushTyre tyre{20.0, 3.0};
  EXPECT_NEAR(tyre(1e-6) / 1e-6, 20.0, 1e-3);
  EXPECT_NEAR(tyre(0.45), 3.0, 1e-12);
  EXPECT_LT(tyre(0.44), 3.0);
  EXPECT_DOUBLE_EQ(tyre(-2.0), -3.0);
}

// A free rotor between stops on a heavy wheel: each impact leaves e of the relative speed.
TEST(Gear, ImpactsLeaveTheirRestitutionAndKeepMomentum) {
  Gear gear{0.02, 0.5, 0.1, 0.4};
  gear.speed = 1.0;
  double wheel = 0.0;
  int impacts = 0;
  for (int k = 0; k < 60; ++k) {
    const double before = gear.speed - wheel;
    const double passed = gear.step(0.0, wheel, 0.0, step);
    wheel += step * passed / gear.wheel;
    EXPECT_NEAR(0.1 * gear.speed + 0.4 * wheel, 0.1, 1e-12);
    EXPECT_LE(std::abs(gear.offset), 0.01 + 1e-12);
    if (passed != 0.0) {
      ++impacts;
      EXPECT_NEAR((gear.speed - wheel) / before, -0.5, 1e-9);
    }
  }
  EXPECT_GE(impacts, 2);
}

TEST(Gear, AtRestAgainstTheStopBothAccelerateAlike) {
  Gear gear{0.02, 0.0, 0.1, 0.4};
  double wheel = 0.0;
  for (int k = 0; k < 2000; ++k) {
    wheel += step * gear.step(1.0, wheel, 0.0, step) / gear.wheel;
  }
  EXPECT_NEAR(gear.offset, 0.01, 1e-12);
  EXPECT_NEAR(gear.speed, wheel, 1e-3);
  EXPECT_NEAR(0.1 * gear.speed + 0.4 * wheel, 1.0 * 2000 * step, 1e-9) << "momentum";
}

TEST(Table, IsLinearBetweenKnotsAndConstantOutside) {
  const Table table{{0.0, 1.0, 3.0}, {2.0, 4.0, 0.0}};
  EXPECT_DOUBLE_EQ(table(-1.0), 2.0);
  EXPECT_DOUBLE_EQ(table(0.5), 3.0);
  EXPECT_DOUBLE_EQ(table(2.0), 2.0);
  EXPECT_DOUBLE_EQ(table(9.0), 0.0);
}

TEST(Laws, AtLeastThreeOfEveryEffectThatHasSeveralAndAtMostOneIsTheFormula) {
  std::map<std::string_view, int> other, formula;
  std::set<std::pair<std::string_view, std::string_view>> names;
  for (const Law& law : laws()) {
    EXPECT_EQ(find_entry(law.effect).name, law.effect);
    EXPECT_TRUE(names.emplace(law.effect, law.name).second) << law.effect << " " << law.name;
    ++(law.formula ? formula : other)[law.effect];
  }
  for (const auto& [effect, count] : other) {
    EXPECT_GE(count, 3) << effect;
    EXPECT_LE(formula[effect], 1) << effect;
  }
  EXPECT_EQ(friction_laws().size() + drive_laws().size(), laws().size());
}

TEST(Laws, AreChosenByName) {
  EXPECT_TRUE(LawChoice("given").able().empty());
  EXPECT_EQ(LawChoice("all").able().size(), laws().size());
  EXPECT_EQ(LawChoice("coulomb/dahl,pacejka").able().size(), 2U);
  const LawChoice other("other");
  for (const Law* law : other.able()) {
    EXPECT_FALSE(law->formula);
  }
  const LawChoice dahl("dahl");
  EXPECT_EQ(dahl.draw("coulomb", Random(1, 2, 3))->name, "dahl");
  EXPECT_EQ(dahl.draw("slope", Random(1, 2, 3)), nullptr);
  EXPECT_THROW(LawChoice("catapult"), InvalidArgument);
}

TEST(Laws, AreDrawnEvenly) {
  const LawChoice all("all");
  std::map<std::string_view, int> drawn;
  for (std::uint64_t k = 0; k < 600; ++k) {
    ++drawn[all.draw("coulomb", Random(1, k, 1000))->name];
  }
  EXPECT_EQ(drawn.size(), 6U);
  for (const auto& [name, count] : drawn) {
    EXPECT_GT(count, 60) << name;
  }
}

// By the properties that the families promise, of many draws, and by the bend of chords.
TEST(Increasing, RisesFromNothingToOneWithItsBendAndNoSteeperThanFour) {
  using Bend = Increasing::Bend;
  double least = 1.0;
  double most = 0.0;
  for (std::uint64_t k = 0; k < 300; ++k) {
    const Bend bend = std::array{Bend::any, Bend::convex, Bend::concave}[k % 3];
    Random random(11, k, 0);
    const Increasing curve(random, bend);
    EXPECT_DOUBLE_EQ(curve(0.0), 0.0);
    EXPECT_NEAR(curve(1.0), 1.0, 1e-12);
    EXPECT_GT(curve(1.5), curve(1.0));
    constexpr int pieces = 500;
    double before = 0.0;
    double rise_before = 0.0;
    for (int n = 1; n <= pieces; ++n) {
      const double value = curve(static_cast<double>(n) / pieces);
      const double rise = value - before;
      EXPECT_GT(rise, 0.0) << k << " at " << n;
      // A cubic between two lines is at most one and a half times as steep as they are.
      EXPECT_LE(rise * pieces, (bend == Bend::any ? 6.0 : 4.0) + 1e-9) << k << " at " << n;
      if (n > 1 && bend != Bend::any) {
        EXPECT_GE(bend == Bend::convex ? rise - rise_before : rise_before - rise, -1e-12) << k << " at " << n;
      }
      before = value;
      rise_before = rise;
    }
    least = std::min(least, curve(0.5));
    most = std::max(most, curve(0.5));
  }
  EXPECT_LT(least, 0.25) << "the family is wide";
  EXPECT_GT(most, 0.75);
}

TEST(DrawnLaws, OneForEveryEffectThatHasSeveralAndNoneElse) {
  std::set<std::string_view> several, drawn;
  for (const Law& law : laws()) {
    several.insert(law.effect);
  }
  for (const Law& law : drawn_laws()) {
    EXPECT_TRUE(drawn.insert(law.effect).second) << law.effect;
    EXPECT_EQ(std::count_if(laws().begin(), laws().end(), [&](const Law& other) { return &other == &law; }), 0);
  }
  EXPECT_EQ(drawn, several);
  EXPECT_EQ(LawChoice("drawn").able().size(), drawn.size());
}

struct World {
  World() {
    Random draws(3, 0, 1);
    robot = draw_robot(draws, Lot());
    // A whole drive has every manoeuvre; its first seconds are enough to see that a law acts.
    drive = draw_drive(robot, draws, 20.0);
  }
  [[nodiscard]] Gap gap(const Subject& subject, double severity, double width = step) const {
    std::vector<Effect> effects;
    effects.push_back(subject.make(robot, Random(5, 0, 9), severity));
    return measure_gap(robot, signals_of(robot, run_world(robot, effects, drive, width)), 20.0);
  }
  RobotDesign robot;
  Drive drive;
};

TEST(Subjects, EveryLawActsOnTheRobot) {
  const World world;
  const std::vector<Subject> all = subjects();
  EXPECT_GE(all.size(), 60U);
  for (const Subject& subject : all) {
    const std::string name =
        fmt::format("{}/{}", subject.entry->name, subject.law != nullptr ? subject.law->name : "given");
    const Gap gap = world.gap(subject, std::min(2.0, subject.entry->largest));
    EXPECT_GT(gap.before, 1.0) << name << ": the healthy robot has 0.06";
    EXPECT_LT(gap.after, 100.0) << name << ": it would be no such robot";
  }
}

TEST(DrawnLaws, EachActsAndNoTwoDrawsAreAlike) {
  const World world;
  for (const Law& law : drawn_laws()) {
    const Subject subject{&find_entry(law.effect), &law};
    const double severity = std::min(1.0, subject.entry->largest);
    std::vector<double> gaps;
    for (std::uint64_t draw = 0; draw < 2; ++draw) {
      std::vector<Effect> effects;
      effects.push_back(subject.make(world.robot, Random(5, draw, 9), severity));
      const Record record = run_world(world.robot, effects, world.drive, step);
      const Gap gap = measure_gap(world.robot, signals_of(world.robot, record), 20.0);
      EXPECT_GT(gap.before, 0.5) << law.effect << ": the healthy robot has 0.06";
      EXPECT_LT(gap.after, 100.0) << law.effect << ": it would be no such robot";
      gaps.push_back(gap.before);
    }
    EXPECT_GT(std::abs(gaps[1] / gaps[0] - 1.0), 1e-3) << law.effect;
  }
}

// Bristles, teeth and tyres have states of their own that are faster than the world's step. The engine's sliding
// contacts do not converge so (16 and 11 per cent on this robot): their stiffness goes with the step.
TEST(Subjects, FastLawsConvergeWithTheStep) {
  const World world;
  const LawChoice fast(
      "coulomb/lugre,coulomb/dahl,stribeck/lugre,caster_drag/bristle,lateral_scrub/bristle,second_order,joint_limits,"
      "restitution,backlash/play,hunt_crossley,pacejka");
  for (const Law* law : fast.able()) {
    const Subject subject{&find_entry(law->effect), law};
    const double coarse = world.gap(subject, 1.0).before;
    const double fine = world.gap(subject, 1.0, 0.5 * step).before;
    EXPECT_NEAR(coarse / fine, 1.0, 0.03) << law->effect << " " << law->name;
  }
}

// The teeth and the tyre of drawn laws have fast states of their own, too.
TEST(DrawnLaws, ConvergeWithTheStep) {
  const World world;
  for (const Law& law : drawn_laws()) {
    const Subject subject{&find_entry(law.effect), &law};
    const double severity = std::min(1.0, subject.entry->largest);
    EXPECT_NEAR(world.gap(subject, severity).before / world.gap(subject, severity, 0.5 * step).before, 1.0, 0.05)
        << law.effect;
  }
}

TEST(Robot, TheWideLotHasSmallAndLargeOnesThatDrive) {
  double least = 1e9;
  double most = 0.0;
  for (std::uint64_t k = 0; k < 60; ++k) {
    Random random(3, k, 1);
    const RobotDesign robot = draw_robot(random, {0.5, 500.0, 1.0, true});
    const double total = robot.body.chassis_mass + 2.0 * robot.body.wheel_mass;
    least = std::min(least, total);
    most = std::max(most, total);
    EXPECT_NE(robot.body.radius[right], robot.radius);
  }
  EXPECT_GT(least, 0.5);
  EXPECT_LT(least, 2.0);
  EXPECT_GT(most, 150.0);
  EXPECT_LT(most, 500.0);
  for (const double total : {0.55, 450.0}) {
    Random random(3, 0, 1);
    const RobotDesign robot = draw_robot(random, {total, 1.001 * total, 1.0, false});
    std::vector<Effect> nothing;
    const Record record = run_world(robot, nothing, draw_drive(robot, random, 20.0), step);
    EXPECT_LT(measure_gap(robot, signals_of(robot, record), 20.0).after, 1.0) << total << " kg, healthy";
  }
}

TEST(Case, LawsChangeNoOtherDraw) {
  Request request;
  request.seed = 3;
  request.duration = 50.0;
  request.effect = "caster_drag";
  const Case given = make_case(request, 2);
  request.laws = LawChoice("swivel");
  const Case other = make_case(request, 2);
  ASSERT_NE(other.causes[0].of.law, nullptr);
  EXPECT_EQ(given.baseline.columns, other.baseline.columns);
  EXPECT_NE(given.real.columns, other.real.columns);
  EXPECT_NEAR(other.causes[0].after / other.gap.after, 1.0, 0.35) << "alone on a part of the drive, and in the case";
}

}  // namespace
}  // namespace wheelwright::reality::laws_test
