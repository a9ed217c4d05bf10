// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible set as drawings.
#pragma once

#include <string>

#include <wheelwright/commission/commission.hpp>

namespace wheelwright::report {

/// The feasible set seen along the other parameters, a drawing for each pair of parameters that some constraint couples
/// (the set is a rectangle in the other pairs), with its box, the estimate and the Chebyshev centre. HTML; empty where
/// there is no set or no pair.
[[nodiscard]] std::string set_projections(const Commissioning& result);

}  // namespace wheelwright::report
