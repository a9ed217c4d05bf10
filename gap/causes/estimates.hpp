// SPDX-License-Identifier: Apache-2.0
/// \file
/// Coefficients and shapes of a set of causes with their intervals, shapes tuned off the grid.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "gap/diagnosis.hpp"
#include "gap/prepared.hpp"
#include "identify/variable_projection.hpp"

namespace wheelwright::gap {

/// A continuous shape of one member of a set.
struct FreeShape {
  std::size_t member = 0;  ///< of the set
  std::size_t shape = 0;   ///< of Effect::shapes
  double lower = 0.0;
  double upper = 0.0;
  bool logarithmic = false;
};

/// Column `column` of the rows, one part for each space.
[[nodiscard]] std::vector<Eigen::VectorXd> column_parts(const GapRows& rows, std::size_t column);

/// The rows of `problem` fitted by `set`, θ (where it is not held) and the effects' coefficients linear, their
/// continuous shapes free. Rows of all spaces one after the other, in units of their floors. Keeps references to
/// `prepared` and `problem`.
class CausesModel final : public identify::SeparableModel {
 public:
  CausesModel(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set, BaseModel base);

  [[nodiscard]] const Eigen::VectorXd& response() const override { return response_; }
  [[nodiscard]] Eigen::Index shapes() const override { return static_cast<Eigen::Index>(free_.size()); }
  [[nodiscard]] Eigen::Index columns() const override { return static_cast<Eigen::Index>(theta_.size()) + linear_; }
  /// The free shapes, in order.
  [[nodiscard]] const std::vector<FreeShape>& free() const { return free_; }
  /// The candidates of the set.
  [[nodiscard]] const std::vector<Candidate>& members() const { return members_; }

  /// The free shapes that the set has.
  [[nodiscard]] Eigen::VectorXd start() const;
  /// Shapes of member `k` where the free ones are `shape`.
  [[nodiscard]] std::vector<double> shape_of(std::size_t k, const Eigen::VectorXd& shape) const;
  /// Columns of member `k` at its own `shape`, row parts by space.
  [[nodiscard]] std::vector<std::vector<Eigen::VectorXd>> parts_of(std::size_t k,
                                                                   const std::vector<double>& shape) const;
  /// Values; derivatives by central differences.
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const override;

 private:
  void fill(const Eigen::VectorXd& shape, Eigen::VectorXd& offset, Eigen::MatrixXd& columns) const;

  const PreparedGap& prepared_;
  const GapProblem& problem_;
  std::vector<Candidate> members_;
  std::vector<Eigen::VectorXd> theta_;
  Eigen::VectorXd response_;
  std::vector<FreeShape> free_;
  Eigen::Index linear_ = 0;
};

/// A set of causes fitted to a drive.
struct FittedCauses {
  std::vector<FittedEffect> effects;              ///< in the order of the set's members
  std::vector<std::vector<GapEstimate>> numbers;  ///< of each effect, as a report has them (Effect::physical)
  std::vector<std::vector<Interval>> intervals;   ///< of each effect's coefficients, 95 %
  Eigen::VectorXd theta;                          ///< p, θ_L with the causes beside it
  Eigen::VectorXd theta_error;                    ///< p, its standard errors; 0 where θ was held
  double freedom = 0.0;                           ///< of Student's t
  Subset subset;                                  ///< of the rows' columns at the set's own shapes
  Eigen::VectorXd coefficients;                   ///< of the subset
};

/// Fits `set` to the rows of `problem`. Continuous shapes are fitted by variable projection from where the search found
/// them; all intervals (95 %) are those of the jackknife over blocks of time (BlockGram::fit) of the model linearised
/// in its shapes. With `base` nominal θ is held where it is trusted.
[[nodiscard]] FittedCauses fit_causes(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set,
                                      BaseModel base, const BlockOptions& blocks);

/// Options of add_tuned_shapes().
struct TuneOptions {
  std::size_t shapes = 3;     ///< effects with at least so many continuous shapes are tuned: a grid of them is coarse
  double gain = 0.05;         ///< share of what the other causes leave that the effect must take off already
  std::size_t samples = 100;  ///< random points of the shapes
  std::size_t descents = 4;   ///< local searches
  std::size_t steps = 200;    ///< most evaluations of each
  std::uint64_t seed = 1;     ///< of the random points
  std::size_t threads = 1;    ///< the result does not depend on it
};

/// Adds to `grids` the best shapes of every effect with many of them: those that leave least in the best set of
/// `looked_at` (Selection::looked_at on the table of `problem`) that has it, its other causes' shapes tuned along. By
/// simplices from random points and from where the grid was best, since such effects (play that is crossed, or just
/// not) are not smooth in their shapes. Errors held out are compared later, as of all other points.
void add_tuned_shapes(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                      const std::vector<CauseSet>& looked_at, const TuneOptions& options = {});

/// Adds to `grids` the shapes of each member of `set`, and of other laws of its name in its place, that leave least
/// with θ held where it is trusted: with θ fitted beside it a curve that is nearly right and a change of θ do as well,
/// and would be two causes. Each from the best point of the table of `problem`, by variable projection.
void add_shapes_with_theta_held(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                                const CauseSet& set);

}  // namespace wheelwright::gap
