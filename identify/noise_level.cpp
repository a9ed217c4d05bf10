// SPDX-License-Identifier: Apache-2.0
#include "identify/noise_level.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/check.hpp"
#include "core/statistics.hpp"

namespace wheelwright::identify {
namespace {

constexpr std::size_t kOrders = DifferenceNoise::kOrders;
constexpr std::size_t kFewestWindows = 50;
constexpr double kEvenStep = 0.1;   // of the median step
constexpr double kNothing = 1e-12;  // of the signal's size: rounding
constexpr double kStandardErrors = 4.0;
constexpr double kSmallBias = 0.1;  // of sd²

constexpr double binomial(unsigned n, unsigned k) {
  double c = 1.0;
  for (unsigned i = 1; i <= k; ++i) {
    c = c * (n - k + i) / i;
  }
  return c;
}

// Σ over lags of the squared cross-correlations of order-d and order-e differences of white noise, each of unit
// variance.
double shared(unsigned d, unsigned e) {
  return binomial(2 * (d + e), d + e) / (binomial(2 * d, d) * binomial(2 * e, e));
}

// Standard error of log(v_d/v_e) for mean squares v of N windows of white noise.
double ratio_error(unsigned d, unsigned e, std::size_t windows) {
  return std::sqrt(2.0 * (shared(d, d) + shared(e, e) - 2.0 * shared(d, e)) / static_cast<double>(windows));
}

// −∂ log v_d/∂ρ for a correlation ρ at lag one.
double sensitivity(unsigned d) { return 2.0 * d / (d + 1.0); }

// What log(v_last/v_d) may be off zero in white noise: chance, or a correlation too small to matter.
double allowed(unsigned d, std::size_t windows) {
  const double small = kSmallBias * (sensitivity(kOrders) - sensitivity(d)) / sensitivity(kOrders);
  return std::max(kStandardErrors * ratio_error(kOrders, d, windows), small);
}

struct Sums {
  std::array<double, kOrders> squares{};
  double largest = 0.0;
};

DifferenceNoise judge_windows(const Sums& sums, std::size_t windows) {
  DifferenceNoise noise;
  noise.windows = windows;
  if (windows < kFewestWindows) {
    return noise;
  }
  for (unsigned d = 1; d <= kOrders; ++d) {
    noise.by_order[d - 1] = std::sqrt(sums.squares[d - 1] / static_cast<double>(windows) / binomial(2 * d, d));
  }
  noise.sd = noise.by_order.back();
  noise.relative_sd = std::sqrt(2.0 * shared(kOrders, kOrders) / static_cast<double>(windows));
  if (noise.sd <= kNothing * sums.largest) {
    noise.kind = DifferenceNoise::Kind::none;
    return noise;
  }
  noise.kind = DifferenceNoise::Kind::white;
  bool level = true;
  for (unsigned d = kOrders - 1; d >= 1; --d) {
    const double step = 2.0 * std::log(noise.sd / noise.by_order[d - 1]);
    const double most = allowed(d, windows);
    if (step > most) {
      noise.kind = DifferenceNoise::Kind::rough;
    } else if (d == kOrders - 1 && step < -most) {
      noise.kind = DifferenceNoise::Kind::smooth;
    }
    level = level && std::abs(step) <= most;
    noise.level_from = level ? d : noise.level_from;
  }
  if (noise.kind != DifferenceNoise::Kind::white) {
    noise.level_from = 0;
    return noise;
  }
  const auto from = static_cast<unsigned>(noise.level_from);
  noise.hidden = allowed(from, windows) * sensitivity(kOrders) / (sensitivity(kOrders) - sensitivity(from));
  return noise;
}

}  // namespace

std::vector<DifferenceNoise> difference_noise(LogSource& log, const std::vector<std::string>& columns) {
  const std::vector<std::size_t> pick = core::positions_of(log, columns);
  const double step = log.median_step();
  std::vector<Sums> sums(columns.size());
  // Last differences of order 0, 1, …, of each column.
  std::vector<std::array<double, kOrders + 1>> last(columns.size());
  std::size_t run = 0, windows = 0;
  double before = 0.0;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    const bool even = std::abs(block.t[k] - before - step) <= kEvenStep * step;
    run = starts || !even ? 1 : run + 1;
    before = block.t[k];
    const bool whole = run > kOrders;
    windows += whole ? 1 : 0;
    for (std::size_t c = 0; c < pick.size(); ++c) {
      double difference = block.columns[pick[c]][k];
      sums[c].largest = std::max(sums[c].largest, std::abs(difference));
      for (std::size_t d = 0; d <= kOrders; ++d) {
        const double older = last[c][d];
        last[c][d] = difference;
        if (whole && d > 0) {
          sums[c].squares[d - 1] += difference * difference;
        }
        difference -= older;
      }
    }
  });
  std::vector<DifferenceNoise> result;
  result.reserve(sums.size());
  for (const Sums& s : sums) {
    result.push_back(judge_windows(s, windows));
  }
  return result;
}

