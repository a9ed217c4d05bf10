// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/certificate.hpp>

#include <algorithm>

#include <boost/multiprecision/cpp_bin_float.hpp>

namespace wheelwright {
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
  return Quad(nearest) < x ? round_up(nearest) : nearest;
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

}  // namespace wheelwright
