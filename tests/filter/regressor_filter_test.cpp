// SPDX-License-Identifier: Apache-2.0
#include "model/filter/row_stream.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/differential_drive.hpp"
#include "model/single_axis.hpp"
#include "tests/filter/wheel_measurement.hpp"

namespace wheelwright::filter::regressor_filter_test {
namespace {

const DifferentialDrive kRobot{.wheel_radius = 0.1, .track_width = 0.4};

// A drive in closed form: v1 = sin t + 0.4 sin 2.7t, v2 = 0.8 cos 1.3t, and the torques that (15) asks for.
struct ClosedForm {
  double m = 20.0, I = 0.9, f1 = 4.0, f3 = 0.5;

  [[nodiscard]] Eigen::Vector2d path(double t) const {
    return {-std::cos(t) - 0.4 / 2.7 * std::cos(2.7 * t), 0.8 / 1.3 * std::sin(1.3 * t)};
  }
  [[nodiscard]] Eigen::Vector2d speed(double t) const {
    return {std::sin(t) + 0.4 * std::sin(2.7 * t), 0.8 * std::cos(1.3 * t)};
  }
  [[nodiscard]] Eigen::Vector2d acceleration(double t) const {
    return {std::cos(t) + 1.08 * std::cos(2.7 * t), -1.04 * std::sin(1.3 * t)};
  }
  [[nodiscard]] Eigen::Vector2d torque(double t) const {
    const Eigen::Vector2d a = acceleration(t), v = speed(t);
    const double r = kRobot.wheel_radius, l = kRobot.lever_arm();
    const double sum = r * (m * a[0] + f1 * v[0]);
    const double difference = r * (I * a[1] + f3 * v[1]) / l;
    return {0.5 * (sum + difference), 0.5 * (sum - difference)};
  }
  [[nodiscard]] Eigen::Vector4d theta() const { return kRobot.wheel_radius * Eigen::Vector4d(m, I, f1, f3); }
};

enum class Clock { even, uneven };

LogTable drive(MotionKind motion, double h, double seconds, Clock clock) {
  const ClosedForm f;
  LogTable log;
  log.names = wheels(motion).columns();
  log.columns.resize(4);
  std::mt19937_64 rng(4);
  std::uniform_real_distribution<double> jitter(-0.4, 0.4);
  for (int k = 0; k * h < seconds; ++k) {
    const double t = (k + (clock == Clock::uneven ? jitter(rng) : 0.0)) * h;
    Eigen::Vector2d motion_now;
    if (motion == MotionKind::angle) {
      motion_now = kRobot.wheel_speed(f.path(t));
    } else if (motion == MotionKind::mean_speed) {
      motion_now = kRobot.wheel_speed((f.path(t + 0.5 * h) - f.path(t - 0.5 * h)) / h);
    } else {
      motion_now = kRobot.wheel_speed(f.speed(t));
    }
    const Eigen::Vector2d tau = f.torque(t);
    log.t.push_back(t);
    for (int j = 0; j < 2; ++j) {
      log.columns[static_cast<std::size_t>(j)].push_back(motion_now[j]);
      log.columns[static_cast<std::size_t>(j) + 2].push_back(tau[j]);
    }
  }
  return log;
}

double worst_equation_error(MotionKind motion, int order, double h, Clock clock) {
  const LogTable log = drive(motion, h, 10.0, clock);
  TableSource source(log);
  TorqueRows stream(source,
                    RegressorFilter(kRobot.model(), {.order = order, .alpha = 6.0, .beta = 6.0}, wheels(motion)));
  const RegressionBlock rows = read_all(stream);
  double worst = 0.0;
  for (std::size_t k = 0; k < rows.instants(); ++k) {
    if (rows.t[k] < 3.0) {
      continue;  // the same instants for all kinds
    }
    for (Eigen::Index i = 0; i < 2; ++i) {
      const auto row = 2 * static_cast<Eigen::Index>(k) + i;
      worst = std::max(worst, std::abs(rows.y[row] - rows.Y.row(row).dot(ClosedForm{}.theta())));
    }
  }
  return worst;
}

struct Kind {
  MotionKind motion;
  int order;
  Clock clock;
};

class FilteredRegression : public testing::TestWithParam<Kind> {};

// The only error is what friction and effort do between samples: it falls with the square of the step or faster.
TEST_P(FilteredRegression, ErrorFallsByFourWhenTheStepHalves) {
  const auto [motion, order, clock] = GetParam();
  const double coarse = worst_equation_error(motion, order, 0.02, clock);
  const double fine = worst_equation_error(motion, order, 0.0025, clock);
  EXPECT_LT(coarse, 0.02);
  EXPECT_GT(std::log2(coarse / fine) / 3.0, clock == Clock::even ? 1.94 : 1.75);
}

INSTANTIATE_TEST_SUITE_P(
    AllKinds, FilteredRegression,
    testing::Values(Kind{MotionKind::speed, 1, Clock::even}, Kind{MotionKind::speed, 2, Clock::even},
                    Kind{MotionKind::angle, 2, Clock::even}, Kind{MotionKind::mean_speed, 2, Clock::even},
                    Kind{MotionKind::speed, 1, Clock::uneven}, Kind{MotionKind::speed, 2, Clock::uneven},
                    Kind{MotionKind::angle, 2, Clock::uneven}));

TEST(TorqueRows, BatchAndStreamingGiveTheSameBits) {
  for (const MotionKind motion : {MotionKind::angle, MotionKind::mean_speed, MotionKind::speed}) {
    const LogTable log = drive(motion, 0.01, 5.0, Clock::even);
    RegressorFilter online(kRobot.model(), {}, wheels(motion));
    TableSource small(log, 7), large(log, 100000);
    TorqueRows a(small, online), b(large, online);
    const RegressionBlock rows_a = read_all(a), rows_b = read_all(b);
    ASSERT_EQ(rows_a.instants(), rows_b.instants());
    EXPECT_EQ(rows_a.Y, rows_b.Y);
    EXPECT_EQ(rows_a.y, rows_b.y);
    std::size_t next = 0;
    for (std::size_t k = 0; k < log.rows(); ++k) {
      const std::array<double, 4> sample{log.columns[0][k], log.columns[1][k], log.columns[2][k], log.columns[3][k]};
      if (online.step(log.t[k], sample)) {
        ASSERT_EQ(rows_a.sample[next], k);
        const auto at = static_cast<Eigen::Index>(2 * next);
        EXPECT_EQ(online.row().Y, core::RowMatrix(rows_a.Y.middleRows(at, 2)));
        EXPECT_EQ(online.row().y, Eigen::VectorXd(rows_a.y.segment(at, 2)));
        ++next;
      }
    }
    EXPECT_EQ(next, rows_a.instants());
  }
}

TEST(TorqueRows, NothingIsFilteredAcrossASplit) {
  const LogTable log = drive(MotionKind::speed, 0.01, 4.0, Clock::even);
  LogTable split = log;
  split.segment_starts = {0, 200};
  const LogTable second = core::slice(log, 200, log.rows());
  TableSource split_source(split), second_source(second);
  const RegressorFilter filter(kRobot.model(), {}, wheels(MotionKind::speed));
  TorqueRows a(split_source, filter), b(second_source, filter);
  const RegressionBlock rows_a = read_all(a), rows_b = read_all(b);
  const auto tail = rows_b.rows();
  EXPECT_EQ(core::RowMatrix(rows_a.Y.bottomRows(tail)), rows_b.Y);
  EXPECT_EQ(Eigen::VectorXd(rows_a.y.tail(tail)), rows_b.y);
}

TEST(RegressorFilter, FunctionTermsAreFilteredLikeTheMotion) {
  // Constant speed: Coulomb friction, viscous friction and the effort are all the same filtered constant, which is 1 up
  // to (βh)²/12 of how the kernel is interpolated.
  model::SingleAxis axis{.coulomb = true, .offset = true};
  Measurement m;
  m.motion = MotionKind::angle;
  m.motion_columns = {"position"};
  m.effort_columns = {"effort"};
  m.nominal_step = 0.01;
  RegressorFilter filter(axis.model(), {.order = 2, .alpha = 4.0, .beta = 4.0}, m);
  for (int k = 0; k <= 1000; ++k) {
    const std::array<double, 2> sample{-0.5 * 0.01 * k, 3.0};
    filter.step(0.01 * k, sample);
  }
  const double one = filter.row().Y(0, 3);
  EXPECT_NEAR(one, 1.0, 0.04 * 0.04 / 12.0);
  EXPECT_NEAR(filter.row().Y(0, 0), 0.0, 1e-12);
  EXPECT_NEAR(filter.row().Y(0, 1), -0.5 * one, 1e-12);
  EXPECT_NEAR(filter.row().Y(0, 2), -one, 1e-12);
  EXPECT_NEAR(filter.row().y[0], 3.0 * one, 1e-12);
}

TEST(RegressorFilter, SpeedlessOrderOneIsRefused) {
  EXPECT_THROW(RegressorFilter(kRobot.model(), {.order = 1, .alpha = 1.0, .beta = 1.0}, wheels(MotionKind::angle)),
               InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::filter::regressor_filter_test
