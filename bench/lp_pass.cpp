// SPDX-License-Identifier: Apache-2.0
// Compiled for the processor at hand where the compiler can, as the user of a loop would: keep other headers out.
#include "lp_pass.hpp"

#include <algorithm>

namespace wheelwright::bench {
namespace {

constexpr std::size_t tile = 256;  // rows that stay in the first-level cache while all points are tested

/// Writes |c − a·x| of `count` rows to `out` and returns the largest.
template <std::size_t P>
double residuals(const double* __restrict a, std::size_t stride, const double* __restrict c, std::size_t count,
                 const double* __restrict x, double* __restrict out) {
  double coefficient[P];
  for (std::size_t j = 0; j < P; ++j) {
    coefficient[j] = x[j];
  }
  for (std::size_t i = 0; i < count; ++i) {
    double rest = c[i];
    for (std::size_t j = 0; j < P; ++j) {
      rest -= a[j * stride + i] * coefficient[j];
    }
    out[i] = rest < 0.0 ? -rest : rest;
  }
  double largest[8] = {};
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    for (std::size_t k = 0; k < 8; ++k) {
      largest[k] = out[i + k] > largest[k] ? out[i + k] : largest[k];
    }
  }
  for (; i < count; ++i) {
    largest[0] = out[i] > largest[0] ? out[i] : largest[0];
  }
  return *std::max_element(largest, largest + 8);
}

/// Keeps the `most` largest; returns the smallest amount that still counts.
double prune(std::vector<Violation>& list, std::size_t most) {
  const auto last = list.begin() + static_cast<std::ptrdiff_t>(most);
  std::nth_element(list.begin(), last - 1, list.end(),
                   [](const Violation& x, const Violation& y) { return x.amount > y.amount; });
  list.erase(last, list.end());
  return list.back().amount;
}

template <std::size_t P>
void pass(const double* a, const double* c, std::size_t n, std::span<const double> points, std::size_t most,
          double tolerance, std::vector<std::vector<Violation>>& found) {
  const std::size_t count = points.size() / P;
  found.assign(count, {});
  std::vector<double> least(count, tolerance), rest(tile);
  for (std::size_t begin = 0; begin < n; begin += tile) {
    const std::size_t rows = std::min(tile, n - begin);
    for (std::size_t v = 0; v < count; ++v) {
      const double largest = residuals<P>(a + begin, n, c + begin, rows, points.data() + v * P, rest.data());
      if (!(largest - 1.0 > least[v])) {
        continue;
      }
      for (std::size_t i = 0; i < rows; ++i) {
        if (rest[i] - 1.0 > least[v]) {
          found[v].push_back({begin + i, rest[i] - 1.0});
        }
      }
      if (found[v].size() >= 4 * most) {
        least[v] = prune(found[v], most);
      }
    }
  }
  for (std::vector<Violation>& list : found) {
    if (list.size() > most) {
      prune(list, most);
    }
  }
}

}  // namespace

void most_violated(const double* a, const double* c, std::size_t n, std::size_t p, std::span<const double> points,
                   std::size_t most, double tolerance, std::vector<std::vector<Violation>>& found) {
  using Pass = void (*)(const double*, const double*, std::size_t, std::span<const double>, std::size_t, double,
                        std::vector<std::vector<Violation>>&);
  static constexpr Pass passes[] = {pass<1>, pass<2>, pass<3>, pass<4>,  pass<5>,  pass<6>,
                                    pass<7>, pass<8>, pass<9>, pass<10>, pass<11>, pass<12>};
  passes[p - 1](a, c, n, points, most, tolerance, found);
}

}  // namespace wheelwright::bench
