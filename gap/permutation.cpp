// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/permutation.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

namespace wheelwright {
namespace {

// Standardised sums over a regime for any arrangement of the blocks of values over those of the regime.
struct Arrangement {
  Eigen::MatrixXd product;  // (block of the regime, block of values)
  double mean = 0.0, deviation = 0.0;

  [[nodiscard]] double score(const std::vector<Eigen::Index>& order) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      sum += product(order[i], static_cast<Eigen::Index>(i));
    }
    return (sum - mean) / deviation;
  }
};

// Mean and deviation over all arrangements (Hoeffding 1951).
Arrangement arrangement(const Mask& regime, const Eigen::MatrixXd& blocks) {
  const Eigen::Index length = blocks.rows(), n = blocks.cols();
  const Eigen::MatrixXd in = regime.head(length * n).cast<double>().matrix().reshaped(length, n);
  Arrangement a;
  a.product.noalias() = in.transpose() * blocks;
  a.mean = a.product.sum() / static_cast<double>(n);
  Eigen::MatrixXd rest = a.product;
  rest.colwise() -= a.product.rowwise().mean();
  rest.rowwise() -= a.product.colwise().mean();
  rest.array() += a.product.mean();
  a.deviation = std::sqrt(rest.squaredNorm() / static_cast<double>(n - 1));
  return a;
}

}  // namespace

double memory_of_squares(const Eigen::VectorXd& series) {
  const Eigen::VectorXd centred = series.array() - series.mean();
  const double variance = centred.squaredNorm();
  double sum = 1.0;
  const Eigen::Index n = series.size();
  for (Eigen::Index lag = 1; lag < n / 4 && variance > 0.0; ++lag) {
    const double rho = centred.head(n - lag).dot(centred.tail(n - lag)) / variance;
    if (std::abs(rho) <= 0.2) {
      break;
    }
    sum += 2.0 * rho * rho;
  }
  return sum;
}

std::vector<double> block_permutation_p_values(const Eigen::VectorXd& values, const std::vector<Mask>& regimes,
                                               double memory, std::size_t permutations, std::uint64_t seed) {
  std::vector<double> p(regimes.size(), 1.0);
  if (values.size() < 64) {
    return p;
  }
  const auto blocks =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(static_cast<double>(values.size()) / (10.0 * memory)), 12, 48);
  const Eigen::Index length = values.size() / blocks;
  const Eigen::MatrixXd cut =
      (values.head(length * blocks).array() - values.head(length * blocks).mean()).matrix().reshaped(length, blocks);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(blocks));
  std::iota(order.begin(), order.end(), Eigen::Index{0});

  std::vector<Arrangement> tested;
  std::vector<std::size_t> index;
  const double scale = std::sqrt(cut.squaredNorm());
  for (std::size_t r = 0; r < regimes.size(); ++r) {
    Arrangement a = arrangement(regimes[r], cut);
    if (a.deviation > 1e-9 * scale) {
      tested.push_back(std::move(a));
      index.push_back(r);
    }
  }
  std::vector<double> observed;
  for (const Arrangement& a : tested) {
    observed.push_back(a.score(order));
  }
  std::vector<std::size_t> rank(tested.size());
  std::iota(rank.begin(), rank.end(), std::size_t{0});
  std::sort(rank.begin(), rank.end(), [&](std::size_t a, std::size_t b) { return observed[a] > observed[b]; });

  std::vector<std::size_t> above(tested.size(), 1);
  std::mt19937_64 generator(seed);
  for (std::size_t k = 0; k < permutations; ++k) {
    std::shuffle(order.begin(), order.end(), generator);
    double largest = -1e300;
    for (std::size_t i = rank.size(); i-- > 0;) {
      largest = std::max(largest, tested[rank[i]].score(order));
      above[i] += largest >= observed[rank[i]] ? 1 : 0;
    }
  }
  double running = 0.0;
  for (std::size_t i = 0; i < rank.size(); ++i) {
    running = std::max(running, static_cast<double>(above[i]) / static_cast<double>(permutations + 1));
    p[index[rank[i]]] = running;
  }
  return p;
}

}  // namespace wheelwright
