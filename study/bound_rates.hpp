// SPDX-License-Identifier: Apache-2.0
/// \file
/// Directional derivatives of a commissioned robot's bounds by an input of its robot file, and of the rows that hold
/// them, through all passes of commissioning.
///
/// Rows know how fast the motion can change between samples from the set of the pass before (commission.hpp,
/// EarlierSet). With B_k the hull of pass k, s the input and V the bounds of the rows of a pass,
///
///     B_0 = V(s),   B_k = V(s, B_{k−1}(s)):
///
/// directional derivatives of linear programs follow the chain rule, pass by pass and to each side by itself. So the
/// rows that hold the bounds of pass k are looked at beside the input's value with B_{k−1} moved along its own
/// derivative.
#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "commission/commission.hpp"
#include "core/log.hpp"
#include "model/filter/row_stream.hpp"
#include "study/bound_derivatives.hpp"

namespace wheelwright::study {

/// The two half-spaces of a row.
struct RowSides {
  bounds::HalfSpace upper, lower;
};

/// Some rows of a log, by sample and output.
using LogRows = std::map<std::pair<std::size_t, std::size_t>, RowSides>;

/// Rows and prior where an input has been moved.
struct RowsBeside {
  LogRows rows;
  Box prior;
};

/// Rates of the active rows of an optimum, to both sides of an input's value; one rate for each.
struct RowRates {
  std::vector<RowRate> left, right;
  std::string trouble{};  ///< why there are none, in words; empty where there are
};

/// True if the rows' error bounds stand on declared noise alone.
[[nodiscard]] bool noise_is_declared(const Commissioning& commissioning);

/// The prior box of θ.
[[nodiscard]] Box prior_of(const Robot& robot);

/// Bound on the acceleration of the robot `at` between samples, for rows that stand on declared noise: by the limit of
/// its accelerations, by pairs of steps of `log` (commission::thrust_bound) and, where there are `sides` (p), by the
/// dynamics with all parameters inside them. `confidence` as CommissionOptions has it.
[[nodiscard]] filter::MotionBound motion_at(LogSource& log, const Commissioning& commissioning, const RobotAt& at,
                                            std::span<const Interval> sides, double confidence);

/// The rows of `log` for the robot and filter `at`, all else as `commissioning` chose it: the same columns and
/// instants; errors are propagated anew where noise is declared, with `motion` between samples, else they stay.
/// `confidence` as CommissionOptions has it.
[[nodiscard]] TorqueRows rows_of(LogSource& log, const Commissioning& commissioning, const RobotAt& at,
                                 const filter::MotionBound& motion, double confidence);

/// The half-spaces that the rows named in `wanted` are in the box `prior`; those that are not there are left out.
[[nodiscard]] LogRows pick_rows(core::RegressionSource& rows, const Box& prior, const LogRows& wanted);

/// The rows of the log that are active at an optimum, with the sides that are.
[[nodiscard]] LogRows active_rows(const HullOptima& optima);

/// Rates of the active rows of `optimum` by differences, from their half-spaces at the input's value and by `step`
/// below and above it: central where a row is smooth, one-sided where it has a kink there. None where a row of the log
/// jumps or is gone; `reach` is a large change of the input, by which that is judged. Rates to both sides that differ
/// by less than 1e-3 of them are a curvature where `curved`, else a kink too.
[[nodiscard]] RowRates row_rates(const HullOptima& optima, const HullOptimum& optimum, double reach, double step,
                                 const RowsBeside& below, const RowsBeside& above, bool curved);

/// One pass of a commissioning.
struct BoundPass {
  HullOptima optima;  ///< of its set
  std::vector<Interval>
      sides;  ///< hull of the set before (p), by which its rows bound the motion; empty: the first pass
};

/// The derivative of one bound with respect to an input.
struct BoundRate {
  OneSided value;
  std::string why_not{};  ///< in words, where both sides do not agree to 1e-6 or there is none
};

/// Those of all bounds.
struct BoundRates {
  std::vector<BoundRate> lower;  ///< p
  std::vector<BoundRate> upper;  ///< p
};

/// The passes of `commissioning`, which was made from `log`, in order; the last one is the published set. Walks the log
/// once for each. Each set has a polytope. `confidence` as CommissionOptions has it.
[[nodiscard]] std::vector<BoundPass> bound_passes(LogSource& log, const Commissioning& commissioning,
                                                  double confidence);

/// Derivatives of the bounds of the last of `passes` with respect to `input`, from differences of the binding rows at
/// `step` (relative) below and above its value. Walks the log twice for each pass that the input reaches. Throws
/// InvalidArgument where an input that is not a prior's is 0.
[[nodiscard]] BoundRates bound_rates(LogSource& log, const Commissioning& commissioning,
                                     const std::vector<BoundPass>& passes, const LocalInput& input, double step,
                                     double confidence);

}  // namespace wheelwright::study
