// SPDX-License-Identifier: Apache-2.0
/// \file
/// How often to look for messages.
#pragma once

#include <algorithm>

namespace wheelwright {

/// Time between two looks: short while something happens, doubled at each look that found nothing.
class LookInterval {
 public:
  /// The time to the next look, 50 to 2000 µs.
  [[nodiscard]] int next(bool busy) {
    microseconds_ = busy ? kShortest : std::min(2 * microseconds_, kLongest);
    return microseconds_;
  }

 private:
  static constexpr int kShortest = 50;
  static constexpr int kLongest = 2000;
  int microseconds_ = kShortest;
};

}  // namespace wheelwright
