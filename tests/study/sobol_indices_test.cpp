// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sobol' indices: the design, exact indices in closed form, values that are missing.
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "study/global_sensitivity.hpp"
#include "tests/study/test_functions.hpp"

namespace wheelwright::study::sobol_indices_test {
namespace {

namespace example = sensitivity_example;

SobolIndices indices(const example::TestFunction& f, const SobolOptions& options = {}) {
  return sobol_indices(example::evaluate(f, sobol_design(f.inputs, options)), f.inputs, options).at(0);
}

TEST(SobolDesign, MixesOneCoordinateAtATime) {
  const SobolOptions options{.points = 8, .replicates = 3};
  const Eigen::MatrixXd design = sobol_design(4, options);
  ASSERT_EQ(design.rows(), 8 * 3 * 6);
  ASSERT_EQ(design.cols(), 4);
  for (Eigen::Index n = 0; n < design.rows(); n += 6) {
    for (Eigen::Index i = 0; i < 4; ++i) {
      for (Eigen::Index j = 0; j < 4; ++j) {
        EXPECT_EQ(design(n + 2 + i, j), design(i == j ? n + 1 : n, j));
      }
      EXPECT_NE(design(n, i), design(n + 1, i));
    }
  }
}

TEST(SobolDesign, GrowsByReplicates) {
  const Eigen::MatrixXd small = sobol_design(3, {.points = 16, .replicates = 4, .seed = 3});
  const Eigen::MatrixXd large = sobol_design(3, {.points = 16, .replicates = 7, .seed = 3});
  EXPECT_EQ(small, large.topRows(small.rows()));
  EXPECT_NE(small, sobol_design(3, {.points = 16, .replicates = 4, .seed = 4}));
}

// Of 26 intervals of 99.9 % all should hold; shares at 95 % are tested over seeds, in sobol_coverage_test.cpp.
TEST(SobolIndices, HoldTheExactOnes) {
  for (const auto& f : {example::ishigami(), example::g_function(), example::additive()}) {
    const SobolIndices found = indices(f, {.points = 1024, .replicates = 16, .confidence = 0.999});
    EXPECT_EQ(found.status, SobolStatus::estimated);
    EXPECT_EQ(found.base_points, 1024 * 16);
    EXPECT_EQ(found.left_out, 0.0);
    for (std::size_t i = 0; i < f.first.size(); ++i) {
      EXPECT_LE(found.first[i].lower, f.first[i]) << f.name << " " << i;
      EXPECT_GE(found.first[i].upper, f.first[i]) << f.name << " " << i;
      EXPECT_LE(found.total[i].lower, f.total[i]) << f.name << " " << i;
      EXPECT_GE(found.total[i].upper, f.total[i]) << f.name << " " << i;
      EXPECT_LT(found.first[i].upper - found.first[i].lower, 0.1) << f.name << " " << i;
      EXPECT_LT(found.total[i].upper - found.total[i].lower, 0.1) << f.name << " " << i;
    }
  }
}

TEST(SobolIndices, TellHowMuchIsInteraction) {
  const auto f = example::ishigami();
  const SobolIndices found = indices(f, {.points = 256, .replicates = 16, .confidence = 0.999});
  const double exact = 1.0 - f.first[0] - f.first[1];
  EXPECT_LE(found.interactions.lower, exact);
  EXPECT_GE(found.interactions.upper, exact);
  const SobolIndices none = indices(example::additive(), {.confidence = 0.999});
  EXPECT_LE(none.interactions.lower, 0.0);
  EXPECT_GE(none.interactions.upper, 0.0);
}

TEST(SobolIndices, OfAnInputThatDoesNothingAreZero) {
  const SobolIndices found = indices(example::additive(Eigen::Vector3d(1.0, 0.0, 2.0)));
  for (const SobolIndex& index : {found.first[1], found.total[1]}) {
    EXPECT_EQ(index.estimate, 0.0);
    EXPECT_EQ(index.lower, 0.0);
    EXPECT_EQ(index.upper, 0.0);
  }
}

// f = c · x has Var f = Σ c²/12.
TEST(SobolIndices, ComeWithMeanAndVariance) {
  const SobolIndices found = indices(example::additive(Eigen::Vector2d(3.0, 4.0), 5.0), {.points = 1024});
  EXPECT_NEAR(found.mean, 8.5, 1e-3);
  EXPECT_NEAR(found.variance, 25.0 / 12.0, 1e-2);
}

TEST(SobolIndices, DoNotDependOnUnitAndOrigin) {
  const auto f = example::g_function();
  auto moved = f;
  moved.value = [&](const Eigen::VectorXd& u) { return 1e6 - 1e3 * f.value(u); };
  const SobolIndices one = indices(f), other = indices(moved);
  for (std::size_t i = 0; i < f.first.size(); ++i) {
    EXPECT_NEAR(one.first[i].lower, other.first[i].lower, 1e-8);
    EXPECT_NEAR(one.total[i].upper, other.total[i].upper, 1e-8);
  }
}

TEST(SobolIndices, OfAConstantAreFlagged) {
  auto f = example::additive(Eigen::Vector2d::Zero(), 0.1);
  const SobolIndices found = indices(f);
  EXPECT_EQ(found.status, SobolStatus::constant);
  EXPECT_DOUBLE_EQ(found.mean, 0.1);
  ASSERT_EQ(found.first.size(), 2U);
  EXPECT_EQ(found.first[0].estimate, 0.0);
  EXPECT_EQ(found.total[1].upper, 0.0);
  f.value = [](const Eigen::VectorXd& u) { return 1e5 * (1.0 + 1e-16 * u[0]); };
  EXPECT_EQ(indices(f).status, SobolStatus::constant);
}

TEST(SobolIndices, LeaveOutWholeBasePointsWithoutAValue) {
  const SobolOptions options{.points = 16, .replicates = 4};
  const auto f = example::ishigami();
  const Eigen::MatrixXd whole = example::evaluate(f, sobol_design(3, options));
  Eigen::MatrixXd values = whole.replicate(1, 3);
  values(5 * 3 + 2, 0) = core::kNan;                            // one of the third base point's
  values(5 * 20, 0) = std::numeric_limits<double>::infinity();  // and one of the 21st's
  values.col(1).segment(5 * 3, 5).setConstant(core::kNan);
  values.col(1).segment(5 * 20, 5).setConstant(-1e300 * 1e300);
  const auto found = sobol_indices(values, 3, options);
  EXPECT_EQ(found[0].base_points, 62);
  EXPECT_DOUBLE_EQ(found[0].left_out, 2.0 / 64.0);
  EXPECT_EQ(found[2].base_points, 64);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(found[0].first[i].estimate, found[1].first[i].estimate);
    EXPECT_EQ(found[0].total[i].upper, found[1].total[i].upper);
    EXPECT_EQ(found[2].total[i].upper, sobol_indices(whole, 3, options)[0].total[i].upper);
  }
}

// A replicate without a single value: the others are a design of their own.
TEST(SobolIndices, DoWithoutAWholeReplicate) {
  const SobolOptions four{.points = 16, .replicates = 4}, three{.points = 16, .replicates = 3};
  const auto f = example::ishigami();
  Eigen::MatrixXd values = example::evaluate(f, sobol_design(3, four));
  const SobolIndices expected = sobol_indices(values.topRows(16 * 3 * 5), 3, three).at(0);
  values.bottomRows(16 * 5).setConstant(core::kNan);
  const SobolIndices found = sobol_indices(values, 3, four).at(0);
  EXPECT_DOUBLE_EQ(found.left_out, 0.25);
  EXPECT_EQ(found.first[0].lower, expected.first[0].lower);
  EXPECT_EQ(found.total[2].upper, expected.total[2].upper);
}

TEST(SobolIndices, SayWhereThereAreTooFewValues) {
  const SobolOptions options{.points = 16, .replicates = 4};
  Eigen::MatrixXd values = example::evaluate(example::ishigami(), sobol_design(3, options)).replicate(1, 3);
  values.col(0).setConstant(core::kNan);
  values.col(1).tail(16 * 3 * 5).setConstant(core::kNan);  // one replicate is left
  values.col(2).tail(16 * 3 * 5).setConstant(0.3);         // one replicate has all the variance
  for (const SobolIndices& found : sobol_indices(values, 3, options)) {
    EXPECT_EQ(found.status, SobolStatus::too_few);
    EXPECT_EQ(found.first.at(2).upper, 0.0);
    EXPECT_EQ(found.interactions.upper, 0.0);
  }
}

TEST(SobolIndices, RefuseWhatIsNoStudy) {
  EXPECT_THROW((void)sobol_design(0), InvalidArgument);
  EXPECT_THROW((void)sobol_design(2, {.points = 24}), InvalidArgument);
  EXPECT_THROW((void)sobol_design(2, {.points = 1}), InvalidArgument);
  EXPECT_THROW((void)sobol_design(2, {.replicates = 1}), InvalidArgument);
  EXPECT_THROW((void)sobol_design(2, {.confidence = 1.0}), InvalidArgument);
  EXPECT_THROW((void)sobol_indices(Eigen::MatrixXd::Zero(7, 1), 2), InvalidArgument);
  EXPECT_TRUE(sobol_indices(Eigen::MatrixXd(8 * 64 * 4, 0), 2).empty());
}

}  // namespace
}  // namespace wheelwright::study::sobol_indices_test
