// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/block_bootstrap.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/random.hpp"

namespace wheelwright::inference {
namespace {

constexpr double kLeastLongRun = 0.01;  // of R(0): a flat-top window can give a negative sum

double flat_top(double x) { return std::abs(x) <= 0.5 ? 1.0 : std::max(0.0, 2.0 * (1.0 - std::abs(x))); }

}  // namespace

SeriesMemory series_memory(const Eigen::VectorXd& series) {
  SeriesMemory memory;
  const Eigen::Index N = series.size();
  if (N < 2) {
    return memory;
  }
  const double n = static_cast<double>(N);
  const Eigen::VectorXd centred = series.array() - series.mean();
  const auto R = [&](Eigen::Index k) { return centred.head(N - k).dot(centred.tail(N - k)) / n; };
  memory.variance = memory.long_run = R(0);
  if (!(memory.variance > 0.0)) {
    return memory;
  }
  const auto run = static_cast<Eigen::Index>(std::max(5.0, std::ceil(std::sqrt(std::log10(n)))));
  const double significant = 2.0 * std::sqrt(std::log10(n) / n);
  const Eigen::Index furthest = std::min<Eigen::Index>(N - 1, static_cast<Eigen::Index>(std::ceil(std::sqrt(n))) + run);
  Eigen::Index last = 0;  // last significant lag before a run of insignificant ones
  for (Eigen::Index k = 1; k <= furthest && k - last <= run; ++k) {
    if (std::abs(R(k)) >= significant * memory.variance) {
      last = k;
    }
  }
  const Eigen::Index M = std::min<Eigen::Index>(2 * last, N - 1);
  memory.lags = static_cast<std::size_t>(M);
  for (Eigen::Index k = 1; k <= M; ++k) {
    const double term = 2.0 * flat_top(static_cast<double>(k) / static_cast<double>(M)) * R(k);
    memory.long_run += term;
    memory.weighted += static_cast<double>(k) * term;
  }
  memory.long_run = std::max(memory.long_run, kLeastLongRun * memory.variance);
  return memory;
}

std::size_t bootstrap_block_length(const Eigen::MatrixXd& series) {
  const double n = static_cast<double>(series.cols());
  double length = 1.0;
  for (Eigen::Index j = 0; j < series.rows(); ++j) {
    const SeriesMemory memory = series_memory(series.row(j).transpose());
    if (memory.variance > 0.0) {
      const double ratio = memory.weighted / memory.long_run;
      length = std::max(length, std::cbrt(1.5 * ratio * ratio * n));
    }
  }
  const double most = std::max(1.0, std::floor(std::min(3.0 * std::sqrt(n), n / 3.0)));
  return static_cast<std::size_t>(std::min(most, std::ceil(length - 1e-9)));
}

double edge_share(const Eigen::MatrixXd& series, std::size_t length) {
  check::that(length >= 1, "length of a block", "at least 1");
  double share = 0.0;
  for (Eigen::Index j = 0; j < series.rows(); ++j) {
    const SeriesMemory memory = series_memory(series.row(j).transpose());
    if (memory.variance > 0.0) {
      share = std::max(share, memory.weighted / memory.long_run);
    }
  }
  return share / static_cast<double>(length);
}

std::size_t sign_group_length(const Eigen::MatrixXd& series, double lost, std::size_t groups) {
  check::positive(lost, "share of variance lost");
  check::that(groups >= 1, "groups", "at least 1");
  const double length = std::max(1.0, std::ceil(edge_share(series, 1) / lost - 1e-9));
  const double most = std::max(1.0, std::floor(static_cast<double>(series.cols()) / static_cast<double>(groups)));
  return static_cast<std::size_t>(std::min(most, length));
}

namespace {

constexpr double kSingularScore = 1e-12;  // reciprocal condition, columns scaled
constexpr double kWholeBlock = 1e-6;      // times are rounded: so much more than whole blocks is none

double typical_seconds(const std::vector<identify::MomentBlock>& blocks) {
  if (blocks.size() < 2) {
    return blocks.empty() ? 0.0 : blocks[0].last - blocks[0].first;
  }
  std::vector<double> lengths;
  for (std::size_t b = 0; b + 1 < blocks.size(); ++b) {
    lengths.push_back(blocks[b + 1].first - blocks[b].first);
  }
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  return *middle;
}

Eigen::VectorXd column_lengths(const Eigen::MatrixXd& gram) {
  Eigen::VectorXd lengths = gram.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (double& s : lengths) {
    s = s > 0.0 ? s : 1.0;
  }
  return lengths;
}

}  // namespace

std::size_t ScoreBlocks::lasting(double seconds) const {
  const double most = std::max(1.0, static_cast<double>(blocks()));
  const double length = block_seconds > 0.0 ? std::ceil(seconds / block_seconds - kWholeBlock) : 1.0;
  return static_cast<std::size_t>(std::clamp(length, 1.0, most));
}

Eigen::MatrixXd ScoreBlocks::scores(const Eigen::VectorXd& at) const {
  const Eigen::Index q = c.rows();
  Eigen::MatrixXd s = c;
  for (Eigen::Index j = 0; j < q; ++j) {
    s -= at[j] * A.middleRows(j * q, q);
  }
  return s;
}

Eigen::VectorXd ScoreBlocks::unscaled(const Eigen::VectorXd& at, double other) const {
  Eigen::VectorXd theta = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(parameters), other);
  theta(kept) = at.cwiseQuotient(scale);
  return theta;
}

