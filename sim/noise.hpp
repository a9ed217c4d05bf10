// SPDX-License-Identifier: Apache-2.0
/// \file
/// Bounded sensor noise: |measured − true| <= bound holds for every sample, in floating point too.
#pragma once

#include <cstdint>
#include <random>

namespace wheelwright {

/// How noise is distributed inside its bound.
enum class NoiseShape {
  uniform,             ///< on [−bound, bound]
  truncated_gaussian,  ///< standard deviation bound/3 before it is cut at ±bound
  two_point,           ///< −bound or bound, as a coin decides
};

/// One stream of noise. Draws are made of mt19937_64 by own transforms, so they do not depend on the standard library.
class Noise {
 public:
  /// `stream` separates the sensors of one seed: switching one on leaves the noise of the others as it was. Throws
  /// InvalidArgument unless `bound` is finite and >= 0.
  Noise(std::uint64_t seed, std::uint64_t stream, double bound, NoiseShape shape = NoiseShape::uniform);

  /// A number in [−1, 1] of the stream's shape. Two seeds or streams are unrelated.
  [[nodiscard]] double unit();

  /// `exact` with noise added: the result differs from `exact` by `bound` at most. With bound 0 it is `exact`, and
  /// nothing is drawn.
  [[nodiscard]] double measure(double exact);

 private:
  [[nodiscard]] double uniform();

  std::mt19937_64 generator_;
  double bound_;
  NoiseShape shape_;
};

}  // namespace wheelwright
