// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/sobol_points.hpp>

#include <array>
#include <bit>
#include <random>
#include <vector>

#include <boost/random/sobol.hpp>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

constexpr int kBits = 64;

// Digits are counted from the most significant one.
struct Scrambling {
  std::array<std::uint64_t, kBits> column = {};  // of the triangular matrix
  std::uint64_t shift = 0;

  explicit Scrambling(std::mt19937_64& generator) {
    for (int digit = 0; digit < kBits; ++digit) {
      const std::uint64_t diagonal = std::uint64_t{1} << (kBits - 1 - digit);
      column[static_cast<std::size_t>(digit)] = diagonal | (generator() & (diagonal - 1));
    }
    shift = generator();
  }

  [[nodiscard]] double operator()(std::uint64_t x) const {
    std::uint64_t y = shift;
    while (x != 0) {
      const int digit = std::countl_zero(x);
      y ^= column[static_cast<std::size_t>(digit)];
      x &= ~(std::uint64_t{1} << (kBits - 1 - digit));
    }
    return (static_cast<double>(y >> 12) + 0.5) * 0x1p-52;
  }
};

}  // namespace

Eigen::MatrixXd sobol_points(Eigen::Index points, Eigen::Index dimensions, Eigen::Index replicates,
                             std::uint64_t seed) {
  check::that(
      points >= 1 && points <= (Eigen::Index{1} << 32) && std::has_single_bit(static_cast<std::uint64_t>(points)),
      "points of a Sobol sequence", "a power of two, at most 2^32");
  check::that(replicates >= 1, "replicates of a Sobol sequence", "at least 1");
  check::that(dimensions >= 1 && dimensions <= 3667, "dimensions of a Sobol sequence", "1 to 3667");
  std::vector<std::uint64_t> sequence(static_cast<std::size_t>(points * dimensions), 0);
  boost::random::sobol engine(static_cast<std::size_t>(dimensions));
  engine.generate(sequence.begin() + dimensions, sequence.end());

  std::mt19937_64 generator(seed);
  Eigen::MatrixXd out(replicates * points, dimensions);
  for (Eigen::Index r = 0; r < replicates; ++r) {
    for (Eigen::Index d = 0; d < dimensions; ++d) {
      const Scrambling scramble(generator);
      for (Eigen::Index n = 0; n < points; ++n) {
        out(r * points + n, d) = scramble(sequence[static_cast<std::size_t>(n * dimensions + d)]);
      }
    }
  }
  return out;
}

}  // namespace wheelwright
