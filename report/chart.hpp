// SPDX-License-Identifier: Apache-2.0
/// \file
/// A chart over time, as data: the page's script draws it with uPlot.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/report/time_axis.hpp>

namespace wheelwright::report {

/// How a line is drawn. Styles differ in dash and width as well as in colour, so that they tell without colour.
enum class Line {
  first,   ///< solid
  second,  ///< dashed
  third,   ///< dotted
  bound,   ///< thin, a limit of what may be
};

/// One line of a chart. What `y` looks at must outlive the call of figure().
struct ChartSeries {
  std::string label;
  std::span<const double> y;  ///< one for each time of the chart's clock; what is not finite is left out
  Line line = Line::first;
  double span = 0.0;  ///< to 1/20 000 of this is enough, where it exceeds the span of `y`
};

/// The area between two series.
struct ChartBand {
  std::size_t upper = 0;  ///< index of a series
  std::size_t lower = 0;
  bool tolerance = false;  ///< pale: where the residual may be; else the residual's own spread
};

/// A stretch (or, with from == to, a moment) of time that stands out.
struct ChartMark {
  double from = 0.0;  ///< s, log time
  double to = 0.0;    ///< s, log time
  std::string label;  ///< short, drawn beside it
  bool pin = false;   ///< a small triangle at the time axis instead of a shaded stretch
};

/// A chart over time.
struct Chart {
  std::string title;
  std::string unit;
  std::string clock;  ///< id of its times, which clock() put on the page
  std::vector<ChartSeries> series;
  std::vector<ChartBand> bands;
  std::vector<ChartMark> marks;
};

/// Points of a series that a page holds at most: longer ones are thinned before, peaks kept.
inline constexpr std::size_t most_chart_points = 2'000'000;

/// The times (s, log time) of one or more charts, which stand once on a page under `id`. No line is drawn across
/// `breaks` (ascending indices of `t` at which a segment starts). Empty for no times.
[[nodiscard]] std::string clock(std::string_view id, const std::vector<double>& t,
                                const std::vector<std::size_t>& breaks, const TimeAxis& axis);

/// The chart as a <figure> that holds its data, packed (packing.hpp): to 1/20 000 of each series' span, or of
/// ChartSeries::span.
[[nodiscard]] std::string figure(const Chart& chart, const TimeAxis& axis);

/// `text` as a JSON string that may stand inside a <script> element.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace wheelwright::report
