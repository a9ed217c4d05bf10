// SPDX-License-Identifier: Apache-2.0
/// \file
/// Designs over the inputs of a study: grids, one at a time, Morris's elementary effects.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::study {

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

/// Points of the grid. Throws InvalidArgument for no input, a level below 1, a nominal vector of another length or
/// outside [0, 1], and more points than `most`, telling their number (or that it overflows).
[[nodiscard]] Eigen::Index grid_points(const Grid& grid);

/// The point at a level for each input, the last input's levels following one another. Throws as grid_points(), and for
/// levels that the grid has not.
[[nodiscard]] Eigen::Index grid_point(const Grid& grid, const std::vector<Eigen::Index>& at);

/// Coordinates of an input's levels. Throws as grid_points(), and for an input that the grid has not.
[[nodiscard]] Eigen::VectorXd grid_coordinates(const Grid& grid, Eigen::Index input);

/// All points, one a row. Throws as grid_points().
[[nodiscard]] Eigen::MatrixXd grid_design(const Grid& grid);

/// The map of one quantity (`values`, one for each point) over inputs `x` and `y`, the others at the levels of `at`
/// (whose entries for x and y are not looked at). Throws as grid_points(), where x and y are the same or no inputs,
/// where `at` has not a level of each other input, and where `values` has not one value for each point.
[[nodiscard]] GridMap grid_map(const Grid& grid, const Eigen::VectorXd& values, Eigen::Index x, Eigen::Index y,
                               std::vector<Eigen::Index> at);

/// A quantity over one input. All values in the quantity's unit, NaN where there was none.
struct InputCurve {
  Eigen::VectorXd coordinates = {};  ///< levels from 0 to 1, equally spaced
  Eigen::VectorXd values = {};       ///< at each of them
  double low = 0.0;                  ///< value at the input's lower end
  double high = 0.0;                 ///< value at its upper end
  double swing = 0.0;                ///< largest less smallest value, with the nominal point; NaN for no value at all
  Eigen::Index missing = 0;          ///< levels without a value
};

/// A quantity over each input.
struct OneAtATime {
  double nominal = 0.0;                 ///< value at the nominal point; NaN where there was none
  std::vector<InputCurve> inputs = {};  ///< in the design's order
  std::vector<std::size_t> order = {};  ///< of the inputs, the largest swing first, those without a value last
};

/// The nominal point, then for each input `levels` rows with that input at 0, 1/(levels − 1), …, 1 and the others
/// nominal. `nominal` holds a coordinate in [0, 1] for each input. Shape (1 + inputs · levels) × inputs. Throws
/// InvalidArgument for no input, a coordinate outside [0, 1], or fewer than two levels.
[[nodiscard]] Eigen::MatrixXd one_at_a_time_design(const Eigen::VectorXd& nominal, Eigen::Index levels = 5);

/// Curves for each column of `values` (rows of the design × quantities; NaN or an infinity where a row gave no value).
/// Throws InvalidArgument where `values` has not the rows of the design.
[[nodiscard]] std::vector<OneAtATime> one_at_a_time(const Eigen::MatrixXd& values, Eigen::Index inputs,
                                                    Eigen::Index levels = 5);

/// Options of a screening, which costs trajectories · (inputs + 1) evaluations.
struct MorrisOptions {
  Eigen::Index trajectories = 20;  ///< at least 2; more of them, with the same seed, only add rows to the design
  Eigen::Index levels = 4;         ///< p of the grid {0, 1/(p−1), …, 1}, even
  std::uint64_t seed = 1;
  double confidence = 0.95;  ///< of each interval by itself, inside (0, 1)
};

/// Elementary effects of one input on one quantity. In the quantity's unit per whole range of the input; NaN where too
/// few effects have values: none for means, fewer than two for the rest.
struct ElementaryEffects {
  double mean = 0.0;            ///< μ: the effect's mean over the cube; effects of both signs cancel
  double mean_absolute = 0.0;   ///< μ* (campolongo2007): of its absolute value, by which inputs are ranked
  double deviation = 0.0;       ///< σ: its standard deviation; 0 without curvature and interactions
  double standard_error = 0.0;  ///< of μ*
  double lower = 0.0;           ///< of the interval of μ*, cut at 0
  double upper = 0.0;
  Eigen::Index effects = 0;  ///< that had values; the rest of the trajectories lack one
};

/// Trajectories, inputs + 1 rows each: from a random point of the grid every input moves once, in random order, by
/// Δ = p/(2(p−1)) up or down. Shape trajectories · (inputs + 1) × inputs, coordinates in [0, 1]. Throws InvalidArgument
/// for no input or options outside their domains.
[[nodiscard]] Eigen::MatrixXd morris_design(Eigen::Index inputs, const MorrisOptions& options = {});

/// Effects for each column of `values` (rows of morris_design(inputs, options) × quantities; NaN or an infinity where a
/// row gave no value); result[quantity][input].
///
/// Trajectories are independent, each has one effect of an input: the interval is μ* ± Student's t with effects − 1
/// degrees of freedom times standard error, for the mean over the grid's points. It holds its confidence as far as a
/// mean of that many effects is normally distributed; rare large effects, as of a threshold, need more trajectories.
///
/// An effect that lacks one of its two values is left out and not imputed. Throws InvalidArgument where `values` has
/// not the rows of the design.
[[nodiscard]] std::vector<std::vector<ElementaryEffects>> morris_effects(const Eigen::MatrixXd& values,
                                                                         Eigen::Index inputs,
                                                                         const MorrisOptions& options = {});

}  // namespace wheelwright::study
