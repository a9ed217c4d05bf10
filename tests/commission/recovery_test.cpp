// SPDX-License-Identifier: Apache-2.0
// Noise-free logs of the simulated robot: what is identified is the truth, to the discretisation error.
#include <cmath>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "identify/least_squares.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::recovery_test {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Shown;

Eigen::VectorXd truth_of(const Scenario& s) { return sim::true_parameters(s, model::make_model(s.robot)); }

// The estimate from the log of `driven`, read as `reader` says.
Eigen::VectorXd identified(const Scenario& driven, const Scenario& reader, int order) {
  Simulation log(driven);
  TorqueRows rows(log, filter_of(reader, {}, order));
  return least_squares(rows).estimate;
}

struct Case {
  Shown shown;
  Hold hold;
  int order;
  double inertia;  // powers of the step with which the errors fall
  double friction = 2.0;
};

class Recovery : public ::testing::TestWithParam<Case> {};

// The acceleration's column is exact, and so is the torque's where efforts are known between samples; the integral of
// the speed over a step is known to the second order. The order is the slope of log(error) over log(step), by least
// squares over three steps, for each parameter; with exact efforts only friction is left to err so.
TEST_P(Recovery, ErrorFallsByFourWhenTheStepHalves) {
  const auto [shown, hold, order, inertia, friction] = GetParam();
  Scenario s = exact_drive(shown, hold);
  const Eigen::VectorXd truth = truth_of(s);
  constexpr double rounding = 1e-12;  // an error as small as this has no order
  Eigen::MatrixXd error(truth.size(), 3);
  for (int k = 0; k < 3; ++k) {
    s.rate = 100.0 * std::pow(2.0, k);
    Scenario reader = s;
    if (shown == Shown::mean_speeds) {
      reader.robot.hold = Hold::first_order;  // the efforts of such a log are means, too
    }
    error.col(k) = (identified(s, reader, order) - truth).cwiseQuotient(truth).cwiseAbs();
  }
  for (Eigen::Index j = 0; j < truth.size(); ++j) {
    // Abscissae 0, −1, −2 in log₂ h: the slope of the regression line is half of the whole fall.
    const double slope = 0.5 * std::log2(error(j, 0) / error(j, 2));
    const double convergence = j < 2 ? inertia : friction;
    EXPECT_TRUE(error(j, 0) < rounding || slope > convergence - 0.05)
        << "parameter " << j << " of order " << slope << ": " << error.row(j);
    EXPECT_LT(error(j, 0), 1e-3) << "parameter " << j;
  }
}

INSTANTIATE_TEST_SUITE_P(
    AllConventions, Recovery,
    ::testing::Values(Case{Shown::angles, Hold::zero_order, 2, 2.0}, Case{Shown::angles, Hold::first_order, 2, 4.0},
                      Case{Shown::speeds, Hold::zero_order, 1, 2.0}, Case{Shown::speeds, Hold::first_order, 1, 2.0},
                      Case{Shown::speeds, Hold::zero_order, 2, 2.0}, Case{Shown::speeds, Hold::first_order, 2, 2.0},
                      Case{Shown::mean_speeds, Hold::zero_order, 2, 2.0},
                      Case{Shown::mean_speeds, Hold::first_order, 2, 2.0}));

// (14) as the paper writes it: with ℓ = D the moment of the wheels is taken twice, and so are I and f3.
TEST(Recovery, TheLeverArmOfThePaperDoublesInertiaAndFrictionOfYaw) {
  const Scenario s = exact_drive(Shown::angles, Hold::first_order);
  Scenario paper = s;
  paper.robot.lever_arm_is_track = true;
  const Eigen::VectorXd half = identified(s, s, 2), track = identified(s, paper, 2);
  const Eigen::Vector4d factor(1.0, 2.0, 1.0, 2.0);
  const Eigen::Vector4d physical(21.0, 0.9, 4.0, 0.5);
  for (Eigen::Index j = 0; j < 4; ++j) {
    EXPECT_NEAR(track[j], factor[j] * half[j], 1e-11 * track[j]);
    EXPECT_NEAR(track[j], s.robot.wheel_radius * factor[j] * physical[j], (j < 2 ? 1e-6 : 1e-4) * track[j]);
  }
}

TEST(Recovery, CommissioningGivesTheSameAndBoundsTheTruth) {
  for (const Shown shown : {Shown::angles, Shown::speeds, Shown::mean_speeds}) {
    for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
      Scenario s = exact_drive(shown, hold);
      Simulation log(s);
      if (shown == Shown::mean_speeds) {
        s.robot.hold = Hold::first_order;
        s.robot.effort_changes = model::EffortChanges::between;
      }
      s.robot.noise.wheel_angle.value = s.robot.noise.wheel_speed.value = s.robot.noise.effort.value = 0.0;
      const Commissioning result = commission_robot(log, s.robot);
      ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
      const Eigen::VectorXd truth = truth_of(s);
      for (std::size_t j = 0; j < result.parameters.size(); ++j) {
        const ParameterResult& p = result.parameters[j];
        const double theta = truth[static_cast<Eigen::Index>(j)];
        ASSERT_TRUE(p.estimate.has_value());
        EXPECT_NEAR(*p.estimate, theta, 1e-3 * theta) << p.parameter.name;
        EXPECT_LE(p.lower, theta) << p.parameter.name << " of log " << static_cast<int>(shown)
                                  << static_cast<int>(hold);
        EXPECT_GE(p.upper, theta) << p.parameter.name << " of log " << static_cast<int>(shown)
                                  << static_cast<int>(hold);
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission::recovery_test
