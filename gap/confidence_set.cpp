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
  std::vector<double> t(losses.size());
  std::vector<std::size_t> order{best};  // the best, then the others, the one to be dropped last first
  for (std::size_t i = 0; i < losses.size(); ++i) {
    if (i != best) {
      t[i] = ((losses[i] - losses[best]).mean() - options.margin) / standard_error(losses[i] - losses[best]);
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin() + 1, order.end(), [&t](std::size_t a, std::size_t b) { return t[a] < t[b]; });
  const auto models = static_cast<Eigen::Index>(order.size());
  Eigen::MatrixXd centred(blocks, models), error(models, models);
  for (Eigen::Index i = 0; i < models; ++i) {
    const Eigen::VectorXd& loss = losses[order[static_cast<std::size_t>(i)]];
    centred.col(i) = loss.array() - loss.mean();
    for (Eigen::Index j = 0; j < i; ++j) {
      error(i, j) = error(j, i) = standard_error(centred.col(i) - centred.col(j));
    }
  }

  // How often the largest studentised mean among the first k + 1 models, beyond that of the best of them, is at least t_k
  // where all are equally good: which one comes out best is left to chance too.
  std::vector<std::size_t> beyond(order.size(), 0);
  std::mt19937_64 generator(options.seed);
  std::uniform_int_distribution<Eigen::Index> any(0, blocks - 1);
  Eigen::VectorXd weight(blocks);
  for (std::size_t r = 0; r < options.resamples; ++r) {
    weight.setZero();
    for (Eigen::Index b = 0; b < blocks; ++b) {
      weight[any(generator)] += 1.0;
    }
    const Eigen::VectorXd mean = centred.transpose() * weight / static_cast<double>(blocks);
    Eigen::Index lowest = 0;
    double largest = 0.0;
    for (Eigen::Index k = 1; k < models; ++k) {
      if (mean[k] < mean[lowest]) {
        lowest = k;
        largest = 0.0;
        for (Eigen::Index i = 0; i < k; ++i) {
          largest = std::max(largest, (mean[i] - mean[k]) / error(i, k));
        }
      } else {
        largest = std::max(largest, (mean[k] - mean[lowest]) / error(k, lowest));
      }
      beyond[static_cast<std::size_t>(k)] += largest >= t[order[static_cast<std::size_t>(k)]] ? 1 : 0;
    }
  }
  std::vector<double> p(losses.size(), 1.0);
  double so_far = 0.0;
  for (std::size_t k = order.size() - 1; k > 0; --k) {
    so_far = std::max(so_far, (1.0 + static_cast<double>(beyond[k])) / (1.0 + static_cast<double>(options.resamples)));
    p[order[k]] = so_far;
  }
  return p;
}

}  // namespace wheelwright
