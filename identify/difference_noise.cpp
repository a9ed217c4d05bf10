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

constexpr double binomial(unsigned n, unsigned k) {
  double c = 1.0;
  for (unsigned i = 1; i <= k; ++i) {
    c = c * (n - k + i) / i;
  }
  return c;
}

// Variance of the mean square of order-d differences of N white samples, relative: 2/N · Σ ρ² over all lags, with
// Σ ρ² = C(4d, 2d)/C(2d, d)².
double relative_variance(unsigned d, std::size_t windows) {
  const double c = binomial(2 * d, d);
  return 2.0 * binomial(4 * d, 2 * d) / (c * c) / static_cast<double>(windows);
}

struct Sums {
  std::array<double, kOrders> squares{};
  double largest = 0.0;
};

DifferenceNoise judge(const Sums& sums, std::size_t windows) {
  DifferenceNoise noise;
  noise.windows = windows;
  if (windows < kFewestWindows) {
    return noise;
  }
  for (unsigned d = 1; d <= kOrders; ++d) {
    noise.by_order[d - 1] = std::sqrt(sums.squares[d - 1] / static_cast<double>(windows) / binomial(2 * d, d));
  }
  noise.sd = noise.by_order.back();
  noise.relative_sd = std::sqrt(relative_variance(kOrders, windows));
  if (noise.sd <= kNothing * sums.largest) {
    noise.kind = DifferenceNoise::Kind::none;
    return noise;
  }
  // The last two steps between orders, in standard errors of the ratio. Differences of neighbouring orders share most of
  // their noise, so that the larger of both errors is generous.
  const double allowed = 1.0 + kStandardErrors * noise.relative_sd;
  const auto ratio = [&](std::size_t d) { return std::pow(noise.by_order[d - 1] / noise.by_order[d - 2], 2.0); };
  const double last = ratio(kOrders), before = ratio(kOrders - 1);
  if (last <= allowed && before <= allowed && last >= 1.0 / allowed && before >= 1.0 / allowed) {
    noise.kind = DifferenceNoise::Kind::white;
  } else {
    noise.kind = last < 1.0 ? DifferenceNoise::Kind::smooth : DifferenceNoise::Kind::rough;
  }
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
    result.push_back(judge(s, windows));
  }
  return result;
}

}  // namespace wheelwright
