// SPDX-License-Identifier: Apache-2.0
/// \file
/// The interval hull of rows in memory: what is read once, and what must be read again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bounds/cutting_planes.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {

/// Cuts a set with rows in memory until its 2p vertices where a parameter is largest or smallest satisfy all of them.
///
/// Rows come in portions, each as long as all before it (up to 262 144 rows), so that most are looked at when the set
/// is small already. Those that a box around it implies never matter again. Those that a vertex violates are cut in;
/// those that one nearly violates are kept at hand, since the next vertex may. Then all are looked at once more, and
/// again until no vertex has moved by more than the rows that are not at hand leave.
class HullSearch {
 public:
  /// `information` as in CuttingPlanes. `threads` look at rows; the result does not depend on their number.
  HullSearch(const Box& prior, const Eigen::MatrixXd& information, std::size_t threads);

  /// Cuts with `rows`, portion by portion, until no vertex violates any of them; false once the set is proved empty.
  /// Throws InvalidArgument where a number is not finite.
  bool cut(const SlabColumns& rows);

  /// The set of what was cut in.
  [[nodiscard]] CuttingPlanes& planes() { return planes_; }
  /// Rows that were violated when they were looked at.
  [[nodiscard]] std::size_t candidates() const { return candidates_; }

 private:
  void begin();
  [[nodiscard]] bool look_again();
  void examine(const SlabColumns& rows, std::size_t first, std::size_t count);
  void offer(const SlabColumns& rows, std::size_t row);
  bool add(const SlabColumns& rows);

  SlabRows rows_;
  CuttingPlanes planes_;
  std::size_t threads_, p_, candidates_ = 0;
  std::vector<unsigned char> open_;  // for every eight rows: whether one of them may matter yet
  CuttingPlanes::OuterBox around_;   // the set as it is
  Eigen::MatrixXd corners_;          // where a parameter is largest or smallest, when that was looked at
  Eigen::MatrixXd points_;           // those of them that are to be looked at
  std::vector<double> unit_;         // half-widths of the box at the first look at all rows
  double near_;                      // rows that leave this share of their bounds are not at hand
  double most_ = 0.0;                // what a way of these half-widths takes of the bounds of a row at most
  RowBank bank_;                     // half-spaces at hand
  std::vector<std::uint32_t> found_;
  std::vector<double> Y_, dY_;
  HalfSpace upper_, lower_;
};

}  // namespace wheelwright::bounds
