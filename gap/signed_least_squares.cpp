// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/signed_least_squares.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright::gap {
namespace {

constexpr double kIndependent = 1e-10;  // share of a squared column that the ones before it must leave

using Flags = std::vector<bool>;

// Cholesky factor of A over the unknowns in `use`; those that are not determined leave `use`.
Eigen::MatrixXd factor(const Eigen::MatrixXd& A, Flags& use) {
  const Eigen::Index n = A.rows();
  Eigen::MatrixXd L = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto u = static_cast<std::size_t>(j);
    const double pivot = use[u] ? A(j, j) - L.row(j).head(j).squaredNorm() : 0.0;
    if (!use[u] || !(pivot > kIndependent * A(j, j))) {
      use[u] = false;
      L.row(j).setZero();
      continue;
    }
    L(j, j) = std::sqrt(pivot);
    for (Eigen::Index i = j + 1; i < n; ++i) {
      if (use[static_cast<std::size_t>(i)]) {
        L(i, j) = (A(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
      }
    }
  }
  return L;
}

// The solution over the unknowns in `use` (which shrinks to the determined ones), zero elsewhere.
Eigen::VectorXd solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Flags& use) {
  const Eigen::Index n = A.rows();
  const Eigen::MatrixXd L = factor(A, use);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] = use[static_cast<std::size_t>(i)] ? (b[i] - L.row(i).head(i).dot(x.head(i))) / L(i, i) : 0.0;
  }
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    if (use[static_cast<std::size_t>(i)]) {
      x[i] = (x[i] - L.col(i).tail(n - 1 - i).dot(x.tail(n - 1 - i))) / L(i, i);
    }
  }
  return x;
}

}  // namespace

SignedSolution signed_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const std::vector<int>& sign) {
  const Eigen::Index n = A.rows();
  check::that(A.cols() == n && b.size() == n, "signed_least_squares", "a square matrix and as many right-hand sides");
  check::that(sign.empty() || sign.size() == static_cast<std::size_t>(n), "signed_least_squares sign",
              "one for each unknown");
  const auto count = static_cast<std::size_t>(n);
  const auto bound = [&sign](std::size_t i) { return sign.empty() ? 0 : sign[i]; };
  SignedSolution result;
  Flags use(count, true);
  result.x = solve(A, b, use);
  bool holds = true;
  for (std::size_t i = 0; i < count; ++i) {
    holds = holds && bound(i) * result.x[static_cast<Eigen::Index>(i)] >= 0.0;
  }
  if (!holds) {
    for (std::size_t i = 0; i < count; ++i) {
      use[i] = bound(i) == 0;
    }
    result.x = solve(A, b, use);
    Flags refused(count, false);  // undetermined beside the others
    for (std::size_t turns = 0; turns < 10 * count + 10; ++turns) {
      const Eigen::VectorXd gradient = b - A * result.x;
      std::size_t enter = count;
      double steepest = 0.0;
      for (std::size_t i = 0; i < count; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        const double slope = bound(i) * gradient[k] / std::sqrt(std::max(A(k, k), 1e-300));
        if (bound(i) != 0 && !use[i] && !refused[i] && slope > std::max(steepest, 1e-12 * std::abs(b[k]))) {
          steepest = slope;
          enter = i;
        }
      }
      if (enter == count) {
        break;
      }
      use[enter] = true;
      while (true) {
        Eigen::VectorXd target = solve(A, b, use);
        double share = 1.0;
        for (std::size_t i = 0; i < count; ++i) {
          const auto k = static_cast<Eigen::Index>(i);
          if (bound(i) != 0 && use[i] && bound(i) * target[k] < 0.0) {
            const double from = bound(i) * result.x[k];
            share = std::min(share, from / (from - bound(i) * target[k]));
          }
        }
        if (share >= 1.0) {
          result.x = target;
          refused[enter] = !use[enter];
          break;
        }
        result.x += share * (target - result.x);
        for (std::size_t i = 0; i < count; ++i) {
          const auto k = static_cast<Eigen::Index>(i);
          if (bound(i) != 0 && use[i] && bound(i) * target[k] < 0.0 &&
              bound(i) * result.x[k] <= 1e-14 * std::abs(target[k])) {
            use[i] = false;
            result.x[k] = 0.0;
          }
        }
        if (!use[enter] && share <= 0.0) {
          refused[enter] = true;
        }
      }
    }
  }
  result.zero.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    result.zero[i] = !use[i];
  }
  return result;
}

Eigen::MatrixXd restricted_inverse(const Eigen::MatrixXd& A, const std::vector<bool>& zero) {
  const Eigen::Index n = A.rows();
  check::that(zero.size() == static_cast<std::size_t>(n), "restricted_inverse", "one flag for each unknown");
  Flags use(zero.size());
  for (std::size_t i = 0; i < use.size(); ++i) {
    use[i] = !zero[i];
  }
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    if (use[static_cast<std::size_t>(j)]) {
      inverse.col(j) = solve(A, Eigen::VectorXd::Unit(n, j), use);
    }
  }
  return inverse;
}

}  // namespace wheelwright::gap
