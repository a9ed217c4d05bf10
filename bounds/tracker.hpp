// SPDX-License-Identifier: Apache-2.0
/// \file
/// A feasible set that follows the data as they come, for parameters that may drift.
#pragma once

#include <optional>
#include <vector>

#include <wheelwright/bounds/polytope.hpp>
#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Options of FeasibleSetTracker.
struct TrackerOptions {
  std::vector<double> drift;  ///< per parameter: largest |dθ_j/dt|, unit of the parameter per second; empty: all zero
  PolytopeOptions polytope;   ///< of the set
};

/// The set of all θ(t) now that fault-free rows up to now allow.
///
/// Where |dθ_j/dt| <= d_j, a row a·θ(s) <= b seen at time s still says at time t
///
///     a·θ(t) <= b + (t − s) Σ_j |a_j| d_j,
///
/// so old rows fade and are forgotten when they no longer cut. Sides of the prior box do not fade. A row that is implied
/// when it comes is dropped for good: with drift it might have cut again later, when those that implied it have faded
/// faster; the set is then larger than it could be, never smaller. Without drift it is the feasible set of all rows.
class FeasibleSetTracker {
 public:
  /// Begins with the prior box, which must be finite. Throws InvalidArgument, also for a drift that is negative or not
  /// finite.
  explicit FeasibleSetTracker(Box prior, TrackerOptions options = {});

  /// Takes the rows of `block`, whose times (s) must not lie before time(). False where they contradict what was known:
  /// a fault, a drift faster than stated or a noise bound too small; contradiction() then says which rows, and the set
  /// stays as it was, faded to the end of the block. Throws InvalidArgument when shapes disagree, a number is not finite
  /// or time goes back.
  bool add(const RegressionBlock& block);

  /// The set at time().
  [[nodiscard]] const Polytope& set() const { return *set_; }
  /// The set at time `t` >= time() if nothing more comes. Throws InvalidArgument for an earlier one.
  [[nodiscard]] Polytope at(double t) const;
  /// Time of the newest row, s; −infinity before the first.
  [[nodiscard]] double time() const { return time_; }
  /// Rows held.
  [[nodiscard]] std::size_t rows() const { return rows_.size(); }
  /// The rows (faded to time()) with multipliers that prove the contradiction of the last add() that returned false.
  [[nodiscard]] const std::vector<WeightedRow>& contradiction() const { return contradiction_; }

 private:
  [[nodiscard]] HalfSpace faded(const HalfSpace& row, double t) const;
  [[nodiscard]] std::vector<HalfSpace> faded(const std::vector<HalfSpace>& rows, double t) const;

  Box prior_;
  TrackerOptions options_;
  SlabRows slabs_;
  std::vector<HalfSpace> rows_;  // as they were when they were seen, at origin.t
  std::optional<Polytope> set_;
  std::vector<WeightedRow> contradiction_;
  double time_;
};

}  // namespace wheelwright
