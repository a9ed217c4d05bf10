// SPDX-License-Identifier: Apache-2.0
#include "bounds/cutter.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kBatch = 512;        // fresh candidates that are worth a linear program
constexpr std::size_t kPortion = 1 << 17;  // rows that are looked at before the box is made anew
constexpr std::size_t kFew = 1 << 13;      // rows put aside that are not worth a look yet

}  // namespace

Cutter::Cutter(const Box& prior, const std::vector<std::vector<std::size_t>>& blocks,
               const Eigen::MatrixXd& information, const CutterOptions& options)
    : rows_(prior), options_(options), p_(prior.dimension()), Y_(p_), dY_(p_), normal_(p_) {
  for (const std::vector<std::size_t>& parameters : blocks) {
    const auto q = static_cast<Eigen::Index>(parameters.size());
    Part part;
    Box box;
    Eigen::MatrixXd own(q, q);
    for (Eigen::Index i = 0; i < q; ++i) {
      const std::size_t j = parameters[static_cast<std::size_t>(i)];
      box.sides.push_back(prior.sides[j]);
      for (Eigen::Index k = 0; k < q; ++k) {
        own(i, k) = information(static_cast<Eigen::Index>(j),
                                static_cast<Eigen::Index>(parameters[static_cast<std::size_t>(k)]));
      }
    }
    part.parameters = parameters;
    part.fresh.parameters = part.kept.parameters = parameters.size();
    part.planes.emplace(box, own, parameters);
    look(part);
    parts_.push_back(std::move(part));
  }
}

void Cutter::look(Part& part) const {
  part.around = part.planes->outer_box();
  part.corners = part.planes->extreme_points();
  std::tie(part.oblique_half, part.oblique_centre) = part.planes->oblique_box();
}

bool Cutter::take(Part& part, std::size_t which, const SlabColumns& columns, std::span<const std::uint32_t> found) {
  for (const std::uint32_t i : found) {
    bool own = false, any = false, finite = std::isfinite(columns.y[i]) && std::isfinite(columns.dy[i]);
    for (std::size_t j = 0; j < p_; ++j) {
      Y_[j] = columns.Y[j][i];
      dY_[j] = columns.dY.empty() ? 0.0 : columns.dY[j][i];
      finite = finite && std::isfinite(Y_[j]) && std::isfinite(dY_[j]) && dY_[j] >= 0.0;
      any = any || Y_[j] != 0.0 || dY_[j] != 0.0;
    }
    check::that(finite && columns.dy[i] >= 0.0, "regression row", "finite numbers and error bounds >= 0");
    for (const std::size_t j : part.parameters) {
      own = own || Y_[j] != 0.0 || dY_[j] != 0.0;
    }
    if (!(own || (!any && which == 0))) {
      continue;
    }
    ++candidates_;
    rows_.half_spaces(Y_, dY_, columns.y[i], columns.dy[i], columns.origin(i), upper_, lower_);
    for (const HalfSpace* half_space : {&upper_, &lower_}) {
      double reach = -half_space->b;
      for (std::size_t k = 0; k < part.parameters.size(); ++k) {
        normal_[k] = half_space->a[static_cast<Eigen::Index>(part.parameters[k])];
        reach += normal_[k] * part.around.centre[k] + std::abs(normal_[k]) * part.around.half[k];
      }
      if (reach > 0.0) {
        part.fresh.add({normal_.data(), part.parameters.size()}, half_space->b, half_space->origin);
      }
    }
    if (part.fresh.size() >= 8 * kBatch && !tighten(part)) {
      return false;
    }
  }
  return part.fresh.size() < kBatch || tighten(part);
}

/// Numbers of the rows that the box around the set does not imply, or (`corners`) that a corner of the hull violates.
std::span<const std::uint32_t> Cutter::search(const Part& part, const SlabColumns& rows, bool corners) {
  std::vector<const double*> Y, dY;
  for (const std::size_t j : part.parameters) {
    Y.push_back(rows.Y[j]);
    if (!rows.dY.empty()) {
      dY.push_back(rows.dY[j]);
    }
  }
  const kernels::Slabs slabs{Y.data(), dY.empty() ? nullptr : dY.data(), rows.y, rows.dy, rows.n, Y.size()};
  found_.resize(std::max(found_.size(), rows.n));
  const kernels::Table& loops = kernels::best();
  const kernels::Oblique oblique{part.oblique_centre.data(), part.oblique_half.data(),
                                 part.planes->coordinates().transform.data()};
  const kernels::Points points{part.around.centre.data(), part.around.half.data(), part.around.least.data(),
                               part.corners.data(), static_cast<std::size_t>(part.corners.cols())};
  const std::size_t count = corners ? loops.examine(slabs, points, found_.data(), nullptr, nullptr)
                                    : loops.scan(slabs, part.around.centre.data(), part.around.half.data(),
                                                 part.around.least.data(), &oblique, 0.0, found_.data(), nullptr);
  return {found_.data(), count};
}

