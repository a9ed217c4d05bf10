// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/hull_derivatives.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <wheelwright/bounds/linear_program.hpp>
#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright::study {

using bounds::HalfSpace;
using bounds::Side;

namespace {

constexpr double kActive = 1e-9;    // slack, relative to the block's size
constexpr double kPositive = 1e-9;  // multiplier, relative to the direction
constexpr double kOptimal = 1e-10;  // how far below the optimum counts as optimal, in sizes of the block

// ±e_j in the parameters of the block.
Eigen::VectorXd direction(const Polytope::Block& block, const HullOptimum& optimum) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(block.parameters.size()));
  const auto k = std::ranges::find(block.parameters, optimum.parameter) - block.parameters.begin();
  c[k] = optimum.side == Side::upper ? 1.0 : -1.0;
  return c;
}

// Whether the row passes through θ*, as nearly as its evaluation tells.
bool is_active(const Polytope::Block& block, const HullOptimum& optimum, const HalfSpace& row) {
  const double slack = row.b - row.a.dot(optimum.at);
  const double rounding =
      64.0 * std::numeric_limits<double>::epsilon() * (std::abs(row.b) + row.a.cwiseAbs().dot(optimum.at.cwiseAbs()));
  if (slack > std::max(kActive * block.coordinates.transform.norm() * row.a.norm(), rounding)) {
    return false;  // nearly every row of a log, without a further look
  }
  const double norm = (block.coordinates.transform.transpose() * bounds::pick(row.a, block.parameters)).norm();
  return norm > 0.0 && slack <= std::max(kActive * norm, rounding);
}

void add_if_active(const Polytope::Block& block, HullOptimum& optimum, const HalfSpace& row) {
  const auto same = [&](const bounds::WeightedRow& known) { return known.row.origin == row.origin; };
  if (is_active(block, optimum, row) && std::ranges::none_of(optimum.active, same)) {
    optimum.active.push_back({row, 0.0});
  }
}

HalfSpace side_of(const Box& prior, std::size_t j, Side side) {
  const bool upper = side == Side::upper;
  HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(prior.dimension())),
                upper ? prior.sides[j].upper : -prior.sides[j].lower,
                {.is_prior = true, .parameter = j, .side = side}};
  row.a[static_cast<Eigen::Index>(j)] = upper ? 1.0 : -1.0;
  return row;
}

// The vertex and its multipliers from the equations of an optimal basis.
void locate(const HullOptima& optima, HullOptimum& optimum) {
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  const Eigen::VectorXd c = block.coordinates.transform.transpose() * direction(block, optimum);
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(c.size(), 8.0);
  bounds::LinearProgram program(-limit, limit);
  program.add_rows(block.normals, block.offsets);
  bounds::LinearProgram::Basis basis;
  if (program.maximise(c / c.norm(), basis).status != bounds::LpSolution::Status::optimal ||
      std::ranges::any_of(basis, [](int row) { return row < 0; })) {
    return;
  }
  Eigen::MatrixXd rows(c.size(), c.size());
  Eigen::VectorXd offsets(c.size());
  for (Eigen::Index r = 0; r < c.size(); ++r) {
    const int facet = basis[static_cast<std::size_t>(r)];
    rows.row(r) = block.normals.col(facet).transpose();
    offsets[r] = block.offsets[facet];
  }
  const core::RankRevealingLu lu(rows), transposed(rows.transpose());
  if (!lu.invertible()) {
    return;
  }
  const Eigen::VectorXd lambda = transposed.solve(c);
  const std::size_t p = optima.set.dimension();
  Eigen::VectorXd theta = block.coordinates.centre + block.coordinates.transform * lu.solve(offsets);
  // Once more with the residuals of the rows themselves.
  for (Eigen::Index r = 0; r < c.size(); ++r) {
    const auto facet = static_cast<std::size_t>(basis[static_cast<std::size_t>(r)]);
    const HalfSpace& row = block.facets[facet];
    const double norm = block.norms[static_cast<Eigen::Index>(facet)];
    offsets[r] = (row.b - row.a.dot(theta)) / norm;
    const double multiplier = std::max(lambda[r], 0.0);
    optimum.unique_maximiser = optimum.unique_maximiser && multiplier > kPositive * c.norm();
    optimum.active.push_back({bounds::spread(row, block.parameters, p), multiplier / norm});
  }
  theta += block.coordinates.transform * lu.solve(offsets);
  optimum.basis = optimum.active.size();
  optimum.at = Eigen::Map<const Eigen::VectorXd>(optima.set.chebyshev_centre().data(), static_cast<Eigen::Index>(p));
  for (std::size_t k = 0; k < block.parameters.size(); ++k) {
    optimum.at[static_cast<Eigen::Index>(block.parameters[k])] = theta[static_cast<Eigen::Index>(k)];
  }
  optimum.found = true;
  for (const HalfSpace& facet : block.facets) {
    add_if_active(block, optimum, bounds::spread(facet, block.parameters, p));
  }
  for (const std::size_t j : block.parameters) {
    add_if_active(block, optimum, side_of(optima.prior, j, Side::lower));
    add_if_active(block, optimum, side_of(optima.prior, j, Side::upper));
  }
}

