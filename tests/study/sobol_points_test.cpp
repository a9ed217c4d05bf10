// SPDX-License-Identifier: Apache-2.0
/// \file
/// What makes a set of points a randomised Sobol sequence.
#include <cmath>
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "study/global_sensitivity.hpp"

namespace wheelwright::study::sobol_points_test {
namespace {

TEST(SobolPoints, StratifyEveryCoordinate) {
  const Eigen::MatrixXd points = sobol_points(64, 12, 3, 5);
  for (Eigen::Index r = 0; r < 3; ++r) {
    for (Eigen::Index d = 0; d < 12; ++d) {
      std::set<double> cells;
      for (const double u : points.col(d).segment(64 * r, 64)) {
        EXPECT_TRUE(u > 0.0 && u < 1.0);
        cells.insert(std::floor(64.0 * u));
      }
      EXPECT_EQ(cells.size(), 64U) << "replicate " << r << ", coordinate " << d;
    }
  }
}

// The first two coordinates are a (0, m, 2)-net: every elementary interval of area 1/64 holds one point.
TEST(SobolPoints, FillTheSquareEvenly) {
  const Eigen::MatrixXd points = sobol_points(64, 2, 1, 11);
  for (const int columns : {1, 2, 4, 8, 16, 32, 64}) {
    std::set<std::pair<int, int>> cells;
    for (const auto& point : points.rowwise()) {
      cells.emplace(static_cast<int>(point[0] * columns), static_cast<int>(point[1] * (64 / columns)));
    }
    EXPECT_EQ(cells.size(), 64U) << columns << " columns";
  }
}

// Each point is uniform whatever its place in the sequence: over replicates, the mean of the first and of the last
// point is 1/2, with a standard error of 1/√(12 · 3000) = 0.0053.
TEST(SobolPoints, AreUniformOneByOne) {
  constexpr Eigen::Index replicates = 3000;
  const Eigen::MatrixXd points = sobol_points(4, 3, replicates, 2);
  for (const Eigen::Index n : {0, 3}) {
    for (Eigen::Index d = 0; d < 3; ++d) {
      double sum = 0.0;
      for (Eigen::Index r = 0; r < replicates; ++r) {
        sum += points(4 * r + n, d);
      }
      EXPECT_NEAR(sum / static_cast<double>(replicates), 0.5, 4.0 * 0.0053);
    }
  }
}

TEST(SobolPoints, DependOnTheSeedAlone) {
  const Eigen::MatrixXd once = sobol_points(16, 5, 4, 7);
  EXPECT_EQ(once, sobol_points(16, 5, 4, 7));
  EXPECT_NE(once, sobol_points(16, 5, 4, 8));
  EXPECT_EQ(once, sobol_points(16, 5, 9, 7).topRows(once.rows()));
  EXPECT_NE(once.topRows(16), once.middleRows(16, 16));
}

TEST(SobolPoints, RefuseWhatIsNoDesign) {
  EXPECT_THROW((void)sobol_points(48, 2, 1, 1), InvalidArgument);
  EXPECT_THROW((void)sobol_points(0, 2, 1, 1), InvalidArgument);
  EXPECT_THROW((void)sobol_points(16, 0, 1, 1), InvalidArgument);
  EXPECT_THROW((void)sobol_points(16, 3668, 1, 1), InvalidArgument);
  EXPECT_THROW((void)sobol_points(16, 2, 0, 1), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::sobol_points_test