namespace {

constexpr std::size_t kOrder = 6;
constexpr std::size_t kLags = 4;
constexpr std::size_t kFewestSharedWindows = 50;
constexpr double kEvenGrid = 0.1;  // of the median step
constexpr double kCorrelated = 0.1;
constexpr double kCorrelationErrors = 10.7;  // six of white series: √(C(24, 12))/C(12, 6)/√N each

// The sixth difference of a series, value by value.
class Difference {
 public:
  double operator()(double value) {
    double difference = value;
    for (double& last : last_) {
      const double older = last;
      last = difference;
      difference -= older;
    }
    return difference;
  }

 private:
  std::array<double, kOrder> last_{};
};

struct Pair {
  Difference first, second;
  std::array<double, kLags> before{};  // sixth differences of the second, newest first
  std::array<double, kLags> products{};
  double squares_first = 0.0, squares_second = 0.0;
};

}  // namespace

bool share_noise(LogSource& log, const std::vector<std::string>& first, const std::vector<std::string>& second) {
  check::that(first.size() == second.size(), "share_noise", "as many columns of one kind as of the other");
  const std::vector<std::size_t> pick = core::positions_of(log, first), pick_second = core::positions_of(log, second);
  const std::size_t count = first.size();
  const double step = log.median_step();
  std::vector<Pair> pairs(count);
  std::size_t run = 0, windows = 0;
  double before = 0.0;
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    const bool even = std::abs(block.t[k] - before - step) <= kEvenGrid * step;
    run = starts || !even ? 1 : run + 1;
    before = block.t[k];
    const bool whole = run > kOrder + kLags;
    windows += whole ? 1 : 0;
    for (std::size_t c = 0; c < count; ++c) {
      Pair& pair = pairs[c];
      const double a = pair.first(block.columns[pick[c]][k]);
      std::rotate(pair.before.rbegin(), pair.before.rbegin() + 1, pair.before.rend());
      pair.before[0] = pair.second(block.columns[pick_second[c]][k]);
      if (whole) {
        pair.squares_first += a * a;
        pair.squares_second += pair.before[0] * pair.before[0];
        for (std::size_t lag = 0; lag < kLags; ++lag) {
          pair.products[lag] += a * pair.before[lag];
        }
      }
    }
  });
  if (windows < kFewestSharedWindows) {
    return false;
  }
  const double limit = std::max(kCorrelated, kCorrelationErrors / std::sqrt(static_cast<double>(windows)));
  return std::ranges::any_of(pairs, [&](const Pair& pair) {
    const double size = std::sqrt(pair.squares_first * pair.squares_second);
    return std::ranges::any_of(pair.products, [&](double product) { return std::abs(product) > limit * size; });
  });
}

ExtrapolatedBound extrapolate(const OutputResidual& residual, std::size_t instants,
                              const ExtrapolationOptions& options) {
  check::that(options.risk > 0.0 && options.risk < 1.0, "extrapolation risk", "a number inside (0, 1)");
  check::positive(options.horizon, "extrapolation horizon");
  check::that(instants > 0, "extrapolation", "at least one instant");
  const double n = std::max(residual.effective_instants, 1.0);
  const double spread = std::sqrt(n / core::chi_squared_quantile(n, options.risk));
  const auto z = [&](double count) {
    return core::normal_upper_quantile(std::min(0.25, options.risk / (2.0 * count)));
  };
  const auto seen = static_cast<double>(instants);
  ExtrapolatedBound result;
  result.bound = residual.rms * spread * z(seen * std::max(options.horizon, 1.0));
  const double most_kurtosis = 3.0 + z(0.5) * std::sqrt(24.0 / n);
  result.heavy_tail = residual.largest > residual.rms * spread * z(seen) || residual.kurtosis > most_kurtosis;
  if (result.heavy_tail) {
    result.bound = std::max(result.bound,
                            residual.largest + residual.rms * std::log(std::max(options.horizon, 1.0) / options.risk));
  }
  result.over_largest = residual.largest > 0.0 ? result.bound / residual.largest : 0.0;
  result.over_rms = residual.rms > 0.0 ? result.bound / residual.rms : 0.0;
  return result;
}

Eigen::VectorXd largest_plausible_error(core::RegressionSource& rows, const Eigen::VectorXd& theta,
                                        const ResidualSummary& summary, double risk) {
  check::that(risk > 0.0 && risk < 1.0, "risk", "a number inside (0, 1)");
  const auto p = static_cast<double>(theta.size());
  const auto scheffe = [&](double freedom) { return p * core::fisher_upper_quantile(p, std::max(freedom, 1.0), risk); };
  const double everywhere = scheffe(summary.freedom);
  std::vector<double> where_seen;
  for (const OutputResidual& output : summary.outputs) {
    where_seen.push_back(scheffe(std::min(output.fit_freedom, summary.freedom)));
  }
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows.outputs()));
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    const auto n = static_cast<Eigen::Index>(block.outputs);
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const double residual = std::abs(block.y[row] - block.Y.row(row).dot(theta));
      const auto of = [&](const Eigen::MatrixXd& covariance) {
        return block.Y.row(row).dot(block.Y.row(row) * covariance);
      };
      const double variance = std::max(where_seen[static_cast<std::size_t>(row % n)] * of(summary.covariance),
                                       everywhere * of(summary.stationary_covariance));
      largest[row % n] = std::max(largest[row % n], residual + std::sqrt(std::max(variance, 0.0)));
    }
  });
  return largest;
}

}  // namespace wheelwright::identify
