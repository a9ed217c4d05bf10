// SPDX-License-Identifier: Apache-2.0
/// \file
/// A drive as one least-squares problem over all residual spaces (filtered efforts, and increments of the pose against
/// wheel odometry, window by window): the residual of a nominal model, and the columns of every effect of a catalogue,
/// row by row; and residuals as signals in time.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "gap/causes/candidate.hpp"
#include "gap/effects/effect.hpp"
#include "gap/rows/block_gram.hpp"

namespace wheelwright::gap {

/// Equation that a residual belongs to.
enum class GapSpace {
  dynamic,    ///< filtered efforts against the model
  kinematic,  ///< increments of the pose against wheel odometry
};

/// Residuals of one channel on the rows that the analysis used. All have one value per row.
struct ResidualSeries {
  GapSpace space = GapSpace::dynamic;
  std::string channel;       ///< "sum", "difference"; "forward", "lateral", "yaw"
  std::string unit;          ///< of the values
  Eigen::VectorXd t;         ///< s, the log's own time; kinematic rows: the middle of the window
  Eigen::VectorXd signal;    ///< the left side: filtered effort, or increment of the pose
  Eigen::VectorXd nominal;   ///< left by M0 with its nominal θ (of the robot file or the baseline)
  Eigen::VectorXd refitted;  ///< left by M0 with θ fitted again: the structural part and the noise
  Eigen::VectorXd after;     ///< left by the best combination of causes
  double floor = 0.0;        ///< standard deviation of the noise, unit of the values
};

/// Consecutive windows, none across segments. What a signal has at their ends is its mean over `reach` rows on both
/// sides, where errors of the pose average out.
struct Windows {
  std::vector<Eigen::Index> first;   ///< rows at which windows begin
  std::vector<Eigen::Index> middle;  ///< rows whose heading is the direction of `forward`
  std::vector<Eigen::Index> last;    ///< rows at which they end, each the next one's first
  Eigen::Index reach = 0;            ///< rows
  Eigen::VectorXd t;                 ///< time of their middles, s

