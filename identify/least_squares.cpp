// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/least_squares.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

constexpr Eigen::Index kBatch = 256;      // rows folded at a time
constexpr double kRankTolerance = 1e-10;  // of the largest singular value of unit columns

}  // namespace

LeastSquares::LeastSquares(std::size_t parameters, Eigen::VectorXd weights)
    : p_(parameters), weights_(std::move(weights)) {
  check::that(parameters > 0, "parameters", "at least 1");
  for (const double w : weights_) {
    check::positive(w, "least-squares weight");
  }
  const auto columns = static_cast<Eigen::Index>(p_) + 1;
  stack_ = Eigen::MatrixXd::Zero(columns + kBatch, columns);
  filled_ = columns;
}

void LeastSquares::fold() const {
  const Eigen::Index columns = stack_.cols();
  if (filled_ == columns) {
    return;
  }
  triangularize(stack_);
  filled_ = columns;
}

void LeastSquares::add(const RegressionBlock& block, std::size_t first, std::size_t last) {
  last = std::min(last, block.instants());
  check::that(block.parameters == p_, "least squares", "rows with the announced number of parameters");
  check::that(weights_.size() == 0 || static_cast<std::size_t>(weights_.size()) == block.outputs, "weights",
              "one for each output");
  const auto p = static_cast<Eigen::Index>(p_);
  for (std::size_t k = first; k < last; ++k) {
    for (std::size_t i = 0; i < block.outputs; ++i) {
      const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
      const double w = weights_.size() == 0 ? 1.0 : weights_[static_cast<Eigen::Index>(i)];
      if (filled_ == stack_.rows()) {
        fold();
      }
      stack_.row(filled_).head(p) = w * block.Y.row(row);
      stack_(filled_, p) = w * block.y[row];
      ++filled_;
    }
  }
  instants_ += last > first ? last - first : 0;
}

void LeastSquares::merge(const LeastSquares& other) {
  check::that(other.p_ == p_ && other.weights_ == weights_, "merge", "the same parameters and weights");
  other.fold();
  fold();
  stack_.middleRows(filled_, other.stack_.cols()) = other.stack_.topRows(other.stack_.cols());
  filled_ += other.stack_.cols();
  instants_ += other.instants_;
}

Eigen::MatrixXd LeastSquares::factor() const {
  fold();
  return stack_.topRows(stack_.cols()).triangularView<Eigen::Upper>();
}

LeastSquaresFit LeastSquares::solve(const std::vector<bool>& excluded) const {
  check::that(instants_ > 0, "least squares", "at least one instant");
  fold();
  const auto p = static_cast<Eigen::Index>(p_);
  Eigen::MatrixXd R = stack_.topLeftCorner(p, p).triangularView<Eigen::Upper>();
  for (std::size_t j = 0; j < excluded.size(); ++j) {
    if (excluded[j]) {
      R.col(static_cast<Eigen::Index>(j)).setZero();
    }
  }
  const Eigen::VectorXd c = stack_.col(p).head(p);

  LeastSquaresFit fit;
  fit.instants = instants_;
  const double root = std::sqrt(static_cast<double>(instants_));
  Eigen::VectorXd scale = R.colwise().norm();
  fit.column_rms = scale / root;
  for (double& s : scale) {
    s = s > 0.0 ? s : 1.0;
  }
  const Eigen::MatrixXd scaled = R * scale.cwiseInverse().asDiagonal();
  const SingularValues svd = singular_values(scaled);
  const Eigen::VectorXd& sigma = svd.values;
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    if (sigma[j] > kRankTolerance * sigma[0] && sigma[j] > 0.0) {
      inverse[j] = 1.0 / sigma[j];
      ++fit.rank;
    }
  }
  fit.condition = sigma[p - 1] > 0.0 ? sigma[0] / sigma[p - 1] : std::numeric_limits<double>::infinity();
  const Eigen::MatrixXd pseudo = scale.cwiseInverse().asDiagonal() * svd.V * inverse.asDiagonal() * svd.U.transpose();
  fit.estimate = pseudo * c;
  fit.inverse_gram = pseudo * pseudo.transpose();
  fit.partial_rms = Eigen::VectorXd::Zero(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    if (fit.rank == p) {
      fit.partial_rms[j] = 1.0 / (std::sqrt(fit.inverse_gram(j, j)) * root);
    } else {
      Eigen::MatrixXd others(p, p - 1);
      others << R.leftCols(j), R.rightCols(p - 1 - j);
      const Eigen::VectorXd explained = p == 1 ? Eigen::VectorXd(Eigen::VectorXd::Zero(p))
                                               : Eigen::VectorXd(others * minimum_norm_solution(others, R.col(j)));
      fit.partial_rms[j] = (R.col(j) - explained).norm() / root;
    }
  }
  const double misfit = stack_(p, p);
  fit.weighted_rss = misfit * misfit + (c - R * fit.estimate).squaredNorm();
  fit.weighted_tss = c.squaredNorm() + misfit * misfit;
  return fit;
}

LeastSquaresFit least_squares(RegressionSource& rows, const Eigen::VectorXd& weights) {
  LeastSquares fit(rows.parameters(), weights);
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    fit.add(block);
  }
  return fit.solve();
}

}  // namespace wheelwright
