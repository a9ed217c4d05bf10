// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/residual_statistics.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
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
      squared_(outputs_.size()) {}

void ResidualStatistics::add(const RegressionBlock& block, std::size_t first, std::size_t last) {
  check::that(block.outputs == outputs_.size(), "residual statistics", "one weight for each output");
  last = std::min(last, block.instants());
  Eigen::VectorXd score(theta_.size()), square(weights_.size());
  for (std::size_t k = first; k < last; ++k) {
    score.setZero();
    for (std::size_t i = 0; i < block.outputs; ++i) {
      const auto row = static_cast<Eigen::Index>(k * block.outputs + i);
      const auto at = static_cast<Eigen::Index>(i);
      const double e = block.y[row] - block.Y.row(row).dot(theta_);
      score += weights_[at] * weights_[at] * e * block.Y.row(row).transpose();
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
    ++instants_;
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
  return s;
}

}  // namespace wheelwright
