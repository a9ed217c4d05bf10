// SPDX-License-Identifier: Apache-2.0
/// \file
/// Full grids: every combination of levels, and maps over two of the inputs.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// A full factorial over the unit cube. Points are numbered from 0, the last input's level runs fastest.
struct Grid {
  std::vector<Eigen::Index> levels = {};  ///< of each input, equally spaced from 0 to 1; one level: the nominal value
  Eigen::VectorXd nominal = {};           ///< coordinate of each input where it has one level, in [0, 1]
  Eigen::Index most = 100'000;            ///< points that are allowed
};

/// A quantity over two inputs, the others at fixed levels.
struct GridMap {
  Eigen::VectorXd x = {};       ///< coordinates of the first input
  Eigen::VectorXd y = {};       ///< of the second
  Eigen::MatrixXd values = {};  ///< values(a, b) at x[a], y[b]; NaN where there was none
};

/// Points of the grid. Throws InvalidArgument for no input, a level below 1, a nominal vector of another length or outside
/// [0, 1], and more points than `most`, telling their number (or that it overflows).
[[nodiscard]] Eigen::Index grid_points(const Grid& grid);

/// Level of each input at a point. Throws as grid_points(), and for a point that the grid has not.
[[nodiscard]] std::vector<Eigen::Index> grid_levels(const Grid& grid, Eigen::Index point);

/// The point at a level for each input: the inverse of grid_levels(). Throws as grid_points(), and for levels that the
/// grid has not.
[[nodiscard]] Eigen::Index grid_point(const Grid& grid, const std::vector<Eigen::Index>& at);

/// Coordinates of an input's levels. Throws as grid_points(), and for an input that the grid has not.
[[nodiscard]] Eigen::VectorXd grid_coordinates(const Grid& grid, Eigen::Index input);

/// All points, one a row. Throws as grid_points().
[[nodiscard]] Eigen::MatrixXd grid_design(const Grid& grid);

/// The map of one quantity (`values`, one for each point) over inputs `x` and `y`, the others at the levels of `at` (whose
/// entries for x and y are not looked at). Throws as grid_points(), where x and y are the same or no inputs, where `at` has
/// not a level of each other input, and where `values` has not one value for each point.
[[nodiscard]] GridMap grid_map(const Grid& grid, const Eigen::VectorXd& values, Eigen::Index x, Eigen::Index y,
                               std::vector<Eigen::Index> at);

}  // namespace wheelwright
