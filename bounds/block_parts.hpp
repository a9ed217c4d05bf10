// SPDX-License-Identifier: Apache-2.0
/// \file
/// Mapping between all parameters and those of one independent block of a set.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/slab_rows.hpp>

namespace wheelwright::bounds {

/// The entries `parameters` of `all`, in that order; every index is below its size (unchecked).
[[nodiscard]] inline Eigen::VectorXd pick(const Eigen::VectorXd& all, const std::vector<std::size_t>& parameters) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    part[static_cast<Eigen::Index>(k)] = all[static_cast<Eigen::Index>(parameters[k])];
  }
  return part;
}

/// A half-space in the parameters `parameters` as one in all `p`, with zeros elsewhere.
[[nodiscard]] inline HalfSpace spread(const HalfSpace& row, const std::vector<std::size_t>& parameters, std::size_t p) {
  HalfSpace full{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p)), row.b, row.origin};
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    full.a[static_cast<Eigen::Index>(parameters[k])] = row.a[static_cast<Eigen::Index>(k)];
  }
  return full;
}

}  // namespace wheelwright::bounds
