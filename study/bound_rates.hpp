// SPDX-License-Identifier: Apache-2.0
/// \file
/// How fast the bounds of a commissioned robot follow an input, through all passes of its commissioning.
///
/// Rows know how fast the motion can change between samples from the set of the pass before (commission.hpp, EarlierSet).
/// With B_k the hull of pass k, s the input and V the bounds of the rows of a pass,
///
///     B_0 = V(s),   B_k = V(s, B_{k−1}(s)):
///
/// directional derivatives of linear programs follow the chain rule, pass by pass and to each side by itself. So the rows
/// that hold the bounds of pass k are looked at beside the input's value with B_{k−1} moved along its own derivative.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/study/hull_derivatives.hpp>
#include <wheelwright/study/local_inputs.hpp>
#include <wheelwright/study/row_rates.hpp>

namespace wheelwright {

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

}  // namespace wheelwright
