// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/shared_noise.hpp>

#include <algorithm>
#include <array>
#include <cmath>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
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
  std::vector<std::size_t> pick;
  for (const auto* names : {&first, &second}) {
    for (const auto& name : *names) {
      const auto column = log.find(name);
      check::that(column.has_value(), "log", "a column '" + name + "'");
      pick.push_back(*column);
    }
  }
  const std::size_t count = first.size();
  const double step = log.median_step();
  std::vector<Pair> pairs(count);
  std::size_t run = 0, windows = 0;
  double before = 0.0;
  LogBlock block;
  log.rewind();
  while (log.next(block)) {
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      const bool starts = segment < block.segment_starts.size() && block.segment_starts[segment] == k;
      segment += starts ? 1 : 0;
      const bool even = std::abs(block.t[k] - before - step) <= kEvenGrid * step;
      run = starts || !even ? 1 : run + 1;
      before = block.t[k];
      const bool whole = run > kOrder + kLags;
      windows += whole ? 1 : 0;
      for (std::size_t c = 0; c < count; ++c) {
        Pair& pair = pairs[c];
        const double a = pair.first(block.columns[pick[c]][k]);
        std::rotate(pair.before.rbegin(), pair.before.rbegin() + 1, pair.before.rend());
        pair.before[0] = pair.second(block.columns[pick[count + c]][k]);
        if (whole) {
          pair.squares_first += a * a;
          pair.squares_second += pair.before[0] * pair.before[0];
          for (std::size_t lag = 0; lag < kLags; ++lag) {
            pair.products[lag] += a * pair.before[lag];
          }
        }
      }
    }
  }
  log.rewind();
  if (windows < kFewestSharedWindows) {
    return false;
  }
  const double limit = std::max(kCorrelated, kCorrelationErrors / std::sqrt(static_cast<double>(windows)));
  return std::ranges::any_of(pairs, [&](const Pair& pair) {
    const double size = std::sqrt(pair.squares_first * pair.squares_second);
    return std::ranges::any_of(pair.products, [&](double product) { return std::abs(product) > limit * size; });
  });
}

}  // namespace wheelwright
