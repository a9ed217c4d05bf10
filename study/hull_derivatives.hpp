// SPDX-License-Identifier: Apache-2.0
/// \file
/// Derivatives of the parameters' bounds by changes of their rows, from the duals of the linear programs.
///
/// An upper bound is V = max { θ_j : a_i·θ <= b_i }. When rows depend on a number s, with rates a_i' and b_i', then
/// (envelope theorem; Gol'shtein 1972 and Freund 1985 where the optimum is degenerate)
///
///     V' = Σ_i λ_i (b_i' − a_i'·θ*)                          where θ* and λ are unique, and else to the right
///     V' = max over optimal θ of max { d_j : a_i·d <= b_i' − a_i'·θ for the rows i active at θ },
///
/// a linear program over few rows; to the left the same with all signs turned. Nothing here knows a robot.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <wheelwright/bounds/polytope.hpp>
#include <wheelwright/core/regression.hpp>

namespace wheelwright::study {

/// One-sided derivatives; NaN where there is none.
struct OneSided {
  double left = 0.0;
  double right = 0.0;
};

/// Optimal vertex of one bound of one parameter, and its active rows.
struct HullOptimum {
  std::size_t parameter = 0;                ///< j
  bounds::Side side = bounds::Side::upper;  ///< which bound of θ_j
  double value = 0.0;                       ///< the certified bound
  bool found = false;     ///< false: no vertex is known (a set that is flat to rounding); nothing below holds
  std::size_t block = 0;  ///< of Polytope::blocks()
  Eigen::VectorXd at;     ///< p, θ*: an optimal vertex, from its equations; the set's centre in other blocks
  /// The rows and prior sides that θ* meets with equality (to 1e-9 of the block's size), p coefficients each. The first
  /// `basis` of them define θ*; their multipliers >= 0 are a solution of Σ λ_i a_i = ±e_j, those of the others are 0.
  /// An upper bound moves by +λ_i per unit of b_i (for a row of the log: per unit of its bound dy), a lower bound by
  /// −λ_i.
  std::vector<bounds::WeightedRow> active;
  std::size_t basis = 0;
  bool unique_maximiser = true;  ///< all multipliers of the basis are > 0 (1e-9 of their scale): θ* is the only optimum
  /// True if just the basis is active and the maximiser is unique: then the bound has a derivative with respect to
  /// everything on which its rows depend smoothly.
  [[nodiscard]] bool is_regular() const { return found && unique_maximiser && active.size() == basis; }
};

/// All 2p bounds of a set.
struct HullOptima {
  Polytope set;
  Box prior;
  std::vector<HullOptimum> lower;  ///< p
  std::vector<HullOptimum> upper;  ///< p
};

/// The optima of all bounds of `set`, made of rows in the box `prior`. Active rows are sought among the facets and the
/// sides of the prior: rows that the set never needed are found by add_active_rows() only. Throws InvalidArgument
/// unless set and prior have the same dimension.
[[nodiscard]] HullOptima hull_optima(const Polytope& set, const Box& prior);

/// Walks `rows` once, and adds those that an optimum meets with equality and that its set could do without. `rows` are
/// those that the set was made of; the row numbers `excluded` (any order) are left out.
void add_active_rows(HullOptima& optima, core::RegressionSource& rows, std::vector<std::size_t> excluded = {});

/// Rates of an active row: a' and b'.
struct RowRate {
  Eigen::VectorXd a;  ///< p, or empty for zero
  double b = 0.0;
};

/// The derivative of a bound when its active rows move: with rates `right` where s grows, and `left` where it falls
/// (both per unit of growing s; the same where rows are smooth in s). One rate for each of optimum.active. Both sides
/// agree where the bound is regular, the rates are the same, and they couple no parameters that the rows keep apart
/// (the right one then is the largest over all values of these). NaN where no vertex was found, and where rows of a
/// bound that is not regular come to couple.
/// Throws InvalidArgument unless the numbers agree.
[[nodiscard]] OneSided bound_derivative(const HullOptima& optima, const HullOptimum& optimum,
                                        std::span<const RowRate> left, std::span<const RowRate> right);

/// Why an optimum is not regular, in words; empty where it is. `name` is the parameter's.
[[nodiscard]] std::string why_not_regular(const HullOptimum& optimum, const std::string& name);

/// "row 812 (t = 8.12 s)" or "the prior's upper side of parameter 2".
[[nodiscard]] std::string row_in_words(const bounds::RowOrigin& origin);

}  // namespace wheelwright::study
