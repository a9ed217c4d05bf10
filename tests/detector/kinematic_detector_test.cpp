// SPDX-License-Identifier: Apache-2.0
#include "detector/detector.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/filter/row_stream.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::detector::kinematic_detector_test {
namespace {

using testing_support::posed_drive;
using testing_support::true_kinematics;

filter::OdometryMeasurement pose_and_angles() {
  filter::OdometryMeasurement m;
  m.motion = MotionKind::angle;
  m.motion_columns = {"phi_r", "phi_l"};
  m.position = m.heading = true;
  m.nominal_step = 0.01;
  return m;
}

// The robot of the examples with its kinematics known to 2 %.
struct Known {
  Scenario scenario = posed_drive(1, 12.0);
  Eigen::VectorXd theta = true_kinematics(scenario.robot);

  [[nodiscard]] filter::OdometryFilter filter() const {
    return {pose_and_angles(), 1.0, {.motion = 1e-3, .position = 2e-3, .heading = 3e-3}};
  }
  [[nodiscard]] ThresholdRule rule() const {
    Box box;
    for (const double value : theta) {
      box.sides.push_back({0.98 * value, 1.02 * value});
    }
    return {Polytope({}, box), theta};
  }
  [[nodiscard]] KinematicDetector detector() const { return {filter(), rule()}; }
};

std::vector<double> sample_of(const LogTable& log, std::size_t k) {
  std::vector<double> sample;
  for (const auto& name : pose_and_angles().columns()) {
    sample.push_back(log.column(name)[k]);
  }
  return sample;
}

TEST(KinematicDetector, DecidesOnTheRowsOfTheStreamBitForBit) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  TableSource source(log);
  filter::OdometryRows stream(source, known.filter());
  const RegressionBlock rows = read_all(stream);
  const ThresholdRule rule = known.rule();
  KinematicDetector detector = known.detector();
  std::size_t i = 0;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const Decision& d = detector.step(log.t[k], sample_of(log, k));
    if (!d.valid) {
      continue;
    }
    ASSERT_LT(i, rows.instants());
    ASSERT_EQ(rows.sample[i], k);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto at = static_cast<Eigen::Index>(3 * i + c);
      const auto row = static_cast<Eigen::Index>(c);
      ASSERT_EQ(detector.filter().row().Y.row(row), rows.Y.row(at));
      ASSERT_EQ(detector.filter().row().dY.row(row), rows.dY.row(at));
      ASSERT_EQ(detector.filter().row().y[row], rows.y[at]);
      ASSERT_EQ(detector.filter().row().dy[row], rows.dy[at]);
      const Threshold t = rule.at({rows.Y.row(at).data(), 4}, {rows.dY.row(at).data(), 4}, rows.dy[at], c);
      ASSERT_EQ(d.channels[c].threshold.lower, t.lower);
      ASSERT_EQ(d.channels[c].threshold.upper, t.upper);
      ASSERT_EQ(d.channels[c].outside, d.channels[c].residual < t.lower || d.channels[c].residual > t.upper);
      ASSERT_FALSE(d.channels[c].alarm);  // a healthy robot
    }
    ++i;
  }
  EXPECT_EQ(i, rows.instants());
  EXPECT_GT(i, 1000u);
}

TEST(KinematicDetector, WaitsForAWindowAfterAGap) {
  const Known known;
  const LogTable log = sim::simulate(known.scenario);
  KinematicDetector detector = known.detector();
  std::size_t first = 0;
  for (std::size_t k = 0; k < 900; ++k) {
    const double gap = k < 500 ? 0.0 : 3.0;
    const Decision& d = detector.step(log.t[k] + gap, sample_of(log, k));
    if (d.valid && k >= 500 && first == 0) {
      first = k;
    }
    if (k >= 500 && k < 599) {
      ASSERT_FALSE(d.valid || d.fault) << k;
    }
  }
  EXPECT_EQ(first, 600u);
}

TEST(KinematicDetector, WantsASetOfItsOwnParameters) {
  const Known known;
  const Box box{{{0.0, 1.0}, {0.0, 1.0}}};
  EXPECT_THROW(KinematicDetector(known.filter(), ThresholdRule(Polytope({}, box), Eigen::Vector2d(0.5, 0.5))),
               InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::kinematic_detector_test