// Derivative of max ±θ_j along s, for s growing with `sign` = 1 and falling with −1.
double directional(const HullOptima& optima, const HullOptimum& optimum, std::span<const RowRate> rates, double sign) {
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  const Eigen::MatrixXd& T = block.coordinates.transform;
  const auto q = static_cast<Eigen::Index>(block.parameters.size());
  const auto m = static_cast<Eigen::Index>(rates.size());
  Eigen::VectorXd g(m);
  Eigen::MatrixXd turned = Eigen::MatrixXd::Zero(q, m), normals(q, m);
  double largest = 0.0, sum = 0.0;
  bool couples = false;
  Eigen::VectorXd elsewhere = Eigen::VectorXd::Zero(optimum.at.size());
  const Eigen::VectorXd theta = bounds::pick(optimum.at, block.parameters);
  for (Eigen::Index i = 0; i < m; ++i) {
    const RowRate& rate = rates[static_cast<std::size_t>(i)];
    const bounds::WeightedRow& row = optimum.active[static_cast<std::size_t>(i)];
    g[i] = sign * rate.b;
    if (rate.a.size() > 0) {
      Eigen::VectorXd others = rate.a;
      for (const std::size_t j : block.parameters) {
        others[static_cast<Eigen::Index>(j)] = 0.0;
      }
      g[i] -= sign * bounds::pick(rate.a, block.parameters).dot(theta);
      couples = couples || !others.isZero(0.0);
      elsewhere -= sign * row.multiplier * others;
    }
    sum += row.multiplier * g[i];
    const Eigen::VectorXd normal = T.transpose() * bounds::pick(row.row.a, block.parameters);
    normals.col(i) = normal / normal.norm();
    g[i] /= normal.norm();
    if (rate.a.size() > 0) {
      turned.col(i) = sign / normal.norm() * (T.transpose() * bounds::pick(rate.a, block.parameters));
    }
    largest = std::max({largest, std::abs(g[i]), turned.col(i).norm()});
  }
  if (couples) {
    // The objective leaves the other blocks free: rows that come to depend on them meet the worst of all their θ.
    if (!optimum.is_regular()) {
      return core::kNan;
    }
    sum += optima.set.support({elsewhere.data(), static_cast<std::size_t>(elsewhere.size())});
  }
  if (optimum.is_regular() || largest == 0.0) {
    return sum;
  }
  // Variables: d, and where the maximiser is not unique and rows turn, the way from θ* to another optimum.
  const bool walk = !optimum.unique_maximiser && !turned.isZero(0.0);
  const Eigen::Index variables = walk ? 2 * q : q, facets = walk ? block.offsets.size() : 0;
  const Eigen::VectorXd c = T.transpose() * direction(block, optimum);
  Eigen::VectorXd objective = Eigen::VectorXd::Zero(variables);
  objective.head(q) = c / c.norm();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(variables, m + facets + (walk ? 1 : 0));
  Eigen::VectorXd offsets(rows.cols());
  rows.topLeftCorner(q, m) = normals;
  offsets.head(m) = g / largest;
  if (walk) {
    rows.bottomLeftCorner(q, m) = turned / largest;
    for (Eigen::Index i = 0; i < facets; ++i) {
      const HalfSpace& facet = block.facets[static_cast<std::size_t>(i)];
      rows.col(m + i).tail(q) = block.normals.col(i);
      offsets[m + i] = std::max(0.0, (facet.b - facet.a.dot(theta)) / block.norms[i]);
    }
    rows.col(m + facets).tail(q) = -c / c.norm();
    offsets[m + facets] = kOptimal;
  }
  // The box is to be as small as it may: it costs digits.
  for (const double reach : {1e2, 1e4, 1e6}) {
    Eigen::VectorXd limit = Eigen::VectorXd::Constant(variables, reach);
    limit.tail(variables - q).setConstant(32.0);
    bounds::LinearProgram program(-limit, limit);
    program.add_rows(rows, offsets);
    const bounds::LpSolution solution = program.maximise(objective);
    if (solution.status == bounds::LpSolution::Status::optimal) {
      return largest * c.norm() * solution.value;
    }
  }
  return core::kNan;
}

}  // namespace

