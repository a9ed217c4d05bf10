// SPDX-License-Identifier: Apache-2.0
/// \file
/// Tight threshold ρ(t) of (34): the range of the fault-free residual over every θ in the feasible set.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "bounds/polytope.hpp"
#include "bounds/support_table.hpp"
#include "bounds/support_walk.hpp"
#include "detector/detector_options.hpp"

namespace wheelwright::detector {

/// Threshold of one output at one instant, for the residual ε = τ_f − Y_f θ̂ (29).
struct Threshold {
  double lower = 0.0;  ///< l <= ε without a fault
  double upper = 0.0;  ///< ε <= u without a fault
  /// ρ = max(u, −l), the paper's symmetric threshold.
  [[nodiscard]] double rho() const noexcept { return upper > -lower ? upper : -lower; }
  /// w = u − l.
  [[nodiscard]] double width() const noexcept { return upper - lower; }
};

/// Thresholds along a log:
///
///     u = h(y + Δ) − yθ̂ + n̄        l = −h(−y + Δ) − yθ̂ − n̄
///
/// with h the support function of the feasible set, y a row of Y_f, Δ the bound on its error and n̄ that of τ_f. The
/// shift by Δ holds for θ_j >= 0; it changes sign where θ_j <= 0 on the whole set, and where θ_j has either sign it is
/// replaced by Δ_j max|θ_j|. All results are rounded outward. h is followed from vertex to vertex, in a table of all
/// vertices (SupportTable) where they are few enough, else as they are found (SupportWalk): with bounded work and
/// without allocation. A budget that runs out makes a threshold wider, never wrong. One object serves one thread.
class ThresholdRule {
 public:
  /// For the feasible set `set` and the best guess `estimate` (p), which need not lie in it.
  ThresholdRule(Polytope set, Eigen::VectorXd estimate, ParameterSetKind kind = ParameterSetKind::polytope);

  /// The threshold for the regressor row `y` (p) with error bound `dy_regressor` (p, Δ >= 0) and `dy_output` (n̄ >= 0).
  /// Rows of one `channel` should follow each other in time: the walk starts where its last row ended.
  [[nodiscard]] Threshold at(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                             std::size_t channel = 0) const noexcept;

  /// at().upper alone, and at().lower alone, for half the work.
  [[nodiscard]] double upper(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                             std::size_t channel = 0) const noexcept;
  [[nodiscard]] double lower(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                             std::size_t channel = 0) const noexcept;

  /// min and max of yθ over the set, outward: the noise-free prediction interval.
  [[nodiscard]] Interval prediction(std::span<const double> y, std::size_t channel = 0) const noexcept;
  /// prediction().upper alone, and prediction().lower alone.
  [[nodiscard]] double largest(std::span<const double> y, std::size_t channel = 0) const noexcept;
  [[nodiscard]] double smallest(std::span<const double> y, std::size_t channel = 0) const noexcept;

  [[nodiscard]] const Polytope& set() const noexcept { return set_; }
  [[nodiscard]] const Eigen::VectorXd& estimate() const noexcept { return estimate_; }
  [[nodiscard]] ParameterSetKind kind() const noexcept { return kind_; }
  /// The table that h is read from; nothing for the box and for sets of more vertices than a table takes.
  [[nodiscard]] const std::optional<bounds::SupportTable>& table() const noexcept { return table_; }

  /// Directions that are followed from one row to the next: two for each of four channels; further channels share them.
  static constexpr std::size_t kSlots = 8;

 private:
  [[nodiscard]] double support(std::span<const double> a, std::size_t slot) const noexcept {
    return table_  ? table_->support(a, slot % kSlots)
           : walk_ ? walk_->support(a, slot % kSlots)
                   : set_.hull().support(a);
  }

  // What stands beside h in both thresholds.
  struct Beside {
    double predicted, extra, rounding;
  };
  // Calls take(j, y_j + Δ_j, −y_j + Δ_j).
  template <typename Take>
  [[nodiscard]] Beside beside(std::span<const double> y, std::span<const double> dy_regressor, double dy_output,
                              Take&& take) const noexcept;
  // Fills direction_ for h(y + Δ) and opposite_ for h(−y + Δ).
  [[nodiscard]] Beside beside(std::span<const double> y, std::span<const double> dy_regressor,
                              double dy_output) const noexcept;
  [[nodiscard]] Threshold of_hull(std::span<const double> y, std::span<const double> dy_regressor,
                                  double dy_output) const noexcept;

  Polytope set_;
  Eigen::VectorXd estimate_;
  ParameterSetKind kind_;
  struct Parameter {
    double estimate = 0.0;  // θ̂_j
    double largest = 0.0;   // max |θ_j|
    double sign = 0.0;      // of θ_j, 0 where it is open
    Interval side;
  };
  std::vector<Parameter> parameters_;
  mutable std::vector<double> direction_, opposite_;
  mutable std::optional<bounds::SupportTable> table_;
  mutable std::optional<bounds::SupportWalk> walk_;  // where there is no table
};

}  // namespace wheelwright::detector
