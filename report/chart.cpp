// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/chart.hpp>

#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/report/packing.hpp>
#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

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

std::string clock(std::string_view id, const std::vector<double>& t, const std::vector<std::size_t>& breaks,
                  const TimeAxis& axis) {
  if (t.empty()) {
    return {};
  }
  const std::vector<double> laid = axis.lay(t);
  const PackedTimes packed = pack_times(laid, breaks);
  std::string out = fmt::format(
      "<div class=\"clock\" id=\"clock-{}\" hidden><script type=\"application/json\">{{\"start\":{},\"end\":{},"
      "\"tick\":{},\"jumps\":[",
      id, packed.start, laid.back(), packed.tick);
  for (std::size_t i = 0; i < packed.jumps.size(); ++i) {
    fmt::format_to(std::back_inserter(out), "{}[{},{}]", i == 0 ? "" : ",", packed.jumps[i].first,
                   packed.jumps[i].second);
  }
  return out + "]}</script><script type=\"text/plain\">" + packed.text + "</script></div>\n";
}

std::string figure(const Chart& chart, const TimeAxis& axis) {
  std::string out = fmt::format("<figure class=\"chart\"><figcaption>{}{}</figcaption><div class=\"plot\"></div>",
                                escape(chart.title),
                                chart.unit.empty() ? "" : " <span class=\"unit\">" + escape(chart.unit) + "</span>");
  out += "<script type=\"application/json\">{\"title\":" + json_string(chart.title);
  out += ",\"clock\":" + json_string("clock-" + chart.clock) + ",\"series\":[";
  std::string packed;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const ChartSeries& series = chart.series[i];
    const PackedSeries p = pack(series.y, series.span);
    out += (i == 0 ? "{\"label\":" : ",{\"label\":") + json_string(series.label);
    fmt::format_to(std::back_inserter(out), ",\"line\":\"{}\",\"low\":{},\"step\":{},\"order\":{}}}", name(series.line),
                   p.low, p.step, p.order);
    packed += "<script type=\"text/plain\">" + p.text + "</script>";
  }
  out += "],\"bands\":[";
  for (std::size_t i = 0; i < chart.bands.size(); ++i) {
    const ChartBand& band = chart.bands[i];
    out += fmt::format("{}[{},{},{}]", i == 0 ? "" : ",", band.upper, band.lower, band.tolerance ? 1 : 0);
  }
  out += "],\"marks\":[";
  for (std::size_t i = 0; i < chart.marks.size() && !axis.repeats(); ++i) {
    const ChartMark& mark = chart.marks[i];
    out += fmt::format("{}[{:.6f},{:.6f},{},{}]", i == 0 ? "" : ",", axis.shown(mark.from), axis.shown(mark.to),
                       json_string(mark.label), mark.pin ? 1 : 0);
  }
  return out + "]}</script>" + packed + "</figure>\n";
}

}  // namespace wheelwright::report
