// SPDX-License-Identifier: Apache-2.0
/// \file
/// The check of a model in words.
#pragma once

#include <string>
#include <vector>

#include "results/model_check.hpp"

namespace wheelwright::results {

/// What proves a bound: "rows 5017, 8211 and the prior"; "the prior" where there is no row.
[[nodiscard]] std::string stands_on(const BoundVerdict& verdict, const SetClaims& claims);

/// The same at a stated risk: "sums 0, 3 and the guaranteed set".
[[nodiscard]] std::string stands_on_at_risk(const BoundVerdict& verdict, const RiskClaims& risk);

/// The same of the pose: "sums at 23.4 and 60.1 s and the guaranteed set".
[[nodiscard]] std::string stands_on_sums(const BoundVerdict& verdict, const KinematicClaims& claims);

/// Units of the parameters, for the effort that the robot has; "1" for a pure number.
[[nodiscard]] std::vector<std::string> units_of(const ModelClaims& claims);

/// What became of the facets, in one sentence without a full stop.
[[nodiscard]] std::string facet_sentence(const FacetVerdicts& facets);

/// The answer, a short table and what is not proved, for a terminal.
[[nodiscard]] std::string check_summary(const ModelCheck& check, const ModelClaims& claims);

}  // namespace wheelwright::results
