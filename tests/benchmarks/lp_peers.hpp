// SPDX-License-Identifier: Apache-2.0
/// \file
/// Peers of the benchmarks of bounds/: straightforward uses of linear programming libraries.
///
/// Every function here *builds* a peer from the rows: it scales them and loads them into the library. What it returns
/// *solves*: it can be called any number of times, begins without a basis each time, and returns the answer and nothing
/// else. The two can so be timed apart. All peers get the rows in the same scaling (ScaledRows). Forms and algorithms
/// are the fastest of those tried with N = 1e4 to 1e6 rows and p = 8. No answer is certified. Solving throws Error
/// where a library does not reach an optimum. Peers refer to nothing of their arguments.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "bounds/box.hpp"
#include "tests/benchmarks/drive_rows.hpp"

namespace wheelwright::bench {

/// Returns all 2p bounds.
using HullPeer = std::function<Box()>;
/// Returns γ* = min γ with |y − Yθ| <= γ dy for every row and θ in the prior box.
using MinimaxPeer = std::function<double()>;
/// Returns max a·θ for each of the directions a (row-major, p numbers each), one after the other.
using SupportPeer = std::function<std::vector<double>(std::span<const double> directions)>;

/// Interval hull by CLP with all rows in one program. The dual form, min Σ (c + 1)λ⁺ − (c − 1)λ⁻ with
/// Σ a(λ⁺ − λ⁻) = ±e_j (p rows, 2N + 2p columns): the first objective by the primal simplex, each of the others by the
/// dual simplex from the basis of the one before. (Ranged rows in the primal form took 3 to 6 times as long by either
/// simplex, with or without presolve; Sprint for each objective 1.3 to 1.8 times.)
[[nodiscard]] HullPeer clp_hull(const DriveRows& rows);

/// The two forms of the full problem between which GLPK has no clear winner.
enum class GlpkForm {
  dual,    ///< as clp_hull(), then GLP_DUALP with projected steepest edge; the faster one with noise u
  ranged,  ///< N ranged rows in p variables, GLP_DUAL with Dantzig's rule; the faster one with noise g
};

/// The same by GLPK, with Harris' ratio test.
[[nodiscard]] HullPeer glpk_hull(const DriveRows& rows, GlpkForm form);

/// Options of clp_loop(), at their fastest for N = 1e6, p = 8 (half or twice of either changes the time by a third at
/// most).
struct LoopOptions {
  std::size_t sample = 500;      ///< rows of the first working set, evenly spaced
  std::size_t join = 100;        ///< most rows that join in a pass, per vertex
  double tolerance = 1e-9;       ///< of dy: a row that is violated by less does not count
  std::size_t pass_limit = 200;  ///< then it throws
};

/// Result of the cutting-plane loop.
struct LoopAnswer {
  Box hull;                     ///< all 2p bounds
  std::size_t passes = 0;       ///< passes over all rows
  std::size_t working_set = 0;  ///< rows in the program at the end
};

/// Interval hull by a cutting-plane loop around CLP: 2p programs on a working set (dual form, each from its own last
/// basis by the primal simplex), then one pass over all rows that tests all 2p vertices, block by block in the
/// first-level cache, compiled for the processor at hand; the most violated rows join, until no row is violated by more
/// than the tolerance.
[[nodiscard]] std::function<LoopAnswer()> clp_loop(const DriveRows& rows, const LoopOptions& options = {});

/// Minimax fit by CLP with all rows in one program: the dual form (p + 1 rows, 2N + 2p columns), primal simplex. (The
/// primal form by the dual simplex took 3 times as long; Sprint 0.8 to 1.2 times.)
[[nodiscard]] MinimaxPeer clp_minimax(const DriveRows& rows);

/// The same by GLPK: dual form, primal simplex, Dantzig's rule. (Projected steepest edge took 1.2 times as long, the
/// primal form by the dual simplex twice as long.)
[[nodiscard]] MinimaxPeer glpk_minimax(const DriveRows& rows);

/// { θ : a·θ <= b }, bounded: the facets that are left of a feasible set.
struct Facets {
  std::size_t m = 0;      ///< facets
  std::size_t p = 0;      ///< parameters
  std::vector<double> a;  ///< m × p, row-major
  std::vector<double> b;  ///< m
};

/// Support function along a sequence of directions by CLP: dual form (p rows, m columns), each by the dual simplex from
/// the basis *and the factorisation* of the one before. (Factorising anew took 3 times as long, the primal form 4 to 8
/// times.)
[[nodiscard]] SupportPeer clp_support(const Facets& facets);

/// The same by GLPK: dual form, GLP_DUALP from the basis of the one before. (GLPK factorises only when it has to. The
/// primal form took 1.1 times as long.)
[[nodiscard]] SupportPeer glpk_support(const Facets& facets);

/// True if GLPK was there when this was built; where not, its peers throw Error.
[[nodiscard]] bool has_glpk() noexcept;

}  // namespace wheelwright::bench
