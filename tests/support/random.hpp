// SPDX-License-Identifier: Apache-2.0
/// \file
/// Seeded numbers that are the same with every standard library, and series of noise made of them.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>

#include <Eigen/Core>

namespace wheelwright::testing_support {

/// A local generator; transforms of its own.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  /// In (0, 1).
  double unit() { return (static_cast<double>(engine_() >> 11U) + 0.5) * 0x1.0p-53; }
  /// In (−1, 1).
  double symmetric() { return 2.0 * unit() - 1.0; }
  /// Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(unit()));
    return radius * std::cos(2.0 * std::numbers::pi * unit());
  }
  /// Laplace of standard deviation 1: tails that fall exponentially.
  double laplace() {
    const double magnitude = -std::log(unit()) / std::numbers::sqrt2;
    return unit() < 0.5 ? -magnitude : magnitude;
  }
  /// An index below `count`.
  std::size_t below(std::size_t count) { return static_cast<std::size_t>(unit() * static_cast<double>(count)); }
  /// Entries in (−1, 1).
  Eigen::MatrixXd matrix(Eigen::Index rows, Eigen::Index columns) {
    return Eigen::MatrixXd::NullaryExpr(rows, columns, [this] { return symmetric(); });
  }

 private:
  std::mt19937_64 engine_;
};

/// e_k = φ e_{k−1} + √(1 − φ²) w_k with standard normal w: stationary, variance 1, correlation φ^|lag|. The sum of N
/// values has the variance N (1 + φ)/(1 − φ) for large N.
class Autoregression {
 public:
  Autoregression(std::uint64_t seed, double phi) : random_(seed), phi_(phi), value_(random_.normal()) {}
  double next() {
    const double now = value_;
    value_ = phi_ * value_ + std::sqrt(1.0 - phi_ * phi_) * random_.normal();
    return now;
  }

 private:
  Random random_;
  double phi_, value_;
};

}  // namespace wheelwright::testing_support
