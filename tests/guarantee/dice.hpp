// SPDX-License-Identifier: Apache-2.0
/// \file
/// Random numbers that are the same on every machine: one seed, one sequence.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

namespace wheelwright::guarantee {

/// SplitMix64 (Steele, Lea and Flood 2014).
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double share() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double lowest, double highest) { return lowest + (highest - lowest) * share(); }
  /// Uniform in the logarithm; both ends > 0.
  double decade(double lowest, double highest) { return lowest * std::pow(highest / lowest, share()); }
  /// In 0 … n − 1.
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(bits() % n); }
  bool chance(double probability) { return share() < probability; }
  double sign() { return (bits() & 1u) != 0 ? 1.0 : -1.0; }
  /// About normal, within six standard deviations.
  double bell() {
    double sum = -6.0;
    for (int k = 0; k < 12; ++k) sum += share();
    return sum;
  }

 private:
  std::uint64_t state_;
};

}  // namespace wheelwright::guarantee
