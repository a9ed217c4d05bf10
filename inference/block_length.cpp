// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/block_length.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
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

}  // namespace wheelwright
