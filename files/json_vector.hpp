// SPDX-License-Identifier: Apache-2.0
/// \file
/// Vectors in results.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/files/json_file.hpp>

namespace wheelwright {

/// The array of numbers at `place`; InputError where it is none.
[[nodiscard]] inline Eigen::VectorXd vector_at(const JsonPlace& place) {
  const std::vector<double> values = place.numbers();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// The same; InputError where there are not `size` numbers.
[[nodiscard]] inline Eigen::VectorXd vector_at(const JsonPlace& place, std::size_t size) {
  Eigen::VectorXd values = vector_at(place);
  if (static_cast<std::size_t>(values.size()) != size) {
    place.fail("an array of " + std::to_string(size) + " numbers");
  }
  return values;
}

}  // namespace wheelwright
