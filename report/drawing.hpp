// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small drawings as SVG.
#pragma once

#include <string>

#include <wheelwright/commission/filter_choice.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/report/parameter_view.hpp>

namespace wheelwright::report {

/// The interval of the bounds as a box, the 95 % interval as whiskers, Chebyshev centre and nominal value. The scale is that
/// of what the log says: the prior's sides may lie beyond the drawing, an arrow then tells.
[[nodiscard]] std::string interval_bar(const ParameterView& view);

/// The curve behind the choice of the filter, criterion over β, both logarithmic; empty for fewer than two candidates.
[[nodiscard]] std::string filter_curve(const FilterChoice& choice);

/// The driven path seen from above, from columns x and y; empty where the log lacks them or does not move.
[[nodiscard]] std::string driven_path(const LogTable& signals);

}  // namespace wheelwright::report
