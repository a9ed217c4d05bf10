// SPDX-License-Identifier: Apache-2.0
// Compiled for the processor at hand where the compiler can, as the user of a loop would: keep other headers out.
#include "tests/benchmarks/lp_pass.hpp"

#include <algorithm>

namespace wheelwright::bench {
namespace {

constexpr std::size_t tile = 256;  // rows that stay in the first-level cache while all points are tested

/// Writes |c − a·x| of `count` rows for Q points to `out`, a tile for each, and the largest of each to `largest`. The
/// points share the loads of a row.
template <std::size_t P, std::size_t Q>
void residuals(const double* __restrict a, std::size_t stride, const double* __restrict c, std::size_t count,
               const double* __restrict x, double* __restrict out, double* __restrict largest) {
  double coefficient[Q][P];
  for (std::size_t q = 0; q < Q; ++q) {
    for (std::size_t j = 0; j < P; ++j) {
      coefficient[q][j] = x[q * P + j];
    }
  }
  for (std::size_t i = 0; i < count; ++i) {
    double rest[Q];
    for (std::size_t q = 0; q < Q; ++q) {
      rest[q] = c[i];
    }
    for (std::size_t j = 0; j < P; ++j) {
      for (std::size_t q = 0; q < Q; ++q) {
        rest[q] -= a[j * stride + i] * coefficient[q][j];
      }
    }
    for (std::size_t q = 0; q < Q; ++q) {
      out[q * tile + i] = rest[q] < 0.0 ? -rest[q] : rest[q];
    }
  }
  for (std::size_t q = 0; q < Q; ++q) {
    constexpr std::size_t lanes = 16;
    double best[lanes] = {};
    const double* from = out + q * tile;
    std::size_t i = 0;
    for (; i + lanes <= count; i += lanes) {
      for (std::size_t k = 0; k < lanes; ++k) {
        best[k] = from[i + k] > best[k] ? from[i + k] : best[k];
      }
    }
    for (; i < count; ++i) {
      best[0] = from[i] > best[0] ? from[i] : best[0];
    }
    largest[q] = *std::max_element(best, best + lanes);
  }
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
  std::vector<double> least(count, tolerance), rest(4 * tile), largest(4);
  for (std::size_t begin = 0; begin < n; begin += tile) {
    const std::size_t rows = std::min(tile, n - begin);
    std::size_t together = 0;
    for (std::size_t first = 0; first < count; first += together) {
      const double* x = points.data() + first * P;
      if (count - first >= 4) {
        together = 4;
        residuals<P, 4>(a + begin, n, c + begin, rows, x, rest.data(), largest.data());
      } else {
        together = 1;
        residuals<P, 1>(a + begin, n, c + begin, rows, x, rest.data(), largest.data());
      }
      for (std::size_t q = 0; q < together; ++q) {
        const std::size_t v = first + q;
        for (std::size_t i = 0; i < rows && largest[q] - 1.0 > least[v]; ++i) {
          if (rest[q * tile + i] - 1.0 > least[v]) {
            found[v].push_back({begin + i, rest[q * tile + i] - 1.0});
          }
        }
        if (found[v].size() >= 4 * most) {
          least[v] = prune(found[v], most);
        }
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
