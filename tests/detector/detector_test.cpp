// SPDX-License-Identifier: Apache-2.0
#ifdef __SSE2__
#include <xmmintrin.h>
#endif

#include <algorithm>
#include <array>
#include <cfenv>
#include <cmath>
#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "detector/detector.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::detector::detector_test {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Random;
using testing_support::Shown;

constexpr double kStep = 0.01;

// The robot of the examples with θ known to 5 %.
struct Known {
  Scenario scenario = exact_drive(Shown::angles, Hold::first_order);
  Model model = model::make_model(scenario.robot);
  Eigen::VectorXd theta = sim::true_parameters(scenario, model);

  [[nodiscard]] ThresholdRule rule() const {
    Box box;
    for (const double value : theta) {
      box.sides.push_back({0.95 * value, 1.05 * value});
    }
    return ThresholdRule(Polytope({}, box), theta);
  }
  [[nodiscard]] TorqueDetector detector(DetectorOptions options = {}) const {
    return Detector(filter_of(scenario), rule(), std::move(options));
  }
};

filter::FilteredRow random_row(Random& random) {
  filter::FilteredRow row{core::RowMatrix(random.matrix(2, 4)), core::RowMatrix::Zero(2, 4), random.matrix(2, 1),
                          Eigen::VectorXd(2)};
  row.dY.setConstant(0.01);
  row.dy.setConstant(0.02);
  return row;
}

TEST(Detector, DecidesByTheThresholdOfItsRow) {
  const Known known;
  Random random(1);
  Detector two_sided = known.detector(), symmetric = known.detector({.test = detector::Test::symmetric});
  const ThresholdRule rule = known.rule();
  int outside = 0, two_sided_only = 0;
  for (int k = 0; k < 2000; ++k) {
    const filter::FilteredRow row = random_row(random);
    const Decision a = two_sided.decide(row), b = symmetric.decide(row);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const ChannelDecision &c = a.channels[static_cast<std::size_t>(i)], &d = b.channels[static_cast<std::size_t>(i)];
      const Threshold t = rule.at({row.Y.row(i).data(), 4}, {row.dY.row(i).data(), 4}, row.dy[i]);
      EXPECT_NEAR(c.residual, row.y[i] - row.Y.row(i).dot(known.theta), 1e-13);
      EXPECT_EQ(c.threshold.lower, t.lower);
      EXPECT_EQ(c.threshold.upper, t.upper);
      EXPECT_EQ(c.outside, c.residual < t.lower || c.residual > t.upper);
      EXPECT_EQ(c.dead_zone, c.outside ? std::abs(c.residual) : 0.0);
      EXPECT_EQ(d.outside, std::abs(d.residual) > t.rho());
      EXPECT_EQ(d.dead_zone, d.outside ? std::abs(d.residual) : 0.0);
      EXPECT_TRUE(c.outside || !d.outside);  // two-sided is never less sensitive
      EXPECT_EQ(c.alarm, c.outside);         // 1 of 1
      outside += c.outside ? 1 : 0;
      two_sided_only += c.outside && !d.outside ? 1 : 0;
    }
    EXPECT_EQ(a.fault, a.channels[0].alarm || a.channels[1].alarm);
  }
  EXPECT_GT(outside, 100);
  EXPECT_GT(two_sided_only, 0);
}

TEST(Detector, ConstantThresholdsAreThoseOfTheSecondResidualFunction) {
  const Known known;
  Random random(2);
  Detector detector = known.detector({.test = detector::Test::symmetric, .mu = Eigen::Vector2d(0.5, 0.0)});
  for (int k = 0; k < 500; ++k) {
    const filter::FilteredRow row = random_row(random);
    const Decision& d = detector.decide(row);
    for (std::size_t i = 0; i < 2; ++i) {
      const double mu = i == 0 ? 0.5 : 0.0, size = std::abs(d.channels[i].residual);
      EXPECT_EQ(d.channels[i].threshold.rho(), mu);
      EXPECT_EQ(d.channels[i].dead_zone, size > mu ? size : 0.0);
    }
  }
}

