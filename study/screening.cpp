// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/screening.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/random.hpp>
#include <wheelwright/core/statistics.hpp>

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

}  // namespace wheelwright::study
