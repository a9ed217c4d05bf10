// SPDX-License-Identifier: Apache-2.0
// A constant change of both wheel radii is a fault ζ = κ·Yθ of the torque equation, κ = (1 + δ1/r)² − 1.
#include <cmath>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "detector/detector.hpp"
#include "detector/online_model.hpp"
#include "detector/threshold.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::detector::radius_fault_test {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::noisy_drive;
using testing_support::Shown;

void set_radius_fault(Scenario& s, double share) {
  s.faults = {{.kind = model::Fault::Kind::wheel_radius, .magnitude = share * s.robot.wheel_radius, .profile = {}}};
}

double kappa_of(double share) { return (1.0 + share) * (1.0 + share) - 1.0; }

// Largest |ε − κ·Y_f θ| over a noise-free drive, over the largest |κ·Y_f θ|.
double relative_error(Shown shown, Hold hold, double share, double rate) {
  Scenario s = exact_drive(shown, hold);
  s.rate = rate;
  set_radius_fault(s, share);
  const Eigen::VectorXd theta = sim::true_parameters(s, model::make_model(s.robot));
  Simulation log(s);
  TorqueRows rows(log, filter_of(s));
  const RegressionBlock block = read_all(rows);
  const Eigen::VectorXd predicted = block.Y * theta, residual = block.y - predicted;
  const Eigen::VectorXd expected = kappa_of(share) * predicted;
  return (residual - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
}

TEST(RadiusFault, GivesAResidualOfKappaTimesTheTorque) {
  for (const Shown shown : {Shown::angles, Shown::speeds}) {
    for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
      for (const double share : {0.1, -0.1, 0.02}) {
        const double coarse = relative_error(shown, hold, share, 100.0);
        EXPECT_LT(coarse, 0.02);
        // What is left is discretisation: it falls by four when the step halves, over three steps.
        EXPECT_GT(0.5 * std::log2(coarse / relative_error(shown, hold, share, 400.0)), 1.9) << share;
      }
    }
  }
}

// With a commissioned model and noisy sensors: wherever |κ| min|Y°θ| > u − l, for every θ of the set and every Y° that
// the sensors' bounds allow, the instant lies outside.
TEST(RadiusFault, IsDetectedWhereItIsCertain) {
  const Scenario healthy = noisy_drive(1, 20.0);
  Simulation learning(healthy);
  const Commissioning result = commission_robot(learning, healthy.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  for (const double share : {0.25, -0.2, 0.12, -0.1}) {
    const double kappa = std::abs(kappa_of(share));
    Scenario faulty = noisy_drive(2, 40.0);
    faulty.trajectory = {.kind = sim::Trajectory::Kind::multi_sine, .speed = 0.6, .yaw_rate = 1.2, .period = 9.0};
    set_radius_fault(faulty, share);
    Simulation log(faulty);
    const OnlineModel& model = result.model;
    TorqueRows rows(log, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
    Detector detector = make_detector(model);
    const ThresholdRule& rule = detector.threshold();
    const RegressionBlock block = read_all(rows);
    int certain = 0;
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const std::span<const double> y(block.Y.row(row).data(), 4), dy(block.dY.row(row).data(), 4);
      const Interval torque = rule.prediction(y);
      const double least = std::max(torque.lower, -torque.upper) - rule.set().support(dy);
      const Threshold t = rule.at(y, dy, block.dy[row]);
      if (kappa * least > t.width()) {
        ++certain;
        const double residual = block.y[row] - block.Y.row(row).dot(rule.estimate());
        ASSERT_TRUE(residual < t.lower || residual > t.upper) << "row " << row << ", share " << share;
        // Growth takes more torque in the direction of motion, shrinkage less.
        EXPECT_EQ(residual > 0.0, (torque.lower > 0.0) == (share > 0.0));
      }
    }
    EXPECT_GT(certain, 0) << share;
  }
}

}  // namespace
}  // namespace wheelwright::detector::radius_fault_test
