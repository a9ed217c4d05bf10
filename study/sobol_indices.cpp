// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/sobol_indices.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <boost/random/sobol.hpp>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright::study {
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

namespace {

// Sums over base points, of values less a common centre.
struct Sums {
  double count = 0.0;
  double mean = 0.0, square = 0.0;  // of A and B, halved
  Eigen::ArrayXd product;           // B (A_B − A)
  Eigen::ArrayXd difference;        // A_B − A
  Eigen::ArrayXd distance;          // (A_B − A)² / 2

  explicit Sums(Eigen::Index inputs)
      : product(Eigen::ArrayXd::Zero(inputs)),
        difference(Eigen::ArrayXd::Zero(inputs)),
        distance(Eigen::ArrayXd::Zero(inputs)) {}

  void add(const Eigen::ArrayXd& block) {
    const Eigen::Index k = product.size();
    const Eigen::ArrayXd step = block.tail(k) - block[0];
    count += 1.0;
    mean += 0.5 * (block[0] + block[1]);
    square += 0.5 * (block[0] * block[0] + block[1] * block[1]);
    product += block[1] * step;
    difference += step;
    distance += 0.5 * step.square();
  }

  void add(const Sums& other) {
    count += other.count;
    mean += other.mean;
    square += other.square;
    product += other.product;
    difference += other.difference;
    distance += other.distance;
  }

  [[nodiscard]] double variance() const { return square / count - (mean / count) * (mean / count); }

  // First-order indices, total indices, interactions.
  [[nodiscard]] Eigen::ArrayXd indices() const {
    const Eigen::Index k = product.size();
    const double v = variance();
    Eigen::ArrayXd out(2 * k + 1);
    out.head(k) = (product - (mean / count) * difference) / (count * v);
    out.segment(k, k) = distance / (count * v);
    out[2 * k] = 1.0 - out.head(k).sum();
    return out;
  }
};

void validate(Eigen::Index inputs, const SobolOptions& options) {
  check::that(inputs >= 1, "inputs of Sobol' indices", "at least 1");
  check::that(options.points >= 2 && std::has_single_bit(static_cast<std::uint64_t>(options.points)), "points",
              "a power of two, at least 2");
  check::that(options.replicates >= 2, "replicates", "at least 2, for without them there are no intervals");
  check::that(options.confidence > 0.0 && options.confidence < 1.0, "confidence", "a number inside (0, 1)");
}

SobolIndices indices_of(const Eigen::ArrayXd& values, Eigen::Index inputs, const SobolOptions& options) {
  const Eigen::Index block = inputs + 2;
  const auto blocks = values.reshaped(block, options.points * options.replicates);
  SobolIndices out;
  out.first.resize(static_cast<std::size_t>(inputs));
  out.total.resize(static_cast<std::size_t>(inputs));

  double centre = 0.0, size = 0.0, spread = 0.0;
  for (Eigen::Index n = 0; n < blocks.cols(); ++n) {
    if (blocks.col(n).allFinite()) {
      ++out.base_points;
      centre += (0.5 * blocks(0, n) + 0.5 * blocks(1, n) - centre) / static_cast<double>(out.base_points);
      size = std::max(size, blocks.col(n).abs().maxCoeff());
    }
  }
  out.left_out = 1.0 - static_cast<double>(out.base_points) / static_cast<double>(blocks.cols());
  out.mean = centre;

  std::vector<Sums> replicates;
  Sums all(inputs);
  for (Eigen::Index r = 0; r < options.replicates; ++r) {
    Sums sums(inputs);
    for (Eigen::Index n = r * options.points; n < (r + 1) * options.points; ++n) {
      if (blocks.col(n).allFinite()) {
        const Eigen::ArrayXd centred = blocks.col(n) - centre;
        spread = std::max(spread, centred.abs().maxCoeff());
        sums.add(centred);
      }
    }
    if (sums.count > 0.0) {
      all.add(sums);
      replicates.push_back(std::move(sums));
    }
  }
  if (replicates.size() < 2 || out.base_points < 4) {
    return out;
  }
  if (!(spread > 16.0 * std::numeric_limits<double>::epsilon() * size)) {
    out.status = SobolStatus::constant;
    return out;
  }
  const double rounding = 1e-13 * spread * spread;
  out.variance = std::max(0.0, all.variance());
  const auto count = static_cast<Eigen::Index>(replicates.size());
  Eigen::ArrayXXd without(2 * inputs + 1, count);
  for (Eigen::Index r = 0; r < count; ++r) {
    Sums rest(inputs);
    for (Eigen::Index other = 0; other < count; ++other) {
      if (other != r) {
        rest.add(replicates[static_cast<std::size_t>(other)]);
      }
    }
    if (!(rest.variance() > rounding)) {
      return out;
    }
    without.col(r) = rest.indices();
  }
  const double freedom = static_cast<double>(count - 1);
  const double t = core::student_quantile(options.confidence, freedom);
  const Eigen::ArrayXd estimate = all.indices();
  const auto index = [&](Eigen::Index j) {
    const Eigen::ArrayXd row = without.row(j);
    const double se = std::sqrt(freedom / static_cast<double>(count) * (row - row.mean()).square().sum());
    return SobolIndex{estimate[j], se, estimate[j] - t * se, estimate[j] + t * se};
  };
  for (Eigen::Index i = 0; i < inputs; ++i) {
    out.first[static_cast<std::size_t>(i)] = index(i);
    out.total[static_cast<std::size_t>(i)] = index(inputs + i);
  }
  out.interactions = index(2 * inputs);
  out.status = SobolStatus::estimated;
  return out;
}

}  // namespace

std::string_view to_string(SobolStatus status) {
  switch (status) {
    case SobolStatus::estimated: return "estimated";
    case SobolStatus::constant: return "constant";
    case SobolStatus::too_few: return "too_few";
  }
  return "";
}

Eigen::MatrixXd sobol_design(Eigen::Index inputs, const SobolOptions& options) {
  validate(inputs, options);
  const Eigen::MatrixXd points = sobol_points(options.points, 2 * inputs, options.replicates, options.seed);
  const Eigen::Index block = inputs + 2;
  Eigen::MatrixXd design(points.rows() * block, inputs);
  for (Eigen::Index n = 0; n < points.rows(); ++n) {
    const Eigen::RowVectorXd a = points.row(n).head(inputs), b = points.row(n).tail(inputs);
    design.middleRows(n * block, block).rowwise() = a;
    design.row(n * block + 1) = b;
    design.middleRows(n * block + 2, inputs).diagonal() = b.transpose();
  }
  return design;
}

std::vector<SobolIndices> sobol_indices(const Eigen::MatrixXd& values, Eigen::Index inputs,
                                        const SobolOptions& options) {
  validate(inputs, options);
  const Eigen::Index rows = options.points * options.replicates * (inputs + 2);
  check::that(values.rows() == rows, fmt::format("{} rows of values", values.rows()),
              fmt::format("{}, one for each row of the design", rows));
  std::vector<SobolIndices> out;
  for (Eigen::Index q = 0; q < values.cols(); ++q) {
    out.push_back(indices_of(values.col(q).array(), inputs, options));
  }
  return out;
}

}  // namespace wheelwright::study
