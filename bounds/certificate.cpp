// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/certificate.hpp>

#include <algorithm>
#include <utility>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include <wheelwright/core/interval.hpp>

namespace wheelwright::bounds {

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
      nearest = core::round_down(nearest);
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

namespace {

/// 113 bits, every operation rounded to nearest: products of two doubles are exact.
using Quad = boost::multiprecision::cpp_bin_float_quad;

/// A sum, and the sum of the sizes of its terms, of which the rounding of n additions is at most n·2⁻¹¹³ (Higham 2002,
/// section 4.2); eight times that covers the products and the rounding of the bound itself.
class Sum {
 public:
  void add(const Quad& term) {
    value_ += term;
    magnitude_ += abs(term);
    ++terms_;
  }
  [[nodiscard]] Quad upper() const { return value_ + error(); }
  [[nodiscard]] Quad lower() const { return value_ - error(); }
  [[nodiscard]] Quad error() const { return ldexp(magnitude_, -110) * (terms_ + 4); }

 private:
  Quad value_ = 0, magnitude_ = 0;
  int terms_ = 0;
};

/// The smallest double not below x.
double outward(const Quad& x) {
  const auto nearest = static_cast<double>(x);
  return Quad(nearest) < x ? core::round_up(nearest) : nearest;
}

}  // namespace

double certified_upper_bound(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box) {
  Sum bound;
  for (const WeightedRow& weighted : rows) {
    if (weighted.multiplier > 0.0) {
      bound.add(Quad(weighted.multiplier) * weighted.row.b);
    }
  }
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    Sum rest;
    rest.add(a[j]);
    for (const WeightedRow& weighted : rows) {
      const double coefficient = weighted.row.a[static_cast<Eigen::Index>(j)];
      if (weighted.multiplier > 0.0 && coefficient != 0.0) {
        rest.add(-Quad(weighted.multiplier) * coefficient);
      }
    }
    const Quad low = rest.lower(), high = rest.upper();
    const Interval& side = box.sides[j];
    if (low != 0 || high != 0) {
      bound.add(
          std::max({Quad(low * side.lower), Quad(low * side.upper), Quad(high * side.lower), Quad(high * side.upper)}));
    }
  }
  return outward(bound.upper());
}

bool proves_empty(std::span<const WeightedRow> rows, const Box& box) {
  const std::vector<double> zero(box.dimension(), 0.0);
  return certified_upper_bound(zero, rows, box) < 0.0;
}

}  // namespace wheelwright::bounds
