// SPDX-License-Identifier: Apache-2.0
// Derivatives of a commissioned robot's bounds against commissioning anew beside the point.
#include <gtest/gtest.h>

#include <cmath>

#include "commission/commission.hpp"
#include "core/error.hpp"
#include "study/bound_derivatives.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::study::local_derivatives_test {
namespace {

using testing_support::noisy_drive;

// Measured speeds and efforts with declared bounds, under a filter of order 1.
Scenario speed_drive(std::uint64_t seed) {
  Scenario s = testing_support::exact_drive(testing_support::Shown::speeds, Hold::first_order);
  s.duration = 8.0;
  s.trajectory.period = 1.6;
  s.sensors.wheel_speed = 0.01;
  s.sensors.effort = 0.02;
  s.robot.noise.wheel_speed.value = 0.01;
  s.robot.noise.effort.value = 0.02;
  s.robot.speed_source = model::SpeedSource::measured;
  s.robot.filter = {.order = 1, .alpha = 8.0, .beta = 8.0};
  s.robot.prior = {{"mass", {5.0, 60.0}}, {"viscous_yaw", {0.45, 0.55}}};
  s.seed = seed;
  return s;
}

Robot with(Robot robot, const std::string& input, double x) {
  if (input == "declared.wheel_speed") {
    robot.noise.wheel_speed.value = x;
  } else if (input == "declared.effort") {
    robot.noise.effort.value = x;
  } else if (input == "filter.alpha") {
    robot.filter.alpha = x;
  } else if (input == "filter.beta") {
    robot.filter.beta = x;
  } else if (input == "wheel_radius") {
    robot.wheel_radius = x;
  } else if (input == "track_width") {
    robot.track_width = x;
  } else if (input == "encoder_counts_per_turn") {
    robot.encoder_counts_per_turn = x;
  } else if (input == "prior.viscous_yaw.lower") {
    robot.prior.at("viscous_yaw").lower = x;
  } else if (input == "prior.viscous_yaw.upper") {
    robot.prior.at("viscous_yaw").upper = x;
  } else if (input == "prior.mass.upper") {
    robot.prior.at("mass").upper = x;
  } else {
    ADD_FAILURE() << input;
  }
  return robot;
}

// Both bounds of all parameters, by commissioning anew.
std::vector<double> bounds(LogSource& log, const Robot& robot) {
  const Commissioning result = commission_robot(log, robot);
  EXPECT_EQ(result.status, Commissioning::Status::done) << result.message;
  std::vector<double> all;
  for (const commission::ParameterResult& p : result.parameters) {
    all.insert(all.end(), {p.lower, p.upper});
  }
  return all;
}

// Differences at `step` and twice it, extrapolated; compared where the two agree, which they do not where other rows
// take over between. How many were compared.
int compare(LogSource& log, const Robot& robot, const LocalSensitivity& local, double tolerance) {
  int compared = 0;
  for (const LocalDerivative& input : local.inputs) {
    const auto difference = [&](double step) {
      const std::vector<double> low = bounds(log, with(robot, input.input, input.value - step));
      const std::vector<double> high = bounds(log, with(robot, input.input, input.value + step));
      std::vector<double> d;
      for (std::size_t k = 0; k < low.size(); ++k) {
        d.push_back((high[k] - low[k]) / (2.0 * step));
      }
      return d;
    };
    const double step = 1e-6 * input.value;
    const std::vector<double> near = difference(step), far = difference(2.0 * step);
    for (std::size_t j = 0; j < input.parameters.size(); ++j) {
      const ParameterDerivative& found = input.parameters[j];
      const double scale = (local.upper[j] - local.lower[j]) / input.value;
      for (const bool upper : {false, true}) {
        const std::size_t k = 2 * j + (upper ? 1 : 0);
        if (!found.differentiable || std::abs(near[k] - far[k]) > 1e-4 * scale) {
          continue;
        }
        const OneSided& side = upper ? found.upper : found.lower;
        EXPECT_NEAR(side.right, near[k], tolerance * (std::abs(near[k]) + scale))
            << input.input << ", " << (upper ? "upper " : "lower ") << local.parameters[j];
        EXPECT_NEAR(side.left, side.right, tolerance * (std::abs(near[k]) + scale));
        ++compared;
      }
    }
  }
  return compared;
}

TEST(LocalDerivatives, EqualDifferencesOfCommissioningWithMeasuredSpeeds) {
  const Scenario s = speed_drive(5);
  LogTable table = sim::simulate(s);
  TableSource log(table);
  const Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  const LocalSensitivity local = local_derivatives(
      log, result,
      {.inputs = {"declared.wheel_speed", "declared.effort", "filter.alpha", "filter.beta", "wheel_radius",
                  "track_width", "prior.mass.upper", "prior.viscous_yaw.lower", "prior.viscous_yaw.upper"}});
  ASSERT_EQ(local.inputs.size(), 9U);
  EXPECT_FALSE(result.earlier.empty());
  // 9 inputs × 4 parameters × 2 bounds.
  EXPECT_GE(compare(log, s.robot, local, 1e-5), 64);
  EXPECT_TRUE(not_differentiable(local).empty()) << not_differentiable(local).front();
}

TEST(LocalDerivatives, EqualDifferencesOfCommissioningWithEncoders) {
  Scenario s = noisy_drive(3, 8.0);
  s.robot.hold = Hold::first_order;
  s.robot.filter = {.order = 2, .alpha = {}, .beta = 8.0};
  LogTable table = sim::simulate(s);
  TableSource log(table);
  const Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  const LocalSensitivity local = local_derivatives(
      log, result,
      {.inputs = {"encoder_counts_per_turn", "declared.effort", "filter.beta", "wheel_radius", "track_width"}});
  EXPECT_FALSE(result.earlier.empty());
  EXPECT_GE(compare(log, s.robot, local, 1e-5), 30);
}

// What theory says without a number: (25) is linear in the gain of the filter; θ_L = r·m, and Y ∝ r.
TEST(LocalDerivatives, ObeyTheScalingsOfTheModel) {
  const Scenario s = noisy_drive(4, 8.0);
  LogTable table = sim::simulate(s);
  TableSource log(table);
  const Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  const LocalSensitivity local = local_derivatives(log, result, {.inputs = {"filter.alpha", "wheel_radius"}});
  for (std::size_t j = 0; j < local.parameters.size(); ++j) {
    const double width = local.upper[j] - local.lower[j];
    ASSERT_TRUE(local.inputs[0].parameters[j].elasticity && local.inputs[1].parameters[j].elasticity);
    EXPECT_NEAR(*local.inputs[0].parameters[j].elasticity, 0.0, 1e-8);
    EXPECT_NEAR(*local.inputs[1].parameters[j].elasticity, -1.0, 1e-7);
    EXPECT_NEAR(local.inputs[1].parameters[j].upper.right, -local.upper[j] / s.robot.wheel_radius,
                1e-7 * (width + local.upper[j]) / s.robot.wheel_radius);
  }
}

TEST(LocalDerivatives, EstimatedNoiseIsHeldFixedAndSaysSo) {
  Scenario s = noisy_drive(3, 8.0);
  s.robot.noise = {};
  s.robot.encoder_counts_per_turn.reset();
  LogTable table = sim::simulate(s);
  TableSource log(table);
  const Commissioning result = commission_robot(log, s.robot);
  ASSERT_EQ(result.noise.front().origin, core::NoiseOrigin::estimated);
  const LocalSensitivity local = local_derivatives(log, result);
  ASSERT_EQ(local.notes.size(), 2U);
  EXPECT_NE(local.notes[1].find("noise is estimated"), std::string::npos);
  EXPECT_THROW(static_cast<void>(local_derivatives(log, result, {.inputs = {"noise.effort"}})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(local_derivatives(log, result, {.inputs = {"prior.charm"}})), InvalidArgument);
}

// A lower side at 0 that is met: raised, it moves the bound with it; below it, a sign is open. The report says so.
TEST(LocalDerivatives, SayWhereThereIsNone) {
  Scenario s = speed_drive(5);
  s.robot.noise.wheel_speed.value = 0.6;
  s.robot.noise.effort.value = 1.0;
  s.robot.prior = {{"viscous_yaw", {0.0, 10.0}}};
  LogTable table = sim::simulate(s);
  TableSource log(table);
  const LocalSensitivity local =
      local_derivatives(log, commission_robot(log, s.robot),
                        {.inputs = {"prior.viscous_yaw.lower", "prior.viscous_yaw", "declared.effort"}});
  ASSERT_EQ(local.lower[3], 0.0);
  const ParameterDerivative& side = local.inputs[0].parameters[3];
  EXPECT_NEAR(side.lower.right, s.robot.wheel_radius, 1e-12);
  EXPECT_TRUE(std::isnan(side.lower.left));
  EXPECT_FALSE(side.differentiable || side.elasticity);
  // A narrower prior raises the side, a wider one leaves it at 0.
  const ParameterDerivative& factor = local.inputs[1].parameters[3];
  EXPECT_NEAR(factor.lower.left, -5.0 * s.robot.wheel_radius, 1e-12);
  EXPECT_EQ(factor.lower.right, 0.0);
  EXPECT_FALSE(factor.differentiable);
  const std::vector<std::string> words = not_differentiable(local);
  ASSERT_FALSE(words.empty());
  EXPECT_NE(words[0].find("not differentiable in prior.viscous_yaw.lower"), std::string::npos) << words[0];
}

// A log twice the same: every row that holds a bound stands there twice, and both move with the robot file together.
TEST(LocalDerivatives, ADriveThatIsLoggedTwiceHasTheDerivativesOfOne) {
  const Scenario s = speed_drive(6);
  LogTable once = sim::simulate(s), twice = once;
  const double shift = once.t.back() - once.t.front() + 10.0;
  twice.segment_starts = once.segment_starts;
  twice.segment_starts.push_back(once.rows());
  for (const double t : once.t) {
    twice.t.push_back(t + shift);
  }
  for (std::size_t k = 0; k < once.columns.size(); ++k) {
    twice.columns[k].insert(twice.columns[k].end(), once.columns[k].begin(), once.columns[k].end());
  }
  TableSource log(once), log_twice(twice);
  const LocalOptions options{.inputs = {"declared.effort", "filter.beta", "wheel_radius"}};
  const LocalSensitivity one = local_derivatives(log, commission_robot(log, s.robot), options);
  const LocalSensitivity two = local_derivatives(log_twice, commission_robot(log_twice, s.robot), options);
  for (std::size_t i = 0; i < one.inputs.size(); ++i) {
    for (std::size_t j = 0; j < one.parameters.size(); ++j) {
      const OneSided &a = one.inputs[i].parameters[j].width, &b = two.inputs[i].parameters[j].width;
      EXPECT_NEAR(a.right, b.right, 1e-5 * (std::abs(a.right) + (one.upper[j] - one.lower[j]) / one.inputs[i].value))
          << one.inputs[i].input << ", " << one.parameters[j];
    }
  }
  EXPECT_FALSE(two.optima->upper[0].is_regular());
}

}  // namespace
}  // namespace wheelwright::study::local_derivatives_test