bool Cutter::offer(const SlabColumns& columns, const std::vector<char>& used) {
  const bool nothing_used = !used.empty() && std::find(used.begin(), used.end(), char{1}) == used.end();
  for (std::size_t first = 0; first < columns.n; first += kPortion) {
    const SlabColumns portion = columns.part(first, std::min(kPortion, columns.n - first));
    for (std::size_t which = 0; which < parts_.size(); ++which) {
      Part& part = parts_[which];
      const bool wanted =
          used.empty() || (nothing_used && which == 0) ||
          std::any_of(part.parameters.begin(), part.parameters.end(), [&](std::size_t j) { return used[j] != 0; });
      if (!wanted) {
        continue;
      }
      const std::span<const std::uint32_t> found = search(part, portion, false);
      if (options_.facets) {
        if (!take(part, which, portion, found)) {
          return false;
        }
        continue;
      }
      part.aside.append(portion, found);
      if (part.aside.size() > 2 * part.settled + kFew && !settle(part, which)) {
        return false;
      }
    }
  }
  return true;
}

/// Cuts in rows that were put aside until no corner violates any, and drops those that the box then implies.
bool Cutter::settle(Part& part, std::size_t which) {
  for (std::size_t round = 1; part.aside.size() > 0; ++round) {
    const SlabColumns rows = part.aside.view();
    const std::size_t before = part.planes->rows().size();
    if (!take(part, which, rows, search(part, rows, true)) || !tighten(part)) {
      return false;
    }
    if (part.planes->stands_still(before, round)) {
      break;
    }
    if (passed_over_) {
      again_ = true;
    }
  }
  if (part.aside.size() > 0) {
    part.aside.keep(search(part, part.aside.view(), false));
  }
  if (part.aside.size() > options_.most) {
    part.aside.clear();
    passed_over_ = true;
  }
  part.settled = part.aside.size();
  return true;
}

bool Cutter::tighten(Part& part) {
  part.planes->add_to_hull(part.fresh, options_.facets ? &part.kept : nullptr);
  if (part.planes->is_empty()) {
    return false;
  }
  part.fresh.clear();
  look(part);
  if (part.kept.size() > options_.most) {
    RowBank all = std::move(part.kept);
    part.kept = {};
    part.kept.parameters = part.parameters.size();
    part.planes->add_to_hull(all, &part.kept);
    if (!part.planes->is_empty() && 2 * part.kept.size() > options_.most) {
      part.planes->add(part.kept);
      part.kept.clear();
    }
    look(part);
  }
  std::size_t held = 0;
  for (const Part& each : parts_) {
    held += each.planes->rows().size() + each.kept.size() + each.aside.size();
  }
  working_set_ = std::max(working_set_, held);
  return !part.planes->is_empty();
}

bool Cutter::tighten() {
  for (std::size_t which = 0; which < parts_.size(); ++which) {
    if (!tighten(parts_[which]) || (!options_.facets && !settle(parts_[which], which))) {
      return false;
    }
  }
  return true;
}

bool Cutter::finish() {
  for (std::size_t which = 0; which < parts_.size(); ++which) {
    Part& part = parts_[which];
    if (!tighten(part) || (!options_.facets && !settle(part, which))) {
      return false;
    }
    if (options_.facets) {
      part.planes->add(part.kept);
      part.kept.clear();
    }
    if (part.planes->is_empty()) {
      return false;
    }
    look(part);
  }
  return true;
}

WeightedRow Cutter::spread(const Part& part, const WeightedRow& row) const {
  WeightedRow full = row;
  full.row.a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p_));
  for (std::size_t i = 0; i < part.parameters.size(); ++i) {
    full.row.a[static_cast<Eigen::Index>(part.parameters[i])] = row.row.a[static_cast<Eigen::Index>(i)];
  }
  return full;
}

std::vector<HalfSpace> Cutter::half_spaces() {
  std::vector<HalfSpace> all;
  for (Part& part : parts_) {
    part.planes->reduce();
    for (const HalfSpace& row : part.planes->rows()) {
      if (!row.origin.is_prior) {
        all.push_back(spread(part, {row, 0.0}).row);
      }
    }
  }
  return all;
}

std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> Cutter::certified_hull() {
  std::vector<CertifiedBound> lower(p_), upper(p_);
  for (Part& part : parts_) {
    auto [low, high] = part.planes->certified_hull();
    for (std::size_t k = 0; k < part.parameters.size(); ++k) {
      for (CertifiedBound* bound : {&low[k], &high[k]}) {
        for (WeightedRow& row : bound->binding) {
          row = spread(part, row);
        }
      }
      lower[part.parameters[k]] = std::move(low[k]);
      upper[part.parameters[k]] = std::move(high[k]);
    }
  }
  return {std::move(lower), std::move(upper)};
}

std::vector<WeightedRow> Cutter::contradiction() const {
  std::vector<WeightedRow> result;
  for (const Part& part : parts_) {
    if (part.planes->is_empty()) {
      for (const WeightedRow& weighted : part.planes->contradiction()) {
        result.push_back(spread(part, weighted));
      }
      break;
    }
  }
  return result;
}

std::size_t Cutter::undecided() const {
  std::size_t sum = 0;
  for (const Part& part : parts_) {
    sum += part.planes->undecided();
  }
  return sum;
}

}  // namespace wheelwright::bounds
