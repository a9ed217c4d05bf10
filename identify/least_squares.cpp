// SPDX-License-Identifier: Apache-2.0
#include "identify/least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::identify {
namespace {

constexpr std::size_t kStretches = 64;    // at least, of which it is known how much they say about a parameter
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
  core::triangularize(stack_);
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
  const core::SingularValues svd = core::singular_values(scaled);
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
      const Eigen::VectorXd explained = p == 1
                                            ? Eigen::VectorXd(Eigen::VectorXd::Zero(p))
                                            : Eigen::VectorXd(others * core::minimum_norm_solution(others, R.col(j)));
      fit.partial_rms[j] = (R.col(j) - explained).norm() / root;
    }
  }
  const double misfit = stack_(p, p);
  fit.weighted_rss = misfit * misfit + (c - R * fit.estimate).squaredNorm();
  fit.weighted_tss = c.squaredNorm() + misfit * misfit;
  return fit;
}

LeastSquaresFit least_squares(core::RegressionSource& rows, const Eigen::VectorXd& weights) {
  LeastSquares fit(rows.parameters(), weights);
  core::for_each_block(rows, [&](const RegressionBlock& block) { fit.add(block); });
  return fit.solve();
}

namespace {

// Mean-zero version of the block sums of a series, so that its long-run variance can be asked for.
double long_run_variance_of_sum(const BlockSums& series, Eigen::Index component) {
  const Eigen::MatrixXd blocks = series.blocks();
  const double mean = blocks.row(component).mean();
  BlockSums centred(1, static_cast<std::size_t>(std::max<Eigen::Index>(blocks.cols(), 8)));
  for (Eigen::Index k = 0; k < blocks.cols(); ++k) {
    centred.add(Eigen::VectorXd::Constant(1, blocks(component, k) - mean));
  }
  return long_run_covariance(centred).matrix(0, 0);
}

}  // namespace

ResidualStatistics::ResidualStatistics(Eigen::VectorXd theta, Eigen::VectorXd weights)
    : theta_(std::move(theta)),
      weights_(std::move(weights)),
      outputs_(static_cast<std::size_t>(weights_.size())),
      squares_(outputs_.size()),
      fourth_(outputs_.size()),
      torque_squares_(outputs_.size()),
      scores_(static_cast<std::size_t>(theta_.size())),
      squared_(outputs_.size()),
      errors_(outputs_.size()),
      grams_(outputs_.size() * static_cast<std::size_t>(theta_.size() * theta_.size()), kStretches) {}

void ResidualStatistics::add(const RegressionBlock& block, std::size_t first, std::size_t last) {
  check::that(block.outputs == outputs_.size(), "residual statistics", "one weight for each output");
  last = std::min(last, block.instants());
  const Eigen::Index p = theta_.size();
  Eigen::VectorXd score(p), square(weights_.size()), error(weights_.size()), gram(weights_.size() * p * p);
  for (std::size_t k = first; k < last; ++k) {
    score.setZero();
    for (std::size_t i = 0; i < block.outputs; ++i) {
      const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
      const auto at = static_cast<Eigen::Index>(i);
      const double e = block.y[row] - block.Y.row(row).dot(theta_);
      score += weights_[at] * weights_[at] * e * block.Y.row(row).transpose();
      error[at] = e;
      Eigen::Map<Eigen::MatrixXd>(gram.data() + at * p * p, p, p) = block.Y.row(row).transpose() * block.Y.row(row);
      square[at] = e * e;
      squares_[i] += e * e;
      fourth_[i] += e * e * e * e;
      torque_squares_[i] += block.y[row] * block.y[row];
      if (std::abs(e) > outputs_[i].largest) {
        outputs_[i].largest = std::abs(e);
        outputs_[i].largest_sample = block.sample[k];
        outputs_[i].largest_time = block.t[k];
      }
    }
    scores_.add(score);
    squared_.add(square);
    errors_.add(error);
    grams_.add(gram);
    ++instants_;
  }
}

