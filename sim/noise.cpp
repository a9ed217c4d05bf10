// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/noise.hpp>

#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

// splitmix64 (Steele, Lea and Flood 2014): spreads seed and stream over all 64 bits.
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15U;
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9U;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebU;
  return x ^ (x >> 31U);
}

}  // namespace

Noise::Noise(std::uint64_t seed, std::uint64_t stream, double bound, NoiseShape shape)
    : generator_(mix(mix(seed) ^ stream)), bound_(check::non_negative(bound, "noise bound")), shape_(shape) {}

double Noise::uniform() { return 2.0 * (static_cast<double>(generator_() >> 11U) * 0x1p-53) - 1.0; }

double Noise::unit() {
  double x = uniform();
  if (shape_ == NoiseShape::two_point) {
    return x < 0.0 ? -1.0 : 1.0;
  }
  if (shape_ == NoiseShape::truncated_gaussian) {
    // Rejection from the uniform: density ∝ exp(−(3x)²/2) on [−1, 1]; 1 − (3x)²/2 lies below it and spares most of exp.
    for (;;) {
      const double height = 0.5 * (uniform() + 1.0);
      if (height <= 1.0 - 4.5 * x * x || height <= std::exp(-4.5 * x * x)) {
        break;
      }
      x = uniform();
    }
  }
  return x;
}

double Noise::measure(double exact) {
  if (bound_ == 0.0) {
    return exact;
  }
  double measured = exact + bound_ * unit();
  while (std::abs(measured - exact) > bound_) {  // the sum was rounded outward
    measured = std::nextafter(measured, exact);
  }
  return measured;
}

}  // namespace wheelwright
