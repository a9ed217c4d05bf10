// SPDX-License-Identifier: Apache-2.0
// The consistency test: closed forms of the limit, and its two promises, tried on simulated robots.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "detector/faults/margins.hpp"
#include "detector/faults/reference_motion.hpp"
#include "tests/benchmarks/limit/consistency.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::bench::consistency_test {
namespace {

using namespace testing_support;

// u = θ v of one joint, in speeds that are sampled, with a θ between two bounds.
struct Viscous {
  Model model;
  filter::Measurement measurement;
  Polytope set;
  detector::ReferenceMotion motion;

  Viscous(double lower, double upper, const std::vector<double>& speeds) : set({}, box(lower, upper)) {
    model.name = "viscous";
    model.parameters = {{"theta", "1", "theta", "1", 1.0, {0.0, 10.0}, ""}};
    model.outputs = {"effort"};
    model.output_units = {"N"};
    model.coordinates = {"v"};
    model.joints = {{"x", "v", "u", "u", "u", ""}};
    model.motion = model.input = Eigen::MatrixXd::Ones(1, 1);
    model.terms = {{.output = 0, .parameter = 0, .kind = Term::Kind::speed}};
    measurement.motion_columns = {"v"};
    measurement.effort_columns = {"u"};
    measurement.nominal_step = 0.01;
    measurement.changes = model::EffortChanges::at_samples;
    LogTable table;
    table.names = {"v", "u"};
    table.columns = {speeds, std::vector<double>(speeds.size(), 0.0)};
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      table.t.push_back(0.01 * static_cast<double>(k));
    }
    TableSource log(table);
    motion = detector::read_reference(log, RegressorFilter(model, {}, measurement));
  }

  static Box box(double lower, double upper) {
    Box b;
    b.sides = {{lower, upper}};
    return b;
  }

  [[nodiscard]] DetectableSize limit(const FaultType& fault, double side, filter::SensorErrors errors) const {
    return ConsistencyTest(model, measurement, errors, set, {.before = 0.02})
        .smallest_detectable(motion, fault, side, 5, 0.1);
  }
};

const FaultType kBias{.name = "bias", .range = {-10.0, 10.0}, .offset = Eigen::VectorXd::Ones(1)};
const FaultType kGain{.name = "gain", .range = {-0.9, 10.0}, .effort = Eigen::MatrixXd::Ones(1, 1)};

// Without healthy samples before the onset, θ° may be anywhere.
TEST(Consistency, LimitOfOneParameterIsTheClosedForm) {
  const double lower = 1.5, upper = 2.0, v = 3.0, effort = 0.1, speed = 0.05;
  const Viscous drive(lower, upper, std::vector<double>(30, v));
  ConsistencyTest test(drive.model, drive.measurement, {.motion = speed, .effort = effort}, drive.set, {.before = 0.0});
  // θ°v + κ = θ(v + d) + e, at worst θ° = lower, θ = upper.
  const double bias = (upper - lower) * v + 2.0 * upper * speed + 2.0 * effort;
  const DetectableSize up = test.smallest_detectable(drive.motion, kBias, 1.0, 5, 0.1);
  EXPECT_NEAR(up.upper, bias, 2e-3 * bias);
  EXPECT_GE(up.upper, bias);
  EXPECT_LE(up.lower, bias);
  EXPECT_GT(up.lower, 0.99 * bias);
  // (1 + κ)θ°v = θ(v + d) + e.
  const double gain = (upper * (v + 2.0 * speed) + 2.0 * effort) / (lower * v) - 1.0;
  const DetectableSize more = test.smallest_detectable(drive.motion, kGain, 1.0, 5, 0.1);
  EXPECT_NEAR(more.upper, gain, 2e-3 * gain);
  EXPECT_GE(more.upper, gain);
  EXPECT_LE(more.lower, gain);
}

// With exact parameters and errors of efforts alone, no functional is better than the sample that shows most.
TEST(Consistency, LimitWithExactParametersIsThatOfTheBestSample) {
  std::vector<double> speeds;
  for (int k = 0; k < 30; ++k) {
    speeds.push_back(2.0 + std::sin(0.7 * k));
  }
  const Viscous drive(2.0, 2.0, speeds);
  const double effort = 0.1;
  double fastest = 0.0;
  for (std::size_t k = 5; k < 15; ++k) {
    fastest = std::max(fastest, 0.5 * (speeds[k] + speeds[k + 1]));
  }
  // First-order hold: two efforts enter an equation with a half each.
  const double expected = 2.0 * effort / (2.0 * fastest);
  const DetectableSize size = drive.limit(kGain, 1.0, {.effort = effort});
  EXPECT_LE(size.lower, size.upper);
  EXPECT_LE(size.upper, expected * (1.0 + 1e-6));
  EXPECT_NEAR(drive.limit(kBias, -1.0, {.effort = effort}).upper, 2.0 * effort, 4e-3 * effort);
}

// What the declared bounds of a robot are, sample by sample.
filter::SensorErrors declared(const Commissioned& c) {
  return {.motion = std::numbers::pi / *c.scenario.robot.encoder_counts_per_turn,
          .effort = *c.scenario.robot.noise.effort.value};
}

