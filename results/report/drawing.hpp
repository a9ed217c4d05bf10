// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small drawings as SVG, and those of feasible sets.
#pragma once

#include <string>
#include <vector>

#include "commission/choice/filter_choice.hpp"
#include "commission/commission.hpp"
#include "core/limits.hpp"
#include "core/log.hpp"
#include "results/report/sections.hpp"

namespace wheelwright::report {

/// Range of numbers that a drawing shows.
struct Range {
  double low = core::kInfinity;  ///< > high: none was taken
  double high = -core::kInfinity;

  /// Widens it for `x`, where that is finite.
  void take(double x);
};

/// An axis of a drawing: the numbers that it has taken, from pixel `from` to pixel `to`.
struct Axis : Range {
  double from, to;
  bool logarithmic;  ///< then low > 0

  /// An axis that has taken nothing yet.
  Axis(double first, double last, bool logarithms = false) : from(first), to(last), logarithmic(logarithms) {}
  Axis(const Range& range, double first, double last, bool logarithms = false)
      : Range(range), from(first), to(last), logarithmic(logarithms) {}

  /// True if it has taken no number.
  [[nodiscard]] bool empty() const { return !(low <= high); }
  /// Widens it at both ends by `share` of its length, by a tenth of its number if it has taken one only; [0, 1] stands
  /// for none.
  void pad(double share);
  /// The pixel of `x`.
  [[nodiscard]] double operator()(double x) const;
  /// The pixel of the number of the axis that is nearest to `x`.
  [[nodiscard]] double inside(double x) const;
  /// Round numbers on it, about five of them unless it is logarithmic.
  [[nodiscard]] std::vector<double> ticks() const;
};

/// The powers of ten in [low, high] and, where `fine`, 2 and 5 times these; low > 0.
[[nodiscard]] std::vector<double> logarithmic_ticks(double low, double high, bool fine);

/// The beginning of a drawing of that size, with `label` (text) for those who cannot see it.
[[nodiscard]] std::string open_svg(double width, double height, const std::string& label);

/// `what` (text) at a place; `anchor` is start, middle or end; in the colour of text where `ink`, else of axes.
[[nodiscard]] std::string svg_text(double x, double y, const char* anchor, const std::string& what, bool ink = false);

/// The interval of the bounds as a box, the 95 % interval as whiskers, Chebyshev centre and nominal value. The scale is
/// that of what the log says: the prior's sides may lie beyond the drawing, an arrow then tells.
[[nodiscard]] std::string interval_bar(const words::ParameterView& view);

/// The curve behind the choice of the filter, criterion over β, both logarithmic; empty for fewer than two candidates.
[[nodiscard]] std::string filter_curve(const commission::FilterChoice& choice);

/// The driven path seen from above, from columns x and y; empty where the log lacks them or does not move.
[[nodiscard]] std::string driven_path(const LogTable& signals);

/// The feasible set seen along the other parameters, a drawing for each pair of parameters that some constraint couples
/// (the set is a rectangle in the other pairs), with its box, the estimate and the Chebyshev centre. HTML; empty where
/// there is no set or no pair.
[[nodiscard]] std::string set_projections(const Commissioning& result);

}  // namespace wheelwright::report
