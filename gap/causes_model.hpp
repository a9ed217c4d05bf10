// SPDX-License-Identifier: Apache-2.0
/// \file
/// A set of causes as a separable least-squares problem: continuous shapes nonlinear, all else linear.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/prepared.hpp>
#include <wheelwright/identify/variable_projection.hpp>

namespace wheelwright {

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

/// The rows of `problem` fitted by `set`, θ (where it is not held) and the effects' coefficients linear, their continuous
/// shapes free. Rows of all spaces one after the other, in units of their floors. Keeps references to `prepared` and
/// `problem`.
class CausesModel final : public SeparableModel {
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
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const override;

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

}  // namespace wheelwright
