// SPDX-License-Identifier: Apache-2.0
#include "bounds/certificate.hpp"

#include <algorithm>
#include <utility>

#include <boost/multiprecision/cpp_bin_float.hpp>

#include "bounds/linear_program.hpp"
#include "core/interval.hpp"

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

namespace {

/// The smallest s >= −1 for which every row may be exceeded by s (in the scaled coordinates); its multipliers are the
/// Farkas vector when s > 0.
std::optional<std::vector<WeightedRow>> elastic_multipliers(std::span<const HalfSpace> rows, const Box& box,
                                                            const Coordinates& coordinates) {
  const auto p = static_cast<Eigen::Index>(box.dimension());
  std::vector<HalfSpace> all(rows.begin(), rows.end());
  for (HalfSpace& side : sides_as_rows(box)) {
    all.push_back(std::move(side));
  }
  const auto m = static_cast<Eigen::Index>(all.size());
  Eigen::MatrixXd a(p + 1, m + 1);
  Eigen::VectorXd b(m + 1), norms(m);
  double scale = 1.0;
  for (Eigen::Index i = 0; i < m; ++i) {
    const HalfSpace& row = all[static_cast<std::size_t>(i)];
    const Eigen::VectorXd g = coordinates.transform.transpose() * row.a;
    norms[i] = std::max(g.norm(), std::numeric_limits<double>::min());
    a.col(i) << g / norms[i], -1.0;
    b[i] = (row.b - row.a.dot(coordinates.centre)) / norms[i];
    if (!row.origin.is_prior) {
      scale = std::max(scale, std::abs(b[i]));
    }
  }
  // Far away rows: solve for z / scale and s / scale instead.
  b /= scale;
  a.col(m) = -Eigen::VectorXd::Unit(p + 1, p);
  b[m] = 1.0;
  // z may leave the box by as much as its sides may be exceeded.
  Eigen::VectorXd limit(p + 1);
  limit << extent(box, coordinates) / scale, 0.0;
  limit.array() += 4.0 + 4.0 * b.cwiseAbs().maxCoeff();
  LinearProgram program(-limit, limit);
  program.add_rows(a, b);
  const LpSolution solution = program.maximise(-Eigen::VectorXd::Unit(p + 1, p));
  if (solution.status != LpSolution::Status::optimal || !(solution.value < 0.0)) {
    return std::nullopt;
  }
  std::vector<WeightedRow> members;
  for (std::size_t k = 0; k < solution.rows.size(); ++k) {
    const int i = solution.rows[k];
    if (i < static_cast<int>(rows.size())) {
      members.push_back(
          {all[static_cast<std::size_t>(i)], solution.multipliers[static_cast<Eigen::Index>(k)] / norms[i]});
    }
  }
  if (!proves_empty(members, box)) {
    return std::nullopt;
  }
  return members;
}

}  // namespace

std::vector<HalfSpace> sides_as_rows(const Box& box, std::span<const std::size_t> parameters) {
  const auto p = static_cast<Eigen::Index>(box.dimension());
  std::vector<HalfSpace> rows;
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto k = static_cast<std::size_t>(j);
    RowOrigin origin;
    origin.is_prior = true;
    origin.parameter = parameters.empty() ? k : parameters[k];
    origin.side = Side::lower;
    rows.push_back({-Eigen::VectorXd::Unit(p, j), -box.sides[k].lower, origin});
    origin.side = Side::upper;
    rows.push_back({Eigen::VectorXd::Unit(p, j), box.sides[k].upper, origin});
  }
  return rows;
}

std::optional<std::vector<WeightedRow>> find_contradiction(std::span<const HalfSpace> rows, const Box& box,
                                                           const Coordinates& coordinates) {
  auto members = elastic_multipliers(rows, box, coordinates);
  if (!members) {
    return std::nullopt;
  }
  for (std::size_t i = 0; i < members->size();) {
    std::vector<HalfSpace> others;
    for (std::size_t k = 0; k < members->size(); ++k) {
      if (k != i) {
        others.push_back((*members)[k].row);
      }
    }
    if (auto fewer = elastic_multipliers(others, box, coordinates)) {
      members = std::move(fewer);
      i = 0;
    } else {
      ++i;
    }
  }
  return members;
}

}  // namespace wheelwright::bounds
