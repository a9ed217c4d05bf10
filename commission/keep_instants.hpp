// SPDX-License-Identifier: Apache-2.0
/// \file
/// Leaving instants out of a block of rows.
#pragma once

#include <algorithm>
#include <cstddef>

#include <Eigen/Core>

#include "core/regression.hpp"

namespace wheelwright::commission {

/// Leaves the instants k of `block` for which keep(k) is true, in their order; keep() is asked once for each.
template <typename Keep>
void keep_instants(core::RegressionBlock& block, Keep&& keep) {
  const auto n = static_cast<Eigen::Index>(block.outputs);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < block.instants(); ++k) {
    if (!keep(k)) {
      continue;
    }
    if (kept != k) {
      const auto to = static_cast<Eigen::Index>(kept) * n;
      const auto from = static_cast<Eigen::Index>(k) * n;
      block.sample[kept] = block.sample[k];
      block.t[kept] = block.t[k];
      for (Eigen::Index i = 0; i < n; ++i) {
        block.Y.row(to + i) = block.Y.row(from + i);
        block.dY.row(to + i) = block.dY.row(from + i);
        block.y[to + i] = block.y[from + i];
        block.dy[to + i] = block.dy[from + i];
      }
    }
    ++kept;
  }
  block.shorten(kept);
}

}  // namespace wheelwright::commission
