// SPDX-License-Identifier: Apache-2.0
/// \file
/// Interval hull of a feasible set without its facets: 2p linear programs over all rows at once, stored by columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bounds/certificate.hpp"
#include "bounds/slab_rows.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds {

/// Rows |y − Y°θ| <= dy, |Y° − Y| <= dY of one output, by columns in somebody else's memory.
struct SlabColumns {
  std::size_t n = 0;                     ///< rows
  std::vector<const double*> Y;          ///< p columns of n values
  std::vector<const double*> dY;         ///< p columns, or none where all are zero
  const double* y = nullptr;             ///< n values
  const double* dy = nullptr;            ///< n bounds >= 0
  const std::size_t* sample = nullptr;   ///< row numbers in the log; null: first_sample, first_sample + 1, …
  const double* t = nullptr;             ///< times, s; null: 0
  std::size_t first_sample = 0;          ///< where `sample` is null
  std::size_t output = 0;                ///< which output these are rows of, where `outputs` is null
  const std::size_t* outputs = nullptr;  ///< n outputs, or null

  /// Number of parameters p.
  [[nodiscard]] std::size_t parameters() const { return Y.size(); }
  /// Where row `i` comes from (upper side).
  [[nodiscard]] RowOrigin origin(std::size_t i) const {
    return {false,
            0,
            sample != nullptr ? sample[i] : first_sample + i,
            t != nullptr ? t[i] : 0.0,
            outputs != nullptr ? outputs[i] : output,
            Side::upper};
  }
  /// Rows [first, first + count).
  [[nodiscard]] SlabColumns part(std::size_t first, std::size_t count) const;
};

/// Rows put aside, by columns.
class SlabStore {
 public:
  /// Copies rows `numbers` of `from`.
  void append(const SlabColumns& from, std::span<const std::uint32_t> numbers);
  /// Keeps rows `numbers` (ascending) only.
  void keep(std::span<const std::uint32_t> numbers);
  /// Forgets all rows.
  void clear() { keep({}); }
  /// The rows, valid until the store changes.
  [[nodiscard]] SlabColumns view() const;
  /// Number of rows.
  [[nodiscard]] std::size_t size() const { return y_.size(); }

 private:
  std::vector<std::vector<double>> Y_, dY_;
  std::vector<double> y_, dy_, t_;
  std::vector<std::size_t> sample_, output_;
};

/// Turns a regression into columns, a fixed number of instants at a time, however its blocks are cut.
class ColumnPacker {
 public:
  /// Called with the columns of one output; `used[j]`: column j has something else than zeros. False ends the walk.
  using Sink = std::function<bool(const SlabColumns& columns, const std::vector<char>& used)>;

  /// For n outputs and p parameters.
  ColumnPacker(std::size_t outputs, std::size_t parameters);
  /// Walks `source` from its beginning and hands every 8192 instants, output by output, to `sink`. Instants whose
  /// number is in `excluded` (ascending) are left out. False where the sink ended the walk.
  bool walk(core::RegressionSource& source, const std::vector<std::size_t>& excluded, const Sink& sink);
  /// The same for one block in memory.
  bool walk(const RegressionBlock& block, const Sink& sink);

 private:
  void append(const RegressionBlock& block, std::size_t instant);
  bool hand_over(const Sink& sink);

  std::size_t outputs_, parameters_, count_ = 0;
  std::vector<double> memory_;
  std::vector<char> used_, noisy_;
  std::vector<std::size_t> samples_;
  std::vector<double> times_;
};

/// Options of interval_hull().
struct IntervalHullOptions {
  std::vector<std::size_t> excluded_samples;  ///< row numbers left out, any order (regression sources only)
  std::size_t threads = 1;                    ///< for rows in memory; the result does not depend on it
  std::size_t most_rows = 1 << 20;  ///< half-spaces kept between passes; less means more passes (sources only)
};

/// Result of interval_hull().
struct IntervalHull {
  bool empty = false;                      ///< proved empty: contradiction holds, hull is the prior box
  Box hull;                                ///< certified: contains the feasible set
  std::vector<CertifiedBound> lower;       ///< per parameter: certified minimum, and the rows with multipliers that
                                           ///< prove it
  std::vector<CertifiedBound> upper;       ///< per parameter: certified maximum
  std::vector<WeightedRow> contradiction;  ///< Farkas certificate where empty
  std::size_t passes = 0;                  ///< walks over all rows
  std::size_t candidates = 0;              ///< rows that were more than looked at
};

/// Interval hull of { θ in prior : |y − Y°θ| <= dy, |Y° − Y| <= dY for every row }.
///
/// A set is cut with an evenly spread sample first (some 16 000 rows); then the rows are compared with a box around the
/// set held and those that may cut with the 2p vertices where a parameter is smallest or largest, until these satisfy
/// all of them. Rows in memory are read once, and once more as far as they may matter (hull_search.hpp: one pass); a
/// source is walked twice (the first pass surveys it, the second keeps what may cut), as long as the rows
/// that matter fit into `most_rows`. Bounds are certified (certificate.hpp). Signs that the prior leaves open in noisy
/// columns are relaxed to the chords of SlabRows; feasible_set() examines them one by one.
///
/// Throws InvalidArgument unless the prior is finite, shapes agree and numbers are finite.
[[nodiscard]] IntervalHull interval_hull(const SlabColumns& rows, const Box& prior,
                                         const IntervalHullOptions& options = {});
/// The same for a regression that is walked block by block.
[[nodiscard]] IntervalHull interval_hull(core::RegressionSource& source, const Box& prior,
                                         const IntervalHullOptions& options = {});

}  // namespace wheelwright::bounds
