// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/infeasibility.hpp>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/linear_program.hpp>

namespace wheelwright::bounds {
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
