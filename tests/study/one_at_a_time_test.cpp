// SPDX-License-Identifier: Apache-2.0
/// \file
/// One input at a time.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "study/global_sensitivity.hpp"
#include "tests/study/test_functions.hpp"

namespace wheelwright::study::one_at_a_time_test {
namespace {

namespace example = sensitivity_example;

TEST(OneAtATimeDesign, VariesOneInputFromEndToEnd) {
  const Eigen::Vector3d nominal(0.2, 0.5, 1.0);
  const Eigen::MatrixXd design = one_at_a_time_design(nominal, 4);
  ASSERT_EQ(design.rows(), 13);
  EXPECT_EQ(design.row(0).transpose(), nominal);
  for (Eigen::Index i = 0; i < 3; ++i) {
    const Eigen::MatrixXd part = design.middleRows(1 + 4 * i, 4);
    EXPECT_EQ(part(0, i), 0.0);
    EXPECT_NEAR(part(1, i), 1.0 / 3.0, 1e-15);
    EXPECT_EQ(part(3, i), 1.0);
    for (Eigen::Index j = 0; j < 3; ++j) {
      if (j != i) {
        EXPECT_TRUE((part.col(j).array() == nominal[j]).all());
      }
    }
  }
}

TEST(OneAtATime, OfALinearFunctionIsSortedBySlope) {
  const Eigen::Vector3d nominal(0.2, 0.5, 1.0);
  const auto f = example::additive(Eigen::Vector3d(1.0, -5.0, 2.0), 10.0);
  const OneAtATime found = one_at_a_time(example::evaluate(f, one_at_a_time_design(nominal)), 3).at(0);
  const double middle = 10.0 + 0.2 - 2.5 + 2.0;
  EXPECT_NEAR(found.nominal, middle, 1e-14);
  EXPECT_NEAR(found.inputs[1].low, middle + 2.5, 1e-14);
  EXPECT_NEAR(found.inputs[1].high, middle - 2.5, 1e-14);
  EXPECT_NEAR(found.inputs[1].swing, 5.0, 1e-14);
  EXPECT_NEAR(found.inputs[2].values[1], middle - 2.0 * 0.75, 1e-14);
  EXPECT_EQ(found.order, (std::vector<std::size_t>{1, 2, 0}));
}

// (u − 0.1)², nominal 0.1: the least value is at neither end and at no level.
TEST(OneAtATime, SwingsAsFarAsTheNominalPoint) {
  const example::TestFunction f{
      "bowl", 1, [](const Eigen::VectorXd& u) { return (u[0] - 0.1) * (u[0] - 0.1); }, {}, {}};
  const Eigen::VectorXd nominal = Eigen::VectorXd::Constant(1, 0.1);
  const OneAtATime found = one_at_a_time(example::evaluate(f, one_at_a_time_design(nominal, 3)), 1, 3).at(0);
  EXPECT_EQ(found.nominal, 0.0);
  EXPECT_NEAR(found.inputs[0].swing, 0.81, 1e-15);
}

TEST(OneAtATime, KeepsGapsWhereValuesAreMissing) {
  Eigen::MatrixXd values(7, 2);  // two inputs, three levels
  values.col(0) << 1.0, 0.0, core::kNan, 3.0, core::kNan, std::numeric_limits<double>::infinity(), core::kNan;
  values.col(1).setConstant(core::kNan);
  const auto found = one_at_a_time(values, 2, 3);
  EXPECT_EQ(found[0].inputs[0].missing, 1);
  EXPECT_EQ(found[0].inputs[0].swing, 3.0);
  EXPECT_TRUE(std::isnan(found[0].inputs[0].values[1]));
  EXPECT_EQ(found[0].inputs[1].missing, 3);
  EXPECT_EQ(found[0].inputs[1].swing, 0.0);  // the nominal point alone
  EXPECT_TRUE(std::isnan(found[0].inputs[1].values[1]));
  EXPECT_TRUE(std::isnan(found[1].inputs[0].swing));
  EXPECT_EQ(found[1].order, (std::vector<std::size_t>{0, 1}));
}

TEST(OneAtATime, RefusesWhatIsNoStudy) {
  EXPECT_THROW((void)one_at_a_time_design(Eigen::VectorXd()), InvalidArgument);
  EXPECT_THROW((void)one_at_a_time_design(Eigen::Vector2d(0.5, 1.5)), InvalidArgument);
  EXPECT_THROW((void)one_at_a_time_design(Eigen::Vector2d(0.5, core::kNan)), InvalidArgument);
  EXPECT_THROW((void)one_at_a_time_design(Eigen::Vector2d(0.5, 0.5), 1), InvalidArgument);
  EXPECT_THROW((void)one_at_a_time(Eigen::MatrixXd::Zero(10, 1), 2), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::one_at_a_time_test
