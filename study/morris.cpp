// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/morris.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {
namespace {

// The move of every input along every trajectory.
struct Trajectories {
  Eigen::MatrixXd rows;
  std::vector<std::vector<Eigen::Index>> order;  // of the inputs that move, one list a trajectory
  std::vector<std::vector<bool>> up;             // of each input
  double step = 0.0;
};

Eigen::Index below(std::mt19937_64& generator, Eigen::Index count) {
  const auto n = static_cast<std::uint64_t>(count);
  const std::uint64_t range = std::mt19937_64::max() - std::mt19937_64::max() % n;
  std::uint64_t draw = generator();
  while (draw >= range) {
    draw = generator();
  }
  return static_cast<Eigen::Index>(draw % n);
}

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
      std::swap(order[static_cast<std::size_t>(i)], order[static_cast<std::size_t>(below(generator, i + 1))]);
    }
    Eigen::RowVectorXd from(inputs), to(inputs);
    std::vector<bool> up(order.size());
    for (Eigen::Index i = 0; i < inputs; ++i) {
      const Eigen::Index level = below(generator, half);
      up[static_cast<std::size_t>(i)] = below(generator, 2) == 1;
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
  ElementaryEffects out{kNan, kNan, kNan, kNan, kNan, kNan, static_cast<Eigen::Index>(effects.size())};
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
    const double t = student_quantile(confidence, n - 1.0);
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

}  // namespace wheelwright
