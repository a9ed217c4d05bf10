// SPDX-License-Identifier: Apache-2.0
#include "model/filter/odometry_filter.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/filter/row_stream.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::filter::odometry_filter_test {
namespace {

using testing_support::Random;

constexpr double kStep = 0.01;

// [r_R, r_L, c_R, c_L, b]: wheels of unlike size, and yaw gains that are no r/D.
const Eigen::VectorXd kTruth = Eigen::Vector<double, 5>(0.101, 0.097, 0.26, 0.25, 0.03);

OdometryMeasurement all_outputs(MotionKind motion = MotionKind::angle) {
  OdometryMeasurement m;
  m.motion = motion;
  m.motion_columns = motion == MotionKind::angle ? std::vector<std::string>{"phi_r", "phi_l"}
                                                 : std::vector<std::string>{"omega_r", "omega_l"};
  m.position = m.heading = m.gyro = true;
  m.nominal_step = kStep;
  return m;
}

struct State {
  double t = 0.0, x = 0.0, y = 0.0, theta = 0.0, right = 0.0, left = 0.0;
};

// One arc with constant wheel speeds, in closed form.
State after_arc(const State& s, double right, double left, double h) {
  const double v = 0.5 * (kTruth[0] * right + kTruth[1] * left), w = kTruth[2] * right - kTruth[3] * left;
  const double half = 0.5 * w * h;
  const double chord = v * h * (std::abs(half) < 1e-9 ? 1.0 : std::sin(half) / half);
  return {s.t + h,
          s.x + chord * std::cos(s.theta + half),
          s.y + chord * std::sin(s.theta + half),
          s.theta + w * h,
          s.right + right * h,
          s.left + left * h};
}

double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

// The table of a drive of arcs, each one step long: what the wheels do in step k is `speeds(k)`.
template <typename Speeds>
LogTable arcs(std::size_t rows, Speeds speeds, bool wrap = false) {
  LogTable log;
  log.names = {"phi_r", "phi_l", "x", "y", "theta", "gyro_z"};
  log.columns.resize(6);
  State s{.t = 2.0, .x = -3.0, .y = 7.0, .theta = 1.0};
  double turned = 0.0;  // ∫ gyro dt by the trapezoidal rule is made to be the true angle and the bias
  double gyro = 0.0;
  for (std::size_t k = 0; k < rows; ++k) {
    log.t.push_back(s.t);
    const std::array values{s.right, s.left, s.x, s.y, wrap ? wrapped(s.theta) : s.theta, gyro};
    for (std::size_t c = 0; c < values.size(); ++c) {
      log.columns[c].push_back(values[c]);
    }
    const auto [right, left] = speeds(k);
    const State next = after_arc(s, right, left, kStep);
    turned = next.theta - s.theta + kTruth[4] * kStep;
    gyro = 2.0 * turned / kStep - gyro;
    s = next;
  }
  return log;
}

std::array<double, 2> varied(std::size_t k) {
  const double t = static_cast<double>(k) * kStep;
  return {4.0 * std::sin(0.7 * t) + 2.0 * std::cos(2.1 * t), 4.0 * std::sin(0.7 * t + 0.4) - 2.5 * std::cos(1.3 * t)};
}

RegressionBlock rows_of(const LogTable& log, OdometryFilter filter, std::size_t block_rows = 4096) {
  TableSource source(log, block_rows);
  OdometryRows stream(source, std::move(filter));
  return read_all(stream);
}

TEST(OdometryFilter, IsExactOnArcs) {
  const LogTable log = arcs(1500, varied, true);  // headings wrapped
  const RegressionBlock rows = rows_of(log, {all_outputs(), 1.0});
  ASSERT_EQ(rows.instants(), 1400u);
  EXPECT_LT((rows.y - rows.Y * kTruth).cwiseAbs().maxCoeff(), 2e-12);
  EXPECT_GT(rows.y.cwiseAbs().maxCoeff(), 0.3);
}

TEST(OdometryFilter, ShowsAStraightLineAndASpinAsTheyAre) {
  const LogTable straight = arcs(101, [](std::size_t) { return std::array{3.0 * kTruth[3], 3.0 * kTruth[2]}; });
  const RegressionBlock line = rows_of(straight, {all_outputs(), 1.0});
  ASSERT_EQ(line.instants(), 1u);
  const double right = 3.0 * kTruth[3], left = 3.0 * kTruth[2];
  EXPECT_NEAR(line.y[0], 0.5 * (kTruth[0] * right + kTruth[1] * left), 1e-12);  // longitudinal, in 1 s
  EXPECT_NEAR(line.y[1], 0.0, 1e-12);                                           // lateral
  EXPECT_NEAR(line.y[2], 0.0, 1e-12);                                           // yaw
  EXPECT_LT((line.Y.row(1)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(line.Y(0, 0), 0.5 * right, 1e-12);
  EXPECT_NEAR(line.Y(2, 3), -left, 1e-12);
  EXPECT_EQ(line.Y(3, 4), line.t[0] - straight.t[0]);

  const LogTable spin = arcs(101, [](std::size_t) { return std::array{kTruth[1], -kTruth[0]}; });
  const RegressionBlock turn = rows_of(spin, {all_outputs(), 1.0});
  EXPECT_NEAR(turn.y[0], 0.0, 1e-12);
  EXPECT_NEAR(turn.y[1], 0.0, 1e-12);
  EXPECT_NEAR(turn.y[2], kTruth[2] * kTruth[1] + kTruth[3] * kTruth[0], 1e-12);
}

// The same sums, made anew for each window.
TEST(OdometryFilter, RunningSumsAreThoseOfEachWindowAlone) {
  const LogTable log = arcs(600, varied);
  const RegressionBlock rows = rows_of(log, {all_outputs(), 0.5});
  const auto &phi_r = log.column("phi_r"), &phi_l = log.column("phi_l"), &theta = log.column("theta");
  for (std::size_t i = 0; i < rows.instants(); i += 7) {
    const std::size_t k = rows.sample[i], k0 = k - 50;
    Eigen::Vector2d right = Eigen::Vector2d::Zero(), left = Eigen::Vector2d::Zero();
    for (std::size_t j = k0; j < k; ++j) {
      const double half = 0.5 * (theta[j + 1] - theta[j]), psi = 0.5 * (theta[j + 1] + theta[j]) - theta[k0];
      const Eigen::Vector2d mean = std::sin(half) / half * Eigen::Vector2d(std::cos(psi), std::sin(psi));
      right += 0.5 * mean * (phi_r[j + 1] - phi_r[j]);
      left += 0.5 * mean * (phi_l[j + 1] - phi_l[j]);
    }
    const auto at = static_cast<Eigen::Index>(4 * i);
    for (Eigen::Index c = 0; c < 2; ++c) {
      ASSERT_NEAR(rows.Y(at + c, 0), right[c], 1e-13);
      ASSERT_NEAR(rows.Y(at + c, 1), left[c], 1e-13);
    }
    ASSERT_EQ(rows.Y(at + 2, 2), phi_r[k] - phi_r[k0]);
    ASSERT_EQ(rows.Y(at + 2, 3), -(phi_l[k] - phi_l[k0]));
  }
}

// A drive whose wheels speed up and slow down within steps, integrated finely; true angles and poses at the stamps.
struct Fine {
  std::vector<State> states;                               // at the stamps
  std::vector<std::array<std::array<double, 2>, 2>> unit;  // over each step, per wheel: ∫ (cos θ, sin θ) dφ
  double acceleration = 0.0;
};

Fine fine_drive(std::size_t rows, double step) {
  constexpr int kParts = 400;
  Fine f;
  State s{.theta = 0.4};
  const auto speed = [](double t) { return std::array{4.0 * std::sin(1.7 * t) + 2.0, 3.0 * std::cos(2.3 * t) + 2.0}; };
  f.acceleration = 6.9;  // 3·2.3 and 4·1.7
  for (std::size_t k = 0; k < rows; ++k) {
    f.states.push_back(s);
    f.unit.push_back({});
    for (int i = 0; i < kParts; ++i) {
      const double h = step / kParts;
      const auto [right, left] = speed(s.t + 0.5 * h);
      const State next = after_arc(s, right, left, h);
      const double middle = 0.5 * (s.theta + next.theta);
      const std::array by{right * h, left * h};
      for (std::size_t w = 0; w < 2; ++w) {
        f.unit.back()[w][0] += std::cos(middle) * by[w];
        f.unit.back()[w][1] += std::sin(middle) * by[w];
      }
      s = next;
    }
  }
  return f;
}

// For every window, the regressor that the true headings and angles give in the *measured* frame lies within dY, and
// the pose within dy.
void expect_bounds_hold(MotionKind motion, double step, OdometryErrors errors, std::uint64_t seed, double least_use) {
  const Fine f = fine_drive(400, step);
  errors.acceleration = f.acceleration;
  errors.yaw_gain = kTruth[2];
  OdometryMeasurement m = all_outputs(motion);
  m.gyro = false;
  m.nominal_step = step;
  const std::size_t window = 50;
  OdometryFilter filter(m, static_cast<double>(window) * step, errors);
  Random random(seed);
  const auto extreme = [&](double bound) { return random.unit() < 0.5 ? bound : -bound; };
  std::vector<double> heading;
  double most = 0.0;
  for (std::size_t k = 0; k < f.states.size(); ++k) {
    const State& s = f.states[k];
    heading.push_back(s.theta + extreme(errors.heading));
    std::array<double, 2> wheels{s.right + extreme(errors.motion), s.left + extreme(errors.motion)};
    if (motion == MotionKind::speed) {
      wheels = {4.0 * std::sin(1.7 * s.t) + 2.0 + extreme(errors.motion),
                3.0 * std::cos(2.3 * s.t) + 2.0 + extreme(errors.motion)};
    }
    const std::array sample{wheels[0], wheels[1], s.x + extreme(errors.position), s.y + extreme(errors.position),
                            heading[k]};
    if (!filter.step(s.t, sample)) {
      continue;
    }
    const std::size_t k0 = k - window;
    const double c = std::cos(heading[k0]), n = std::sin(heading[k0]);
    const auto turn_back = [&](double x, double y) { return Eigen::Vector2d(c * x + n * y, c * y - n * x); };
    const FilteredRow& row = filter.row();
    std::array<std::array<double, 2>, 2> sum{};
    for (std::size_t j = k0; j < k; ++j) {
      for (std::size_t w = 0; w < 2; ++w) {
        sum[w][0] += f.unit[j][w][0];
        sum[w][1] += f.unit[j][w][1];
      }
    }
    const State& begin = f.states[k0];
    const Eigen::Vector2d true_y = turn_back(s.x - begin.x, s.y - begin.y);
    for (Eigen::Index i = 0; i < 2; ++i) {
      for (Eigen::Index w = 0; w < 2; ++w) {
        const auto& of_wheel = sum[static_cast<std::size_t>(w)];
        const double off = std::abs(row.Y(i, w) - 0.5 * turn_back(of_wheel[0], of_wheel[1])[i]);
        ASSERT_LE(off, row.dY(i, w)) << "output " << i << ", wheel " << w << ", sample " << k;
        most = std::max(most, off / row.dY(i, w));
      }
      ASSERT_LE(std::abs(row.y[i] - true_y[i]), row.dy[i]);
      ASSERT_LE(row.dy[i], 2.0 * std::numbers::sqrt2 * errors.position + 1e-12);
    }
    ASSERT_LE(std::abs(row.Y(2, 2) - (s.right - begin.right)), row.dY(2, 2));
    ASSERT_LE(std::abs(row.Y(2, 3) + (s.left - begin.left)), row.dY(2, 3));
    ASSERT_LE(std::abs(row.y[2] - (s.theta - begin.theta)), row.dy[2]);
  }
  EXPECT_GT(most, least_use);  // not vacuous
}

TEST(OdometryFilter, BoundsHoldForTheWorstNoiseOfEachSensor) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    expect_bounds_hold(MotionKind::angle, 0.01, {.motion = 2e-3}, seed, 0.02);
    expect_bounds_hold(MotionKind::angle, 0.01, {.heading = 5e-3}, seed, 0.05);
    expect_bounds_hold(MotionKind::angle, 0.01, {.motion = 2e-3, .position = 2e-3, .heading = 5e-3}, seed, 0.02);
  }
}

TEST(OdometryFilter, BoundsHoldForWhatHappensWithinAStep) {
  expect_bounds_hold(MotionKind::angle, 0.01, {}, 1, 0.02);
  expect_bounds_hold(MotionKind::angle, 0.05, {}, 1, 0.02);
}

TEST(OdometryFilter, BoundsHoldForSpeeds) {
  // |ω̈| <= 15.9 rad/s²: the trapezoidal rule misses 15.9 h²/12 rad/s at most, which a bound on speeds has to hold.
  expect_bounds_hold(MotionKind::speed, 0.01, {.motion = 0.02 + 15.9 * 1e-4 / 12.0, .heading = 2e-3}, 2, 0.01);
}

TEST(OdometryFilter, AnEstimatedBoundStandsAlone) {
  const LogTable log = arcs(300, varied);
  OdometryErrors errors{.motion = 1e-3, .position = 1e-3, .heading = 1e-3};
  errors.estimated = Eigen::Vector4d(0.5, 0.0, 0.25, 0.125);
  const RegressionBlock rows = rows_of(log, {all_outputs(), 1.0, errors});
  for (Eigen::Index k = 0; k < rows.rows(); k += 4) {
    ASSERT_EQ(rows.dy[k], 0.5);
    ASSERT_EQ(rows.dY.row(k).cwiseAbs().maxCoeff(), 0.0);
    ASSERT_GT(rows.dY.row(k + 1).maxCoeff(), 0.0);
    ASSERT_EQ(rows.dy[k + 2], 0.25);
    ASSERT_EQ(rows.dy[k + 3], 0.125);
  }
}

TEST(OdometryFilter, WindowsEndAtTheSampleAndBeginNearestToTheirLength) {
  OdometryFilter filter(all_outputs(), 0.5);
  Random random(3);
  std::vector<double> times;
  double t = 10.0;
  for (int k = 0; k < 400; ++k) {
    times.push_back(t);
    const bool valid = filter.step(t, std::array{0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
    if (valid) {
      EXPECT_EQ(filter.window_end(), t);
      double nearest = times.front();
      for (const double other : times) {
        nearest = std::abs(t - other - 0.5) < std::abs(t - nearest - 0.5) ? other : nearest;
      }
      ASSERT_EQ(filter.window_start(), nearest);
      ASSERT_EQ(filter.row().Y(3, 4), t - nearest);
    } else {
      ASSERT_LT(t - times.front(), 0.5);
    }
    t += kStep * (0.7 + 0.6 * random.unit());
  }
}

TEST(OdometryFilter, NeverLooksAcrossAGap) {
  LogTable log = arcs(600, varied);
  log.segment_starts = {0, 317};
  for (std::size_t k = 317; k < log.rows(); ++k) {
    log.t[k] += 4.0;
    log.column("x")[k] += 100.0;
  }
  TableSource source(log, 50);
  OdometryRows stream(source, {all_outputs(), 1.0});
  RegressionBlock block;
  std::size_t instants = 0;
  while (stream.next(block)) {
    instants += block.instants();
    ASSERT_TRUE(block.rows() == 0 || (block.y - block.Y * kTruth).cwiseAbs().maxCoeff() < 2e-12);
  }
  EXPECT_EQ(instants, 217u + 183u);

  OdometryFilter filter(all_outputs(), 1.0);
  std::vector<double> sample;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    if (k == log.segment_starts[1]) {
      filter.restart();
    }
    sample.clear();
    for (const std::string& name : filter.measurement().columns()) {
      sample.push_back(log.column(name)[k]);
    }
    if (filter.step(log.t[k], sample)) {
      ASSERT_NEAR(log.t[k] - filter.window_start(), 1.0, 1e-9);
    }
  }
}

TEST(OdometryFilter, DoesNotDependOnHowALogIsCut) {
  const LogTable log = arcs(700, varied);
  const RegressionBlock whole = rows_of(log, {all_outputs(), 1.0}), cut = rows_of(log, {all_outputs(), 1.0}, 13);
  EXPECT_EQ(whole.sample, cut.sample);
  EXPECT_EQ(whole.Y, cut.Y);
  EXPECT_EQ(whole.dY, cut.dY);
  EXPECT_EQ(whole.y, cut.y);
  EXPECT_EQ(whole.dy, cut.dy);
}

// Hours later a window is as good as in the beginning.
TEST(OdometryFilter, DoesNotDriftOverALongLog) {
  OdometryFilter filter(all_outputs(), 0.2);
  State s;
  double gyro = 0.0, most = 0.0;
  for (std::size_t k = 0; k < 300000; ++k) {
    const std::array sample{s.right, s.left, 0.0, 0.0, wrapped(s.theta), gyro};
    if (filter.step(s.t, sample) && k > 299900) {
      const FilteredRow& row = filter.row();
      most = std::max(most, std::abs(row.y[2] - row.Y.row(2).dot(kTruth)));
      // A circle, driven round for an hour: its chord over the window, per unit of radius.
      const double half = 0.5 * (kTruth[2] * 30.0 - kTruth[3] * 20.0) * (filter.window_end() - filter.window_start());
      const double length = std::hypot(row.Y(0, 0), row.Y(1, 0)), arc = 0.5 * row.Y(2, 2);
      most = std::max(most, std::abs(length - arc * std::sin(half) / half));
    }
    const double t = s.t;
    s = after_arc(s, 30.0, 20.0, kStep);
    s.t = t + kStep;
  }
  EXPECT_GT(most, 0.0);
  EXPECT_LT(most, 2e-10);  // what the sample's own times, angles and headings of 10⁴ to 10⁵ can hold
}

// Wheels in closed form, φ = a sin(ωt): the gyro samples what they make, wrong by up to its bound and steadily biased.
TEST(OdometryFilter, ADeclaredGyroIsBoundedAtEveryRate) {
  double used = 0.0;
  for (const double rate : {10.0, 50.0, 500.0}) {
    for (const double uneven : {0.0, 0.4}) {
      SCOPED_TRACE(std::to_string(rate) + " Hz, uneven by " + std::to_string(uneven));
      Random random(static_cast<unsigned>(rate) + (uneven > 0.0 ? 1U : 0U));
      OdometryMeasurement m = all_outputs();
      m.position = m.heading = false;
      m.nominal_step = 1.0 / rate;
      const Eigen::Vector3d truth = kTruth.tail(3);
      const double fast = 2.0, slow = 1.3, reach = 3.0;  // rad/s, rad/s, rad
      OdometryErrors errors;
      errors.gyro = 0.02;
      errors.acceleration = reach * fast * fast;
      errors.yaw_gain = std::max(truth[0], truth[1]);
      OdometryFilter filter(m, 1.0, errors);
      std::size_t rows = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(20.0 * rate); ++k) {
        const double t = (static_cast<double>(k) + uneven * 0.5 * random.symmetric()) / rate;
        const double right = reach * std::sin(fast * t), left = reach * std::cos(slow * t);
        const double turning =
            truth[0] * reach * fast * std::cos(fast * t) + truth[1] * reach * slow * std::sin(slow * t);
        const std::array sample{right, left, turning + truth[2] + errors.gyro * (random.unit() < 0.9 ? 1.0 : -1.0)};
        if (filter.step(t, sample)) {
          const FilteredRow& row = filter.row();
          const double off = std::abs(row.y[0] - row.Y.row(0).dot(truth));
          EXPECT_LE(off, row.dy[0] + row.dY.row(0).dot(truth.cwiseAbs()));
          used = std::max(used, off / row.dy[0]);
          ++rows;
        }
      }
      EXPECT_GT(rows, static_cast<std::size_t>(15.0 * rate));
    }
  }
  EXPECT_GT(used, 0.3);  // the bound is not idle
}

TEST(OdometryFilter, MeanSpeedsAreIntegratedBackToAngles) {
  const LogTable truth = arcs(402, varied);
  LogTable log;
  log.names = {"omega_r", "omega_l", "theta"};
  log.columns.resize(3);
  const auto &r = truth.column("phi_r"), &l = truth.column("phi_l"), &theta = truth.column("theta");
  for (std::size_t k = 1; k + 1 < truth.rows(); ++k) {  // differences over the interval around the stamp
    log.t.push_back(truth.t[k]);
    log.columns[0].push_back(0.5 * (r[k + 1] - r[k - 1]) / kStep);
    log.columns[1].push_back(0.5 * (l[k + 1] - l[k - 1]) / kStep);
    log.columns[2].push_back(theta[k]);
  }
  OdometryMeasurement m = all_outputs(MotionKind::mean_speed);
  m.position = m.gyro = false;
  const RegressionBlock rows = rows_of(log, {m, 1.0});
  for (std::size_t i = 0; i < rows.instants(); ++i) {
    const std::size_t k = rows.sample[i] + 1, k0 = k - 100;
    const auto mean = [](const std::vector<double>& x, std::size_t at) {
      return 0.25 * (x[at - 1] + 2.0 * x[at] + x[at + 1]);
    };
    ASSERT_NEAR(rows.Y(static_cast<Eigen::Index>(i), 0), mean(r, k) - mean(r, k0), 1e-12);
  }
}

TEST(OdometryFilter, AHeldPoseCountsWhereItIsNew) {
  LogTable log = arcs(900, varied);
  for (const char* name : {"x", "y", "theta"}) {
    auto& column = log.column(name);
    for (std::size_t k = 0; k < column.size(); ++k) {
      column[k] = column[k - k % 10];
    }
  }
  log.names.pop_back();
  log.columns.pop_back();
  TableSource source(log);
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  Measurement torque;
  const auto found = find_odometry(source, robot, model::make_model(robot), torque);
  ASSERT_TRUE(found.has_value());
  EXPECT_TRUE(found->held_pose);
  const RegressionBlock rows = rows_of(log, {*found, 1.0});
  EXPECT_EQ(rows.instants(), 80u);                                            // one in ten
  EXPECT_LT((rows.y - rows.Y * kTruth.head(4)).cwiseAbs().maxCoeff(), 2e-3);  // steps of 0.1 s are no arcs
}

TEST(OdometryFilter, FindsWhatALogHas) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  const Model model = model::make_model(robot);
  Measurement torque;
  torque.motion = MotionKind::mean_speed;
  torque.motion_columns = {"omega_r", "omega_l"};
  const auto with = [&](std::vector<std::string> names) {
    LogTable log = arcs(50, varied);
    names.insert(names.end(), {"omega_r", "omega_l"});
    log.columns.assign(names.size(), log.columns[0]);
    log.names = names;
    TableSource source(log);
    return find_odometry(source, robot, model, torque);
  };
  EXPECT_FALSE(with({"x", "y"}).has_value());
  EXPECT_EQ(with({"gyro_z"})->outputs(), (std::vector<std::string>{"gyro_yaw"}));
  EXPECT_EQ(with({"gyro_z"})->motion, MotionKind::mean_speed);
  EXPECT_EQ(with({"theta", "x"})->outputs(), (std::vector<std::string>{"yaw"}));
  EXPECT_EQ(with({"theta", "x", "y", "phi_r", "phi_l"})->motion, MotionKind::angle);
  EXPECT_EQ(with({"theta", "x", "y", "gyro_z"})->outputs(),
            (std::vector<std::string>{"longitudinal", "lateral", "yaw", "gyro_yaw"}));
  EXPECT_FALSE(with({"theta", "x", "y"})->held_pose);
}

