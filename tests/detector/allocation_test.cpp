// SPDX-License-Identifier: Apache-2.0
#include "tests/support/allocations.hpp"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "commission/commission.hpp"
#include "detector/detector.hpp"
#include "detector/online_model.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/kinematic_drives.hpp"
#include "tests/support/known_unicycle.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::detector::allocation_test {
namespace {

#ifdef WHEELWRIGHT_COUNTS_ALLOCATIONS

using testing_support::allocations;
using testing_support::noisy_drive;

TEST(Allocation, IsCountedForNewAndForEigen) {
  const std::size_t before = allocations;
  const Eigen::VectorXd vector = Eigen::VectorXd::Zero(100);
  EXPECT_GT(allocations, before);
  const std::size_t between = allocations;
  const std::vector<double> numbers(100, vector[3]);
  EXPECT_GT(allocations, between);
  EXPECT_EQ(numbers.back(), 0.0);
}

void expect_no_allocation(const Scenario& drive, const Robot& robot, DetectorOptions options) {
  Simulation learning(drive);
  const Commissioning result = commission_robot(learning, robot);
  ASSERT_NE(result.model.facets.size(), 0u) << result.message;
  Detector detector = make_detector(result.model, std::move(options));
  Scenario other = drive;
  other.seed = 99;
  const LogTable table = sim::simulate(other);
  const auto names = result.model.measurement.columns();
  std::vector<const std::vector<double>*> columns;
  for (const auto& name : names) {
    columns.push_back(&table.column(name));
  }
  std::vector<double> sample(columns.size());
  std::size_t valid = 0;
  const std::size_t before = allocations;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      sample[c] = (*columns[c])[k];
    }
    const double gap = k > table.rows() / 2 ? 10.0 : 0.0;  // the filter restarts once
    valid += detector.step(table.t[k] + gap, sample).valid ? 1 : 0;
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(valid, table.rows() / 4);
}

TEST(Allocation, ADetectorStepHasNone) {
  const Scenario drive = noisy_drive(1);
  expect_no_allocation(drive, drive.robot, {});
  expect_no_allocation(drive, drive.robot, {.set = ParameterSetKind::box, .test = detector::Test::symmetric});
  expect_no_allocation(drive, drive.robot,
                       {.persistence = Persistence{.k = 3, .n = 5}, .mu = Eigen::Vector2d(0.1, 0.1)});
}

// Dry friction couples both channels: a set of six parameters with more vertices than are kept is walked.
TEST(Allocation, NorWithFunctionTermsAndAHeading) {
  Scenario drive = noisy_drive(1);
  drive.robot.parameters = {{"mass", "yaw_inertia", "viscous_x", "viscous_y", "viscous_yaw", "coulomb"}};
  drive.robot.anisotropic_friction = true;
  drive.sensors.pose = true;
  drive.robot.noise.heading.value = 0.0;
  expect_no_allocation(drive, drive.robot, {});
  expect_no_allocation(drive, drive.robot, {.set = ParameterSetKind::box});
}

TEST(Allocation, NorHasAStepOfTheKinematicDetector) {
  const Scenario drive = testing_support::posed_drive(1, 12.0);
  Simulation learning(drive);
  const Commissioning result = commission_robot(learning, drive.robot);
  ASSERT_TRUE(result.model.kinematic.has_value()) << result.kinematic.message;
  KinematicDetector detector = make_detector(*result.model.kinematic);
  const LogTable table = sim::simulate(drive);
  const std::vector<std::string> names = result.model.kinematic->measurement.columns();
  std::vector<const std::vector<double>*> columns;
  for (const auto& name : names) {
    columns.push_back(&table.column(name));
  }
  std::vector<double> sample(columns.size());
  std::size_t valid = 0;
  const std::size_t before = allocations;
  for (std::size_t k = 0; k < table.rows(); ++k) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      sample[c] = (*columns[c])[k];
    }
    const double gap = k > table.rows() / 2 ? 10.0 : 0.0;  // the window restarts once
    valid += detector.step(table.t[k] + gap, sample).valid ? 1 : 0;
  }
  EXPECT_EQ(allocations, before);
  EXPECT_GT(valid, table.rows() / 2);
}

TEST(Allocation, NorHasAStepOfSumsOfThePose) {
  testing_support::ExactUnicycle robot;
  robot.slip_across = 0.5;
  robot.fault_at = 20.0;  // both sides of a threshold
  const KinematicModel model = testing_support::known_kinematics(robot, 0.01);
  PoseSumDetector detector(model);
  const LogTable log = drive(robot, 1);
  std::size_t looks = 0;
  bool alarm = false;
  const std::size_t before = allocations;
  testing_support::walk(log, detector, [&](std::size_t) {
    looks += detector.looks().size();
    alarm = alarm || detector.alarm();
  });
  EXPECT_EQ(allocations, before);
  EXPECT_GT(looks, 1000U);
  EXPECT_TRUE(alarm);
}

#elif !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // their malloc is not ours to replace

TEST(Allocation, IsCountedHere) {
  (void)testing_support::skip_unless(false, "allocations are counted with the GNU C library alone");
}

#endif

}  // namespace
}  // namespace wheelwright::detector::allocation_test
