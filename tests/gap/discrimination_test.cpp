// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "commission/design/stages.hpp"
#include "core/error.hpp"
#include "gap/effects/effect.hpp"
#include "gap/next/discrimination_design.hpp"
#include "gap/next/further_drive.hpp"
#include "gap/rows/block_gram.hpp"
#include "gap/rows/drive.hpp"
#include "tests/design/robots.hpp"

namespace wheelwright::gap::discrimination_test {

using design::DesignSubject;

namespace {

using testing_support::small_robot;

DesignSubject subject(double step = 0.02) {
  Robot robot = small_robot();
  robot.hold = Hold::first_order;
  robot.noise.position.value = 0.004;
  robot.noise.heading.value = 0.01;
  return design::subject_of(robot, step);
}

design::MotionLimits limits(double duration = 8.0) {
  design::MotionLimits l = design::limits_of(small_robot());
  l.duration = duration;
  l.radius = 2.0;
  return l;
}

// A motion from functions of time.
template <typename Speed>
design::Plan plan_of_speeds(const DesignSubject& s, double duration, const Speed& speed) {
  design::Plan plan;
  plan.step = s.step;
  const auto n = static_cast<Eigen::Index>(std::lround(duration / s.step)) + 1;
  plan.speed.resize(2, n);
  plan.acceleration = Eigen::MatrixXd::Zero(2, n);
  for (Eigen::Index k = 0; k < n; ++k) {
    plan.speed.col(k) = speed(plan.t(k));
  }
  for (Eigen::Index k = 1; k + 1 < n; ++k) {
    plan.acceleration.col(k) = (plan.speed.col(k + 1) - plan.speed.col(k - 1)) / (2.0 * s.step);
  }
  design::integrate_pose(plan, s.model);
  return plan;
}

Rival rival(const std::string& effect, std::vector<double> coefficients, std::vector<double> shape = {}) {
  return {{{effect, std::move(coefficients), std::move(shape)}}};
}

const Effect& effect_of(const std::vector<Effect>& catalogue, const std::string& name) {
  return *std::ranges::find(catalogue, name, &Effect::name);
}

PlannedNoise torque_only(const DesignSubject& s) {
  PlannedNoise noise = expected_noise(s);
  noise.pose = {};
  return noise;
}

TEST(PlannedDrive, EffortsObeyTheModel) {
  const DesignSubject s = subject();
  const design::StageFamily family(s, limits(), 2);
  const Drive drive = planned_drive(family.plan(std::vector{0.9, 0.6, 0.5, 0.1, 0.7, 0.2}, s.step), s);
  for (const Eigen::Index k : {0, 40, 77, 150, 333}) {
    const std::vector speed{drive.coordinates[0].speed[k], drive.coordinates[1].speed[k]};
    const std::vector acceleration{drive.coordinates[0].smooth_acceleration[k],
                                   drive.coordinates[1].smooth_acceleration[k]};
    const std::vector<double> zero(2, 0.0), joint{drive.joints[0].speed[k], drive.joints[1].speed[k]};
    const Eigen::VectorXd left =
        drive.model.input * Eigen::Vector2d(drive.joints[0].effort[k], drive.joints[1].effort[k]);
    const Eigen::VectorXd right =
        model::regressor(drive.model, {speed, zero, joint, zero, drive.heading[k], 0.0}, acceleration) * s.theta;
    EXPECT_NEAR((left - right).norm(), 0.0, 1e-12 * (1.0 + right.norm()));
  }
  EXPECT_TRUE(drive.joints[0].resting[0]);  // the 0.1 s before it begins
  EXPECT_FALSE(drive.joints[0].resting[200] && drive.joints[1].resting[200]);
  EXPECT_TRUE(drive.has_pose());
}

// Dry friction at one speed is viscous friction, which θ takes up; at two speeds u and w, n rows each, what is left of
// a constant g beside a column (u, w) is S = g² n (u − w)²/(u² + w²), and Δ = S/τ with τ the sum of the correlations.
TEST(Discrimination, DryFrictionAtOneSpeedAndAtTwo) {
  const DesignSubject s = subject(0.05);
  const PlannedNoise noise = torque_only(s);
  const double c = 0.1, u = 0.3, w = 0.6, half = 200.0;
  // A scrubbing moment is no match for it on a straight line: its column is zero there.
  const std::vector<Rival> rivals{rival("coulomb", {c}), rival("lateral_scrub", {0.1}, {0.01})};
  const auto one =
      discrimination(planned_drive(plan_of_speeds(s, 2.0 * half, [&](double) { return Eigen::Vector2d(u, 0.0); }), s),
                     rivals, effect_catalogue(), noise);
  EXPECT_LT(one[0].excess, 1e-12);
  const auto two = discrimination(
      planned_drive(plan_of_speeds(s, 2.0 * half, [&](double t) { return Eigen::Vector2d(t < half ? u : w, 0.0); }), s),
      rivals, effect_catalogue(), noise);
  const double n = half / s.step, g = 2.0 * c / noise.output[0];
  const double excess = g * g * n * (u - w) * (u - w) / (u * u + w * w);
  EXPECT_NEAR(two[0].excess / excess, 1.0, 0.01);  // transients: of the order of 1/(β · 200 s)
  const double bh = noise.beta * s.step, a = std::exp(-bh);
  const double tau = 1.0 + 2.0 * a / (1.0 - a) + 2.0 * bh * a / ((1.0 - a) * (1.0 - a));
  EXPECT_NEAR(two[0].delta * tau / excess, 1.0, 0.01);
  EXPECT_NEAR(tau * bh / 4.0, 1.0, 0.02);  // N rows count for N βh/4
}

TEST(Discrimination, NothingTellsARivalFromItself) {
  const DesignSubject s = subject();
  const design::StageFamily family(s, limits(), 2);
  const Drive drive = planned_drive(family.plan(std::vector{0.9, 0.6, 0.5, 0.1, 0.7, 0.2}, s.step), s);
  const std::vector<Effect> catalogue = effect_catalogue();
  for (const char* name : {"coulomb", "delay", "torque_deadzone", "wheel_radius_asymmetric"}) {
    const Rival same = typical_rival({name}, catalogue, drive);
    for (const RivalSeparation& pair : discrimination(drive, {same, same}, catalogue, expected_noise(s))) {
      EXPECT_LT(pair.share, 1e-12) << name;
      EXPECT_LT(pair.deviations(), 1e-6) << name;
    }
  }
}

TEST(Discrimination, LagIsDelayInSlowMotionOnly) {
  const DesignSubject s = subject(0.01);
  const std::vector<Rival> rivals{rival("actuator_lag", {}, {0.03}), rival("delay", {}, {0.03})};
  const auto share_at = [&](double w) {
    // Several frequencies: at a single one inertia and friction take up any phase.
    const design::Plan plan = plan_of_speeds(s, 12.0, [w](double t) {
      const double window = std::pow(std::sin(std::numbers::pi * t / 12.0), 4);
      return Eigen::Vector2d(0.2 * window * (std::sin(w * t) + std::sin(2.9 * w * t)),
                             0.3 * window * (std::sin(1.3 * w * t) + std::sin(3.7 * w * t)));
    });
    return discrimination(planned_drive(plan, s), rivals, effect_catalogue(), torque_only(s))[0].share;
  };
  const double slow = share_at(1.0), fast = share_at(12.0);
  EXPECT_LT(slow, 1e-3);
  EXPECT_GT(fast, 30.0 * slow);
}

// Noise as assumed on top of the true rival's rows: the sum of squares decides as often as promised.
TEST(Discrimination, DecidesAtThePromisedRate) {
  const DesignSubject s = subject();
  const std::vector<Effect> catalogue = effect_catalogue();
  PlannedNoise noise = torque_only(s);
  const design::StageFamily family(s, limits(16.0), 3);
  const Drive drive = planned_drive(family.plan(std::vector{0.9, 0.6, 0.5, 0.1, 0.7, 0.2, 0.8, 0.1, 0.4}, s.step), s);
  std::vector<Rival> rivals{rival("coulomb", {0.1}), rival("caster_drag", {1.0}, {0.2, 0.002})};
  double deviations = discrimination(drive, rivals, catalogue, noise)[0].deviations();
  ASSERT_GT(deviations, 0.0);
  const double size = 0.1 / deviations;  // so that it is one deviation
  rivals[0].causes[0].coefficients[0] = size;
  const RivalSeparation promise = discrimination(drive, rivals, catalogue, noise)[0];
  EXPECT_NEAR(promise.deviations(), 1.0, 1e-6);
  RecordProperty("d", 1);

  // The caster at the distance that imitates best.
  const Column truth = effect_of(catalogue, "coulomb").columns(drive, {})[0];
  const Column other = effect_of(catalogue, "caster_drag").columns(drive, promise.shape)[0];
  const auto regressor = filtered_regressor(drive, noise.beta);
  const Mask used = moving(drive, noise.beta);
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal;
  const auto masked = [&](const Eigen::VectorXd& x) {
    return x.size() > 0 ? Eigen::VectorXd(used.select(x.array(), 0.0).matrix()) : Eigen::VectorXd();
  };
  const double whole = noise.output[0] / std::sqrt(noise.beta * s.step / 4.0);  // white noise before the filter
  constexpr int kTrials = 300;
  int right = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<RowSpace> spaces(2);
    for (std::size_t i = 0; i < 2; ++i) {
      RowSpace& space = spaces[i];
      space.t = drive.t;
      space.floor = noise.output[i];
      const Eigen::VectorXd white = Eigen::VectorXd::NullaryExpr(drive.rows(), [&] { return normal(generator); });
      const double scale = whole * noise.output[i] / noise.output[0];
      space.response =
          masked(size * filtered(drive, noise.beta, truth.effort[i]) + scale * filtered(drive, noise.beta, white));
      for (const auto& of_parameter : regressor) {
        space.columns.push_back(masked(of_parameter[i]));
      }
      space.columns.push_back(masked(filtered(drive, noise.beta, truth.effort[i])));
      space.columns.push_back(masked(filtered(drive, noise.beta, other.effort[i])));
    }
    const BlockGram gram(spaces, {.blocks = 4, .purge = 0.0});
    const double of_truth = gram.fit({.columns = {0, 1, 2, 3, 4}}).mean_square;
    const double of_other = gram.fit({.columns = {0, 1, 2, 3, 5}}).mean_square;
    right += of_truth < of_other ? 1 : 0;
  }
  const double p = promise.probability(), rate = static_cast<double>(right) / kTrials;
  EXPECT_NEAR(rate, p, 3.0 * std::sqrt(p * (1.0 - p) / kTrials));
}

TEST(Discrimination, RefusesWhatCannotBeCompared) {
  const DesignSubject s = subject();
  const design::StageFamily family(s, limits(), 2);
  const Drive drive = planned_drive(family.plan(std::vector{0.9, 0.6, 0.5, 0.1, 0.7, 0.2}, s.step), s);
  const std::vector<Effect> catalogue = effect_catalogue();
  const PlannedNoise noise = expected_noise(s);
  const Rival good = rival("coulomb", {0.1});
  EXPECT_THROW((void)discrimination(drive, {good}, catalogue, noise), InvalidArgument);
  EXPECT_THROW((void)discrimination(drive, {good, rival("gremlins", {1.0})}, catalogue, noise), InvalidArgument);
  EXPECT_THROW((void)discrimination(drive, {good, rival("delay", {1.0}, {0.1})}, catalogue, noise), InvalidArgument);
  EXPECT_THROW((void)discrimination(drive, {good, rival("delay", {}, {NAN})}, catalogue, noise), InvalidArgument);
  PlannedNoise silent = noise;
  silent.output[1] = 0.0;
  EXPECT_THROW((void)discrimination(drive, {good, rival("delay", {}, {0.1})}, catalogue, silent), InvalidArgument);
}

design::DesignOptions quick() {
  design::DesignOptions options;
  options.stages = 3;
  options.samples = 30;
  options.descents = 2;
  options.steps = 60;
  options.coarse_step = 0.04;
  return options;
}

TEST(DiscriminationDesign, WhatNoMotionSeparatesIsNamed) {
  const DesignSubject s = subject();
  const std::vector<Effect> catalogue = effect_catalogue();
  // Beside a θ that is fitted anew, mass added and torque constants lost are both nothing.
  const DiscriminationDesign design = design_for_discrimination(
      s, limits(), {rival("payload", {1.0, 0.05}), rival("torque_gain", {0.05})}, catalogue, torque_only(s), quick());
  ASSERT_EQ(design.inseparable.size(), 1U);
  EXPECT_TRUE(design.inseparable[0].by_any_motion);
  EXPECT_NE(design.inseparable[0].measurement.find("scales"), std::string::npos);
  EXPECT_FALSE(design.worst());
}

TEST(DiscriminationDesign, ASpecialCaseIsNoRival) {
  const DesignSubject s = subject();
  const DiscriminationDesign design =
      design_for_discrimination(s, limits(), {rival("coulomb", {0.1}), rival("coulomb_asymmetric", {0.1, 0.1})},
                                effect_catalogue(), torque_only(s), quick());
  ASSERT_EQ(design.inseparable.size(), 1U);
  EXPECT_TRUE(design.inseparable[0].special_case);
}

TEST(DiscriminationDesign, GainsOnTheDriveThatWasAnalysed) {
  const DesignSubject s = subject();
  const std::vector<Rival> rivals{rival("actuator_lag", {}, {0.03}), rival("delay", {}, {0.03})};
  // A gentle drive of the same length.
  Drive gentle = planned_drive(
      plan_of_speeds(s, 8.0, [](double t) { return Eigen::Vector2d(0.3 * std::sin(t), 0.4 * std::sin(1.7 * t)); }), s);
  const DiscriminationDesign design =
      design_for_discrimination(s, limits(), rivals, effect_catalogue(), torque_only(s), quick(), &gentle);
  ASSERT_EQ(design.analysed.size(), design.promised.size());
  for (std::size_t k = 0; k < design.analysed.size(); ++k) {
    EXPECT_GT(design.promised[k].deviations(), design.analysed[k].deviations());
  }
}

TEST(SlowDiscriminationDesign, BeatsTheFigureEightAndRandomManoeuvres) {
  const DesignSubject s = subject();
  const std::vector<Effect> catalogue = effect_catalogue();
  const PlannedNoise noise = torque_only(s);
  const design::MotionLimits within = limits();
  const design::StageFamily family(s, within, 3);
  const Drive typical = planned_drive(family.plan(std::vector<double>(family.dimension(), 0.8), s.step), s);
  const std::vector<std::pair<const char*, const char*>> pairs{
      {"coulomb", "caster_drag"}, {"viscous_asymmetric", "torque_gain_asymmetric"}, {"actuator_lag", "delay"}};
  for (const auto& [a, b] : pairs) {
    const std::vector<Rival> rivals{typical_rival({a}, catalogue, typical), typical_rival({b}, catalogue, typical)};
    const DiscriminationDesign design = design_for_discrimination(s, within, rivals, catalogue, noise, quick());
    ASSERT_TRUE(design.worst()) << a;
    const double mine = design.promised[*design.worst()].deviations();
    EXPECT_NEAR(mine, -design.manoeuvre.objective, 1e-9 * mine);
    EXPECT_LE(design.manoeuvre.use.largest(), 1.0);
    const design::PlanObjective objective = tell_apart(s, rivals, catalogue, noise, design.decidable);
    ASSERT_TRUE(design.figure_eight_plan);
    EXPECT_GT(mine, -objective(*design.figure_eight_plan)) << a;
    std::mt19937_64 generator(99);
    std::uniform_real_distribution<double> uniform;
    for (int k = 0; k < 10; ++k) {
      std::vector<double> x(family.dimension());
      std::generate(x.begin(), x.end(), [&] { return uniform(generator); });
      EXPECT_GE(mine, -objective(family.plan(x, s.step))) << a;
    }
    EXPECT_GE(design.stages.size(), 2U);
    EXPECT_FALSE(design.sentences.empty());
  }
}

}  // namespace
}  // namespace wheelwright::gap::discrimination_test
