// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/block_bootstrap.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/LU>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/inference/block_length.hpp>
#include <wheelwright/inference/score_blocks.hpp>

namespace wheelwright {
namespace {

constexpr double kSingularResample = 1e-12;  // reciprocal condition, columns scaled
constexpr std::size_t kFewStretches = 4;     // fewer cannot show their own spread
constexpr double kMostMissed = 0.5;          // of the variance, that is allowed for

// An index below `count`, each as likely, the same with every standard library.
std::size_t below(std::mt19937_64& generator, std::size_t count) {
  const std::uint64_t range = std::mt19937_64::max() - std::mt19937_64::max() % count;
  std::uint64_t drawn = generator();
  while (drawn >= range) {
    drawn = generator();
  }
  return static_cast<std::size_t>(drawn % count);
}

// Column s: the sum of columns s, s + 1, …, s + length − 1, counted round a circle.
Eigen::MatrixXd circular_sums(const Eigen::MatrixXd& columns, Eigen::Index length) {
  Eigen::MatrixXd sums = columns;
  const Eigen::Index B = columns.cols();
  for (Eigen::Index k = 1; k < length; ++k) {
    const Eigen::Index shift = k % B;
    sums.leftCols(B - shift) += columns.rightCols(B - shift);
    sums.rightCols(shift) += columns.leftCols(shift);
  }
  return sums;
}

// Quantile by linear interpolation between order statistics.
double quantile(std::vector<double> values, double level) {
  std::sort(values.begin(), values.end());
  const double at = level * static_cast<double>(values.size() - 1);
  const auto below_at = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below_at + 1, values.size() - 1);
  return values[below_at] + (at - static_cast<double>(below_at)) * (values[above] - values[below_at]);
}

}  // namespace

BlockBootstrap block_bootstrap(const RegressionMoments& moments, const BlockBootstrapOptions& options) {
  check::that(options.confidence > 0.0 && options.confidence < 1.0, "confidence", "between 0 and 1");
  check::that(options.resamples >= 20, "resamples", "at least 20");
  check::non_negative(options.seconds, "length of a stretch");
  const ScoreBlocks blocks = score_blocks(moments, options.estimator, options.instruments);
  const Eigen::Index q = blocks.c.rows();

  BlockBootstrap result;
  result.theta = blocks.unscaled(blocks.psi);
  result.standard_error = result.lower = result.upper = result.percentile_lower = result.percentile_upper =
      Eigen::VectorXd::Zero(static_cast<Eigen::Index>(blocks.parameters));
  result.confidence = options.confidence;
  result.seed = options.seed;
  result.reason = blocks.reason;
  if (!blocks.solvable) {
    return result;
  }
  const Eigen::MatrixXd influence = blocks.inverse * blocks.scores(blocks.psi);
  const std::size_t length =
      options.seconds > 0.0 ? blocks.lasting(options.seconds) : bootstrap_block_length(influence);
  const auto l = static_cast<Eigen::Index>(length);
  result.seconds = static_cast<double>(length) * blocks.block_seconds;
  result.stretches = (blocks.blocks() + length - 1) / length;
  if (result.stretches < kFewStretches) {
    result.reason = "the log is too short for its errors' memory";
    return result;
  }
  const auto K = static_cast<Eigen::Index>(result.stretches);

  const Eigen::MatrixXd A = circular_sums(blocks.A, l);
  const Eigen::MatrixXd c = circular_sums(blocks.c, l);
  // Stretches taken to be independent miss what their edges share.
  const double missed = std::min(kMostMissed, edge_share(influence, length));
  const Eigen::VectorXd standard_error =
      (circular_sums(influence, l).rowwise().squaredNorm() / (static_cast<double>(l) * (1.0 - missed))).cwiseSqrt();

  std::mt19937_64 generator(options.seed);
  std::vector<std::vector<double>> draws(static_cast<std::size_t>(q)), ratios(static_cast<std::size_t>(q));
  std::vector<Eigen::Index> starts(result.stretches);
  Eigen::VectorXd A_sum(q * q), c_sum(q), score(q), squares(q);
  for (std::size_t r = 0; r < options.resamples; ++r) {
    A_sum.setZero();
    c_sum.setZero();
    for (Eigen::Index& start : starts) {
      start = static_cast<Eigen::Index>(below(generator, blocks.blocks()));
      A_sum += A.col(start);
      c_sum += c.col(start);
    }
    const LuFactors lu(A_sum.reshaped(q, q));
    if (!(lu.reciprocal_condition() > kSingularResample)) {
      ++result.singular;
      continue;
    }
    const Eigen::VectorXd psi = lu.solve(c_sum);
    const Eigen::MatrixXd inverse = lu.inverse();
    squares.setZero();
    for (const Eigen::Index start : starts) {
      score = c.col(start);
      for (Eigen::Index j = 0; j < q; ++j) {
        score -= psi[j] * A.col(start).segment(j * q, q);
      }
      squares += (inverse * score).cwiseAbs2();
    }
    ++result.resamples;
    // The spread of K stretches about their own mean, which the solution makes zero.
    squares *= static_cast<double>(K) / static_cast<double>(K - 1);
    for (Eigen::Index j = 0; j < q; ++j) {
      const double difference = psi[j] - blocks.psi[j];
      draws[static_cast<std::size_t>(j)].push_back(psi[j]);
      ratios[static_cast<std::size_t>(j)].push_back(squares[j] > 0.0 ? std::abs(difference) / std::sqrt(squares[j])
                                                                     : 0.0);
    }
  }
  if (2 * result.resamples < options.resamples) {
    result.reason = "most resamples do not tell the parameters apart";
    return result;
  }
  result.usable = true;
  for (Eigen::Index j = 0; j < q; ++j) {
    const Eigen::Index at = blocks.kept[static_cast<std::size_t>(j)];
    const double tail = 0.5 * (1.0 - options.confidence);
    const double t = quantile(ratios[static_cast<std::size_t>(j)], options.confidence);
    result.standard_error[at] = standard_error[j] / blocks.scale[j];
    result.lower[at] = result.theta[at] - t * result.standard_error[at];
    result.upper[at] = result.theta[at] + t * result.standard_error[at];
    result.percentile_lower[at] = quantile(draws[static_cast<std::size_t>(j)], tail) / blocks.scale[j];
    result.percentile_upper[at] = quantile(draws[static_cast<std::size_t>(j)], 1.0 - tail) / blocks.scale[j];
  }
  return result;
}

}  // namespace wheelwright
