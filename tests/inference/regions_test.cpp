// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/regions.hpp"
#include "core/statistics.hpp"

#include <gtest/gtest.h>

#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::regions_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

identify::RegressionMoments moments_of(std::uint64_t seed, Eigen::Index instants, double phi) {
  Random random(seed);
  Autoregression error(seed + 50, phi);
  const Eigen::MatrixXd Y = random.matrix(instants, 2);
  Eigen::VectorXd y = Y * Eigen::Vector2d(1.0, -2.0);
  for (double& value : y) {
    value += error.next();
  }
  identify::RegressionMoments moments(1, 2);
  moments.add(block_of(Y, y, 1));
  return moments;
}

TEST(Regions, StandSideBySideWithTheirPromises) {
  const identify::RegressionMoments moments = moments_of(1, 4000, 0.3);
  const identify::Estimate estimate = identify::ordinary_least_squares(moments);
  const IntervalBounds hull{Eigen::Vector2d(0.5, -2.5), Eigen::Vector2d(1.5, -1.5), Eigen::VectorXd::Constant(1, 4.5),
                            "N·m"};
  RegionOptions options;
  options.bootstrap.resamples = 500;
  const RegionComparison found = compare_regions(moments, estimate, options, hull);
  ASSERT_EQ(found.rows.size(), 4U);
  for (const RegionRow& row : found.rows) {
    EXPECT_TRUE(row.available) << to_string(row.method) << ": " << row.remark;
    EXPECT_FALSE(row.promise.empty());
    for (Eigen::Index j = 0; j < 2; ++j) {
      EXPECT_LE(row.lower[j], estimate.theta[j]);
      EXPECT_GE(row.upper[j], estimate.theta[j]);
    }
  }
  const double t = core::student_quantile(0.95, estimate.freedom);
  EXPECT_EQ(found.rows[0].upper[0], estimate.theta[0] + t * estimate.standard_error[0]);
  // Scores of an independent regressor are nearly white: the two asymptotic intervals agree, and the one for both
  // parameters at once is wider by about √χ²_2(0.95)/1.96 = 1.25.
  const auto width = [&](std::size_t row) { return found.rows[row].upper[0] - found.rows[row].lower[0]; };
  EXPECT_NEAR(width(1) / width(0), 1.0, 0.35);
  EXPECT_GT(width(2) / width(1), 1.0);
  EXPECT_LT(width(2) / width(1), 1.8);
  EXPECT_EQ(found.rows[2].promise.substr(0, 35), "at least 95 % for all parameters at");
  EXPECT_EQ(found.rows[3].promise, "always, for all parameters at once, while |e| ≤ 4.5 N·m at every instant");
  EXPECT_EQ(found.rows[3].upper, hull.upper);
}

TEST(Regions, SayWhatIsDoubtful) {
  // One parameter, whose column is as slow as the errors: four seconds are a few of their memories.
  Autoregression motion(1, 0.99), error(2, 0.99);
  Eigen::MatrixXd Y(400, 1);
  Eigen::VectorXd y(400);
  for (Eigen::Index k = 0; k < 400; ++k) {
    Y(k, 0) = motion.next();
    y[k] = Y(k, 0) + error.next();
  }
  identify::RegressionMoments moments(1, 1);
  moments.add(block_of(Y, y, 1));
  const RegionComparison slow = compare_regions(moments, identify::ordinary_least_squares(moments));
  EXPECT_NE(slow.rows[2].remark.find("short for its errors' memory"), std::string::npos);

  identify::Estimate other = identify::ordinary_least_squares(moments_of(3, 400, 0.0));
  other.estimator = identify::Estimator::bias_compensated;
  const RegionComparison compensated = compare_regions(moments_of(3, 400, 0.0), other);
  EXPECT_NE(compensated.rows[1].remark.find("noise of the motion"), std::string::npos);
  EXPECT_EQ(compensated.rows.size(), 3U);
}

TEST(Regions, AreUnboundedWhereNothingIsKnown) {
  Random random(4);
  Eigen::MatrixXd Y = random.matrix(400, 2);
  Y.col(1) = Y.col(0);
  identify::RegressionMoments moments(1, 2);
  moments.add(block_of(Y, random.matrix(400, 1), 1));
  const RegionComparison found = compare_regions(moments, identify::ordinary_least_squares(moments));
  for (const RegionRow& row : found.rows) {
    EXPECT_FALSE(row.available);
    EXPECT_FALSE(row.remark.empty());
    EXPECT_TRUE((row.upper.array() > 1e300).all());
  }
}

}  // namespace
}  // namespace wheelwright::inference::regions_test
