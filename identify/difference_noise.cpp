// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/difference_noise.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
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
  std::vector<std::size_t> pick;
  for (const auto& name : columns) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    pick.push_back(*column);
  }
  const double step = log.median_step();
  std::vector<Sums> sums(columns.size());
  // Last differences of order 0, 1, …, of each column.
  std::vector<std::array<double, kOrders + 1>> last(columns.size());
  std::size_t run = 0, windows = 0;
  double before = 0.0;
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const bool starts = segment < block.segment_starts.size() && block.segment_starts[segment] == k;
      segment += starts ? 1 : 0;
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
    }
  }
  log.rewind();
  std::vector<DifferenceNoise> result;
  result.reserve(sums.size());
  for (const Sums& s : sums) {
    result.push_back(judge_windows(s, windows));
  }
  return result;
}

}  // namespace wheelwright
