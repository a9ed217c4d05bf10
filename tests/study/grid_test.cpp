// SPDX-License-Identifier: Apache-2.0
/// \file
/// Points of a full grid and their numbers.
#include <cmath>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "study/global_sensitivity.hpp"

namespace wheelwright::study::grid_test {
namespace {

const Grid kGrid{{3, 1, 2, 4}, Eigen::Vector4d(0.5, 0.3, 0.5, 0.5)};

// Levels of each input at a point, the last input's one after the other.
std::vector<Eigen::Index> grid_levels(const Grid& grid, Eigen::Index point) {
  std::vector<Eigen::Index> at(grid.levels.size());
  for (std::size_t i = at.size(); i-- > 0;) {
    at[i] = point % grid.levels[i];
    point /= grid.levels[i];
  }
  return at;
}

TEST(Grid, NumbersItsPoints) {
  ASSERT_EQ(grid_points(kGrid), 24);
  const Eigen::MatrixXd design = grid_design(kGrid);
  ASSERT_EQ(design.rows(), 24);
  for (Eigen::Index n = 0; n < 24; ++n) {
    const std::vector<Eigen::Index> at = grid_levels(kGrid, n);
    EXPECT_EQ(grid_point(kGrid, at), n);
    for (Eigen::Index i = 0; i < 4; ++i) {
      EXPECT_EQ(design(n, i), grid_coordinates(kGrid, i)[at[static_cast<std::size_t>(i)]]);
    }
  }
  EXPECT_EQ(grid_levels(kGrid, 1), (std::vector<Eigen::Index>{0, 0, 0, 1}));
  EXPECT_EQ(grid_levels(kGrid, 23), (std::vector<Eigen::Index>{2, 0, 1, 3}));
}

TEST(Grid, ReachesBothEndsAndHoldsSingleLevelsNominal) {
  EXPECT_EQ(grid_coordinates(kGrid, 0), Eigen::Vector3d(0.0, 0.5, 1.0));
  EXPECT_EQ(grid_coordinates(kGrid, 1), Eigen::VectorXd::Constant(1, 0.3));
  EXPECT_EQ(grid_coordinates(kGrid, 2), Eigen::Vector2d(0.0, 1.0));
}

// f = 100 a + 10 c + d, of the levels.
TEST(GridMap, IsASlice) {
  Eigen::VectorXd values(24);
  for (Eigen::Index n = 0; n < 24; ++n) {
    const auto at = grid_levels(kGrid, n);
    values[n] = static_cast<double>(100 * at[0] + 10 * at[2] + at[3]);
  }
  const GridMap map = grid_map(kGrid, values, 3, 0, {0, 0, 1, 0});
  ASSERT_EQ(map.values.rows(), 4);
  ASSERT_EQ(map.values.cols(), 3);
  for (Eigen::Index a = 0; a < 4; ++a) {
    for (Eigen::Index b = 0; b < 3; ++b) {
      EXPECT_EQ(map.values(a, b), static_cast<double>(100 * b + 10 + a));
    }
  }
  EXPECT_EQ(map.y, grid_coordinates(kGrid, 0));
  values[grid_point(kGrid, {2, 0, 1, 3})] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(grid_map(kGrid, values, 3, 0, {0, 0, 1, 0}).values(3, 2)));
}

std::string refusal(const Grid& grid) {
  try {
    (void)grid_points(grid);
  } catch (const InvalidArgument& error) {
    return error.what();
  }
  return "";
}

TEST(Grid, RefusesTooManyPoints) {
  const Eigen::VectorXd nominal = Eigen::VectorXd::Constant(8, 0.5);
  EXPECT_THAT(refusal({{100, 100, 100}, Eigen::Vector3d::Zero()}),
              ::testing::HasSubstr("100 × 100 × 100 = 1000000 points: expected at most 100000"));
  EXPECT_THAT(refusal({std::vector<Eigen::Index>(8, 1'000'000), nominal}), ::testing::HasSubstr("at most 100000"));
  EXPECT_EQ(grid_points({{100, 100, 100}, Eigen::Vector3d::Zero(), 1'000'000}), 1'000'000);
}

TEST(Grid, RefusesWhatIsNoGrid) {
  EXPECT_NE(refusal({}), "");
  EXPECT_NE(refusal({{2, 0}, Eigen::Vector2d::Zero()}), "");
  EXPECT_NE(refusal({{2, 2}, Eigen::Vector3d::Zero()}), "");
  EXPECT_NE(refusal({{2, 2}, Eigen::Vector2d(0.5, -0.5)}), "");
  EXPECT_THROW((void)grid_point(kGrid, {0, 0, 2, 0}), InvalidArgument);
  EXPECT_THROW((void)grid_point(kGrid, {0, 0}), InvalidArgument);
  EXPECT_THROW((void)grid_coordinates(kGrid, 4), InvalidArgument);
  const Eigen::VectorXd values = Eigen::VectorXd::Zero(24);
  EXPECT_THROW((void)grid_map(kGrid, values, 1, 1, {0, 0, 0, 0}), InvalidArgument);
  EXPECT_THROW((void)grid_map(kGrid, values, 0, 4, {0, 0, 0, 0}), InvalidArgument);
  EXPECT_THROW((void)grid_map(kGrid, values, 0, 1, {0, 0, 0, 7}), InvalidArgument);
  EXPECT_THROW((void)grid_map(kGrid, values.head(23), 0, 1, {0, 0, 0, 0}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::grid_test
