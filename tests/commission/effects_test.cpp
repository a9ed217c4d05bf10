// SPDX-License-Identifier: Apache-2.0
// Commissioning of a robot whose file carries what its simulator has beyond the basic model.
#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "core/error.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::effects_test {
namespace {

// Noise inside its declared bounds: the truth is inside the guaranteed ones, and without the effects nothing explains
// the log.
TEST(CommissionEffects, TheTruthIsInsideAndTheBasicModelIsRefuted) {
  Scenario s = testing_support::noisy_drive(3, 20.0);
  s.robot.hold = Hold::first_order;
  const Robot plain = s.robot;
  s.robot.effects = {{"coulomb", {{"c", {0.3, 0.3}}}}, {"actuator_lag", {{"T", {0.04, 0.04}}}}};
  Simulation log(s);
  const Commissioning with = commission_robot(log, s.robot);
  ASSERT_EQ(with.status, Commissioning::Status::done) << with.message;
  const Eigen::VectorXd truth = sim::true_parameters(s, model::make_model(s.robot));
  ASSERT_EQ(with.parameters.size(), static_cast<std::size_t>(truth.size()));
  for (std::size_t j = 0; j < with.parameters.size(); ++j) {
    EXPECT_LE(with.parameters[j].lower, truth[static_cast<Eigen::Index>(j)]) << with.parameters[j].parameter.name;
    EXPECT_GE(with.parameters[j].upper, truth[static_cast<Eigen::Index>(j)]) << with.parameters[j].parameter.name;
  }
  EXPECT_EQ(commission_robot(log, plain).status, Commissioning::Status::empty);
}

TEST(CommissionEffects, WhatALogCannotBeCorrectedForIsRefused) {
  Scenario s = testing_support::noisy_drive(3);
  s.robot.effects = {{"backlash", {{"gap", {0.02, 0.02}}}}};
  Simulation log(s);
  EXPECT_THROW(static_cast<void>(commission_robot(log, s.robot)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::commission::effects_test
