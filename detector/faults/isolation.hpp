// SPDX-License-Identifier: Apache-2.0
/// \file
/// Fault isolation after an alarm: the faults that the data still allow, with bounds on size and onset. Set-valued,
/// with proofs.
///
/// **All of it is of faults that are steps and stay**: of one size from one onset on (a drift: with the rise that the
/// catalogue gives it). A fault that takes longer to come than a few samples is none: its size and its onset may lie
/// outside the intervals, and its kind may be excluded.
///
/// A fault of size κ that set in in [T_a, T_b] explains the rows of a window when one θ of the feasible set P satisfies
/// all of them, before and after (onset_rows.hpp), in all outputs:
///
///     |τ_f − (y + κ g1 + κ² g2) θ − κ c − w₁A − w₂B − w₃C| <= n̄ + (Δ + |κ| e1 + κ² e2)|θ| + |κ| e_c.
///
/// For κ in [κ_m − η, κ_m + η], κ = κ_m + d, and a middle θ_c of P this is, with G = g1 + 2κ_m g2,
///
///     |τ_f − (y + κ_m g1 + κ_m² g2) θ − κ_m c − d (Gθ_c + c) − w₁A − …| <= … + η |G||θ − θ_c| + η² |g2||θ|,
///
/// since dGθ = dGθ_c + dG(θ − θ_c): linear in (θ, d, A, B, C), with all that is left out bounded over the box of P. The
/// linear program's bounds on d, certified (certificate.hpp), make [κ_m − η, κ_m + η] narrower, again and again; what
/// does not get narrower is cut in two. A program proved infeasible excludes the piece. The intervals of onsets are cut
/// in two alike.
///
/// **So a step that stays is never excluded, and its size and onset lie in the intervals**, where the model and the
/// sensors' bounds hold and the fault is of the catalogue. The intervals are outer bounds: where the budget runs out
/// they are wider, never wrong. Where bounds are estimated (ē) the proof stands on them.
///
/// Faults that make an encoder's reading stand still leave the true motion unknown: they are judged by the reading
/// alone.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/interval.hpp"
#include "model/fault_type.hpp"

namespace wheelwright::bounds {
class Polytope;
}  // namespace wheelwright::bounds

namespace wheelwright::filter {
class RegressorFilter;
}  // namespace wheelwright::filter

namespace wheelwright::detector {

struct ReferenceMotion;

/// Options of the isolation.
struct IsolationOptions {
  double before = 3.0;             ///< s before the first instant outside in which the fault may have set in
  double after = 1.0;              ///< s after the alarm that are looked at
  double onset_step = 0.05;        ///< s: intervals of onsets are not cut below this (nor below two instants)
  double resolution = 0.02;        ///< ends of the sizes' intervals are sought to this, relative
  std::size_t most_instants = 60;  ///< of the window, whose rows are used
  std::size_t budget = 1500;       ///< linear programs for each fault
  std::size_t threads = 1;         ///< the result does not depend on it
};

/// What sums over all scales leave of a fault that is not excluded otherwise, at the stated risk, if it is a step that
/// stays (sum_isolation.hpp).
struct SumFinding {
  bool excluded = false;  ///< no size and onset explains the looks at the sums, but for the risk
  std::optional<Interval>
      magnitude;     ///< where it is not excluded and has a size: holds that of a step, but for the risk
  Interval onset{};  ///< where it is not excluded: holds that of a step, but for the risk, s
};

/// Finding on one fault.
struct FaultFinding {
  /// Kinds of answers.
  enum class Verdict {
    consistent,   ///< not excluded
    excluded,     ///< proved: no step of any size and onset, θ and noise explains the window
    not_examined  ///< its rows are not known (a bump of unknown phase, OnsetRows::knows())
  };
  FaultType fault;
  Verdict verdict = Verdict::not_examined;
  std::optional<Interval> magnitude;  ///< where consistent, unless it is there or not: holds that of a step
  Interval onset{};                   ///< where consistent: holds that of a step, s
  bool earlier = false;               ///< the onset may also lie before the window (then onset.lower is its beginning):
                                      ///< before its memory, in a gap of the log, or before the log
  bool complete = true;               ///< the budget sufficed
  std::size_t programs = 0;           ///< linear programs that were solved
  std::optional<SumFinding> at_risk{};  ///< where sums over scales were asked
};

/// Findings on all faults.
struct Isolation {
  Interval window{};  ///< s, of the rows that were used
  std::vector<FaultFinding> findings;

  /// Number of findings with that verdict.
  [[nodiscard]] std::size_t count(FaultFinding::Verdict verdict) const;
  /// Number of findings that are consistent, and not excluded at the stated risk either.
  [[nodiscard]] std::size_t count_at_risk() const;
};

/// Weighted mean of a fault's size over [from, to].
struct MeanSize {
  double from = 0.0, to = 0.0;  ///< s
  Interval size{};              ///< holds the mean, in the fault's unit
};

/// Size of a fault at one instant.
struct SizeAt {
  double t = 0.0;   ///< s
  Interval size{};  ///< holds it, in the fault's unit
};

/// Size of one fault over time, whether it is a step or not (size_over_time.hpp).
struct SizeOverTime {
  FaultType fault;
  std::vector<MeanSize> means{};  ///< any bounded course; empty where no weights are known
  bool excluded = false;          ///< no bounded course explains the rows
  std::vector<SizeAt> growing{};  ///< if it only grows: at 200 instants at most; empty where nothing is known
  bool growing_excluded = false;  ///< it did not only grow
};

/// Tells `faults` apart after an alarm at `alarm` whose first instant outside is `outside` (both times of rows of the
/// log, s). `motion` is the log's own (read_reference() with `filter`), or a piece of it that begins 16/β and more
/// before the window; `set` is P. Throws InvalidArgument where `alarm` is not in the motion, or options make no sense.
[[nodiscard]] Isolation isolate(const ReferenceMotion& motion, const filter::RegressorFilter& filter,
                                const bounds::Polytope& set, const std::vector<FaultType>& faults, double outside,
                                double alarm, const IsolationOptions& options = {});

}  // namespace wheelwright::detector
