// SPDX-License-Identifier: Apache-2.0
/// \file
/// The first thing that a page about a detector says: what it will see, how soon, and how sure.
#pragma once

#include <string>

#include "commission/margin_survey.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::report {

/// Sizes of telling_faults() over the time to detection, one line for each guarantee, as pictures and as a table, and
/// what each guarantee is worth. HTML; empty where no size is certain.
[[nodiscard]] std::string outlook(const commission::MarginSurvey& survey, const OnlineModel& model);

}  // namespace wheelwright::report
