// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/cutting_planes.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/LU>

#include <wheelwright/bounds/certificate.hpp>

namespace wheelwright {
namespace {

constexpr double kCut = 1e-10;  // of the size of the set: what cuts less than that is left out

}  // namespace

CuttingPlanes::CuttingPlanes(const Box& box, const Eigen::MatrixXd& information, std::vector<std::size_t> parameters)
    : box_(box), program_(static_cast<Eigen::Index>(box.dimension())) {
  check_finite(box, "box of cutting planes");
  const auto p = static_cast<Eigen::Index>(box.dimension());
  coordinates_ = whitened(box, information);
  rows_ = sides_as_rows(box, parameters);
  reduced_size_ = rows_.size();
  // Half-widths of the box seen from z: |z| = |T⁻¹ (θ − centre)|.
  Eigen::VectorXd half(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    half[j] = 0.5 * box.sides[static_cast<std::size_t>(j)].width();
  }
  z_upper_ = coordinates_.transform.inverse().cwiseAbs() * half;
  z_lower_ = -z_upper_;
  vertices_ = Eigen::MatrixXd::Zero(p, 2 * p);
  recentre();
}

bool CuttingPlanes::implied(const Eigen::VectorXd& a, double b) const {
  const Eigen::Index p = a.size();
  double reach = 0.0;
  for (Eigen::Index j = 0; j < p; ++j) {
    const double g = coordinates_.transform.col(j).dot(a);
    reach += g > 0.0 ? g * z_upper_[j] : g * z_lower_[j];
  }
  return reach + a.dot(coordinates_.centre) <= b;
}

void CuttingPlanes::insert(std::span<const HalfSpace> rows) {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  const auto m = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd a(p, m);
  Eigen::VectorXd b(m);
  const Eigen::Index before = norms_.size();
  norms_.conservativeResize(before + m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const HalfSpace& row = rows[static_cast<std::size_t>(i)];
    const Eigen::VectorXd g = coordinates_.transform.transpose() * row.a;
    const double norm = std::max(g.norm(), 1e-300);
    norms_[before + i] = norm;
    a.col(i) = g / norm;
    b[i] = (row.b - row.a.dot(coordinates_.centre)) / norm;
  }
  program_.add_rows(a, b);
}

void CuttingPlanes::rebuild() {
  program_ = LinearProgram(static_cast<Eigen::Index>(box_.dimension()));
  norms_.resize(0);
  insert(rows_);
}

Eigen::VectorXd CuttingPlanes::resolution() const {
  const Eigen::Index p = z_lower_.size();
  Eigen::VectorXd smallest(p);
  for (Eigen::Index k = 0; k < p; ++k) {
    double steps = 0.0;
    for (Eigen::Index j = 0; j < p; ++j) {
      const double side = box_.sides[static_cast<std::size_t>(j)].width();
      const double step = 1e-14 * std::abs(coordinates_.centre[j]) + 1e-15 * side + 1e-290;
      steps = std::max(steps, std::abs(coordinates_.transform(j, k)) / step);
    }
    smallest[k] = 1.0 / std::max(steps, 1e-290);
  }
  return smallest;
}

void CuttingPlanes::recentre() {
  const Eigen::VectorXd middle = 0.5 * (z_lower_ + z_upper_);
  Eigen::VectorXd half = 0.5 * (z_upper_ - z_lower_);
  half = half.cwiseMax(resolution());
  coordinates_.centre += coordinates_.transform * middle;
  coordinates_.transform = coordinates_.transform * half.asDiagonal();
  z_lower_ = ((z_lower_ - middle).array() / half.array()).matrix();
  z_upper_ = ((z_upper_ - middle).array() / half.array()).matrix();
  vertices_.colwise() -= middle;
  vertices_ = half.cwiseInverse().asDiagonal() * vertices_;
  rebuild();
}

void CuttingPlanes::update_box() {
  const Eigen::Index p = z_lower_.size();
  for (Eigen::Index k = 0; k < 2 * p; ++k) {
    const Eigen::Index j = k / 2;
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    const LpSolution solution = program_.maximise(sign * Eigen::VectorXd::Unit(p, j));
    if (solution.status != LpSolution::Status::optimal) {
      continue;
    }
    vertices_.col(k) = solution.x;
    double& side = sign > 0.0 ? z_upper_[j] : z_lower_[j];
    side = solution.x[j];
  }
  for (Eigen::Index j = 0; j < p; ++j) {
    if (z_lower_[j] > z_upper_[j]) {
      std::swap(z_lower_[j], z_upper_[j]);
    }
  }
}

bool CuttingPlanes::resolve_infeasibility(std::size_t first_new) {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  const LpSolution probe = program_.maximise(Eigen::VectorXd::Unit(p, 0));
  if (probe.status != LpSolution::Status::infeasible) {
    return false;
  }
  std::vector<HalfSpace> data;
  for (const HalfSpace& row : rows_) {
    if (!row.origin.is_prior) {
      data.push_back(row);
    }
  }
  contradiction_ = find_contradiction(data, box_, coordinates_);
  if (!contradiction_) {
    undecided_ += rows_.size() - first_new;
    rows_.resize(first_new);
    rebuild();
  }
  return true;
}

void CuttingPlanes::add(std::vector<HalfSpace> candidates) {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  if (is_empty() || candidates.empty()) {
    return;
  }
  const auto still_open = [&](const HalfSpace& row) { return !implied(row.a, row.b); };
  std::vector<HalfSpace> open;
  for (HalfSpace& row : candidates) {
    if (row.a.isZero(0.0)) {
      if (row.b < 0.0) {
        contradiction_ = std::vector<WeightedRow>{{std::move(row), 1.0}};
        return;
      }
    } else if (still_open(row)) {
      open.push_back(std::move(row));
    }
  }

  // Cutting planes at the 2p vertices that span the box: the most violated row of each joins, until none is violated.
  bool vertices_known = rows_.size() > static_cast<std::size_t>(2 * p);
  if (!vertices_known && !open.empty()) {
    update_box();
    vertices_known = true;
  }
  while (!open.empty()) {
    std::vector<double> worst(static_cast<std::size_t>(2 * p), kCut);
    std::vector<std::ptrdiff_t> which(static_cast<std::size_t>(2 * p), -1);
    for (std::size_t i = 0; i < open.size(); ++i) {
      const Eigen::VectorXd g = coordinates_.transform.transpose() * open[i].a;
      const double offset = open[i].b - open[i].a.dot(coordinates_.centre), norm = std::max(g.norm(), 1e-300);
      for (Eigen::Index k = 0; k < 2 * p; ++k) {
        const double violation = (g.dot(vertices_.col(k)) - offset) / norm;
        if (violation > worst[static_cast<std::size_t>(k)]) {
          worst[static_cast<std::size_t>(k)] = violation;
          which[static_cast<std::size_t>(k)] = static_cast<std::ptrdiff_t>(i);
        }
      }
    }
    std::sort(which.begin(), which.end(), std::greater<>());
    which.erase(std::unique(which.begin(), which.end()), which.end());
    while (!which.empty() && which.back() < 0) {
      which.pop_back();
    }
    if (which.empty()) {
      break;
    }
    const std::size_t first_new = rows_.size();
    for (const std::ptrdiff_t i : which) {
      rows_.push_back(std::move(open[static_cast<std::size_t>(i)]));
      open.erase(open.begin() + i);
    }
    insert(std::span(rows_).subspan(first_new));
    if (resolve_infeasibility(first_new)) {
      if (is_empty()) {
        return;
      }
    }
    update_box();
    const Eigen::VectorXd half = (0.5 * (z_upper_ - z_lower_)).cwiseMax(resolution());
    if (half.minCoeff() < 0.05) {
      recentre();
    }
    std::erase_if(open, [&](const HalfSpace& row) { return !still_open(row); });
  }

  // What is left may cut between these vertices: one linear program each.
  bool changed = false;
  for (HalfSpace& row : open) {
    const Eigen::VectorXd g = coordinates_.transform.transpose() * row.a;
    const double offset = row.b - row.a.dot(coordinates_.centre), norm = std::max(g.norm(), 1e-300);
    const LpSolution solution = program_.maximise(g / norm);
    if (solution.status == LpSolution::Status::optimal && solution.value <= offset / norm + kCut) {
      continue;
    }
    rows_.push_back(std::move(row));
    insert(std::span(rows_).last(1));
    changed = true;
  }
  if (changed) {
    update_box();
  }
  if (rows_.size() > 2 * reduced_size_ + 100) {
    reduce();
  }
}

void CuttingPlanes::reduce() {
  if (is_empty()) {
    return;
  }
  update_box();
  recentre();
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  std::vector<char> kept(rows_.size(), 1);
  // Newest first: where rows coincide, the earliest stays.
  for (std::size_t i = rows_.size(); i-- > 0;) {
    const auto row = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd g = coordinates_.transform.transpose() * rows_[i].a / norms_[row];
    const double offset = (rows_[i].b - rows_[i].a.dot(coordinates_.centre)) / norms_[row];
    program_.disable(row);
    const LpSolution solution = program_.maximise(g);
    if (solution.status == LpSolution::Status::optimal && solution.value <= offset + kCut) {
      kept[i] = 0;
    } else {
      program_.enable(row);
    }
  }
  std::vector<HalfSpace> remaining;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (kept[i] != 0) {
      remaining.push_back(std::move(rows_[i]));
    }
  }
  rows_ = std::move(remaining);
  reduced_size_ = std::max(rows_.size(), static_cast<std::size_t>(2 * p));
  rebuild();
}