void ResidualStatistics::know_errors(ResidualSummary& s, const Eigen::MatrixXd& inverse_gram) const {
  const Eigen::Index p = theta_.size();
  const Eigen::MatrixXd grams = grams_.blocks();
  const auto count = static_cast<double>(instants_);
  const double share = grams.cols() > 0 ? static_cast<double>(grams.cols() * grams_.block_length()) / count : 1.0;
  const auto of_block = [&](Eigen::Index i, Eigen::Index b) {
    return Eigen::Map<const Eigen::MatrixXd>(grams.col(b).data() + i * p * p, p, p);
  };
  Eigen::MatrixXd scores = Eigen::MatrixXd::Zero(p, p), squares = Eigen::MatrixXd::Zero(p, grams.cols());
  std::vector<Eigen::MatrixXd> totals;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    const double at_an_instant = std::pow(weights_[at], 4) * long_run_variance_of_sum(errors_, at) / count;
    totals.emplace_back(Eigen::MatrixXd::Zero(p, p));
    for (Eigen::Index b = 0; b < grams.cols(); ++b) {
      totals[i] += of_block(at, b) / share;
      squares.col(b) += at_an_instant * (inverse_gram * of_block(at, b) * inverse_gram).diagonal();
    }
    scores += at_an_instant * totals[i];
  }
  s.stationary_covariance = inverse_gram * scores * inverse_gram;
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    double& freedom = s.outputs[i].fit_freedom = core::kInfinity;
    for (Eigen::Index j = 0; j < p; ++j) {
      if (totals[i](j, j) > 0.0 && inverse_gram(j, j) > 0.0) {
        freedom = std::min(freedom, effective_freedom(squares.row(j), static_cast<std::size_t>(s.freedom)));
      }
    }
  }
}

ResidualSummary ResidualStatistics::summary(const Eigen::MatrixXd& inverse_gram) const {
  check::that(instants_ > 0, "residual statistics", "at least one instant");
  ResidualSummary s;
  s.instants = instants_;
  s.outputs = outputs_;
  const auto count = static_cast<double>(instants_);
  for (std::size_t i = 0; i < outputs_.size(); ++i) {
    OutputResidual& o = s.outputs[i];
    const double variance = squares_[i] / count;
    o.rms = std::sqrt(variance);
    o.torque_rms = std::sqrt(torque_squares_[i] / count);
    o.kurtosis = variance > 0.0 ? fourth_[i] / count / (variance * variance) : 0.0;
    // The mean of n independent Gaussian squares has the variance 2σ⁴/n.
    const double of_mean = long_run_variance_of_sum(squared_, static_cast<Eigen::Index>(i)) / (count * count);
    o.effective_instants =
        of_mean > 0.0 ? std::clamp(2.0 * variance * variance / of_mean, std::min(4.0, count), count) : count;
  }
  const LongRunCovariance scores = long_run_covariance(scores_);
  s.covariance = inverse_gram * scores.matrix * inverse_gram;
  s.standard_error = s.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  s.freedom = scores.freedom;
  know_errors(s, inverse_gram);
  return s;
}

namespace {

constexpr double kCollinear = 1e-7;  // of the column's own size

}  // namespace

void judge_noise_alone(ExcitationFinding& finding) {
  finding.state = Excitation::not_excited;
  finding.reason = "its motion is no larger than what sensor noise alone would show";
}

std::vector<ExcitationFinding> judge_excitation(const LeastSquaresFit& fit, const Eigen::VectorXd& standard_error,
                                                double t_quantile, const Eigen::VectorXd& noise_rms) {
  std::vector<ExcitationFinding> findings;
  for (Eigen::Index j = 0; j < fit.estimate.size(); ++j) {
    ExcitationFinding f;
    f.signal_rms = fit.partial_rms[j];
    f.noise_rms = noise_rms.size() > 0 ? noise_rms[j] : 0.0;
    if (!(fit.column_rms[j] > 0.0)) {
      f.state = Excitation::not_excited;
      f.reason = "its motion never occurs in the log";
    } else if (fit.partial_rms[j] <= kCollinear * fit.column_rms[j]) {
      f.state = Excitation::not_excited;
      f.reason = "its motion always comes together with that of another parameter";
    } else if (fit.partial_rms[j] < signal_over_noise * f.noise_rms) {
      judge_noise_alone(f);
    } else if (std::abs(fit.estimate[j]) < t_quantile * standard_error[j]) {
      f.state = Excitation::indistinct;
      f.reason = "it cannot be told from zero on this log";
    }
    findings.push_back(f);
  }
  return findings;
}

}  // namespace wheelwright::identify
