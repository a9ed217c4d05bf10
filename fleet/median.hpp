// SPDX-License-Identifier: Apache-2.0
/// \file
/// The middle of a list.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace wheelwright {

/// The median of `values`, of two middle ones the larger. At least one value.
[[nodiscard]] inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace wheelwright
