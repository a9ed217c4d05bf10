// SPDX-License-Identifier: Apache-2.0
#include "model/filter/noise.hpp"

#include <array>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "model/differential_drive.hpp"
#include "model/filter/regressor_filter.hpp"
#include "model/single_axis.hpp"

namespace wheelwright::filter::noise_test {
namespace {

Measurement axis(MotionKind motion) {
  Measurement m;
  m.motion = motion;
  m.motion_columns = {motion == MotionKind::angle ? "position" : "velocity"};
  m.effort_columns = {"effort"};
  m.nominal_step = 0.01;
  return m;
}

// Noise alone, sent through the filter: |row| is the error that the bounds promise to cover.
struct Worst {
  double acceleration = 0.0, speed = 0.0, effort = 0.0;
  double acceleration_square = 0.0;
  long rows = 0;
};

template <typename Draw>
Worst noise_through(const FilterDesign& design, MotionKind motion, Draw draw, int samples) {
  RegressorFilter filter(model::SingleAxis{}.model(), design, axis(motion));
  Worst worst;
  for (int k = 0; k < samples; ++k) {
    const double t = 0.01 * k;
    const std::array<double, 2> sample{k == 0 && motion == MotionKind::mean_speed ? 0.0 : draw(k), draw(k + 1000000)};
    if (!filter.step(t, sample)) {
      continue;
    }
    const auto& row = filter.row();
    worst.acceleration = std::max(worst.acceleration, std::abs(row.Y(0, 0)));
    worst.speed = std::max(worst.speed, std::abs(row.Y(0, 1)));
    worst.effort = std::max(worst.effort, std::abs(row.y[0]));
    worst.acceleration_square += row.Y(0, 0) * row.Y(0, 0);
    ++worst.rows;
  }
  return worst;
}

TEST(WorstCaseNorms, CoverHostileNoiseAndAreNearlyReached) {
  struct Case {
    int order;
    MotionKind motion;
  };
  for (const Case c : {Case{1, MotionKind::speed}, Case{2, MotionKind::speed}, Case{2, MotionKind::angle}}) {
    const FilterDesign design{.order = c.order, .alpha = 8.0, .beta = 5.0};
    const KernelNorms norms = worst_case_norms(design, c.motion);
    Worst worst;
    // Square waves of many periods come close to the worst sign pattern of each kernel.
    for (int period = 2; period < 400; period = period * 5 / 4 + 1) {
      const Worst w = noise_through(
          design, c.motion, [&](int k) { return (k / period) % 2 == 0 ? 1.0 : -1.0; }, 3000);
      worst.acceleration = std::max(worst.acceleration, w.acceleration);
      worst.speed = std::max(worst.speed, w.speed);
      worst.effort = std::max(worst.effort, w.effort);
    }
    EXPECT_LE(worst.acceleration, norms.acceleration);
    EXPECT_LE(worst.speed, norms.speed);
    EXPECT_LE(worst.effort, norms.effort);
    EXPECT_GT(worst.acceleration, 0.7 * norms.acceleration);
    EXPECT_GT(worst.speed, 0.7 * norms.speed);
    EXPECT_GT(worst.effort, 0.7 * norms.effort);
  }
}

TEST(StatisticalNorms, AreTheStandardDeviationOfFilteredWhiteNoise) {
  for (const MotionKind motion : {MotionKind::speed, MotionKind::angle}) {
    const FilterDesign design{.order = 2, .alpha = 8.0, .beta = 5.0};
    std::mt19937_64 rng(2);
    std::normal_distribution<double> gauss;
    const Worst w = noise_through(
        design, motion, [&](int) { return gauss(rng); }, 400000);
    const double sd = std::sqrt(w.acceleration_square / static_cast<double>(w.rows));
    EXPECT_NEAR(sd / statistical_norms(design, motion, 0.01).acceleration, 1.0, 0.03);
  }
}

TEST(StatisticalNorms, ApproachTheClosedFormsForSmallSteps) {
  const double h = 1e-4;
  const FilterDesign first{.order = 1, .alpha = 8.0, .beta = 5.0};
  const KernelNorms n1 = statistical_norms(first, MotionKind::speed, h);
  EXPECT_NEAR(n1.speed / (8.0 * std::sqrt(h / 10.0)), 1.0, 1e-3);
  EXPECT_NEAR(n1.acceleration / 8.0, 1.0, 1e-3);
  const FilterDesign second{.order = 2, .alpha = 8.0, .beta = 5.0};
  const KernelNorms n2 = statistical_norms(second, MotionKind::angle, h);
  EXPECT_NEAR(n2.effort / (64.0 * std::sqrt(h / (4.0 * 125.0))), 1.0, 1e-3);
  EXPECT_NEAR(n2.speed / (64.0 * std::sqrt(h / 20.0)), 1.0, 1e-3);
  // Slopes of the smoothed kernel over its first steps: 1 − r^k (1 − r)/2 with r = e^{−2}; their differences weigh the
  // angles.
  const double r = std::exp(-2.0), first_weight = 1.0 - 0.5 * (1.0 - r);
  const double energy = first_weight * first_weight + 0.25 * std::pow(1.0 - r, 4) / (1.0 - r * r);
  EXPECT_NEAR(n2.acceleration / (64.0 * std::sqrt(energy)), 1.0, 1e-2);
}

TEST(Propagate, StatisticalBoundsAreNeverWiderThanTheWorstCase) {
  const Model model = model::SingleAxis{}.model();
  const FilterDesign design;
  const SensorErrors sensors{.motion = 1e-3, .effort = 0.1};
  const SignalErrors worst = propagate(model, design, axis(MotionKind::angle), sensors);
  const SignalErrors usual = propagate(model, design, axis(MotionKind::angle), sensors,
                                       {.mode = NoiseMode::statistical, .largest_step = 0.001});
  EXPECT_LT(usual.speed[0], worst.speed[0]);
  EXPECT_LT(usual.output[0], worst.output[0]);
  EXPECT_LE(usual.acceleration[0], worst.acceleration[0]);
}

// Squares of what a unit error of one sample leaves in all later rows, errors of the joints adding up.
TEST(NoiseGram, IsWhatUnitErrorsLeaveInTheRows) {
  const Model model = DifferentialDrive{.wheel_radius = 0.1, .track_width = 0.5}.model();
  const double h = 0.01;
  for (const MotionKind motion : {MotionKind::speed, MotionKind::angle}) {
    const FilterDesign design{.order = 2, .alpha = 8.0, .beta = 5.0};
    Measurement m;
    m.motion = motion;
    m.motion_columns = {"r", "l"};
    m.effort_columns = {"tr", "tl"};
    m.nominal_step = h;
    std::vector<Eigen::MatrixXd> of_motion(2, Eigen::MatrixXd::Zero(4, 4));
    Eigen::Vector2d of_effort = Eigen::Vector2d::Zero();
    for (std::size_t channel = 0; channel < 4; ++channel) {
      RegressorFilter filter(model, design, m);
      for (int k = 0; k < 3000; ++k) {
        std::array<double, 4> sample{};
        sample[channel] = k == 5 ? 1.0 : 0.0;
        if (!filter.step(h * k, sample)) {
          continue;
        }
        for (std::size_t i = 0; i < 2; ++i) {
          const auto row = filter.row().Y.row(static_cast<Eigen::Index>(i));
          const double y = filter.row().y[static_cast<Eigen::Index>(i)];
          of_motion[i] += row.transpose() * row;
          of_effort[static_cast<Eigen::Index>(i)] += y * y;
        }
      }
    }
    const NoiseGram gram = noise_gram(model, design, m, h);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_LE((gram.motion[i] - of_motion[i]).norm(), 1e-9 * of_motion[i].norm()) << "output " << i;
      if (motion == MotionKind::speed) {
        const auto at = static_cast<Eigen::Index>(i);
        EXPECT_NEAR(gram.effort[at], of_effort[at], 1e-9 * of_effort[at]);
      }
    }
  }
}

// The two bounds are compared as wholes: a statistical bound at a confidence of nearly one is the worst case, for a
// robot of two joints, too, whose worst cases add up in absolute values. (Comparing the norms of one joint first and
// adding squares after that was too small by √2, and 1,600 of 400,000 rows went beyond a bound that one row in 4·10⁸
// may pass.)
TEST(StatisticalNoise, OfTwoJointsIsNeverBelowWhatTheyCanDoTogether) {
  DifferentialDrive drive;
  drive.wheel_radius = 0.1;
  drive.track_width = 0.4;
  const Model model = drive.model();
  Measurement measurement;
  measurement.motion = MotionKind::speed;
  measurement.motion_columns = {"omega_r", "omega_l"};
  measurement.effort_columns = {"tau_r", "tau_l"};
  measurement.nominal_step = 0.01;
  const FilterDesign design{.order = 1, .alpha = 40.0, .beta = 40.0};
  const SensorErrors sensors{.motion = 0.02, .effort = 0.01};
  const SignalErrors worst = propagate(model, design, measurement, sensors);
  PropagationOptions sure{.mode = NoiseMode::statistical, .confidence = 1.0 - 1e-15, .rows = 1e9, .largest_step = 0.01};
  const SignalErrors bound = propagate(model, design, measurement, sensors, sure);
  EXPECT_EQ(bound.acceleration, worst.acceleration);
  EXPECT_TRUE((bound.output.array() <= worst.output.array()).all());

  // Two joints that err by ±n̄ as a coin decides: no row of 200,000 beyond a bound for all of them at 1e-6.
  sure.confidence = 1.0 - 1e-6;
  sure.rows = 2e5;
  const SignalErrors likely = propagate(model, design, measurement, sensors, sure);
  RegressorFilter filter(model, design, measurement);
  std::mt19937_64 generator(7);
  const auto coin = [&](double size) { return (generator() & 1U) != 0 ? size : -size; };
  long beyond = 0;
  for (int k = 0; k < 200000; ++k) {
    const std::array<double, 4> sample{coin(0.02), coin(0.02), coin(0.01), coin(0.01)};
    if (!filter.step(0.01 * k, sample) || k < 50) {
      continue;
    }
    beyond += std::abs(filter.row().Y(0, 0)) > likely.acceleration[0] ? 1 : 0;
    beyond += std::abs(filter.row().Y(1, 1)) > likely.acceleration[1] ? 1 : 0;
    beyond += std::abs(filter.row().y[0]) > likely.output[0] ? 1 : 0;
  }
  EXPECT_EQ(beyond, 0);
}

}  // namespace
}  // namespace wheelwright::filter::noise_test