ScoreBlocks score_blocks(const identify::RegressionMoments& moments, const identify::EstimatorOptions& options,
                         bool instruments) {
  const std::size_t p = moments.parameters();
  check::that(options.excluded.empty() || options.excluded.size() == p, "excluded parameters", "one flag for each");
  const bool with_z = instruments && moments.has_instruments();
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs()));
  ScoreBlocks s;
  s.parameters = p;
  for (std::size_t j = 0; j < p; ++j) {
    if (options.excluded.empty() || !options.excluded[j]) {
      s.kept.push_back(static_cast<Eigen::Index>(j));
    }
  }
  const auto q = static_cast<Eigen::Index>(s.kept.size());
  const auto B = static_cast<Eigen::Index>(moments.blocks().size());
  const identify::MomentSums total = moments.total(w);
  const Eigen::MatrixXd shape = (with_z ? total.ZZ : total.YY)(s.kept, s.kept);
  s.scale = column_lengths(total.YY(s.kept, s.kept));
  const Eigen::VectorXd row_scale = column_lengths(shape).cwiseInverse();
  const Eigen::VectorXd column_scale = s.scale.cwiseInverse();
  s.shape = row_scale.asDiagonal() * shape * row_scale.asDiagonal();
  s.A.resize(q * q, B);
  s.c.resize(q, B);
  for (Eigen::Index b = 0; b < B; ++b) {
    const identify::MomentSums sums = moments.block(static_cast<std::size_t>(b), w);
    const Eigen::MatrixXd A =
        row_scale.asDiagonal() * (with_z ? sums.ZY : sums.YY)(s.kept, s.kept) * column_scale.asDiagonal();
    s.A.col(b) = A.reshaped();
    s.c.col(b) = row_scale.cwiseProduct((with_z ? sums.Zy : sums.Yy)(s.kept));
  }
  s.block_seconds = typical_seconds(moments.blocks());
  s.total_A = s.A.rowwise().sum().reshaped(q, q);
  s.total_c = s.c.rowwise().sum();
  s.psi = Eigen::VectorXd::Zero(q);
  s.inverse = Eigen::MatrixXd::Zero(q, q);
  if (q == 0 || B == 0) {
    s.reason = "there is nothing to estimate";
    return s;
  }
  const core::LuFactors lu(s.total_A);
  const core::LuFactors shape_lu(s.shape);
  s.solvable = s.total_A.allFinite() && s.total_c.allFinite() && lu.reciprocal_condition() > kSingularScore &&
               shape_lu.reciprocal_condition() > kSingularScore;
  if (!s.solvable) {
    s.reason =
        with_z ? "the instruments do not tell the parameters apart" : "the log does not tell the parameters apart";
    return s;
  }
  s.psi = lu.solve(s.total_c);
  s.inverse = lu.inverse();
  return s;
}

ScoreBlocks grouped(const ScoreBlocks& blocks, std::size_t length) {
  check::that(length >= 1, "length of a group", "at least one block");
  ScoreBlocks groups = blocks;
  const auto B = static_cast<Eigen::Index>(blocks.blocks());
  const auto l = static_cast<Eigen::Index>(length);
  const Eigen::Index G = (B + l - 1) / l;
  groups.A.resize(blocks.A.rows(), G);
  groups.c.resize(blocks.c.rows(), G);
  for (Eigen::Index g = 0; g < G; ++g) {
    const Eigen::Index count = std::min(l, B - g * l);
    groups.A.col(g) = blocks.A.middleCols(g * l, count).rowwise().sum();
    groups.c.col(g) = blocks.c.middleCols(g * l, count).rowwise().sum();
  }
  groups.block_seconds = static_cast<double>(length) * blocks.block_seconds;
  return groups;
}

namespace {

constexpr double kSingularResample = 1e-12;  // reciprocal condition, columns scaled
constexpr std::size_t kFewStretches = 4;     // fewer cannot show their own spread
constexpr double kMostMissed = 0.5;          // of the variance, that is allowed for

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

BlockBootstrap block_bootstrap(const identify::RegressionMoments& moments, const BlockBootstrapOptions& options) {
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
      start = static_cast<Eigen::Index>(core::uniform_below(generator, blocks.blocks()));
      A_sum += A.col(start);
      c_sum += c.col(start);
    }
    const core::LuFactors lu(A_sum.reshaped(q, q));
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

}  // namespace wheelwright::inference
