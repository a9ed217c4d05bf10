// SPDX-License-Identifier: Apache-2.0
/// \file
/// The minimax (Chebyshev) fit: the smallest error bound with which a model explains all rows.
#pragma once

#include <vector>

#include "bounds/box.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/slab_rows.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds {

/// Options of minimax_fit().
struct MinimaxOptions {
  std::vector<double> weights;                ///< w per output, > 0; infinity leaves an output out; empty: all 1
  std::vector<std::size_t> excluded_samples;  ///< row numbers (RegressionBlock::sample) left out, any order
  double tolerance = 1e-9;                    ///< wanted (upper − lower) / upper
  std::size_t pass_limit = 24;                ///< most passes over the source, per pattern of open signs
};

/// Result of minimax_fit(): lower <= γ* <= upper whatever the number of passes.
struct MinimaxFit {
  double lower = 0.0;               ///< certified by `active` in outward arithmetic
  double upper = 0.0;               ///< what `theta` reaches over all rows, rounded outward
  std::vector<double> theta;        ///< p parameters in the prior box, with which `upper` is reached
  std::vector<WeightedRow> active;  ///< rows a·θ − wγ <= b (last coefficient −w) and multipliers that prove `lower`
  std::size_t passes = 0;           ///< passes over the source, or parts of it once more
  bool converged = false;           ///< the bracket is as narrow as the tolerance asks, or as double precision allows
};

/// γ* = min γ over θ in prior such that |y_r − Y_r θ| <= γ w_i + dy_r + dY_r |θ| for every row r of output i.
///
/// With dy = dY = 0 it is the Chebyshev fit; with declared bounds it is by how much they must be raised (0: not at
/// all). By cutting planes: each pass adds the rows that the present fit violates most, and the last one, which adds
/// none, evaluates the fit on all rows. Signs that the prior leaves open in noisy columns are examined one pattern at a
/// time (up to four such parameters; beyond, `lower` stands on the convex description of SlabRows and the bracket may
/// stay open). Throws InvalidArgument when shapes disagree, a number is not finite, or no output is left.
[[nodiscard]] MinimaxFit minimax_fit(core::RegressionSource& source, const Box& prior,
                                     const MinimaxOptions& options = {});

/// The same for rows of one output in memory (γ* in units of `weights`, one number, or of 1), usually in one pass: the
/// fit of an evenly spread sample comes first; then the rows in looks, each as long as all before it: those are put
/// aside that can matter for any θ in a box around the fit of all before, and the last fit is that of all rows when it
/// lies in every look's box (where it does not, that look is taken again with a wider one).
[[nodiscard]] MinimaxFit minimax_fit(const SlabColumns& rows, const Box& prior, const MinimaxOptions& options = {});

}  // namespace wheelwright::bounds
