// SPDX-License-Identifier: Apache-2.0
// What StepEnclosure says of the time between two samples, against every instant of robots that plant.cpp solves
// exactly: speeds, their means, and which way wheels turn.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "model/differential_drive.hpp"
#include "model/filter/element_filter.hpp"
#include "model/single_axis.hpp"
#include "tests/guarantee/dice.hpp"
#include "tests/guarantee/plant.hpp"

namespace wheelwright::guarantee::enclosure_test {
namespace {

constexpr int kCuts = 24;           // of a step
constexpr double kAccurate = 1e-9;  // of the largest speed: what plant.cpp rounds

enum class Efforts { held, between, linear };

struct World {
  Truth truth;
  bool speeds = false;
  Efforts efforts = Efforts::held;
  double rate = 100.0;
  double reach = 1.0;   // of efforts, N·m per joint
  double smooth = 0.8;  // of an effort, what stays of the one before
  double known = 1.1;   // factor by which parameters are known, upwards and downwards
  double noise = 0.0;   // bound, rad or rad/s
  double limit = 0.0;   // rad/s² of each joint; 0: none, the dynamics only
  double effort_noise = 0.0;
};

Model model_of(const World& w) {
  const bool dry = w.truth.coulomb > 0.0;
  return w.truth.axis
             ? model::SingleAxis{.coulomb = dry}.model()
             : model::DifferentialDrive{.wheel_radius = w.truth.radius, .track_width = w.truth.track, .coulomb = dry}
                   .model();
}

filter::ElementFilter filter_of(const World& w, const Model& m) {
  const Truth& t = w.truth;
  filter::Measurement measurement;
  measurement.motion = w.speeds ? MotionKind::speed : MotionKind::angle;
  for (const model::Joint& joint : m.joints) {
    measurement.motion_columns.push_back(joint.angle);
    measurement.effort_columns.push_back(joint.torque);
  }
  measurement.hold = w.efforts == Efforts::linear ? Hold::first_order : Hold::zero_order;
  measurement.changes =
      w.efforts == Efforts::between ? model::EffortChanges::between : model::EffortChanges::at_samples;
  measurement.nominal_step = 1.0 / w.rate;
  filter::SignalErrors errors = filter::propagate(m, {.order = 2, .alpha = 5.0, .beta = 5.0}, measurement,
                                                  {.motion = w.noise, .effort = w.effort_noise});
  const double r = t.axis ? 1.0 : t.radius;
  const std::vector<double> theta =
      t.axis ? std::vector{t.mass, t.viscous_linear, t.coulomb}
             : std::vector{r * t.mass, r * t.yaw_inertia, r * t.viscous_linear, r * t.viscous_yaw, t.coulomb};
  std::vector<Interval> sides;
  for (std::size_t j = 0; j < m.p(); ++j) {
    sides.push_back({theta[j] / w.known, theta[j] * w.known});
  }
  const Eigen::VectorXd effort = errors.motion.effort;
  errors.motion = filter::motion_bound(m, sides);
  errors.motion.effort = effort;
  if (w.limit > 0.0) {
    errors.motion.mobility.resize(0, 0);
    errors.motion.limit = w.limit * m.motion.cwiseAbs().rowwise().sum();
  }
  return {m, measurement, errors};
}

struct Outcome {
  std::size_t steps = 0, known = 0;  // of the latter the direction of every wheel is told
  std::size_t reversals = 0;         // steps in which a wheel stands or turns round
  double sharpest = 0.0;             // acceleration of a joint from cut to cut, rad/s²
  std::string broken;                // the first promise
};

Outcome watch(const World& w, std::uint64_t seed, int steps = 120) {
  const Model m = model_of(w);
  filter::ElementFilter elements = filter_of(w, m);
  Dice dice(seed);
  Plant plant(w.truth);
  const std::size_t joints = m.joints.size();
  const double h = 1.0 / w.rate;
  const auto draw = [&](const Pair& last) {
    Pair next{};
    for (std::size_t j = 0; j < joints; ++j) {
      next[j] = w.smooth * last[j] + (1.0 - w.smooth) * w.reach * dice.uniform(-3.0, 3.0);
    }
    return next;
  };
  const auto motion = [&](const Pair& joint) {
    Eigen::VectorXd all(static_cast<Eigen::Index>(joints));
    for (std::size_t j = 0; j < joints; ++j) all[static_cast<Eigen::Index>(j)] = joint[j];
    return Eigen::VectorXd(m.motion * all);
  };
  const auto error = [&](double bound) { return bound * (dice.chance(0.5) ? 1.0 : -1.0); };
  Outcome outcome;
  Pair effort{}, effort_error{};
  std::vector<double> sample(2 * joints);
  std::vector<Pair> speed;  // at every cut of the last step
  for (int k = 0; k <= steps; ++k) {
    const Pair next = draw(effort);
    for (std::size_t j = 0; j < joints; ++j) {
      sample[j] = (w.speeds ? plant.speed()[j] : plant.angle()[j]) + error(w.noise);
      effort_error[j] = error(w.effort_noise);
      sample[joints + j] = (w.efforts == Efforts::held ? next[j] : effort[j]) + effort_error[j];
    }
    const bool any = elements.step(k * h, sample);
    if (any && !speed.empty() && elements.element().known) {
      const filter::StepMotion& step = elements.last_step();
      ++outcome.steps;
      Eigen::VectorXd mean = Eigen::VectorXd::Zero(step.speed.size()), moment = mean, fastest = mean;
      for (int i = 0; i < kCuts; ++i) {  // by Simpson's rule, with the speed in the middle of each pair
        const double share = (i == 0 ? 1.0 : 2.0) / (2.0 * kCuts), at = i / double(kCuts) - 0.5;
        const Eigen::VectorXd v = motion(speed[static_cast<std::size_t>(i)]);
        mean += share * v;
        moment += share * at * h * h * v;
        if (i + 1 == kCuts) {
          const Eigen::VectorXd last = motion(speed.back());
          mean += last / (2.0 * kCuts);
          moment += 0.5 * h * h * last / (2.0 * kCuts);
        }
      }
      const auto breaks = [&](const std::string& what, Eigen::Index i, double is, double bound) {
        if (is > bound && outcome.broken.empty()) {
          outcome.broken = fmt::format("{} of {} in step {}: {} > {}", what, i, k, is, bound);
        }
      };
      std::array<bool, 2> turns{};
      for (const Pair& joint : speed) {
        const Eigen::VectorXd v = motion(joint);
        fastest = fastest.cwiseMax(v.cwiseAbs());
        for (Eigen::Index c = 0; c < v.size(); ++c) {
          breaks("speed", c, std::abs(v[c] - step.speed[c]),
                 step.departure[c] + step.speed_error[c] + kAccurate * (std::abs(v[c]) + std::abs(step.speed[c])));
        }
        for (std::size_t j = 0; j < joints; ++j) {
          turns[j] = turns[j] || joint[j] * step.joint_speed[static_cast<Eigen::Index>(j)] <= 0.0;
        }
      }
      const double coarse = 0.02 / kCuts;  // of the departure: sums in place of integrals
      for (Eigen::Index c = 0; c < mean.size(); ++c) {
        const double room = coarse * (step.departure[c] + fastest[c]);
        if (w.speeds) {
          const double doubt = elements.element().motion_doubt[c] / h;
          breaks("mean", c, std::abs(mean[c] - step.speed[c]), doubt + step.speed_error[c] + room);
        } else {
          breaks("moment", c, std::abs(moment[c]), elements.element().motion_doubt[c] + room * h * h);
        }
      }
      if (w.truth.coulomb > 0.0) {
        const bool told = std::ranges::all_of(step.values, [](const model::TermValue& v) { return v.error == 0.0; });
        outcome.known += told ? 1 : 0;
        outcome.reversals += turns[0] || turns[1] ? 1 : 0;
        // Sum and difference of the signs, or the sign.
        for (std::size_t i = 0; i < step.values.size(); ++i) {
          for (const Pair& joint : speed) {
            const auto sign = [&](std::size_t j) { return double(joint[j] > 0.0) - double(joint[j] < 0.0); };
            const double arm = 0.5 * w.truth.track;
            const double is = w.truth.axis ? sign(0) : i == 0 ? sign(0) + sign(1) : arm * (sign(0) - sign(1));
            breaks("friction", static_cast<Eigen::Index>(i), std::abs(is - step.values[i].value),
                   step.values[i].error * (1.0 + kAccurate) + kAccurate);
          }
        }
      }
    }
    speed.assign(1, plant.speed());
    const double change = w.efforts == Efforts::between ? dice.uniform(0.0, 1.0) : 0.0;
    for (int i = 0; i < kCuts; ++i) {
      const double from = double(i) / kCuts;
      Pair now{}, slope{};
      for (std::size_t j = 0; j < joints; ++j) {
        const double rise = next[j] - effort[j];
        now[j] = w.efforts == Efforts::linear ? effort[j] + rise * from : from >= change ? next[j] : effort[j];
        slope[j] = w.efforts == Efforts::linear ? rise / h : 0.0;
      }
      plant.advance(h / kCuts, now, slope);
      for (std::size_t j = 0; j < joints; ++j) {
        outcome.sharpest = std::max(outcome.sharpest, std::abs(plant.speed()[j] - speed.back()[j]) * kCuts / h);
      }
      speed.push_back(plant.speed());
    }
    effort = next;
  }
  return outcome;
}

World random_world(Dice& dice) {
  World w;
  w.rate = dice.decade(10.0, 500.0);
  const double h = 1.0 / w.rate;
  Truth& t = w.truth;
  t.axis = dice.chance(0.4);
  t.mass = dice.decade(0.1, 100.0);
  const double constant = h * dice.decade(0.2, 300.0);
  t.viscous_linear = t.mass / constant;
  if (!t.axis) {
    t.radius = dice.uniform(0.03, 0.2);
    t.track = dice.uniform(0.2, 0.8);
    t.yaw_inertia = 0.25 * t.mass * t.track * t.track * dice.decade(0.1, 5.0);
    t.viscous_yaw = t.yaw_inertia / (h * dice.decade(0.2, 300.0));
  }
  w.reach = dice.decade(0.1, 10.0);
  w.smooth = dice.chance(0.3) ? 0.0 : dice.uniform(0.5, 0.98);
  if (dice.chance(0.75)) {
    t.coulomb = w.reach * dice.decade(0.05, 1.0);
  }
  w.speeds = dice.chance(0.5);
  w.efforts = dice.chance(0.6) ? Efforts::held : dice.chance(0.5) ? Efforts::between : Efforts::linear;
  w.known = 1.0 + dice.decade(1e-3, 2.0);
  const double speed = w.reach * h / (t.axis ? t.mass : t.radius * t.radius * t.mass);  // gained in a step
  w.noise = dice.chance(0.3) ? 0.0 : dice.decade(1e-4, 1.0) * speed * (w.speeds ? 1.0 : h);
  w.effort_noise = dice.chance(0.5) ? 0.0 : dice.decade(1e-4, 0.1) * w.reach;
  return w;
}

std::string words(const World& w) {
  const Truth& t = w.truth;
  return fmt::format(
      "{}, {}, efforts {}, {:.4g} Hz, m {:.4g} f {:.4g} I {:.4g} g {:.4g} r {:.4g} D {:.4g} c {:.4g}, "
      "reach {:.4g}, known to {:.4g}, noise {:.3g}",
      t.axis ? "axis" : "wheels", w.speeds ? "speeds" : "angles", static_cast<int>(w.efforts), w.rate, t.mass,
      t.viscous_linear, t.yaw_inertia, t.viscous_yaw, t.radius, t.track, t.coulomb, w.reach, w.known, w.noise);
}

TEST(Enclosure, HoldsAtEveryInstantOfRandomRobots) {
  Dice dice(20571);
  std::size_t steps = 0, reversals = 0, known = 0;
  for (std::uint64_t k = 0; k < 400; ++k) {
    const World w = random_world(dice);
    const Outcome outcome = watch(w, 1000 + k);
    EXPECT_EQ(outcome.broken, "") << "world " << k << ": " << words(w);
    steps += outcome.steps;
    reversals += outcome.reversals;
    known += outcome.known;
    if (k % 4 == 0) {  // no dynamics, but a limit on accelerations
      World limited = w;
      limited.limit = 1.5 * outcome.sharpest;
      EXPECT_EQ(watch(limited, 1000 + k).broken, "") << "world " << k << " with a limit: " << words(w);
    }
  }
  EXPECT_GT(steps, 40000u);
  EXPECT_GT(reversals, 5000u);
  EXPECT_GT(known, 10000u);
}

// Two wheels whose friction, and little else, couples them, near standstill and stiff: where a wheel may stop and go on
// within one step.
TEST(Enclosure, HoldsWhereOneWheelStopsAndGoesOnInAStep) {
  Dice dice(57);
  std::size_t reversals = 0;
  for (std::uint64_t k = 0; k < 400; ++k) {
    World w = random_world(dice);
    w.truth.axis = false;
    w.truth.radius = dice.uniform(0.05, 0.2);
    w.truth.track = 0.4;
    w.truth.yaw_inertia = 0.25 * w.truth.mass * 0.16 * dice.decade(0.05, 20.0);
    w.truth.viscous_linear = w.truth.mass * w.rate / dice.decade(0.05, 20.0);
    w.truth.viscous_yaw = w.truth.yaw_inertia * w.rate / dice.decade(0.05, 20.0);
    w.truth.coulomb = w.reach * dice.uniform(0.1, 1.0);
    w.efforts = Efforts::held;
    w.smooth = dice.uniform(0.0, 0.9);
    const Outcome outcome = watch(w, 5000 + k);
    EXPECT_EQ(outcome.broken, "") << "world " << k << ": " << words(w);
    reversals += outcome.reversals;
  }
  EXPECT_GT(reversals, 5000u);
}

// A sign is in doubt in the steps in which a wheel turns round, and in few more.
TEST(Enclosure, LeavesFewSignsInDoubtButThoseThatChange) {
  for (const bool axis : {true, false}) {
    for (const bool speeds : {true, false}) {
      for (const double rate : {20.0, 50.0, 100.0, 200.0}) {
        World w;
        w.truth = {.axis = axis,
                   .radius = 0.1,
                   .track = 0.4,
                   .mass = axis ? 0.1 : 20.0,
                   .yaw_inertia = 0.8,
                   .viscous_linear = axis ? 0.02 : 4.0,
                   .viscous_yaw = 0.4,
                   .coulomb = 0.5};
        w.speeds = speeds;
        w.rate = rate;
        w.smooth = std::exp(-4.0 / rate);
        w.reach = 1.0 / std::sqrt(1.0 - w.smooth);
        const Outcome outcome = watch(w, 3, 3000);
        EXPECT_EQ(outcome.broken, "") << words(w);
        const std::size_t in_doubt = outcome.steps - outcome.known;
        ::testing::Test::RecordProperty(fmt::format("in_doubt_{}_{}_{}", axis, speeds, rate),
                                        fmt::format("{}", in_doubt));
        EXPECT_LT(in_doubt, 3 * outcome.reversals) << words(w) << ": " << outcome.reversals << " steps with a reversal";
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::guarantee::enclosure_test
