// SPDX-License-Identifier: Apache-2.0
// What is promised under declared noise, counted: the truth is in the set, and a healthy robot raises no alarm.
#include <array>
#include <cstdint>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "detector/detector.hpp"
#include "detector/online_model.hpp"
#include "tests/support/drives.hpp"

namespace wheelwright::commission::slow_guarantee_test {
namespace {

using testing_support::noisy_drive;

// Robots, trajectories and shapes of noise change with the seed.
Scenario varied_drive(std::uint64_t seed, double duration) {
  Scenario s = noisy_drive(seed, duration);
  const auto vary = [&](std::uint64_t stride, double lowest, double highest) {
    const double share = static_cast<double>((seed * stride) % 101) / 100.0;
    return lowest + share * (highest - lowest);
  };
  s.parameters = {.mass = vary(7, 8.0, 40.0),
                  .yaw_inertia = vary(11, 0.3, 2.0),
                  .viscous_x = vary(13, 1.0, 10.0),
                  .viscous_yaw = vary(17, 0.1, 1.5)};
  s.parameters.viscous_y = s.parameters.viscous_x;
  s.trajectory.kind = seed % 3 == 0 ? sim::Trajectory::Kind::multi_sine : sim::Trajectory::Kind::commissioning;
  s.sensors.noise = testing_support::kNoiseShapes[seed / 2 % 3];
  s.robot.hold = seed % 5 < 3 ? Hold::zero_order : Hold::first_order;
  return s;
}

void expect_truth_inside(std::uint64_t first, std::uint64_t last, const CommissionOptions& options) {
  for (std::uint64_t seed = first; seed < last; ++seed) {
    const Scenario s = varied_drive(seed, 8.0 + static_cast<double>(seed % 5));
    Simulation log(s);
    const Commissioning result = commission_robot(log, s.robot, options);
    ASSERT_EQ(result.status, Commissioning::Status::done) << "seed " << seed << ": " << result.message;
    ASSERT_EQ(result.noise[0].origin, core::NoiseOrigin::declared);
    const Eigen::VectorXd truth = sim::true_parameters(s, result.model.model);
    for (const bounds::HalfSpace& facet : result.model.facets) {
      ASSERT_LE(facet.a.dot(truth), facet.b) << "seed " << seed;
    }
    for (std::size_t j = 0; j < result.parameters.size(); ++j) {
      const double theta = truth[static_cast<Eigen::Index>(j)];
      ASSERT_LE(result.parameters[j].lower, theta) << "seed " << seed << ", " << result.parameters[j].parameter.name;
      ASSERT_GE(result.parameters[j].upper, theta) << "seed " << seed << ", " << result.parameters[j].parameter.name;
    }
    // The prior alone would hold the truth, too.
    EXPECT_LT(result.parameters[0].upper, 10.0 * truth[0]) << "seed " << seed;
  }
}

// A thousand runs, in parts that may run side by side.
class SlowGuaranteePart : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SlowGuaranteePart, TheTruthIsInTheSetInAThousandRuns) {
  expect_truth_inside(200 * GetParam(), 200 * GetParam() + 200, {});
}

INSTANTIATE_TEST_SUITE_P(Fifths, SlowGuaranteePart, ::testing::Range<std::uint64_t>(0, 5));

TEST(SlowGuarantee, TheTruthIsInTheStatisticalSetInTwoHundredRuns) {
  CommissionOptions options;
  options.noise_mode = filter::NoiseMode::statistical;
  expect_truth_inside(2000, 2200, options);
}

struct Watch {
  std::size_t samples = 0;
  std::size_t decisions = 0;
  std::size_t alarms = 0;
};

void watch(const OnlineModel& model, const Scenario& drive, Watch& total) {
  Simulation log(drive);
  Detector detector = make_detector(model);
  ASSERT_TRUE(detector.threshold().set().has_vertices());
  core::for_each_sample(log, model.measurement.columns(), [&](const core::LogSample& sample) {
    const Decision& d = detector.step(sample.t, sample.values);
    ++total.samples;
    total.decisions += d.valid ? 1 : 0;
    total.alarms += d.fault ? 1 : 0;
  });
}

// Ten robots, each on other trajectories than the one it was commissioned on: 10⁷ samples with the polytope's [l, u].
TEST(SlowGuarantee, TenMillionSamplesWithoutAnAlarm) {
  Watch total;
  for (std::uint64_t robot = 1; robot <= 10; ++robot) {
    const Scenario learned = varied_drive(robot, 20.0);
    Simulation log(learned);
    const Commissioning result = commission_robot(log, learned.robot);
    ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
    constexpr std::array kinds = {sim::Trajectory::Kind::figure_eight, sim::Trajectory::Kind::multi_sine,
                                  sim::Trajectory::Kind::stops, sim::Trajectory::Kind::commissioning};
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      Scenario drive = learned;
      drive.seed = 1000 * robot + k;
      drive.trajectory.kind = kinds[k];
      drive.trajectory.period = 9.0 + static_cast<double>(k);
      drive.duration = 2500.0;
      watch(result.model, drive, total);
    }
  }
  EXPECT_GE(total.samples, 10'000'000u);
  EXPECT_GT(total.decisions, 9'900'000u);
  EXPECT_EQ(total.alarms, 0u);
}

}  // namespace
}  // namespace wheelwright::commission::slow_guarantee_test
