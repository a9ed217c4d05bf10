// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of `wheelwright choose`: what every candidate costs, and the chosen detector's commissioning.
#pragma once

#include <string>

#include "commission/choice/detector_choice.hpp"
#include "results/report/commission_report.hpp"

namespace wheelwright::report {

/// The comparison of all candidates, then the page of the chosen one (commission_report()). `choice.chosen` is there.
[[nodiscard]] std::string choice_report(const commission::DetectorChoice& choice, CommissionContext context);

}  // namespace wheelwright::report
