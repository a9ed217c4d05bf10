// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small sums in a fixed order: the same digits in every language and build.
#pragma once

#include <functional>

#include <Eigen/Core>

namespace wheelwright::filter {

/// act(0), ..., act(n - 1); without a loop where n is 2, as for robots on two wheels.
template <typename Act>
void each(Eigen::Index n, Act&& act) {
  if (n == 2) {
    act(0);
    act(1);
    return;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    act(i);
  }
}

/// result = matrix · x, with `part` of each of the matrix's numbers, each sum from the first column to the last. The
/// matrix has a column or more, x and the result have its sizes (unchecked).
template <typename Part = std::identity>
void multiply(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& x, Eigen::VectorXd& result, const Part& part = {}) {
  const Eigen::Index rows = matrix.rows(), columns = matrix.cols();
  const double* const m = matrix.data();
  each(rows, [&](Eigen::Index i) {
    double sum = part(m[i]) * x[0];
    if (columns == 2) {
      sum += part(m[i + rows]) * x[1];
    } else {
      for (Eigen::Index j = 1; j < columns; ++j) {
        sum += part(m[i + j * rows]) * x[j];
      }
    }
    result[i] = sum;
  });
}

}  // namespace wheelwright::filter
