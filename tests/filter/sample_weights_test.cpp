// SPDX-License-Identifier: Apache-2.0
// Weights of single samples, against what a sum does when that sample is moved.
#include "model/filter/sample_weights.hpp"

#include <cmath>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include "model/differential_drive.hpp"
#include "model/filter/predictable_regressor.hpp"
#include "model/single_axis.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::filter::sample_weights_test {
namespace {

using testing_support::Random;

struct Case {
  std::string name;
  bool axis = true;
  MotionKind motion = MotionKind::angle;
  Hold hold = Hold::zero_order;
  model::EffortChanges changes = model::EffortChanges::at_samples;
  double jitter = 0.0;
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

constexpr double kStep = 0.01;
constexpr std::size_t kSamples = 60;

Model model_of(const Case& c) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  return c.axis ? model::SingleAxis{}.model() : model::make_model(robot);
}

Measurement measurement_of(const Case& c, const Model& model) {
  Measurement m;
  m.motion = c.motion;
  m.hold = c.hold;
  m.changes = c.changes;
  m.nominal_step = kStep;
  m.motion_columns.resize(model.joints.size());
  m.effort_columns.resize(model.joints.size());
  return m;
}

// Any log: sums are linear in its samples, whatever they are.
struct Log {
  std::vector<double> t;
  std::vector<std::vector<double>> samples;
};

Log any_log(const Case& c, std::size_t columns, std::uint64_t seed) {
  Random random(seed);
  Log log;
  double t = 0.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    log.t.push_back(t);
    t += kStep * (1.0 + c.jitter * random.symmetric());
    std::vector<double>& sample = log.samples.emplace_back(columns);
    for (double& value : sample) {
      value = random.symmetric();
    }
  }
  return log;
}

core::RowMatrix weight_of(std::size_t element, Eigen::Index outputs, Eigen::Index sums) {
  Random random(1000 + element);
  return random.matrix(outputs, sums);
}

// Σ g (torque − Yθ), and what SampleWeights hands out.
template <typename Sink>
Eigen::VectorXd sum_of(const Case& c, const Log& log, const Eigen::VectorXd& theta, Sink&& sink) {
  constexpr Eigen::Index kSums = 3;
  const Model model = model_of(c);
  ElementFilter filter(model, measurement_of(c, model));
  SampleWeights weights(filter, {theta, Eigen::VectorXd::Zero(theta.size())}, kSums);
  WeakSummation sums(filter, kSums);
  std::size_t element = 0;
  for (std::size_t k = 0; k < log.t.size(); ++k) {
    const bool has = filter.step(log.t[k], log.samples[k]);
    if (filter.began()) {
      weights.begin();
      sums.begin();
    }
    if (has) {
      const core::RowMatrix g = weight_of(element++, static_cast<Eigen::Index>(model.n()), kSums);
      weights.take(filter, g, sink);
      sums.take(filter, g);
    }
  }
  weights.end(sink);
  return sums.sums().y - sums.sums().Y * theta;
}

class SampleWeight : public ::testing::TestWithParam<Case> {};

// Sums are linear in every sample: moving one by 1 moves them by its weight, but for rounding.
TEST_P(SampleWeight, IsByHowMuchASumMovesWithItsSample) {
  const Case& c = GetParam();
  const Model model = model_of(c);
  const std::size_t joints = model.joints.size();
  const Log log = any_log(c, 2 * joints, 7);
  Random random(3);
  const Eigen::VectorXd theta =
      Eigen::VectorXd::NullaryExpr(static_cast<Eigen::Index>(model.p()), [&] { return 1.0 + random.unit(); });
  std::map<std::pair<int, std::size_t>, std::vector<Eigen::VectorXd>> handed;
  const Eigen::VectorXd base = sum_of(c, log, theta, [&](const filter::SampleWeight& s) {
    EXPECT_TRUE(s.exact);
    handed[{static_cast<int>(s.sensor), s.joint}].push_back(s.middle);
  });
  const auto ignore = [](const filter::SampleWeight&) {};
  const auto near = [&](const Eigen::VectorXd& moved, const Eigen::VectorXd& weight, const std::string& what) {
    const double size = std::max({base.cwiseAbs().maxCoeff(), moved.cwiseAbs().maxCoeff(), 1.0});
    EXPECT_LE((moved - base - weight).cwiseAbs().maxCoeff(), 1e-11 * size) << what;
  };
  for (std::size_t j = 0; j < joints; ++j) {
    const auto& efforts = handed[{1, j}];
    const auto& motions = handed[{0, j}];
    ASSERT_GE(efforts.size(), kSamples - 3);
    for (std::size_t k = 0; k < kSamples; ++k) {
      Log other = log;
      other.samples[k][joints + j] += 1.0;
      const Eigen::VectorXd moved = sum_of(c, other, theta, ignore);
      near(moved, k < efforts.size() ? efforts[k] : Eigen::VectorXd::Zero(base.size()), fmt::format("effort {}", k));
      other = log;
      other.samples[k][j] += 1.0;
      near(sum_of(c, other, theta, ignore), k < motions.size() ? motions[k] : Eigen::VectorXd::Zero(base.size()),
           fmt::format("motion {}", k));
    }
  }
}

