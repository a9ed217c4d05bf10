// SPDX-License-Identifier: Apache-2.0
/// \file
/// Many half-spaces in few pieces of memory.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <wheelwright/bounds/half_space.hpp>

namespace wheelwright {

/// Half-spaces a·θ <= b of `parameters` coefficients each, one after the other.
struct RowBank {
  std::size_t parameters = 0;      ///< p
  std::vector<double> a;           ///< n × p, row after row
  std::vector<double> b;           ///< n
  std::vector<RowOrigin> origins;  ///< n

  /// Number of half-spaces n.
  [[nodiscard]] std::size_t size() const { return b.size(); }
  /// The coefficients of half-space `i`.
  [[nodiscard]] std::span<const double> normal(std::size_t i) const { return {a.data() + i * parameters, parameters}; }
  /// Adds one half-space.
  void add(std::span<const double> normal, double bound, const RowOrigin& origin) {
    a.insert(a.end(), normal.begin(), normal.end());
    b.push_back(bound);
    origins.push_back(origin);
  }
  /// Half-space `i` by itself.
  [[nodiscard]] HalfSpace at(std::size_t i) const {
    return {Eigen::Map<const Eigen::VectorXd>(a.data() + i * parameters, static_cast<Eigen::Index>(parameters)), b[i],
            origins[i]};
  }
  /// Forgets all, keeps the memory.
  void clear() {
    a.clear();
    b.clear();
    origins.clear();
  }
};

}  // namespace wheelwright
