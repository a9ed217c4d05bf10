// SPDX-License-Identifier: Apache-2.0
/// \file
/// Half-spaces of parameters from rows of a regression with bounded errors (errors in variables), and their storage;
/// half-spaces of one independent block of a set as such of all parameters.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds {

/// Side of a half-space: which of the two inequalities of a slab, or of an interval of the prior box, it is.
enum class Side {
  upper,  ///< Yθ <= y + dy, or θ_j <= upper
  lower,  ///< Yθ >= y − dy, or θ_j >= lower
};

/// Where a half-space comes from: one row of the regression, or one side of the prior box.
struct RowOrigin {
  bool is_prior = false;      ///< a side of the prior box; `parameter` says which
  std::size_t parameter = 0;  ///< parameter of a side of the prior box
  std::size_t sample = 0;     ///< row number in the log (RegressionBlock::sample)
  double t = 0.0;             ///< time of that row, s
  std::size_t output = 0;     ///< output (channel) of the row
  Side side = Side::upper;    ///< which inequality
  friend bool operator==(const RowOrigin&, const RowOrigin&) = default;
};

/// { θ : a·θ <= b }.
struct HalfSpace {
  Eigen::VectorXd a;  ///< p coefficients
  double b = 0.0;     ///< right-hand side, unit of the output
  RowOrigin origin;   ///< where it comes from
};

/// A half-space and its multiplier in a linear combination of constraints.
struct WeightedRow {
  HalfSpace row;            ///< the constraint a·θ <= b
  double multiplier = 0.0;  ///< λ >= 0
};

/// Half-spaces a·θ <= b of `parameters` coefficients each, one after the other.
struct RowBank {
  std::size_t parameters = 0;      ///< p
  std::vector<double> a;           ///< n × p, row after row
  std::vector<double> b;           ///< n
  std::vector<RowOrigin> origins;  ///< n

  /// Number of half-spaces n.
  [[nodiscard]] std::size_t size() const { return b.size(); }
  /// The coefficients of half-space `i`.
  [[nodiscard]] std::span<const double> normal(std::size_t i) const { return {a.data() + i * parameters, parameters}; }
  /// Adds one half-space.
  void add(std::span<const double> normal, double bound, const RowOrigin& origin) {
    a.insert(a.end(), normal.begin(), normal.end());
    b.push_back(bound);
    origins.push_back(origin);
  }
  /// Half-space `i` by itself.
  [[nodiscard]] HalfSpace at(std::size_t i) const {
    return {Eigen::Map<const Eigen::VectorXd>(a.data() + i * parameters, static_cast<Eigen::Index>(parameters)), b[i],
            origins[i]};
  }
  /// Forgets all, keeps the memory.
  void clear() {
    a.clear();
    b.clear();
    origins.clear();
  }
};

/// Turns the row |y − Y°θ| <= dy, |Y° − Y| <= dY into the two half-spaces it means for θ in a prior box:
///
///     (Y − σ dY)θ <= y + dy   and   (Y + σ dY)θ >= y − dy,   σ_j = +1 where θ_j >= 0, −1 where θ_j <= 0.
///
/// Where the box leaves the sign of θ_j open and dY_j > 0, |θ_j| is replaced by its chord over the side,
/// |θ_j| <= (s θ_j + t), s = (u + l)/(u − l), t = −2ul/(u − l): the convex hull of that row's set, an outer
/// description. All rounding is outward: no admissible θ of the box is cut off.
class SlabRows {
 public:
  /// Throws InvalidArgument unless the box is finite.
  explicit SlabRows(const Box& prior);

  /// Writes the half-spaces of row `row` of `block`, which has as many parameters as the box.
  void half_spaces(const RegressionBlock& block, Eigen::Index row, HalfSpace& upper, HalfSpace& lower) const;

  /// The same for a row by itself; `upper.origin` says where it comes from.
  void half_spaces(std::span<const double> Y, std::span<const double> dY, double y, double dy, const RowOrigin& origin,
                   HalfSpace& upper, HalfSpace& lower) const;

  /// True if the sign of θ_j is open.
  [[nodiscard]] bool sign_is_open(std::size_t j) const { return open_[j]; }

 private:
  std::vector<bool> open_;
  std::vector<double> sign_;
  std::vector<Interval> slope_, intercept_;
  std::vector<double> magnitude_;
};

/// The entries `parameters` of `all`, in that order; every index is below its size (unchecked).
[[nodiscard]] inline Eigen::VectorXd pick(const Eigen::VectorXd& all, const std::vector<std::size_t>& parameters) {
  Eigen::VectorXd part(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    part[static_cast<Eigen::Index>(k)] = all[static_cast<Eigen::Index>(parameters[k])];
  }
  return part;
}

/// A half-space in the parameters `parameters` as one in all `p`, with zeros elsewhere.
[[nodiscard]] inline HalfSpace spread(const HalfSpace& row, const std::vector<std::size_t>& parameters, std::size_t p) {
  HalfSpace full{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p)), row.b, row.origin};
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    full.a[static_cast<Eigen::Index>(parameters[k])] = row.a[static_cast<Eigen::Index>(k)];
  }
  return full;
}

}  // namespace wheelwright::bounds
