// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/confidence_set.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

// Standard error of the mean of `d`; the smallest positive number where it does not vary.
double standard_error(const Eigen::VectorXd& d) {
  const auto n = static_cast<double>(d.size());
  const double variance = (d.array() - d.mean()).square().sum() / (n - 1.0);
  return std::max(std::sqrt(variance / n), std::numeric_limits<double>::min());
}

}  // namespace

std::vector<double> model_confidence_set(const std::vector<Eigen::VectorXd>& losses,
                                         const ConfidenceSetOptions& options) {
  check::that(!losses.empty() && losses.front().size() >= 4, "losses", "at least one model and four blocks");
  check::that(options.resamples > 0, "ConfidenceSetOptions::resamples", "> 0");
  const Eigen::Index blocks = losses.front().size();
  for (const Eigen::VectorXd& loss : losses) {
    check::that(loss.size() == blocks && loss.allFinite(), "losses", "one finite value per block");
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < losses.size(); ++i) {
    if (losses[i].sum() < losses[best].sum()) {
      best = i;
    }
  }
  struct Rival {
    std::size_t model;
    Eigen::VectorXd difference;  // against the best, freed of its mean
    double mean, error, t;
  };
  std::vector<Rival> rivals;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    if (i == best) {
      continue;
    }
    Eigen::VectorXd d = losses[i] - losses[best];
    const double mean = d.mean();
    const double error = standard_error(d);
    rivals.push_back({i, d.array() - mean, mean, error, (mean - options.margin) / error});
  }
  std::stable_sort(rivals.begin(), rivals.end(), [](const Rival& a, const Rival& b) { return a.t > b.t; });

  // How often the largest of the studentised means of the rivals k … end, resampled about zero, is at least t_k.
  std::vector<std::size_t> beyond(rivals.size(), 0);
  std::mt19937_64 generator(options.seed);
  std::uniform_int_distribution<Eigen::Index> any(0, blocks - 1);
  Eigen::VectorXd weight(blocks);
  for (std::size_t r = 0; r < options.resamples; ++r) {
    weight.setZero();
    for (Eigen::Index b = 0; b < blocks; ++b) {
      weight[any(generator)] += 1.0;
    }
    double largest = -std::numeric_limits<double>::infinity();
    for (std::size_t k = rivals.size(); k-- > 0;) {
      const double mean = weight.dot(rivals[k].difference) / static_cast<double>(blocks);
      largest = std::max(largest, mean / rivals[k].error);
      beyond[k] += largest >= rivals[k].t ? 1 : 0;
    }
  }
  std::vector<double> p(losses.size(), 1.0);
  double so_far = 0.0;
  for (std::size_t k = 0; k < rivals.size(); ++k) {
    so_far = std::max(so_far, (1.0 + static_cast<double>(beyond[k])) / (1.0 + static_cast<double>(options.resamples)));
    p[rivals[k].model] = so_far;
  }
  return p;
}

}  // namespace wheelwright
