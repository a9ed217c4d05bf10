// SPDX-License-Identifier: Apache-2.0
/// \file
/// The working set of a feasible set: keeps, of all half-spaces offered, those that cut.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bounds/certificate.hpp"
#include "bounds/linear_program.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {

/// { θ in box : a·θ <= b for every half-space offered }, held by the few half-spaces that matter.
///
/// Half-spaces may be offered in any order and portions. One that does not cut the set held so far (by more than 1e-10
/// of its size) is dropped for good, which is right since the set only shrinks: memory depends on the facets, not on
/// the rows offered, and the set held is never smaller than the exact one.
class CuttingPlanes {
 public:
  /// Starts with a finite box. `information` (p × p, symmetric, positive semi-definite) is Σ aaᵀ/w² over rows of
  /// half-width w: it whitens the coordinates, and matters for speed and digits only. `parameters` are the numbers that
  /// the sides of the box carry as origins.
  CuttingPlanes(const Box& box, const Eigen::MatrixXd& information, std::vector<std::size_t> parameters = {});

  /// The 2p points θ of the rows held where a parameter is largest or smallest, one per column.
  [[nodiscard]] Eigen::MatrixXd extreme_points() const;
  /// The box of z that contains the set, to rounding: half-widths, and the θ of its middle.
  [[nodiscard]] std::pair<Eigen::VectorXd, Eigen::VectorXd> oblique_box() const;
  /// A box of θ around the set, to rounding, as kernels::Points has it.
  struct OuterBox {
    std::vector<double> centre, half;
    std::vector<double> least;  ///< the smallest |θ_j| in it
  };
  [[nodiscard]] OuterBox outer_box() const;

  /// Adds those of `candidates` that cut: first the rows most violated where one of the z or θ is largest or smallest,
  /// until none is violated there; then, one linear program each, what cuts between these vertices.
  void add(const RowBank& candidates);
  /// Adds only rows that move a vertex where one of the z or θ is largest or smallest, until `candidates` move none:
  /// enough for the interval hull of the set of `rows` and `candidates`, though not for the set. Appends to `open`,
  /// unless null, those that were not added and that no closed form (a box around the set in the whitened coordinates)
  /// shows to be implied.
  void add_to_hull(const RowBank& candidates, RowBank* open);
  /// Whether cutting has come to its end: nothing was added to the first `before` rows or, where `round` is large, only
  /// rows that are among them. (A corner whose linear program fails stays where it was and asks for the same row for
  /// ever.)
  [[nodiscard]] bool stands_still(std::size_t before, std::size_t round) const;
  /// Drops every row that the others imply.
  void reduce();

  /// True if the set is proved empty; then nothing more is added.
  [[nodiscard]] bool is_empty() const { return contradiction_.has_value(); }
  /// The proof (data rows only; the box is understood). Call only where is_empty().
  [[nodiscard]] const std::vector<WeightedRow>& contradiction() const { return *contradiction_; }
  /// The rows held, sides of the box among them.
  [[nodiscard]] const std::vector<HalfSpace>& rows() const { return rows_; }
  /// Half-spaces left out because floating point found them contradictory but no rigorous proof could be given.
  [[nodiscard]] std::size_t undecided() const { return undecided_; }
  /// Coordinates in which the set lies in about [−1, 1]ᵖ.
  [[nodiscard]] const Coordinates& coordinates() const { return coordinates_; }

  /// max a·θ by linear program, uncertified; nothing where the program fails.
  [[nodiscard]] std::optional<LpSolution> maximise(const Eigen::VectorXd& a);
  /// Certified lower and upper bounds, 2p of them: bound j of the first is min θ_j, of the second max θ_j.
  [[nodiscard]] std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> certified_hull();

 private:
  /// Candidates in z, by columns.
  struct Whitened;

  /// Rigorous upper bound of a·θ over the set, proved over `within`, a box that contains the set. The search begins at
  /// `basis`.
  [[nodiscard]] CertifiedBound certified_maximum(const Eigen::VectorXd& a, const Box& within,
                                                 LinearProgram::Basis basis);
  void insert(std::span<const HalfSpace> rows);
  void clear_program();
  void rebuild();
  template <class Keep>
  void take_facets(Whitened& bank, Keep keep);
  [[nodiscard]] Eigen::VectorXd middle() const;
  bool update_box(bool oblique = true);
  void recentre();
  [[nodiscard]] Whitened whiten(const RowBank& candidates, std::span<const std::size_t> numbers, bool open_only) const;
  [[nodiscard]] std::vector<std::size_t> open(const RowBank& candidates, std::span<const std::size_t> numbers) const;
  /// What add_to_hull() leaves open: numbers of candidates that no closed form shows to be implied.
  std::vector<std::size_t> cut_corners(const RowBank& candidates, bool hull_only);
  /// Half-widths below which an axis of z is as good as flat: a few units in the last place of θ.
  [[nodiscard]] Eigen::VectorXd resolution() const;
  void resolve_infeasibility(std::size_t first_new);

  Box box_;
  Coordinates coordinates_;
  std::vector<HalfSpace> rows_;
  Eigen::VectorXd norms_;
  std::optional<LinearProgram> program_;
  std::vector<LinearProgram::Basis> corners_;
  std::vector<std::size_t> known_;  // rows of the program that a corner is known to be the best of; 0: none
  Eigen::VectorXd z_lower_, z_upper_;
  Eigen::MatrixXd vertices_;
  std::size_t reduced_size_;
  std::size_t undecided_ = 0;
  std::optional<std::vector<WeightedRow>> contradiction_;
};

}  // namespace wheelwright::bounds