HullOptima hull_optima(const Polytope& set, const Box& prior) {
  check::that(prior.dimension() == set.dimension(), "prior box", "one side per parameter of the set");
  const std::size_t p = set.dimension();
  HullOptima optima{set, prior, std::vector<HullOptimum>(p), std::vector<HullOptimum>(p)};
  for (std::size_t b = 0; b < set.blocks().size(); ++b) {
    for (const std::size_t j : set.blocks()[b].parameters) {
      for (HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
        const bool upper = optimum == &optima.upper[j];
        optimum->parameter = j;
        optimum->side = upper ? Side::upper : Side::lower;
        optimum->value = upper ? set.hull().sides[j].upper : set.hull().sides[j].lower;
        optimum->block = b;
        locate(optima, *optimum);
      }
    }
  }
  return optima;
}

void add_active_rows(HullOptima& optima, core::RegressionSource& rows, std::vector<std::size_t> excluded) {
  check::that(rows.parameters() == optima.set.dimension(), "rows", "as many parameters as the set");
  std::ranges::sort(excluded);
  const bounds::SlabRows slabs(optima.prior);
  HalfSpace upper, lower;
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      if (std::ranges::binary_search(excluded, block.sample[static_cast<std::size_t>(r) / block.outputs])) {
        continue;
      }
      slabs.half_spaces(block, r, upper, lower);
      for (auto* side : {&optima.lower, &optima.upper}) {
        for (HullOptimum& optimum : *side) {
          if (optimum.found) {
            add_if_active(optima.set.blocks()[optimum.block], optimum, upper);
            add_if_active(optima.set.blocks()[optimum.block], optimum, lower);
          }
        }
      }
    }
  }
}

OneSided bound_derivative(const HullOptima& optima, const HullOptimum& optimum, std::span<const RowRate> left,
                          std::span<const RowRate> right) {
  check::that(left.size() == optimum.active.size() && right.size() == optimum.active.size(), "rates",
              "one for each active row");
  if (!optimum.found) {
    return {core::kNan, core::kNan};
  }
  const double sign = optimum.side == Side::upper ? 1.0 : -1.0;
  return {-sign * directional(optima, optimum, left, -1.0), sign * directional(optima, optimum, right, 1.0)};
}

std::string row_in_words(const bounds::RowOrigin& origin) {
  const char* side = origin.side == Side::upper ? "upper" : "lower";
  return origin.is_prior ? fmt::format("the prior's {} side of parameter {}", side, origin.parameter)
                         : fmt::format("row {} (t = {:.6g} s)", origin.sample, origin.t);
}

std::string why_not_regular(const HullOptimum& optimum, const std::string& name) {
  const std::string bound = fmt::format("the {} bound of {}", optimum.side == Side::upper ? "upper" : "lower", name);
  if (!optimum.found) {
    return bound + ": no vertex is known, the set is flat to rounding";
  }
  std::string words;
  if (!optimum.unique_maximiser) {
    words = bound + " is attained on more than one point of the set, or held by rows of which one does not count";
  }
  if (optimum.active.size() > optimum.basis) {
    words += words.empty() ? bound + ": " : "; ";
    words += fmt::format("{} constraints meet where {} define the vertex", optimum.active.size(), optimum.basis);
    for (std::size_t i = optimum.basis; i < std::min(optimum.active.size(), optimum.basis + 3); ++i) {
      words += (i == optimum.basis ? ": beside these " : ", ") + row_in_words(optimum.active[i].row.origin);
    }
    words += optimum.active.size() > optimum.basis + 3 ? ", …" : "";
  }
  return words;
}

}  // namespace wheelwright::study
