// SPDX-License-Identifier: Apache-2.0
/// \file
/// The size of a fault that k of the last n instants show.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include <wheelwright/detector/events.hpp>

namespace wheelwright {

/// The k-th smallest of the last n sizes: what an alarm under a rule "k of n" needs.
class Lasting {
 public:
  /// For the rule `persistence`.
  explicit Lasting(Persistence persistence) : persistence_(persistence) {}

  /// Takes the smallest size that the next instant shows (infinite: none); returns the smallest that k of the last n
  /// instants show, infinite where there is none.
  double add(double size) {
    last_.push_back(size);
    if (last_.size() > persistence_.n) {
      last_.erase(last_.begin());
    }
    if (last_.size() < persistence_.k) {
      return std::numeric_limits<double>::infinity();
    }
    std::vector<double> sorted = last_;
    const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(persistence_.k - 1);
    std::nth_element(sorted.begin(), at, sorted.end());
    return *at;
  }

 private:
  Persistence persistence_;
  std::vector<double> last_;
};

}  // namespace wheelwright
