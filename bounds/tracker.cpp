// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/tracker.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace wheelwright {

FeasibleSetTracker::FeasibleSetTracker(Box prior, TrackerOptions options)
    : prior_(std::move(prior)),
      options_(std::move(options)),
      slabs_(prior_),
      time_(-std::numeric_limits<double>::infinity()) {
  if (options_.drift.empty()) {
    options_.drift.assign(prior_.dimension(), 0.0);
  }
  check::that(
      options_.drift.size() == prior_.dimension() && std::all_of(options_.drift.begin(), options_.drift.end(),
                                                                 [](double d) { return d >= 0.0 && std::isfinite(d); }),
      "drift", "one number >= 0 for each parameter");
  set_.emplace(std::vector<HalfSpace>{}, prior_, options_.polytope);
}

HalfSpace FeasibleSetTracker::faded(const HalfSpace& row, double t) const {
  HalfSpace result = row;
  double rate = 0.0;
  for (std::size_t j = 0; j < prior_.dimension(); ++j) {
    if (options_.drift[j] > 0.0) {
      rate = round_up(rate + round_up(std::abs(row.a[static_cast<Eigen::Index>(j)]) * options_.drift[j]));
    }
  }
  if (rate > 0.0) {
    result.b = round_up(row.b + round_up(rate * round_up(t - row.origin.t)));
  }
  return result;
}

std::vector<HalfSpace> FeasibleSetTracker::faded(const std::vector<HalfSpace>& rows, double t) const {
  std::vector<HalfSpace> result;
  result.reserve(rows.size());
  for (const HalfSpace& row : rows) {
    result.push_back(faded(row, t));
  }
  return result;
}

Polytope FeasibleSetTracker::at(double t) const {
  check::that(t >= time_, "t", "not before the newest row");
  return rows_.empty() ? *set_ : Polytope(faded(rows_, t), prior_, options_.polytope);
}

bool FeasibleSetTracker::add(const RegressionBlock& block) {
  const std::size_t p = prior_.dimension();
  check::that(block.parameters == p && block.outputs > 0, "regression block", "one column for each parameter");
  if (block.instants() == 0) {
    return true;
  }
  double last = time_;
  for (const double t : block.t) {
    check::that(std::isfinite(t) && t >= last, "t", "finite times that do not go back");
    last = t;
  }
  // What is known, faded to the end of the block, implies most new rows: they need not be looked at again.
  const Box known = rows_.empty() ? prior_ : Polytope(faded(rows_, last), prior_, {.vertex_limit = 0}).hull();
  std::vector<HalfSpace> all = rows_;
  HalfSpace upper, lower;
  for (Eigen::Index r = 0; r < block.rows(); ++r) {
    check::that(block.Y.row(r).allFinite() && block.dY.row(r).allFinite() && std::isfinite(block.y[r]) &&
                    std::isfinite(block.dy[r]) && block.dy[r] >= 0.0 && (block.dY.row(r).array() >= 0.0).all(),
                "regression row", "finite numbers and error bounds >= 0");
    slabs_.half_spaces(block, r, upper, lower);
    for (const HalfSpace* row : {&upper, &lower}) {
      if (known.support({row->a.data(), p}) > faded(*row, last).b) {
        all.push_back(*row);
      }
    }
  }
  auto result = Polytope::intersect(faded(all, last), prior_, options_.polytope);
  time_ = last;
  if (auto* contradiction = std::get_if<std::vector<WeightedRow>>(&result)) {
    contradiction_ = std::move(*contradiction);
    set_ = at(last);
    return false;
  }
  set_ = std::move(std::get<Polytope>(result));
  rows_.clear();
  for (const HalfSpace& facet : set_->facets()) {
    if (!facet.origin.is_prior) {
      rows_.push_back(*std::find_if(all.begin(), all.end(), [&](const HalfSpace& row) {
        return row.origin == facet.origin && row.a == facet.a;
      }));
    }
  }
  return true;
}

}  // namespace wheelwright
