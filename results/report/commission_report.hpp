// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a commissioning.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/commission.hpp"
#include "commission/detection.hpp"
#include "commission/margin_survey.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// Where a commissioning came from, and what its page shows beside its result.
struct CommissionContext : ReportContext {
  std::optional<Detection> own_log{};              ///< the model's detector on the log it was made from
  std::optional<commission::MarginSurvey> seen{};  ///< what is certain to be seen (first_look())
  std::vector<Section> lead{};                     ///< before its own sections
};

/// One self-contained HTML page: the result in words, parameters, residual inside [l, u] and prediction over the whole
/// log (where `context.own_log` is given), raw signals, validation, noise and filter, data. It loads nothing when
/// opened; every name is escaped, every number is finite.
[[nodiscard]] std::string commission_report(const Commissioning& result, const CommissionContext& context);

}  // namespace wheelwright::report
