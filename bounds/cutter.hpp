// SPDX-License-Identifier: Apache-2.0
/// \file
/// Incremental cutting of a feasible set from its prior box by the rows of a log, batch after batch.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "bounds/cutting_planes.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {

/// Options of a Cutter.
struct CutterOptions {
  bool facets = true;          ///< find all facets; false: only what sets the interval hull
  std::size_t most = 1 << 17;  ///< half-spaces kept or rows put aside, per block of parameters
};

/// { θ in prior : all rows }, held as a product over independent blocks of parameters, with the few half-spaces of each
/// that matter.
///
/// A row is first compared with a box around the set held so far: most rows of a long log are implied by it and cost
/// one look. The others are kept until the hull of the set has become small, since most are implied then; the rest is
/// tried one by one against the facets (CuttingPlanes::add). For the interval hull alone they are put aside, and those
/// that a corner of the hull violates are cut in until there are none.
class Cutter {
 public:
  /// `blocks` are groups of parameters that no row couples, `information` (p × p) as in CuttingPlanes.
  Cutter(const Box& prior, const std::vector<std::vector<std::size_t>>& blocks, const Eigen::MatrixXd& information,
         const CutterOptions& options = {});

  /// Takes rows; `used` says which columns have something else than zeros (empty: all). False once the set is proved
  /// empty. Throws InvalidArgument where a number is not finite.
  bool offer(const SlabColumns& columns, const std::vector<char>& used = {});
  /// Moves the hull to where the rows kept so far put it; false once the set is proved empty.
  bool tighten();
  /// Ends: all rows kept are cut in or dropped. False where the set is proved empty. Without facets: where `again()`,
  /// the rows must all be offered once more.
  bool finish();

  /// Without facets: rows were passed over that may cut what was held later, so that another pass is needed.
  [[nodiscard]] bool again() const { return again_; }
  /// Begins another pass.
  void begin_pass() { again_ = passed_over_ = false; }

  /// The half-spaces held, in all p parameters, sides of the prior box left out.
  [[nodiscard]] std::vector<HalfSpace> half_spaces();
  /// Certified lower and upper bounds of every parameter, with binding rows in all p parameters.
  [[nodiscard]] std::pair<std::vector<CertifiedBound>, std::vector<CertifiedBound>> certified_hull();
  /// The rows that prove the set empty. None where it is not.
  [[nodiscard]] std::vector<WeightedRow> contradiction() const;
  /// Most half-spaces held at once.
  [[nodiscard]] std::size_t working_set() const { return working_set_; }
  /// As CuttingPlanes::undecided().
  [[nodiscard]] std::size_t undecided() const;
  /// Rows that were more than looked at.
  [[nodiscard]] std::size_t candidates() const { return candidates_; }

 private:
  struct Part {
    std::vector<std::size_t> parameters;
    std::optional<CuttingPlanes> planes;
    RowBank fresh, kept;
    CuttingPlanes::OuterBox around;                // the set held
    Eigen::VectorXd oblique_half, oblique_centre;  // a box in the coordinates of `planes`
    Eigen::MatrixXd corners;                       // where a parameter is largest or smallest
    SlabStore aside;                               // without facets: rows that the box does not imply
    std::size_t settled = 0;                       // how many of them there were when the corners satisfied them all
  };

  void look(Part& part) const;
  bool tighten(Part& part);
  [[nodiscard]] std::span<const std::uint32_t> search(const Part& part, const SlabColumns& rows, bool corners);
  bool settle(Part& part, std::size_t which);
  bool take(Part& part, std::size_t which, const SlabColumns& columns, std::span<const std::uint32_t> found);
  [[nodiscard]] WeightedRow spread(const Part& part, const WeightedRow& row) const;

  SlabRows rows_;
  CutterOptions options_;
  std::size_t p_;
  std::vector<Part> parts_;
  std::vector<std::uint32_t> found_;
  std::vector<double> Y_, dY_, normal_;
  HalfSpace upper_, lower_;
  std::size_t working_set_ = 0, candidates_ = 0;
  bool passed_over_ = false, again_ = false;
};

}  // namespace wheelwright::bounds