// What a driver cuts off adds up: half of the unit in every second and of either wheel, in the direction of motion.
TEST(OdometryFilter, SpeedsThatAreCutOffAreGivenBackHalfTheirUnit) {
  constexpr double kUnit = 0.1, kWindow = 1.0;
  for (const bool down : {false, true}) {
    for (const double side : {1.0, -1.0}) {
      OdometryMeasurement m = all_outputs(MotionKind::speed);
      m.position = m.heading = false;
      OdometryFilter as_logged(m, kWindow);
      m.cut = model::SpeedCut{.unit = kUnit, .down = down};
      OdometryFilter given_back(m, kWindow);
      double turned = 0.0, worst = 0.0, least = 1.0;
      std::vector<double> angles;
      for (int k = 0; k < 500; ++k) {
        const double speed = side * (3.0 + 1.7 * std::sin(0.07 * k) + 0.9 * std::sin(0.0311 * k));
        const double cut = kUnit * (down ? std::floor(speed / kUnit) : std::trunc(speed / kUnit));
        turned += k > 0 ? kStep * speed : 0.0;
        angles.push_back(turned);
        const std::array<double, 3> sample{cut, cut, 0.0};
        const bool row = as_logged.step(kStep * k, sample);
        ASSERT_EQ(given_back.step(kStep * k, sample), row);
        if (row && k >= 100) {
          const double truth = turned - angles[static_cast<std::size_t>(k) - 100];
          worst = std::max(worst, std::abs(given_back.row().Y(0, 0) - truth));
          least = std::min(least, std::abs(as_logged.row().Y(0, 0) - truth));
        }
      }
      EXPECT_LT(worst, 0.25 * kUnit * kWindow);
      EXPECT_GT(least, 0.3 * kUnit * kWindow);
    }
  }
}

TEST(OdometryFilter, SaysWhatIsWrong) {
  EXPECT_THROW(OdometryFilter(all_outputs(), 0.0), InvalidArgument);
  EXPECT_THROW(OdometryFilter(all_outputs(), 0.015), InvalidArgument);
  EXPECT_THROW(OdometryFilter(all_outputs(), 1e6), InvalidArgument) << "times in days would fill the memory";
  EXPECT_THROW(OdometryFilter(all_outputs(), 1.0, {.heading = -1.0}), InvalidArgument);
  OdometryMeasurement none = all_outputs();
  none.position = none.heading = none.gyro = false;
  EXPECT_THROW(OdometryFilter(none, 1.0), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::filter::odometry_filter_test