TEST(Detector, AlarmsPersistInTheirChannel) {
  const Known known;
  Random random(3);
  Detector detector = known.detector({.persistence = Persistence{.k = 2, .n = 3}});
  std::array<std::deque<bool>, 2> windows;
  for (int k = 0; k < 2000; ++k) {
    const Decision& d = detector.decide(random_row(random));
    for (std::size_t i = 0; i < 2; ++i) {
      windows[i].push_back(d.channels[i].outside);
      if (windows[i].size() > 3) {
        windows[i].pop_front();
      }
      ASSERT_EQ(d.channels[i].alarm, std::count(windows[i].begin(), windows[i].end(), true) >= 2);
    }
  }
}

// Steps through rows [first, last) of a log of angles, shifted by `shift` in time.
Decision walk(TorqueDetector& detector, const LogTable& log, std::size_t first, std::size_t last, double shift,
              std::size_t* invalid = nullptr) {
  Decision d;
  for (std::size_t k = first; k < last; ++k) {
    const std::array sample{log.column("phi_r")[k], log.column("phi_l")[k], log.column("tau_r")[k],
                            log.column("tau_l")[k]};
    d = detector.step(log.t[k] + shift, sample);
    if (invalid != nullptr) {
      *invalid += d.valid ? 0 : 1;
    }
  }
  return d;
}

void expect_same(const Decision& a, const Decision& b) {
  ASSERT_TRUE(a.valid && b.valid);
  for (std::size_t i = 0; i < a.channels.size(); ++i) {
    EXPECT_EQ(a.channels[i].residual, b.channels[i].residual);
    EXPECT_EQ(a.channels[i].threshold.lower, b.channels[i].threshold.lower);
    EXPECT_EQ(a.channels[i].threshold.upper, b.channels[i].threshold.upper);
  }
}

TEST(Detector, RestartsAtAGap) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  // Times are moved by whole multiples of a power of two, which leaves their differences as they are to rounding.
  Detector through = known.detector(), after = known.detector(), uninterrupted = known.detector();
  walk(through, log, 0, 700, 0.0);
  std::size_t invalid = 0;
  const Decision a = walk(through, log, 700, 1400, 8.0, &invalid);
  expect_same(a, walk(after, log, 700, 1400, 8.0));
  EXPECT_GT(invalid, 100u);  // 12/β of settling at 100 Hz and β = 8, in the middle of a drive
  walk(uninterrupted, log, 0, 700, 0.0);
  invalid = 0;
  walk(uninterrupted, log, 700, 1400, 0.7 * kStep, &invalid);
  EXPECT_EQ(invalid, 0u);  // a slow step
  walk(uninterrupted, log, 0, 700, 100.0);
  invalid = 0;
  walk(uninterrupted, log, 700, 1400, 100.0 + kStep, &invalid);
  EXPECT_GT(invalid, 0u);  // a row is missing: the effort in between is not known
  EXPECT_LT(invalid, 100u);
}

TEST(Detector, RestartsWhereTimeGoesBackAndWhenItIsTold) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  Detector back = known.detector(), told = known.detector(), fresh = known.detector();
  const Decision expected = walk(fresh, log, 0, 600, 0.0);
  walk(back, log, 0, 900, 0.0);
  expect_same(walk(back, log, 0, 600, 0.0), expected);
  walk(told, log, 0, 300, 0.0);
  told.restart();
  expect_same(walk(told, log, 0, 600, 0.0), expected);
}

// Samples that are no numbers are as if they had never come: the detector is neither blind nor mistaken afterwards.
TEST(Detector, ASampleThatIsNoNumberIsLost) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  Detector without = known.detector(), with = known.detector();
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinite = std::numeric_limits<double>::infinity();
  std::size_t valid = 0;
  for (std::size_t k = 0; k < 1400; ++k) {
    std::array sample{log.column("phi_r")[k], log.column("phi_l")[k], log.column("tau_r")[k], log.column("tau_l")[k]};
    const bool storm = k >= 700 && k < 702, alone = k % 311 == 310;
    double t = log.t[k];
    if (storm || alone) {
      (k % 5 == 4 ? t : sample[k % 4]) = k % 2 == 0 ? nan : -infinite;
      const Decision& lost = with.step(t, sample);
      EXPECT_FALSE(lost.valid || lost.fault) << k;
      continue;
    }
    const Decision expected = without.step(t, sample);
    const Decision& found = with.step(t, sample);
    ASSERT_EQ(found.valid, expected.valid) << k;
    ASSERT_EQ(found.fault, expected.fault) << k;
    if (found.valid) {
      expect_same(found, expected);
      ++valid;
    }
  }
  EXPECT_GT(valid, 700u);
}