std::optional<LpSolution> CuttingPlanes::maximise(const Eigen::VectorXd& a) {
  const Eigen::VectorXd g = coordinates_.transform.transpose() * a;
  const double norm = g.norm();
  if (!(norm > 0.0)) {
    LpSolution zero;
    zero.status = LpSolution::Status::optimal;
    zero.x = coordinates_.centre;
    return zero;
  }
  LpSolution solution = program_.maximise(g / norm);
  if (solution.status != LpSolution::Status::optimal) {
    return std::nullopt;
  }
  solution.x = coordinates_.centre + coordinates_.transform * solution.x;
  solution.value = a.dot(solution.x);
  for (std::size_t k = 0; k < solution.rows.size(); ++k) {
    solution.multipliers[static_cast<Eigen::Index>(k)] *= norm / norms_[solution.rows[k]];
  }
  return solution;
}

CertifiedBound CuttingPlanes::certified_maximum(const Eigen::VectorXd& a, const Box& within) {
  const std::span<const double> direction(a.data(), static_cast<std::size_t>(a.size()));
  CertifiedBound bound{within.support(direction), {}};
  if (const std::optional<LpSolution> solution = maximise(a)) {
    for (std::size_t k = 0; k < solution->rows.size(); ++k) {
      bound.binding.push_back(
          {rows_[static_cast<std::size_t>(solution->rows[k])], solution->multipliers[static_cast<Eigen::Index>(k)]});
    }
    bound.value = std::min(bound.value, certified_upper_bound(direction, bound.binding, within));
  }
  return bound;
}

std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> CuttingPlanes::certified_hull() {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  std::vector<CertifiedBound> lower, upper;
  Box first = box_;
  for (Eigen::Index j = 0; j < p; ++j) {
    lower.push_back(certified_maximum(-Eigen::VectorXd::Unit(p, j), box_));
    upper.push_back(certified_maximum(Eigen::VectorXd::Unit(p, j), box_));
    first.sides[static_cast<std::size_t>(j)] = {-lower.back().value, upper.back().value};
  }
  // Once more over the hull just proved: what is left of a − Aᵀλ then meets a small box.
  for (std::size_t j = 0; j < static_cast<std::size_t>(p); ++j) {
    std::vector<double> axis(static_cast<std::size_t>(p), 0.0);
    axis[j] = -1.0;
    lower[j].value = -std::min(lower[j].value, certified_upper_bound(axis, lower[j].binding, first));
    axis[j] = 1.0;
    upper[j].value = std::min(upper[j].value, certified_upper_bound(axis, upper[j].binding, first));
    // The sides of the box are exact: no rounding leads beyond them.
    lower[j].value = std::max(lower[j].value, box_.sides[j].lower);
    upper[j].value = std::min(upper[j].value, box_.sides[j].upper);
  }
  return {std::move(lower), std::move(upper)};
}

}  // namespace wheelwright
