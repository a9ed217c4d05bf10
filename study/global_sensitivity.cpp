// SPDX-License-Identifier: Apache-2.0
#include "study/global_sensitivity.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <boost/random/sobol.hpp>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/random.hpp"
#include "core/statistics.hpp"

namespace wheelwright::study {
namespace {

std::size_t at_index(Eigen::Index i) { return static_cast<std::size_t>(i); }

}  // namespace

Eigen::Index grid_points(const Grid& grid) {
  check::that(!grid.levels.empty(), "inputs of a grid", "at least 1");
  check::that(grid.nominal.size() == static_cast<Eigen::Index>(grid.levels.size()),
              fmt::format("{} nominal coordinates of a grid", grid.nominal.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  check::that((grid.nominal.array() >= 0.0).all() && (grid.nominal.array() <= 1.0).all(), "nominal coordinates",
              "numbers in [0, 1]");
  Eigen::Index points = 1;
  bool overflow = false;
  for (const Eigen::Index levels : grid.levels) {
    check::that(levels >= 1, fmt::format("{} levels of an input of a grid", levels), "at least 1");
    overflow = overflow || levels > std::numeric_limits<Eigen::Index>::max() / points;
    points = overflow ? points : points * levels;
  }
  check::that(!overflow && points <= grid.most,
              overflow ? fmt::format("a grid of {} points", fmt::join(grid.levels, " × "))
                       : fmt::format("a grid of {} = {} points", fmt::join(grid.levels, " × "), points),
              fmt::format("at most {}; take fewer levels, or Sobol' indices, which need no grid", grid.most));
  return points;
}

Eigen::Index grid_point(const Grid& grid, const std::vector<Eigen::Index>& at) {
  (void)grid_points(grid);
  check::that(at.size() == grid.levels.size(), fmt::format("{} levels of a grid's point", at.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  Eigen::Index point = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    check::that(at[i] >= 0 && at[i] < grid.levels[i], fmt::format("level {} of input {} of a grid", at[i], i),
                fmt::format("0 to {}", grid.levels[i] - 1));
    point = point * grid.levels[i] + at[i];
  }
  return point;
}

Eigen::VectorXd grid_coordinates(const Grid& grid, Eigen::Index input) {
  (void)grid_points(grid);
  check::that(input >= 0 && input < grid.nominal.size(), fmt::format("input {} of a grid", input),
              fmt::format("0 to {}", grid.nominal.size() - 1));
  const Eigen::Index levels = grid.levels[at_index(input)];
  if (levels == 1) {
    return Eigen::VectorXd::Constant(1, grid.nominal[input]);
  }
  return Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
}

Eigen::MatrixXd grid_design(const Grid& grid) {
  const Eigen::Index points = grid_points(grid);
  Eigen::MatrixXd design(points, grid.nominal.size());
  Eigen::Index run = 1;  // rows over which an input keeps its level
  for (Eigen::Index i = design.cols(); i-- > 0;) {
    const Eigen::VectorXd coordinates = grid_coordinates(grid, i);
    for (Eigen::Index n = 0; n < points; ++n) {
      design(n, i) = coordinates[n / run % coordinates.size()];
    }
    run *= coordinates.size();
  }
  return design;
}

GridMap grid_map(const Grid& grid, const Eigen::VectorXd& values, Eigen::Index x, Eigen::Index y,
                 std::vector<Eigen::Index> at) {
  const Eigen::Index points = grid_points(grid);
  check::that(values.size() == points, fmt::format("{} values of a grid", values.size()),
              fmt::format("{}, one for each point", points));
  check::that(x != y, "inputs of a map", "two different ones");
  GridMap map{grid_coordinates(grid, x), grid_coordinates(grid, y), {}};
  check::that(at.size() == grid.levels.size(), fmt::format("{} levels of a map", at.size()),
              fmt::format("{}, one for each input", grid.levels.size()));
  map.values.resize(map.x.size(), map.y.size());
  for (Eigen::Index a = 0; a < map.x.size(); ++a) {
    for (Eigen::Index b = 0; b < map.y.size(); ++b) {
      at[at_index(x)] = a;
      at[at_index(y)] = b;
      const double value = values[grid_point(grid, at)];
      map.values(a, b) = std::isfinite(value) ? value : std::numeric_limits<double>::quiet_NaN();
    }
  }
  return map;
}

namespace {

void validate(Eigen::Index inputs, Eigen::Index levels) {
  check::that(inputs >= 1, "inputs of a study", "at least 1");
  check::that(levels >= 2, "levels", "at least 2, the ends of the range");
}

OneAtATime curves(const Eigen::VectorXd& values, Eigen::Index inputs, Eigen::Index levels) {
  OneAtATime out;
  out.nominal = values[0];
  for (Eigen::Index i = 0; i < inputs; ++i) {
    InputCurve curve;
    curve.coordinates = Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
    curve.values = values.segment(1 + i * levels, levels);
    curve.low = curve.values[0];
    curve.high = curve.values[levels - 1];
    double least = out.nominal, most = out.nominal;
    for (const double y : curve.values) {
      least = std::fmin(least, y);
      most = std::fmax(most, y);
      curve.missing += std::isnan(y) ? 1 : 0;
    }
    curve.swing = most - least;
    out.inputs.push_back(std::move(curve));
  }
  out.order.resize(out.inputs.size());
  std::iota(out.order.begin(), out.order.end(), std::size_t{0});
  const auto rank = [&](std::size_t i) { return std::isnan(out.inputs[i].swing) ? -1.0 : out.inputs[i].swing; };
  std::stable_sort(out.order.begin(), out.order.end(), [&](std::size_t a, std::size_t b) { return rank(a) > rank(b); });
  return out;
}

}  // namespace

Eigen::MatrixXd one_at_a_time_design(const Eigen::VectorXd& nominal, Eigen::Index levels) {
  const Eigen::Index inputs = nominal.size();
  validate(inputs, levels);
  check::that((nominal.array() >= 0.0).all() && (nominal.array() <= 1.0).all(), "nominal coordinates",
              "numbers in [0, 1]");
  Eigen::MatrixXd design = nominal.transpose().replicate(1 + inputs * levels, 1);
  for (Eigen::Index i = 0; i < inputs; ++i) {
    design.col(i).segment(1 + i * levels, levels) = Eigen::VectorXd::LinSpaced(levels, 0.0, 1.0);
  }
  return design;
}

std::vector<OneAtATime> one_at_a_time(const Eigen::MatrixXd& values, Eigen::Index inputs, Eigen::Index levels) {
  validate(inputs, levels);
  check::that(values.rows() == 1 + inputs * levels, fmt::format("{} rows of values", values.rows()),
              fmt::format("{}, one for each row of the design", 1 + inputs * levels));
  const Eigen::MatrixXd finite = values.unaryExpr([](double y) { return std::isfinite(y) ? y : core::kNan; });
  std::vector<OneAtATime> out;
  for (Eigen::Index q = 0; q < finite.cols(); ++q) {
    out.push_back(curves(finite.col(q), inputs, levels));
  }
  return out;
}

namespace {

// The move of every input along every trajectory.
struct Trajectories {
  Eigen::MatrixXd rows;
  std::vector<std::vector<Eigen::Index>> order;  // of the inputs that move, one list a trajectory
  std::vector<std::vector<bool>> up;             // of each input
  double step = 0.0;
};

Trajectories trajectories(Eigen::Index inputs, const MorrisOptions& options) {
  check::that(inputs >= 1, "inputs of a screening", "at least 1");
  check::that(options.trajectories >= 2, "trajectories", "at least 2");
  check::that(options.levels >= 2 && options.levels % 2 == 0, "levels", "an even number, at least 2");
  check::that(options.confidence > 0.0 && options.confidence < 1.0, "confidence", "a number inside (0, 1)");
  std::mt19937_64 generator(options.seed);
  const Eigen::Index half = options.levels / 2;
  const auto last = static_cast<double>(options.levels - 1);
  Trajectories out;
  out.step = static_cast<double>(half) / last;
  out.rows.resize(options.trajectories * (inputs + 1), inputs);
  for (Eigen::Index r = 0; r < options.trajectories; ++r) {
    std::vector<Eigen::Index> order(static_cast<std::size_t>(inputs));
    std::iota(order.begin(), order.end(), Eigen::Index{0});
    for (Eigen::Index i = inputs - 1; i > 0; --i) {
      std::swap(order[static_cast<std::size_t>(i)],
                order[core::uniform_below(generator, static_cast<std::uint64_t>(i + 1))]);
    }
    Eigen::RowVectorXd from(inputs), to(inputs);
    std::vector<bool> up(order.size());
    for (Eigen::Index i = 0; i < inputs; ++i) {
      const auto level = static_cast<Eigen::Index>(core::uniform_below(generator, static_cast<std::uint64_t>(half)));
      up[static_cast<std::size_t>(i)] = core::uniform_below(generator, 2) == 1;
      from[i] = static_cast<double>(level) / last;
      to[i] = static_cast<double>(level + half) / last;
      if (!up[static_cast<std::size_t>(i)]) {
        std::swap(from[i], to[i]);
      }
    }
    const Eigen::Index start = r * (inputs + 1);
    out.rows.middleRows(start, inputs + 1).rowwise() = from;
    for (Eigen::Index m = 0; m < inputs; ++m) {
      const Eigen::Index i = order[static_cast<std::size_t>(m)];
      out.rows.col(i).segment(start + m + 1, inputs - m).setConstant(to[i]);
    }
    out.order.push_back(std::move(order));
    out.up.push_back(std::move(up));
  }
  return out;
}

ElementaryEffects summary(const std::vector<double>& effects, double confidence) {
  ElementaryEffects out{core::kNan,
                        core::kNan,
                        core::kNan,
                        core::kNan,
                        core::kNan,
                        core::kNan,
                        static_cast<Eigen::Index>(effects.size())};
  if (effects.empty()) {
    return out;
  }
  const Eigen::ArrayXd e = Eigen::Map<const Eigen::ArrayXd>(effects.data(), out.effects);
  out.mean = e.mean();
  out.mean_absolute = e.abs().mean();
  if (out.effects > 1) {
    const auto n = static_cast<double>(out.effects);
    out.deviation = std::sqrt((e - out.mean).square().sum() / (n - 1.0));
    out.standard_error = std::sqrt((e.abs() - out.mean_absolute).square().sum() / (n - 1.0) / n);
    const double t = core::student_quantile(confidence, n - 1.0);
    out.lower = std::max(0.0, out.mean_absolute - t * out.standard_error);
    out.upper = out.mean_absolute + t * out.standard_error;
  }
  return out;
}

}  // namespace

Eigen::MatrixXd morris_design(Eigen::Index inputs, const MorrisOptions& options) {
  return trajectories(inputs, options).rows;
}

std::vector<std::vector<ElementaryEffects>> morris_effects(const Eigen::MatrixXd& values, Eigen::Index inputs,
                                                           const MorrisOptions& options) {
  const Trajectories design = trajectories(inputs, options);
  check::that(values.rows() == design.rows.rows(), fmt::format("{} rows of values", values.rows()),
              fmt::format("{}, one for each row of the design", design.rows.rows()));
  std::vector<std::vector<ElementaryEffects>> out;
  for (Eigen::Index q = 0; q < values.cols(); ++q) {
    std::vector<std::vector<double>> effects(static_cast<std::size_t>(inputs));
    for (Eigen::Index r = 0; r < options.trajectories; ++r) {
      for (Eigen::Index m = 0; m < inputs; ++m) {
        const Eigen::Index row = r * (inputs + 1) + m;
        const auto moved =
            static_cast<std::size_t>(design.order[static_cast<std::size_t>(r)][static_cast<std::size_t>(m)]);
        const double change = values(row + 1, q) - values(row, q);
        if (std::isfinite(change)) {
          effects[moved].push_back((design.up[static_cast<std::size_t>(r)][moved] ? change : -change) / design.step);
        }
      }
    }
    out.emplace_back();
    for (const std::vector<double>& of_input : effects) {
      out.back().push_back(summary(of_input, options.confidence));
    }
  }
  return out;
}

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
