// SPDX-License-Identifier: Apache-2.0
/// \file
/// A drive as one least-squares problem over all residual spaces: the residual of a nominal model, and the columns of
/// every effect of a catalogue, row by row.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/block_gram.hpp>
#include <wheelwright/gap/candidate.hpp>
#include <wheelwright/gap/effect.hpp>
#include <wheelwright/gap/kinematic_rows.hpp>
#include <wheelwright/gap/residual_series.hpp>

namespace wheelwright::gap {

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
  double row_step = 0.4;    ///< in 1/β: rows of efforts are taken this far apart; those between say nothing new
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

/// Residual of the response of `space` under `subset` with the first of its coefficients; without any, the response
/// less the fixed columns.
[[nodiscard]] Eigen::VectorXd residual(const RowSpace& space, const Subset& subset,
                                       const Eigen::VectorXd& coefficients);

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
