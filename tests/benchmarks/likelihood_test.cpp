// SPDX-License-Identifier: Apache-2.0
// The limit at a stated risk: closed forms where errors are independent from equation to equation.
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/benchmarks/limit/likelihood.hpp"

namespace wheelwright::bench::likelihood_test {
namespace {

constexpr double kTheta = 1.7, kEffort = 0.1;
constexpr LikelihoodQuestion kQuestion{.risk = 1e-6, .window = 0.1, .before = 0.05};

// u = θ v of one joint, speeds sampled and efforts held: every equation has one effort of its own.
struct Viscous {
  Model model;
  filter::Measurement measurement;
  std::vector<double> speeds;
  detector::ReferenceMotion motion;

  Viscous() {
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
    measurement.hold = Hold::zero_order;
    measurement.changes = model::EffortChanges::at_samples;
    LogTable table;
    table.names = {"v", "u"};
    for (std::size_t k = 0; k < 30; ++k) {
      table.t.push_back(0.01 * static_cast<double>(k));
      speeds.push_back(1.0 + 0.5 * std::sin(0.7 * static_cast<double>(k)));
    }
    table.columns = {speeds, std::vector<double>(speeds.size(), 0.0)};
    TableSource log(table);
    motion = detector::read_reference(log, RegressorFilter(model, {}, measurement));
  }

  [[nodiscard]] double limit(const model::FaultType& fault, double side, double speed, double effort) const {
    return likelihood_limit(model, measurement, {.motion = speed, .effort = effort},
                            Eigen::VectorXd::Constant(1, kTheta), motion, fault, side, 10, kQuestion);
  }
};

const model::FaultType kBias{.name = "bias", .range = {-10.0, 10.0}, .offset = Eigen::VectorXd::Ones(1)};
const model::FaultType kGain{.name = "gain", .range = {-0.9, 10.0}, .effort = Eigen::MatrixXd::Ones(1, 1)};

TEST(Likelihood, QuantileIsThatOfANormalVariable) {
  EXPECT_NEAR(upper_quantile(0.15865525393145707), 1.0, 1e-12);
  EXPECT_NEAR(upper_quantile(9.865876450376946e-10), 6.0, 1e-9);
}

TEST(Likelihood, LimitOfABiasFallsWithTheRootOfTheSamples) {
  const Viscous drive;
  // Equations between the onset at 0.10 s and 0.20 s: ten.
  const double expected = upper_quantile(kQuestion.risk) * kEffort / std::sqrt(10.0);
  EXPECT_NEAR(drive.limit(kBias, 1.0, 0.0, kEffort), expected, 1e-6 * expected);
  EXPECT_NEAR(drive.limit(kBias, -1.0, 0.0, kEffort), expected, 1e-6 * expected);
}

TEST(Likelihood, LimitOfAGainWeighsEverySampleByItsEffort) {
  const Viscous drive;
  double square = 0.0;
  for (std::size_t k = 10; k < 20; ++k) {
    square += std::pow(0.5 * kTheta * (drive.speeds[k] + drive.speeds[k + 1]), 2);
  }
  const double expected = upper_quantile(kQuestion.risk) * kEffort / std::sqrt(square);
  EXPECT_NEAR(drive.limit(kGain, 1.0, 0.0, kEffort), expected, 1e-6 * expected);
}

// Errors of speeds stand in two equations each, θ/2 times: a constant bias over the whole of ten equations is hidden by
// them all the more, and by twice the errors exactly twice as well.
TEST(Likelihood, ErrorsOfTheMotionHideMoreAndAllScaleTogether) {
  const Viscous drive;
  const double alone = drive.limit(kBias, 1.0, 0.0, kEffort), both = drive.limit(kBias, 1.0, 0.05, kEffort);
  EXPECT_GT(both, 1.01 * alone);
  EXPECT_LT(both, alone * std::sqrt(1.0 + std::pow(kTheta * 0.05 / kEffort, 2)));
  EXPECT_NEAR(drive.limit(kBias, 1.0, 0.10, 2.0 * kEffort), 2.0 * both, 1e-6 * both);
}

TEST(Likelihood, NothingIsSeenBeyondTheRange) {
  const Viscous drive;
  model::FaultType small = kBias;
  small.range = {-1e-3, 1e-3};
  EXPECT_TRUE(std::isinf(drive.limit(small, 1.0, 0.0, kEffort)));
}

}  // namespace
}  // namespace wheelwright::bench::likelihood_test
