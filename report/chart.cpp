// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/chart.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

// The power of ten that resolves the span of `values` into at least `parts`.
double quantum(std::span<const double> values, double parts) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : values) {
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  }
  double span = high - low;
  if (!(span > 0.0) || !std::isfinite(span)) {
    span = std::isfinite(low) && low != 0.0 ? std::abs(low) : 1.0;
  }
  return std::pow(10.0, std::floor(std::log10(span / parts)));
}

void append_number(std::string& out, double x, double step) {
  if (!std::isfinite(x)) {
    out += "null";
    return;
  }
  const double rounded = std::round(x / step) * step;
  fmt::format_to(std::back_inserter(out), "{:.12g}", rounded == 0.0 ? 0.0 : rounded);
}

// A null between segments, so that no line joins them; in `t` the middle of the gap.
void append_values(std::string& out, const std::vector<double>& values, const std::vector<std::size_t>& breaks,
                   double parts, bool is_time) {
  const double step = quantum(values, parts);
  std::size_t next_break = 0;
  out += '[';
  for (std::size_t i = 0; i < values.size(); ++i) {
    while (next_break < breaks.size() && breaks[next_break] < i) {
      ++next_break;
    }
    if (i > 0) {
      out += ',';
      if (next_break < breaks.size() && breaks[next_break] == i) {
        append_number(out, is_time ? 0.5 * (values[i - 1] + values[i]) : std::nan(""), step);
        out += ',';
      }
    }
    append_number(out, values[i], step);
  }
  out += ']';
}

const char* name(Line line) {
  switch (line) {
    case Line::first: return "first";
    case Line::second: return "second";
    case Line::third: return "third";
    case Line::bound: return "bound";
  }
  return "first";
}

}  // namespace

std::string json_string(std::string_view text) {
  std::string dumped = nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  std::string out;
  for (const char c : dumped) {
    switch (c) {
      case '<': out += "\\u003c"; break;
      case '>': out += "\\u003e"; break;
      case '&': out += "\\u0026"; break;
      default: out += c;
    }
  }
  return out;
}

std::string figure(const Chart& chart, const TimeAxis& axis) {
  const std::vector<double> t = axis.lay(chart.t);
  std::string out = fmt::format("<figure class=\"chart\"><figcaption>{}{}</figcaption><div class=\"plot\"></div>",
                                escape(chart.title),
                                chart.unit.empty() ? "" : " <span class=\"unit\">" + escape(chart.unit) + "</span>");
  out += "<script type=\"application/json\">{\"title\":" + json_string(chart.title);
  out += ",\"unit\":" + json_string(chart.unit) + ",\"t\":";
  append_values(out, t, chart.breaks, 1e6, true);
  out += ",\"series\":[";
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const ChartSeries& series = chart.series[i];
    out += (i == 0 ? "{\"label\":" : ",{\"label\":") + json_string(series.label);
    out += fmt::format(",\"line\":\"{}\",\"y\":", name(series.line));
    append_values(out, series.y, chart.breaks, 2e4, false);
    out += '}';
  }
  out += "],\"bands\":[";
  for (std::size_t i = 0; i < chart.bands.size(); ++i) {
    const ChartBand& band = chart.bands[i];
    out += fmt::format("{}[{},{},{}]", i == 0 ? "" : ",", band.upper, band.lower, band.tolerance ? 1 : 0);
  }
  out += "],\"marks\":[";
  for (std::size_t i = 0; i < chart.marks.size() && !axis.repeats(); ++i) {
    const ChartMark& mark = chart.marks[i];
    out += i == 0 ? "[" : ",[";
    append_number(out, axis.shown(mark.from), 1e-6);
    out += ',';
    append_number(out, axis.shown(mark.to), 1e-6);
    out += ',' + json_string(mark.label) + ']';
  }
  return out + "]}</script></figure>\n";
}

}  // namespace wheelwright::report
