// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/grid.hpp>

#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

std::size_t at_index(Eigen::Index i) { return static_cast<std::size_t>(i); }

}  // namespace

Eigen::Index grid_points(const Grid& grid) {
  check::that(!grid.levels.empty(), "inputs of a grid", "at least 1");
  check::that(grid.nominal.size() == static_cast<Eigen::Index>(grid.levels.size()),
              fmt::format("{} nominal coordinates of a grid", grid.nominal.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  check::that((grid.nominal.array() >= 0.0).all() && (grid.nominal.array() <= 1.0).all(), "nominal coordinates",
              "numbers in [0, 1]");
  Eigen::Index points = 1;
  bool overflow = false;
  for (const Eigen::Index levels : grid.levels) {
    check::that(levels >= 1, fmt::format("{} levels of an input of a grid", levels), "at least 1");
    overflow = overflow || levels > std::numeric_limits<Eigen::Index>::max() / points;
    points = overflow ? points : points * levels;
  }
  check::that(!overflow && points <= grid.most,
              overflow ? fmt::format("a grid of {} points", fmt::join(grid.levels, " × "))
                       : fmt::format("a grid of {} = {} points", fmt::join(grid.levels, " × "), points),
              fmt::format("at most {}; take fewer levels, or Sobol' indices, which need no grid", grid.most));
  return points;
}

std::vector<Eigen::Index> grid_levels(const Grid& grid, Eigen::Index point) {
  const Eigen::Index points = grid_points(grid);
  check::that(point >= 0 && point < points, fmt::format("point {} of a grid", point),
              fmt::format("0 to {}", points - 1));
  std::vector<Eigen::Index> at(grid.levels.size());
  for (std::size_t i = at.size(); i-- > 0;) {
    at[i] = point % grid.levels[i];
    point /= grid.levels[i];
  }
  return at;
}

Eigen::Index grid_point(const Grid& grid, const std::vector<Eigen::Index>& at) {
  (void)grid_points(grid);
  check::that(at.size() == grid.levels.size(), fmt::format("{} levels of a grid's point", at.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  Eigen::Index point = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    check::that(at[i] >= 0 && at[i] < grid.levels[i], fmt::format("level {} of input {} of a grid", at[i], i),
                fmt::format("0 to {}", grid.levels[i] - 1));
    point = point * grid.levels[i] + at[i];
  }
  return point;
}

Eigen::VectorXd grid_coordinates(const Grid& grid, Eigen::Index input) {
  (void)grid_points(grid);
  check::that(input >= 0 && input < grid.nominal.size(), fmt::format("input {} of a grid", input),
              fmt::format("0 to {}", grid.nominal.size() - 1));
  const Eigen::Index levels = grid.levels[at_index(input)];
  if (levels == 1) {
    return Eigen::VectorXd::Constant(1, grid.nominal[input]);
  }
  return Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
}

Eigen::MatrixXd grid_design(const Grid& grid) {
  const Eigen::Index points = grid_points(grid);
  Eigen::MatrixXd design(points, grid.nominal.size());
  Eigen::Index run = 1;  // rows over which an input keeps its level
  for (Eigen::Index i = design.cols(); i-- > 0;) {
    const Eigen::VectorXd coordinates = grid_coordinates(grid, i);
    for (Eigen::Index n = 0; n < points; ++n) {
      design(n, i) = coordinates[n / run % coordinates.size()];
    }
    run *= coordinates.size();
  }
  return design;
}

GridMap grid_map(const Grid& grid, const Eigen::VectorXd& values, Eigen::Index x, Eigen::Index y,
                 std::vector<Eigen::Index> at) {
  const Eigen::Index points = grid_points(grid);
  check::that(values.size() == points, fmt::format("{} values of a grid", values.size()),
              fmt::format("{}, one for each point", points));
  check::that(x != y, "inputs of a map", "two different ones");
  GridMap map{grid_coordinates(grid, x), grid_coordinates(grid, y), {}};
  check::that(at.size() == grid.levels.size(), fmt::format("{} levels of a map", at.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  map.values.resize(map.x.size(), map.y.size());
  for (Eigen::Index a = 0; a < map.x.size(); ++a) {
    for (Eigen::Index b = 0; b < map.y.size(); ++b) {
      at[at_index(x)] = a;
      at[at_index(y)] = b;
      const double value = values[grid_point(grid, at)];
      map.values(a, b) = std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return map;
}

}  // namespace wheelwright
