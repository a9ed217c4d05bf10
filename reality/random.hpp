// SPDX-License-Identifier: Apache-2.0
/// \file
/// Seeded draws that are the same on every machine.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

namespace wheelwright::reality {

/// One stream of draws, by own transforms of mt19937_64.
class Random {
 public:
  /// `item` and `stream` separate draws of one seed (SplitMix64, Steele et al. 2014): no two are related.
  Random(std::uint64_t seed, std::uint64_t item, std::uint64_t stream)
      : generator_(mix(mix(mix(seed) + item) + stream)) {}

  /// Uniform on [low, high).
  [[nodiscard]] double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  /// Log-uniform on [low, high), both > 0.
  [[nodiscard]] double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  /// Standard normal (Box and Muller 1958).
  [[nodiscard]] double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform(0.0, 1.0)));
    return radius * std::cos(2.0 * std::numbers::pi * uniform(0.0, 1.0));
  }
  /// −1 or 1.
  [[nodiscard]] double sign() { return uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0; }
  /// 0 … count − 1.
  [[nodiscard]] std::size_t below(std::size_t count) {
    return static_cast<std::size_t>(uniform(0.0, static_cast<double>(count)));
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  std::mt19937_64 generator_;
};

}  // namespace wheelwright::reality