filter::Measurement measurement_of(const Commissioned& c) { return c.model.measurement; }

detector::ReferenceMotion motion_of(const Commissioned& c, LogSource& log) {
  return detector::read_reference(log,
                                  RegressorFilter(c.model.model, c.model.filter, measurement_of(c), c.model.errors));
}

std::size_t instant_at(const detector::ReferenceMotion& motion, double t) {
  return static_cast<std::size_t>(std::lower_bound(motion.instant.begin(), motion.instant.end(), t) -
                                  motion.instant.begin());
}

TEST(Consistency, HealthySamplesAreNeverRefuted) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Commissioned c = commissioned_robot(seed);
    const FaultyRun run = random_run(c, 100 + seed, breakages()[0]);
    const LogTable table = log_of(FaultyRun{.robot = &c,
                                            .drive = run.drive,
                                            .fault = run.fault,
                                            .simulated = model::Fault::Kind::wheel_radius,
                                            .onset = 9.99},
                                  0.0, true);
    TableSource log(table);
    const detector::ReferenceMotion motion = motion_of(c, log);
    const Eigen::MatrixXd effort = read_efforts(log, measurement_of(c));
    ConsistencyTest test(c.model.model, measurement_of(c), declared(c), Polytope(c.model.facets, c.model.box));
    Random random(seed);
    for (int window = 0; window < 25; ++window) {
      const std::size_t length = 5 + random.below(25), first = random.below(motion.instants() - length - 1);
      const Consistency found = test.consistent(motion, effort, first, first + length);
      EXPECT_FALSE(found.refuted) << "seed " << seed << ", instant " << first;
      EXPECT_LE(found.unexplained, 1e-6) << "seed " << seed << ", instant " << first;
    }
  }
}

TEST(Consistency, ALittleMoreThanTheLimitIsAlwaysRefutedAndNoTestDoesBetter) {
  std::size_t tried = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Commissioned c = commissioned_robot(seed);
    const Polytope set(c.model.facets, c.model.box);
    ConsistencyTest test(c.model.model, measurement_of(c), declared(c), set, {.before = 0.1});
    for (const Breakage& breakage : breakages()) {
      const bool reading = !breakage.simulated && breakage.fault.starts_with("effort");
      if (!reading && !breakage.fault.starts_with("wheel_radius")) {
        continue;
      }
      const FaultyRun run = random_run(c, 10 * seed + 7, breakage);
      const double window = 0.2;
      // A radius changes the motion: the limit is that of the motion with it.
      const double made = reading ? 0.0 : run.side * 0.3;
      const LogTable bare = log_of(run, made, false);
      TableSource reference(bare);
      const detector::ReferenceMotion motion = motion_of(c, reference);
      const std::size_t onset = instant_at(motion, run.onset);
      const DetectableSize size = test.smallest_detectable(motion, run.fault, run.side, onset, window);
      EXPECT_LE(size.lower, size.upper) << breakage.fault;
      const Promise threshold = promise(run, made, window, 0.0);
      EXPECT_GE(threshold.certain, size.upper * (1.0 - 1e-3)) << breakage.fault << ", seed " << seed;
      const double magnitude = reading ? 1.05 * size.upper : 0.3;
      if (!(1.05 * size.upper <= magnitude) || magnitude > std::max(run.fault.range.upper, 0.5)) {
        continue;
      }
      const LogTable broken = log_of(run, run.side * magnitude, true);
      TableSource log(broken);
      const detector::ReferenceMotion seen = motion_of(c, log);
      const Consistency found =
          test.consistent(seen, read_efforts(log, measurement_of(c)), instant_at(seen, run.onset - 0.15),
                          std::min(instant_at(seen, run.onset + window + 0.03), seen.instants() - 1));
      EXPECT_TRUE(found.refuted) << breakage.fault << ", seed " << seed << ", " << magnitude;
      ++tried;
    }
  }
  EXPECT_GE(tried, 6U);
}

TEST(Consistency, RejectsWhatMakesNoSense) {
  const Viscous drive(1.0, 2.0, std::vector<double>(30, 1.0));
  ConsistencyTest test(drive.model, drive.measurement, {.effort = 0.1}, drive.set);
  EXPECT_THROW((void)test.consistent(drive.motion, Eigen::MatrixXd::Zero(1, 30), 7, 7), InvalidArgument);
  EXPECT_THROW((void)test.smallest_detectable(drive.motion, kBias, 0.5, 5, 0.1), InvalidArgument);
  EXPECT_THROW((void)test.smallest_detectable(drive.motion, kBias, 1.0, 29, 0.1), InvalidArgument);
  EXPECT_THROW(ConsistencyTest(drive.model, drive.measurement, {.effort = -0.1}, drive.set), InvalidArgument);
  filter::Measurement late = drive.measurement;
  late.correction.lag = 0.05;
  ConsistencyTest corrected(drive.model, late, {.effort = 0.1}, drive.set);
  EXPECT_THROW((void)corrected.consistent(drive.motion, Eigen::MatrixXd::Zero(1, 30), 5, 7), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::bench::consistency_test