using enum model::EffortChanges;
INSTANTIATE_TEST_SUITE_P(
    AllKinds, SampleWeight,
    ::testing::Values(Case{"axis_held", true, MotionKind::angle, Hold::zero_order, at_samples, 0.0},
                      Case{"axis_held_uneven", true, MotionKind::angle, Hold::zero_order, at_samples, 0.2},
                      Case{"axis_linear", true, MotionKind::angle, Hold::first_order, at_samples, 0.0},
                      Case{"axis_linear_uneven", true, MotionKind::angle, Hold::first_order, at_samples, 0.2},
                      Case{"axis_smooth", true, MotionKind::angle, Hold::first_order, between, 0.0},
                      Case{"axis_smooth_uneven", true, MotionKind::angle, Hold::first_order, between, 0.2},
                      Case{"axis_speed_held", true, MotionKind::speed, Hold::zero_order, at_samples, 0.2},
                      Case{"axis_speed_linear", true, MotionKind::speed, Hold::first_order, at_samples, 0.0},
                      Case{"axis_speed_smooth", true, MotionKind::speed, Hold::first_order, between, 0.0},
                      Case{"axis_speed_smooth_uneven", true, MotionKind::speed, Hold::first_order, between, 0.2},
                      Case{"wheels_held", false, MotionKind::angle, Hold::zero_order, at_samples, 0.0},
                      Case{"wheels_held_uneven", false, MotionKind::angle, Hold::zero_order, at_samples, 0.2},
                      Case{"wheels_speed", false, MotionKind::speed, Hold::first_order, between, 0.0}),
    [](const auto& each) { return each.param.name; });

// Weights of efforts under mean speeds, whose stamps lie in the middle of the steps.
TEST(SampleWeights, OfEffortsInTheMiddleOfSteps) {
  for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
    for (const model::EffortChanges changes : {at_samples, between}) {
      if (hold == Hold::zero_order && changes == between) {
        continue;
      }
      const Case c{"mean", true, MotionKind::mean_speed, hold, changes, 0.0};
      const Log log = any_log(c, 2, 9);
      const Eigen::VectorXd theta = Eigen::Vector2d(2.0, 1.0);
      std::vector<Eigen::VectorXd> efforts;
      const Eigen::VectorXd base = sum_of(c, log, theta, [&](const filter::SampleWeight& s) {
        if (s.sensor == filter::SampleWeight::Sensor::effort) {
          efforts.push_back(s.middle);
        }
      });
      const double size = std::max(base.cwiseAbs().maxCoeff(), 1.0);
      // The first sample has no step before it: elements begin one later than for angles.
      double worst = 1e300;
      for (std::size_t shift = 0; shift <= 2; ++shift) {
        double error = 0.0;
        for (std::size_t k = 0; k + 3 < kSamples; ++k) {
          Log other = log;
          other.samples[k + shift][1] += 1.0;
          const Eigen::VectorXd moved = sum_of(c, other, theta, [](const filter::SampleWeight&) {}) - base;
          error = std::max(error, (moved - efforts[k]).cwiseAbs().maxCoeff());
        }
        worst = std::min(worst, error);
      }
      EXPECT_LE(worst, 1e-11 * size);
    }
  }
}

// A weight stays what it was, to the last digit, when a sample is moved that its element or the one before it holds, or
// one within the correlation time before these.
TEST(PredictableRegressor, DoesNotDependOnWhatItWeighs) {
  const std::vector<std::tuple<MotionKind, double>> cases{{MotionKind::angle, 0.0},
                                                          {MotionKind::angle, 0.05},
                                                          {MotionKind::speed, 0.0},
                                                          {MotionKind::speed, 0.032},
                                                          {MotionKind::mean_speed, 0.0}};
  for (const auto& [motion, correlation] : cases) {
    const Case c{"", true, motion, Hold::first_order, between, 0.0};
    const Model model = model_of(c);
    const Log log = any_log(c, 2, 5);
    // Weight of every element, and the time of the newest sample when it was taken.
    const auto weights = [&](const Log& of) {
      ElementFilter filter(model, measurement_of(c, model));
      PredictableRegressor foreseen(filter, 0.1, correlation);
      std::vector<std::pair<double, core::RowMatrix>> result;
      for (std::size_t k = 0; k < of.t.size(); ++k) {
        const bool has = filter.step(of.t[k], of.samples[k]);
        if (filter.began()) {
          foreseen.begin();
        }
        if (has) {
          foreseen.take(filter);
          result.emplace_back(filter.element().t, foreseen.value());
        }
      }
      return result;
    };
    const auto base = weights(log);
    bool any = false;
    for (std::size_t k = 5; k < kSamples; ++k) {
      Log other = log;
      other.samples[k][0] += 1.0;
      other.samples[k][1] += 1.0;
      const auto moved = weights(other);
      for (std::size_t e = 0; e < base.size(); ++e) {
        // Oldest sample that this element holds: an interval before its own.
        const double oldest = base[e].first - kStep * (motion == MotionKind::speed ? 3.0 : 1.5);
        if (log.t[k] >= oldest - correlation - 1e-9) {
          EXPECT_EQ(base[e].second, moved[e].second) << k << " " << e;
        } else {
          any = any || base[e].second != moved[e].second;
        }
      }
    }
    EXPECT_TRUE(any);
  }
}

}  // namespace
}  // namespace wheelwright::filter::sample_weights_test
