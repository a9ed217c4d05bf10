// SPDX-License-Identifier: Apache-2.0
/// \file
/// Verification of what a model says at a stated risk.
#pragma once

#include <vector>

#include "core/log.hpp"
#include "results/model_check.hpp"

namespace wheelwright::results {

/// Takes the sums of `risk` over `log` again (commission::risk_sums(): it has the arithmetic of elements and sample
/// weights in common with commissioning, not the choice of directions, the solver, or the set) and verifies
///
/// - that the errors are those that the robot declares, that the log's samples stand as far apart as they take it, and
///   that the ellipsoids are those of every delay and block, whose risks, added exactly, are no more than the stated;
/// - that no radius, share of the errors or side of a sum is smaller or sharper than the log makes it;
/// - that each half-space of the set is, or follows from, the facet, side of a sum or side of the box that it names;
/// - by multipliers, in exact arithmetic, both ends of each side of the hull, and that nothing narrower is published.
///
/// Sums are rounded: those of the log have half of what a claim allows for that, so that another machine's rounding
/// refuses no honest one. `proved` is the box in which θ was proved to lie in the worst case, `facets` says which
/// half-spaces of the guaranteed set were proved.
[[nodiscard]] RiskCheck check_at_risk(const ModelClaims& claims, const RiskClaims& risk, LogSource& log,
                                      const Box& proved, const std::vector<bool>& facets);

}  // namespace wheelwright::results
