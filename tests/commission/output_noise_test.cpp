// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "commission/noise_budget.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission {
namespace {

TEST(OutputNoise, AConvergedFitTellsTheFactor) {
  bounds::MinimaxFit fit;
  fit.converged = true;
  fit.lower = 1.4999, fit.upper = 1.5;
  EXPECT_DOUBLE_EQ(noise_that_leaves_a_set(fit,
                                           [](double) {
                                             ADD_FAILURE() << "asked although the fit knows";
                                             return true;
                                           }),
                   1.05 * 1.5);
}

// Whatever a fit that stopped early had proved, the factor is the same up to the steps of the search.
TEST(OutputNoise, AFitThatStoppedEarlyIsFinished) {
  constexpr double kTruth = 1.51;
  const auto leaves = [](double factor) { return factor >= kTruth; };
  for (const double lower : {0.2, 1.0, 1.3}) {
    for (const double upper : {1.6, 9.02, 1e6}) {
      bounds::MinimaxFit fit;
      fit.converged = false;
      fit.lower = lower, fit.upper = upper;
      const double factor = noise_that_leaves_a_set(fit, leaves);
      EXPECT_GE(factor, 1.05 * kTruth) << lower << ' ' << upper;
      EXPECT_LE(factor, 1.05 * 1.05 * kTruth) << lower << ' ' << upper;
    }
  }
}

// Straight ahead, both wheels logged alike: nothing of their difference is left, and from that follows neither that its
// errors are nothing nor anything of the parameters of turning.
TEST(OutputNoise, WhereNothingMovedIsThatOfTheSameJoints) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Scenario s = testing_support::noisy_drive(seed, 30.0);
    s.trajectory = {.kind = sim::Trajectory::Kind::straight, .speed = 0.6, .period = 6.0};
    s.robot.noise.effort.value.reset();
    s.robot.encoder_counts_per_turn.reset();
    LogTable log = sim::simulate(s);
    TableSource recorded(log);
    const Commissioning apart = commission_robot(recorded, s.robot);
    for (const char* column : {"phi_", "tau_"}) {
      log.column(std::string(column) + "l") = log.column(std::string(column) + "r");
    }
    TableSource same(log);
    const Commissioning alike = commission_robot(same, s.robot);
    ASSERT_EQ(alike.status, Commissioning::Status::partial);
    ASSERT_EQ(alike.noise[1].origin, core::NoiseOrigin::estimated);
    EXPECT_GE(alike.noise[1].bound, apart.noise[1].learning);
    for (const ParameterResult& p : alike.parameters) {
      const bool of_turning = p.parameter.physical == "yaw_inertia" || p.parameter.physical == "viscous_yaw";
      EXPECT_EQ(p.excitation == identify::Excitation::not_excited, of_turning) << p.parameter.name;
      EXPECT_EQ(p.lower_is_prior && p.upper_is_prior, of_turning) << p.parameter.name;
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission
