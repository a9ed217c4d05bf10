// SPDX-License-Identifier: Apache-2.0
#include "bounds/cutting_planes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bounds/certificate.hpp"

namespace wheelwright::bounds {
namespace {

constexpr double kCut = 1e-12;           // of the size of the set: a row that cuts less than that is left out
constexpr std::size_t kManyRounds = 20;  // of cutting, from which rows are looked at for having been there

}  // namespace

CuttingPlanes::CuttingPlanes(const Box& box, const Eigen::MatrixXd& information, std::vector<std::size_t> parameters)
    : box_(box), corners_(4 * box.dimension()), known_(4 * box.dimension(), 0) {
  check_finite(box, "box of cutting planes");
  coordinates_ = whitened(box, information);
  rows_ = sides_as_rows(box, parameters);
  reduced_size_ = rows_.size();
  z_upper_ = extent(box, coordinates_);
  z_lower_ = -z_upper_;
  vertices_ = Eigen::MatrixXd::Zero(z_upper_.size(), 4 * z_upper_.size());
  recentre();
}

Eigen::VectorXd CuttingPlanes::middle() const {
  return coordinates_.centre + coordinates_.transform * (0.5 * (z_upper_ + z_lower_));
}

std::pair<Eigen::VectorXd, Eigen::VectorXd> CuttingPlanes::oblique_box() const {
  return {0.5 * (z_upper_ - z_lower_), middle()};
}

CuttingPlanes::OuterBox CuttingPlanes::outer_box() const {
  const Eigen::Index p = z_lower_.size();
  const Eigen::VectorXd half = coordinates_.transform.cwiseAbs() * (0.5 * (z_upper_ - z_lower_));
  const Eigen::VectorXd centre = middle();
  OuterBox around;
  for (Eigen::Index j = 0; j < p; ++j) {
    double low = centre[j] - half[j], high = centre[j] + half[j];
    if (!corners_[static_cast<std::size_t>(2 * (p + j))].rows.empty() &&
        !corners_[static_cast<std::size_t>(2 * (p + j) + 1)].rows.empty()) {
      const auto theta = [&](Eigen::Index k) {
        return coordinates_.centre[j] + coordinates_.transform.row(j).dot(vertices_.col(k));
      };
      high = std::min(high, theta(2 * (p + j)));
      low = std::max(low, theta(2 * (p + j) + 1));
    }
    // The prior side is exact, the other to rounding; a row more that is looked at does no harm.
    Interval side = box_.sides[static_cast<std::size_t>(j)];
    side.lower = std::min(std::max(side.lower, low), side.upper);
    side.upper = std::max(std::min(side.upper, high), side.lower);
    around.centre.push_back(side.centre());
    around.half.push_back(0.5 * side.width());
    around.least.push_back(std::max({0.0, side.lower, -side.upper}));
  }
  return around;
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
  program_->add_rows(a, b);
}

/// A program without rows, whose box contains the set with room to spare.
void CuttingPlanes::clear_program() {
  const Eigen::VectorXd room = (2.0 * (z_upper_ - z_lower_)).array() + 1.0;
  program_.emplace(z_lower_ - room, z_upper_ + room);
  norms_.resize(0);
  std::fill(known_.begin(), known_.end(), std::size_t{0});
}

void CuttingPlanes::rebuild() {
  clear_program();
  for (LinearProgram::Basis& corner : corners_) {
    corner.inverse.clear();
  }
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

/// Solves for the corners along θ, and (`oblique`) for those along z, which set the box of z.
/// False where one of the programs found no point at all.
bool CuttingPlanes::update_box(bool oblique) {
  const Eigen::Index p = z_lower_.size();
  bool feasible = true;
  for (Eigen::Index k = oblique ? 0 : 2 * p; k < 4 * p; ++k) {
    // The set has only shrunk: a corner that satisfies what came since is the best one still.
    std::size_t& known = known_[static_cast<std::size_t>(k)];
    if (known > 0 && !(program_->violation(known, vertices_.col(k).data()) > kCut)) {
      known = rows_.size();
      continue;
    }
    known = 0;
    const Eigen::Index j = k / 2 % p;
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    Eigen::VectorXd direction = sign * Eigen::VectorXd::Unit(p, j);
    if (k >= 2 * p) {
      direction = sign * coordinates_.transform.row(j).transpose();
    }
    const LpSolution solution = program_->maximise(direction, corners_[static_cast<std::size_t>(k)]);
    if (solution.status != LpSolution::Status::optimal) {
      feasible = feasible && solution.status != LpSolution::Status::infeasible;
      continue;
    }
    known = rows_.size();
    vertices_.col(k) = solution.x;
    if (k < 2 * p) {
      double& side = sign > 0.0 ? z_upper_[j] : z_lower_[j];
      side = solution.x[j];
    }
  }
  for (Eigen::Index j = 0; j < p; ++j) {
    if (z_lower_[j] > z_upper_[j]) {
      std::swap(z_lower_[j], z_upper_[j]);
    }
  }
  return feasible;
}

/// Proves the rows contradictory, or drops those from `first_new` on.
void CuttingPlanes::resolve_infeasibility(std::size_t first_new) {
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
    std::fill(corners_.begin(), corners_.end(), LinearProgram::Basis{});
    rebuild();
    update_box();
  }
}

struct CuttingPlanes::Whitened {
  std::vector<double> a, b;          ///< unit normals by columns and offsets, padded
  std::vector<std::size_t> numbers;  ///< of the candidates
  std::size_t stride = 0, p = 0;

  [[nodiscard]] kernels::Rows view() const { return {a.data(), stride, stride, p, b.data()}; }
  /// The candidate never matters again.
  void drop(std::size_t i) { b[i] = std::numeric_limits<double>::infinity(); }
  [[nodiscard]] bool dropped(std::size_t i) const { return b[i] == std::numeric_limits<double>::infinity(); }
};

/// The candidates `numbers` in z; `open_only`: those of them that the box of z does not imply.
CuttingPlanes::Whitened CuttingPlanes::whiten(const RowBank& candidates, std::span<const std::size_t> numbers,
                                              bool open_only) const {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  const Eigen::VectorXd half = 0.5 * (z_upper_ - z_lower_), middle = 0.5 * (z_upper_ + z_lower_);
  Whitened result;
  result.p = box_.dimension();
  result.stride = (numbers.size() + kernels::kLanes - 1) / kernels::kLanes * kernels::kLanes;
  result.a.assign(result.stride * result.p, 0.0);
  result.b.assign(result.stride, std::numeric_limits<double>::infinity());
  // Many at a time, for the sake of the product.
  constexpr Eigen::Index kMany = 64;
  Eigen::MatrixXd a(p, kMany), g(p, kMany);
  for (std::size_t first = 0; first < numbers.size(); first += kMany) {
    const auto count = static_cast<Eigen::Index>(std::min<std::size_t>(kMany, numbers.size() - first));
    for (Eigen::Index c = 0; c < count; ++c) {
      std::copy_n(candidates.normal(numbers[first + static_cast<std::size_t>(c)]).data(), p, a.col(c).data());
    }
    g.leftCols(count).noalias() = coordinates_.transform.transpose() * a.leftCols(count);
    for (Eigen::Index c = 0; c < count; ++c) {
      const std::size_t number = numbers[first + static_cast<std::size_t>(c)];
      const double rest = candidates.b[number] - a.col(c).dot(coordinates_.centre);
      if (open_only && !(g.col(c).dot(middle) + g.col(c).cwiseAbs().dot(half) > rest)) {
        continue;
      }
      const std::size_t k = result.numbers.size();
      const double norm = std::max(g.col(c).norm(), 1e-300);
      for (Eigen::Index j = 0; j < p; ++j) {
        result.a[static_cast<std::size_t>(j) * result.stride + k] = g(j, c) / norm;
      }
      result.b[k] = rest / norm;
      result.numbers.push_back(number);
    }
  }
  return result;
}

std::vector<std::size_t> CuttingPlanes::open(const RowBank& candidates, std::span<const std::size_t> numbers) const {
  return whiten(candidates, numbers, true).numbers;
}

std::vector<std::size_t> CuttingPlanes::cut_corners(const RowBank& candidates, bool hull_only) {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const auto normal = candidates.normal(i);
    if (std::any_of(normal.begin(), normal.end(), [](double x) { return x != 0.0; })) {
      numbers.push_back(i);
    } else if (candidates.b[i] < 0.0) {
      contradiction_ = std::vector<WeightedRow>{{candidates.at(i), 1.0}};
      return {};
    }
  }
  if (rows_.size() <= static_cast<std::size_t>(2 * p)) {
    update_box();
  }
  Whitened bank = whiten(candidates, numbers, true);
  // The box of z is needed now and then only where no facets are looked for.
  bool stale = false;
  for (int round = 1;; ++round) {
    std::vector<std::size_t> worst;
    for (Eigen::Index k = hull_only ? 2 * p : 0; k < vertices_.cols(); ++k) {
      const kernels::Found found = kernels::best().most_violated(bank.view(), vertices_.col(k).data());
      if (found.value > kCut) {
        worst.push_back(found.row);
      }
    }
    std::sort(worst.begin(), worst.end());
    worst.erase(std::unique(worst.begin(), worst.end()), worst.end());
    if (worst.empty()) {
      break;
    }
    const std::size_t first_new = rows_.size();
    for (const std::size_t i : worst) {
      rows_.push_back(candidates.at(bank.numbers[i]));
      bank.drop(i);
    }
    insert(std::span(rows_).subspan(first_new));
    stale = hull_only && round % 4 != 0;
    if (!update_box(!stale)) {
      resolve_infeasibility(first_new);
      if (is_empty()) {
        return {};
      }
    }
    const Eigen::VectorXd half = (0.5 * (z_upper_ - z_lower_)).cwiseMax(resolution());
    if (half.minCoeff() < 0.05) {
      recentre();
      std::vector<std::size_t> kept;
      for (std::size_t i = 0; i < bank.numbers.size(); ++i) {
        if (!bank.dropped(i)) {
          kept.push_back(bank.numbers[i]);
        }
      }
      bank = whiten(candidates, kept, true);
    }
  }
  if (stale) {
    update_box();
  }
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < bank.numbers.size(); ++i) {
    if (!bank.dropped(i)) {
      left.push_back(bank.numbers[i]);
    }
  }
  return open(candidates, left);
}

void CuttingPlanes::add_to_hull(const RowBank& candidates, RowBank* open) {
  if (is_empty()) {
    return;
  }
  const std::vector<std::size_t> left = cut_corners(candidates, true);
  for (std::size_t k = 0; open != nullptr && k < left.size(); ++k) {
    open->add(candidates.normal(left[k]), candidates.b[left[k]], candidates.origins[left[k]]);
  }
}

bool CuttingPlanes::stands_still(std::size_t before, std::size_t round) const {
  if (rows_.size() <= before) {
    return true;
  }
  const auto old = rows_.begin() + static_cast<std::ptrdiff_t>(before);
  return round > kManyRounds && std::all_of(old, rows_.end(), [&](const HalfSpace& row) {
           return std::any_of(rows_.begin(), old, [&](const HalfSpace& each) { return each.origin == row.origin; });
         });
}

Eigen::MatrixXd CuttingPlanes::extreme_points() const {
  const Eigen::Index p = z_lower_.size();
  return (coordinates_.transform * vertices_.rightCols(2 * p)).colwise() + coordinates_.centre;
}

/// Hands to `keep`, which adds them to the program, the rows of `bank` that cut what the program holds: facets of the
/// set, each once. A ray from within meets a facet first, where a linear program only finds a row that cuts
/// (Clarkson 1994).
template <class Keep>
void CuttingPlanes::take_facets(Whitened& bank, Keep keep) {
  const Eigen::VectorXd inner = vertices_.rowwise().mean();
  std::vector<double> slack(bank.stride), along(bank.stride);
  kernels::best().slack(bank.view(), inner.data(), slack.data());
  Eigen::VectorXd g(inner.size()), ray(inner.size());
  for (std::size_t i = 0; i < bank.numbers.size(); ++i) {
    for (std::size_t j = 0; j < bank.p; ++j) {
      g[static_cast<Eigen::Index>(j)] = bank.a[j * bank.stride + i];
    }
    while (!bank.dropped(i)) {
      const std::optional<double> reached = program_->reach(g.data(), bank.b[i] + 2.0 * kCut);
      if (reached && *reached <= bank.b[i] + kCut) {
        bank.drop(i);
        break;
      }
      std::size_t facet = i;
      if (reached) {
        ray = Eigen::Map<const Eigen::VectorXd>(program_->vertex(), ray.size()) - inner;
        const kernels::Found found =
            kernels::best().first_blocking(bank.view(), slack.data(), ray.data(), 1e-12, along.data());
        facet = found.value < 1.0 && !bank.dropped(found.row) ? found.row : i;
      }
      keep(facet);
      bank.drop(facet);
      slack[facet] = std::numeric_limits<double>::infinity();
    }
    slack[i] = std::numeric_limits<double>::infinity();
  }
}

