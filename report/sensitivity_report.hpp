// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a sensitivity study.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/report/context.hpp>
#include <wheelwright/study/bound_derivatives.hpp>
#include <wheelwright/study/study.hpp>

namespace wheelwright::report {

/// One self-contained HTML page: what matters most for each quantity in words, tornado charts and curves, shares of the
/// variance, elementary effects, maps, the bounds' derivatives and where there are none, and what could not be
/// evaluated.
[[nodiscard]] std::string sensitivity_report(const study::Study& study, const study::StudyResult& result,
                                             const std::optional<study::LocalSensitivity>& local,
                                             const std::vector<std::string>& notes, const ReportContext& context);

}  // namespace wheelwright::report
