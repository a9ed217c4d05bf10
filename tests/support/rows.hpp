// SPDX-License-Identifier: Apache-2.0
/// \file
/// Regressions made of given matrices.
#pragma once

#include <cstddef>

#include "core/regression.hpp"

namespace wheelwright::testing_support {

/// Rows {Y, y} with n `outputs`, all error bounds zero, at 100 Hz; sample numbers count from 0.
inline RegressionBlock block_of(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y, std::size_t outputs) {
  RegressionBlock block;
  block.resize(static_cast<std::size_t>(Y.rows()) / outputs, outputs, static_cast<std::size_t>(Y.cols()));
  for (std::size_t k = 0; k < block.instants(); ++k) {
    block.sample[k] = k;
    block.t[k] = 0.01 * static_cast<double>(k);
  }
  block.Y = Y;
  block.dY.setZero();
  block.y = y;
  block.dy.setZero();
  return block;
}

}  // namespace wheelwright::testing_support
