// SPDX-License-Identifier: Apache-2.0
/// \file
/// Random numbers that are the same with every standard library.
#pragma once

#include <cstdint>
#include <random>

namespace wheelwright::core {

/// A number in [0, 1), a multiple of 2⁻⁵³.
[[nodiscard]] inline double uniform(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11U) * 0x1p-53;
}

/// One of 0 … count − 1, each as probable as the others; count >= 1.
[[nodiscard]] inline std::uint64_t uniform_below(std::mt19937_64& generator, std::uint64_t count) {
  const std::uint64_t range = std::mt19937_64::max() - std::mt19937_64::max() % count;
  std::uint64_t drawn = generator();
  while (drawn >= range) {
    drawn = generator();
  }
  return drawn % count;
}

}  // namespace wheelwright::core