  [[nodiscard]] std::size_t size() const { return first.size(); }
};

/// One value per window; a vector is empty where the log cannot tell.
struct Increments {
  Eigen::VectorXd forward;  ///< m, along the heading at the window's middle
  Eigen::VectorXd lateral;  ///< m, to its left
  Eigen::VectorXd yaw;      ///< rad
};

/// Standard deviation of the increments' noise; 0 where it is unknown.
struct IncrementNoise {
  double forward = 0.0;  ///< m
  double lateral = 0.0;  ///< m
  double yaw = 0.0;      ///< rad
};

/// Windows of `length` (s; at least two steps) with a reach of a quarter of it, the remainder of each segment left out.
/// A segment without a whole window has none. Throws InvalidArgument unless `length` is > 0.
[[nodiscard]] Windows make_windows(const Drive& drive, double length = 0.5);

/// Pose minus odometry over each window: with the measured p and θ and the wheels' smooth v1 and v2,
///
///     [forward, lateral] = R(−θ_middle) (p_last − p_first − ∫ v1 [cos θ, sin θ] dt)
///     yaw                = θ_last − θ_first − ∫ v2 dt
///
/// where the ends of what is integrated are means too (Windows::reach).
///
/// Only yaw for a log with a heading but no position, or with a gyro only (whose ∫ gyro dt stands for the heading);
/// nothing for a log with neither, or a robot without two wheels.
[[nodiscard]] Increments pose_gap(const Drive& drive, const Windows& windows);

/// Increments of a column's body velocity (Column::forward, lateral, yaw): ∫ R(θ) [forward, lateral] dt, turned alike,
/// and ∫ yaw dt. The vectors are empty where those of pose_gap are, and where the column has no such part.
[[nodiscard]] Increments increments_of(const Drive& drive, const Windows& windows, const Column& column);

/// Noise of the increments from that of the pose, by third differences of the pose (a smooth motion leaves none of
/// itself), which averages out over the windows' `reach`; never below what the pose's resolution makes. Errors of the
/// wheels are not in it.
[[nodiscard]] IncrementNoise pose_noise(const Drive& drive, Eigen::Index reach = 0);

/// Part of `gap` that the wheels' motion does not determine: half the mean square difference between windows of nearly
/// the same motion (both coordinates at first, middle and last row, each within a twentieth of its root mean square in
/// the mean), each with its nearest one of another time. A drive with fewer than `fewest` such windows has none to be
/// had. It is what repeated runs would show, the ground's and the pose's own whims included (Rice 1984).
[[nodiscard]] IncrementNoise repeatability(const Drive& drive, const Windows& windows, const Increments& gap,
                                           std::size_t fewest = 30);

/// An effect with its numbers.
struct FittedEffect {
  Effect effect;
  std::vector<double> shape;
  Eigen::VectorXd coefficients;  ///< of its columns; empty for an effect of unit coefficient
};

/// Standard deviation of what noise alone leaves in the filtered rows.
struct NoiseFloor {
  Eigen::VectorXd efforts;    ///< per output
  IncrementNoise increments;  ///< of the pose; a zero leaves that row out
};

/// Options for the rows of a drive.
struct GapRowOptions {
  double beta = 10.0;       ///< of f₂, 1/s
  double row_step = 1.0;    ///< in 1/β: rows of efforts are taken this far apart; those between say little new, and
                            ///< would count for more than the pose's
  double window = 0.5;      ///< s, of pose increments
  bool skip_rest = true;    ///< leave out rows near a joint's standstill
  std::size_t threads = 1;  ///< results do not depend on it
};

/// The rows of a drive.
struct GapRows {
  std::vector<RowSpace> spaces;         ///< efforts by output, then forward, lateral and yaw as far as there is a pose;
                                        ///< columns: those of θ, then what was added
  std::vector<GapSpace> kinds;          ///< of each space
  std::vector<Eigen::Index> instants;   ///< of the effort rows, in the drive
  Windows windows;                      ///< of the pose rows
  std::size_t parameters = 0;           ///< p, the first columns
  std::vector<Eigen::VectorXd> signal;  ///< of each space: the left side before anything is taken from it
};

/// Rows of `drive` with the response y − Yθ − Σ `healthy` (efforts) and pose − odometry − Σ `healthy` (pose), θ being
/// drive.theta. The spaces of efforts have no rows for a drive without efforts. Throws InputError when too few rows are
/// left: a log that never moves, or is shorter than the filter.
[[nodiscard]] GapRows make_gap_rows(const Drive& drive, const NoiseFloor& floor,
                                    const std::vector<FittedEffect>& healthy, const GapRowOptions& options);

/// Adds a column, one part for each space, and returns its index.
std::size_t add_column(std::vector<RowSpace>& spaces, std::vector<Eigen::VectorXd> parts);

/// The values of `signal` at `rows`.
[[nodiscard]] Eigen::VectorXd picked(const Eigen::VectorXd& signal, const std::vector<Eigen::Index>& rows);

/// The part of `column` in each space of `rows`.
[[nodiscard]] std::vector<Eigen::VectorXd> rows_of(const Drive& drive, const GapRows& rows, const Column& column,
                                                   const GapRowOptions& options);

/// The contribution of `fitted` to the rows.
[[nodiscard]] std::vector<Eigen::VectorXd> rows_of(const Drive& drive, const GapRows& rows, const FittedEffect& fitted,
                                                   const GapRowOptions& options);

/// Points of each effect's shapes, by effect.
using ShapeGrids = std::vector<std::vector<std::vector<double>>>;

/// The grids of all effects of `catalogue`; none for those that do not apply to `drive`.
[[nodiscard]] ShapeGrids all_shapes(const std::vector<Effect>& catalogue, const Drive& drive);

/// Finer grids about the shapes of the single effects and of the best `sets` of every other size of `looked_at`
/// (Selection::looked_at on `table`): every continuous shape goes from one point of `grids` below to one above in
/// `points` steps each way, and discrete ones take all their values.
[[nodiscard]] ShapeGrids finer_shapes(const std::vector<Effect>& catalogue, const ShapeGrids& grids,
                                      const CandidateTable& table, const std::vector<CauseSet>& looked_at,
                                      std::size_t sets = 8, int points = 3);

/// Adds the columns of every effect of `catalogue` at the points of `shapes`. The table's `gram` is not set yet.
[[nodiscard]] CandidateTable add_catalogue(GapRows& rows, const Drive& drive, const std::vector<Effect>& catalogue,
                                           const ShapeGrids& shapes, const GapRowOptions& options);

}  // namespace wheelwright::gap