// A client may have set another rounding mode, or (linked with fast-math) have denormals flushed to zero.
TEST(Detector, RoundingOfItsCallerChangesDigitsOnly) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  const auto said = [&] {
    Detector detector = known.detector();
    std::vector<Interval> all;  // residual and half the threshold's width
    for (std::size_t k = 0; k < 1400; ++k) {
      const std::array sample{log.column("phi_r")[k], log.column("phi_l")[k], log.column("tau_r")[k],
                              log.column("tau_l")[k]};
      const Decision& d = detector.step(log.t[k], sample);
      for (std::size_t i = 0; d.valid && i < d.channels.size(); ++i) {
        all.push_back({d.channels[i].residual, 0.5 * d.channels[i].threshold.width()});
      }
    }
    return all;
  };
  const std::vector<Interval> usual = said();
  ASSERT_GT(usual.size(), 1000u);
  const auto compare = [&](const std::vector<Interval>& other, const char* mode) {
    ASSERT_EQ(other.size(), usual.size()) << mode;
    for (std::size_t k = 0; k < usual.size(); ++k) {
      ASSERT_NEAR(other[k].lower, usual[k].lower, 1e-9 * usual[k].upper + 1e-13) << mode << ' ' << k;
      ASSERT_NEAR(other[k].upper, usual[k].upper, 1e-9 * usual[k].upper + 1e-13) << mode << ' ' << k;
    }
  };
  for (const auto& [mode, name] : {std::pair(FE_UPWARD, "up"), {FE_DOWNWARD, "down"}, {FE_TOWARDZERO, "to zero"}}) {
    std::fesetround(mode);
    const std::vector<Interval> other = said();
    std::fesetround(FE_TONEAREST);
    compare(other, name);
  }
#ifdef __SSE2__
  const unsigned before = _mm_getcsr();
  _mm_setcsr(before | 0x8040U);  // flush to zero, denormals are zeros
  const std::vector<Interval> other = said();
  _mm_setcsr(before);
  compare(other, "flush to zero");
#endif
}

TEST(Detector, RestartForgetsThePersistence) {
  const Known known;
  Detector detector = known.detector({.persistence = Persistence{.k = 2, .n = 2}});
  filter::FilteredRow row{core::RowMatrix::Zero(2, 4), core::RowMatrix::Zero(2, 4), Eigen::Vector2d(1.0, 0.0),
                          Eigen::Vector2d::Zero()};
  EXPECT_FALSE(detector.decide(row).fault);
  detector.restart();
  EXPECT_FALSE(detector.decide(row).fault);
  EXPECT_TRUE(detector.decide(row).fault);
}

TEST(Detector, ANumberThatIsNoneIsNoHealth) {
  const Known known;
  Detector detector = known.detector();
  filter::FilteredRow row{core::RowMatrix::Zero(2, 4), core::RowMatrix::Zero(2, 4), Eigen::Vector2d::Zero(),
                          Eigen::Vector2d::Zero()};
  row.y[0] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(detector.decide(row).fault);
}

TEST(Detector, MisuseIsRefused) {
  const Known known;
  EXPECT_THROW(known.detector({.mu = Eigen::Vector3d::Ones()}), InvalidArgument);
  EXPECT_THROW(known.detector({.mu = Eigen::Vector2d(1.0, -1.0)}), InvalidArgument);
  EXPECT_THROW(known.detector({.mu = Eigen::Vector2d(1.0, std::nan(""))}), InvalidArgument);
  EXPECT_THROW(known.detector({.persistence = Persistence{.k = 2, .n = 1}}), InvalidArgument);
  Box box;
  box.sides = {{0.0, 1.0}};
  EXPECT_THROW(Detector(filter_of(known.scenario), ThresholdRule(Polytope({}, box), Eigen::VectorXd::Zero(1))),
               InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::detector_test