void CuttingPlanes::add(const RowBank& candidates) {
  if (is_empty()) {
    return;
  }
  std::vector<std::size_t> left = cut_corners(candidates, false);
  if (is_empty() || left.empty()) {
    return;
  }
  // Neighbours in time have nearly the same normal, or its opposite: one side after the other, so that one vertex
  // serves many of them.
  const Eigen::VectorXd one_side =
      coordinates_.transform.transpose() *
      Eigen::Map<const Eigen::VectorXd>(candidates.normal(left.front()).data(), z_lower_.size());
  const Eigen::VectorXd towards = coordinates_.transform * one_side;
  std::stable_partition(left.begin(), left.end(), [&](std::size_t i) {
    return towards.dot(Eigen::Map<const Eigen::VectorXd>(candidates.normal(i).data(), towards.size())) >= 0.0;
  });
  Whitened bank = whiten(candidates, left, false);
  take_facets(bank, [&](std::size_t facet) {
    rows_.push_back(candidates.at(bank.numbers[facet]));
    insert(std::span(rows_).last(1));
  });
  update_box();
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
  // Built up anew from nothing but the box of the program, so that every row is tried against facets only.
  RowBank all;
  all.parameters = box_.dimension();
  for (const HalfSpace& row : rows_) {
    all.add({row.a.data(), all.parameters}, row.b, row.origin);
  }
  std::vector<std::size_t> everyone(rows_.size());
  std::iota(everyone.begin(), everyone.end(), std::size_t{0});
  Whitened bank = whiten(all, everyone, false);
  clear_program();
  std::vector<std::size_t> facets;
  take_facets(bank, [&](std::size_t facet) {
    facets.push_back(facet);
    insert(std::span(rows_).subspan(facet, 1));
  });
  std::sort(facets.begin(), facets.end());
  std::vector<HalfSpace> remaining;
  for (const std::size_t i : facets) {
    remaining.push_back(std::move(rows_[i]));
  }
  rows_ = std::move(remaining);
  reduced_size_ = std::max(rows_.size(), static_cast<std::size_t>(2 * p));
  std::fill(corners_.begin(), corners_.end(), LinearProgram::Basis{});
  rebuild();
  update_box();
}

CertifiedBound CuttingPlanes::certified_maximum(const Eigen::VectorXd& a, const Box& within,
                                                LinearProgram::Basis basis) {
  const std::span<const double> direction(a.data(), static_cast<std::size_t>(a.size()));
  CertifiedBound bound{within.support(direction), {}};
  const LpSolution solution = program_->maximise(coordinates_.transform.transpose() * a, basis);
  if (solution.status != LpSolution::Status::optimal) {
    return bound;
  }
  std::vector<const HalfSpace*> vertex;
  for (const int i : basis.rows) {
    if (i >= 0) {
      vertex.push_back(&rows_[static_cast<std::size_t>(i)]);
    }
  }
  bound.binding = refined_multipliers(vertex, direction, false);
  if (bound.binding.empty()) {
    for (std::size_t k = 0; k < solution.rows.size(); ++k) {
      bound.binding.push_back({rows_[static_cast<std::size_t>(solution.rows[k])],
                               solution.multipliers[static_cast<Eigen::Index>(k)] / norms_[solution.rows[k]]});
    }
  }
  bound.value = std::min(bound.value, certified_upper_bound(direction, bound.binding, within));
  return bound;
}

std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> CuttingPlanes::certified_hull() {
  const auto p = static_cast<Eigen::Index>(box_.dimension());
  std::vector<CertifiedBound> lower, upper;
  Box first = box_;
  for (Eigen::Index j = 0; j < p; ++j) {
    const auto above = static_cast<std::size_t>(2 * (p + j));
    lower.push_back(certified_maximum(-Eigen::VectorXd::Unit(p, j), box_, corners_[above + 1]));
    upper.push_back(certified_maximum(Eigen::VectorXd::Unit(p, j), box_, corners_[above]));
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

}  // namespace wheelwright::bounds
