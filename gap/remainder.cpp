// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/remainder.hpp>

#include <limits>

#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

Eigen::MatrixXd products(const BlockGram& gram, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  Eigen::MatrixXd m(static_cast<Eigen::Index>(a.size()), static_cast<Eigen::Index>(b.size()));
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    for (Eigen::Index j = 0; j < m.cols(); ++j) {
      m(i, j) = gram.product(a[static_cast<std::size_t>(i)], b[static_cast<std::size_t>(j)]);
    }
  }
  return m;
}

}  // namespace

Eigen::MatrixXd remainder(const BlockGram& gram, const std::vector<std::size_t>& of,
                          const std::vector<std::size_t>& on) {
  Eigen::MatrixXd rest = products(gram, of, of);
  if (of.empty() || on.empty()) {
    return rest;
  }
  Eigen::MatrixXd A = products(gram, on, on);
  const Eigen::VectorXd unit = A.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
  A = unit.asDiagonal() * A * unit.asDiagonal();
  A.diagonal().array() += 1e-10;
  const Eigen::MatrixXd c = unit.asDiagonal() * products(gram, on, of);
  rest -= c.transpose() * LdltFactors(A).solve(c);
  return rest;
}

}  // namespace wheelwright
