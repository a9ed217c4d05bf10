// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/refined_multipliers.hpp>

#include <algorithm>
#include <utility>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <wheelwright/core/interval.hpp>

namespace wheelwright {

std::vector<WeightedRow> refined_multipliers(std::span<const HalfSpace* const> basis, std::span<const double> a,
                                             bool split) {
  using Quad = boost::multiprecision::cpp_bin_float_quad;
  const std::size_t p = a.size();
  if (basis.size() != p) {
    return {};
  }
  // Columns are the half-spaces; Gauss with the largest pivot of a column, rows scaled to one.
  std::vector<std::vector<Quad>> m(p, std::vector<Quad>(p + 1));
  for (std::size_t j = 0; j < p; ++j) {
    double largest = std::abs(a[j]);
    for (std::size_t i = 0; i < p; ++i) {
      largest = std::max(largest, std::abs(basis[i]->a[static_cast<Eigen::Index>(j)]));
    }
    if (!(largest > 0.0)) {
      return {};
    }
    for (std::size_t i = 0; i < p; ++i) {
      m[j][i] = Quad(basis[i]->a[static_cast<Eigen::Index>(j)]) / largest;
    }
    m[j][p] = Quad(a[j]) / largest;
  }
  for (std::size_t c = 0; c < p; ++c) {
    std::size_t pivot = c;
    for (std::size_t r = c + 1; r < p; ++r) {
      pivot = abs(m[r][c]) > abs(m[pivot][c]) ? r : pivot;
    }
    if (m[pivot][c] == 0) {
      return {};
    }
    std::swap(m[c], m[pivot]);
    for (std::size_t r = c + 1; r < p; ++r) {
      if (m[r][c] != 0) {
        const Quad factor = m[r][c] / m[c][c];
        for (std::size_t k = c; k <= p; ++k) {
          m[r][k] -= factor * m[c][k];
        }
      }
    }
  }
  std::vector<Quad> lambda(p);
  for (std::size_t c = p; c-- > 0;) {
    Quad sum = m[c][p];
    for (std::size_t k = c + 1; k < p; ++k) {
      sum -= m[c][k] * lambda[k];
    }
    lambda[c] = sum / m[c][c];
  }
  std::vector<WeightedRow> result;
  for (std::size_t i = 0; i < p; ++i) {
    auto nearest = static_cast<double>(lambda[i]);
    if (!(nearest > 0.0) || !std::isfinite(nearest)) {
      continue;
    }
    if (split && Quad(nearest) > lambda[i]) {
      nearest = round_down(nearest);
    }
    result.push_back({*basis[i], nearest});
    if (split) {
      const auto rest = static_cast<double>(Quad(lambda[i] - nearest));
      if (rest > 0.0) {
        result.push_back({*basis[i], rest});
      }
    }
  }
  return result;
}

}  // namespace wheelwright
