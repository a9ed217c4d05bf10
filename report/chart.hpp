// SPDX-License-Identifier: Apache-2.0
/// \file
/// A chart over time, as data: the page's script draws it with uPlot.
#pragma once

#include <cstddef>
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

/// One line of a chart.
struct ChartSeries {
  std::string label;
  std::vector<double> y;  ///< as long as Chart::t; what is not finite is left out
  Line line = Line::first;
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
  std::string label;  ///< short, drawn at its top
};

/// A chart over time.
struct Chart {
  std::string title;
  std::string unit;
  std::vector<double> t;  ///< s, log time
  std::vector<ChartSeries> series;
  std::vector<ChartBand> bands;
  std::vector<ChartMark> marks;
  std::vector<std::size_t> breaks;  ///< indices of `t` before which no line is drawn (ascending)
};

/// The chart as a <figure> that holds its data as JSON: numbers to 1/20 000 of each series' span, gaps as null, nothing
/// that is not finite.
[[nodiscard]] std::string figure(const Chart& chart, const TimeAxis& axis);

/// `text` as a JSON string that may stand inside a <script> element.
[[nodiscard]] std::string json_string(std::string_view text);

}  // namespace wheelwright::report
