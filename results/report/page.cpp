// SPDX-License-Identifier: Apache-2.0
#include "results/report/page.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>

#include <fmt/format.h>
#include <zlib.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "core/statistics.hpp"
#include "report_assets.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using namespace words;

namespace {

constexpr double kSteps = 10000.0;
constexpr std::uint16_t kGap = 0xffff;

using Bytes = std::vector<unsigned char>;

Bytes deflated(const Bytes& bytes, int level, int strategy) {
  z_stream stream{};
  if (deflateInit2(&stream, level, Z_DEFLATED, 15, 9, strategy) != Z_OK) {
    throw Error("zlib could not be started: out of memory");
  }
  Bytes out(deflateBound(&stream, bytes.size()));
  stream.next_in = const_cast<unsigned char*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = out.data();
  stream.avail_out = static_cast<uInt>(out.size());
  const int status = deflate(&stream, Z_FINISH);
  out.resize(stream.total_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) {
    throw Error("zlib did not finish");
  }
  return out;
}

// Noise has no repetitions, and looking for them costs time and bits; constant and stepped signals have.
Bytes smallest(const Bytes& bytes) {
  Bytes plain = deflated(bytes, 1, Z_HUFFMAN_ONLY);
  Bytes repeating = deflated(bytes, 3, Z_DEFAULT_STRATEGY);
  return repeating.size() < plain.size() ? repeating : plain;
}

std::string base64(const Bytes& bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    const std::uint32_t three = bytes[i] << 16U | (n > 1 ? bytes[i + 1] << 8U : 0U) | (n > 2 ? bytes[i + 2] : 0U);
    out += digits[three >> 18U];
    out += digits[three >> 12U & 63U];
    out += n > 1 ? digits[three >> 6U & 63U] : '=';
    out += n > 2 ? digits[three & 63U] : '=';
  }
  return out;
}

// Plane k holds the k-th lowest byte of every number.
template <typename Unsigned>
std::string planes(const std::vector<Unsigned>& numbers) {
  Bytes bytes(sizeof(Unsigned) * numbers.size());
  for (std::size_t k = 0; k < sizeof(Unsigned); ++k) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      bytes[k * numbers.size() + i] = static_cast<unsigned char>(numbers[i] >> (8 * k));
    }
  }
  return base64(smallest(bytes));
}

std::uint16_t zigzag(std::uint16_t difference) {
  const int d = static_cast<std::int16_t>(difference);
  return static_cast<std::uint16_t>(d >= 0 ? 2 * d : -2 * d - 1);
}

// The order whose differences are smallest in the sum.
int best_order(const std::vector<std::uint16_t>& codes) {
  std::array<double, 3> sums{};
  std::uint16_t before = 0, slope = 0;
  for (const std::uint16_t code : codes) {
    const auto first = static_cast<std::uint16_t>(code - before);
    const auto second = static_cast<std::uint16_t>(first - slope);
    sums[0] += code;
    sums[1] += zigzag(first);
    sums[2] += zigzag(second);
    before = code;
    slope = first;
  }
  return static_cast<int>(std::min_element(sums.begin(), sums.end()) - sums.begin());
}

// A power of ten of a microsecond.
double tick_for(std::span<const double> t, const std::vector<bool>& starts) {
  std::vector<double> steps;
  double largest = 0.0;
  for (std::size_t i = 1; i < t.size(); ++i) {
    if (!starts[i]) {
      steps.push_back(t[i] - t[i - 1]);
      largest = std::max(largest, std::abs(steps.back()));
    }
  }
  double tick = 1e-6;
  if (!steps.empty()) {
    const double usual = core::median(std::move(steps));
    while (usual > 0.0 && usual < 100.0 * tick && tick > 1e-12) {
      tick *= 0.1;
    }
  }
  while (largest > tick * 0x1p29) {
    tick *= 10.0;
  }
  return tick;
}

}  // namespace

PackedSeries pack(std::span<const double> values, double span) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : values) {
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  }
  PackedSeries out;
  if (low <= high) {
    out.low = low;
    out.step = std::max(high / kSteps - low / kSteps, span / kSteps);
  }
  std::vector<std::uint16_t> codes(values.size(), kGap);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(values[i])) {
      const double above = out.step > 0.0 ? (values[i] - low) / out.step : 0.0;
      codes[i] = static_cast<std::uint16_t>(std::lround(std::clamp(above, 0.0, kSteps)));
    }
  }
  out.order = best_order(codes);
  std::uint16_t before = 0, slope = 0;
  for (std::uint16_t& code : codes) {
    const auto first = static_cast<std::uint16_t>(code - before);
    const auto second = static_cast<std::uint16_t>(first - slope);
    before = code;
    slope = first;
    code = zigzag(out.order == 0 ? code : out.order == 1 ? first : second);
  }
  out.text = planes(codes);
  return out;
}

PackedTimes pack_times(std::span<const double> t, const std::vector<std::size_t>& breaks) {
  PackedTimes out;
  if (t.empty()) {
    return out;
  }
  std::vector<bool> starts(t.size(), false);
  starts[0] = true;
  for (const std::size_t i : breaks) {
    if (i < t.size()) {
      starts[i] = true;
    }
  }
  out.start = t[0];
  out.tick = tick_for(t, starts);
  std::vector<std::uint32_t> differences(t.size(), 0);
  std::int64_t before = 0, step = 0;
  for (std::size_t i = 0; i < t.size(); ++i) {
    const std::int64_t k = std::llround((t[i] - out.start) / out.tick);
    if (starts[i]) {
      out.jumps.emplace_back(i, k);
    } else {
      const std::int64_t second = k - before - step;
      differences[i] = static_cast<std::uint32_t>(second >= 0 ? 2 * second : -2 * second - 1);
      step = k - before;
    }
    before = k;
  }
  out.text = planes(differences);
  return out;
}

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

namespace {

void append_definition(std::string& out, std::string_view term, const std::vector<std::string>& values) {
  if (values.empty()) {
    return;
  }
  out += fmt::format("<dt>{}</dt>", term);
  for (const std::string& value : values) {
    out += "<dd>" + value + "</dd>";
  }
}

std::string navigation(const std::vector<Section>& sections) {
  std::string out = "<nav aria-label=\"Sections\">";
  for (const Section& section : sections) {
    out += fmt::format("<a href=\"#{}\">{}</a>", section.id, escape(section.heading));
  }
  return out + "</nav>\n";
}

}  // namespace

std::string page(const PageContent& content) {
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en-GB\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'\">\n<meta name=\"color-scheme\" content=\"light dark\">\n";
  out += "<title>" + escape(content.title) + "</title>\n<style>";
  out += embedded::uplot_css;
  out += "\n";
  out += embedded::page_css;
  out += "</style>\n</head>\n<body>\n<header>\n<h1>" + escape(content.title) + "</h1>\n";
  out += navigation(content.sections) + "</header>\n<main>\n";
  out += fmt::format("<section id=\"result\" class=\"result {}\"><p class=\"verdict\">{}</p>\n", content.status,
                     escape_with_code(content.verdict));
  if (content.warrant) {
    out += warrant_note(*content.warrant);
  }
  out += content.first;
  for (const std::string& sentence : content.sentences) {
    out += paragraph(escape_with_code(sentence));
  }
  out += "<noscript><p class=\"warning\">The charts need JavaScript; all words and tables are here.</p></noscript>\n";
  out += "</section>\n";
  for (const Section& section : content.sections) {
    out += fmt::format("<section id=\"{}\"><h2>{}</h2>\n", section.id, escape(section.heading));
    out += section.body + "</section>\n";
  }
  out += "</main>\n<footer>" + escape(content.software) + "</footer>\n";
  out += "<div id=\"zoom\" role=\"toolbar\" aria-label=\"Zoom\" hidden></div>\n";
  for (const std::string_view script :
       {embedded::uplot_js, embedded::series_js, embedded::charts_js, embedded::links_js}) {
    out += "<script>";
    out += script;
    out += "</script>\n";
  }
  return out + "</body>\n</html>\n";
}

std::string table(const std::vector<Cell>& header, const std::vector<std::vector<Cell>>& rows) {
  const auto append = [](std::string& out, std::string_view tag, std::string_view attributes, const Cell& cell) {
    out += fmt::format("<{0}{1}{2}>{3}</{0}>", tag, attributes, cell.is_number ? " class=\"n\"" : "", cell.html);
  };
  std::string out =
      rows.size() > 14 ? "<div class=\"wide tall\"><table><thead><tr>" : "<div class=\"wide\"><table><thead><tr>";
  for (const Cell& cell : header) {
    append(out, "th", " scope=\"col\"", cell);
  }
  out += "</tr></thead><tbody>\n";
  for (const std::vector<Cell>& row : rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) {
      append(out, i == 0 ? "th" : "td", i == 0 ? " scope=\"row\"" : "", row[i]);
    }
    out += "</tr>\n";
  }
  return out + "</tbody></table></div>\n";
}

std::string paragraph(std::string_view html) { return fmt::format("<p>{}</p>\n", html); }

std::string note(std::string_view html) { return paragraph("<span class=\"note\">" + std::string(html) + "</span>"); }

std::string bullets(const std::vector<std::string>& items) {
  if (items.empty()) {
    return {};
  }
  std::string out = "<ul>";
  for (const std::string& item : items) {
    out += "<li>" + escape_with_code(item) + "</li>";
  }
  return out + "</ul>\n";
}

std::string definitions(const std::vector<std::pair<std::string, std::string>>& items) {
  std::string out = "<dl>";
  for (const auto& [term, value] : items) {
    append_definition(out, escape(term), {escape(value)});
  }
  return out + "</dl>\n";
}

std::string time_button(double from, double to, std::string_view text, const TimeAxis& axis) {
  if (axis.repeats()) {
    return escape(text);
  }
  return fmt::format("<button type=\"button\" class=\"time\" data-from=\"{:.6f}\" data-to=\"{:.6f}\">{}</button>",
                     axis.shown(from), axis.shown(to), escape(text));
}

std::string provenance(const ReportContext& context, const TimeAxis& axis) {
  std::vector<std::string> files, seeds, clock;
  for (const std::string& file : context.log_files) {
    files.push_back("<code>" + escape(file) + "</code>");
  }
  for (const ReportSeed& seed : context.seeds) {
    seeds.push_back(escape(seed.purpose) + " " + std::to_string(seed.value));
  }
  if (axis.origin() != 0.0) {
    clock.push_back(fmt::format("times on this page count from {:.0f} s of the log's clock", axis.origin()));
  }
  if (axis.repeats()) {
    clock.push_back("the log's time goes back: its runs are drawn end to end, and times are those of each run");
  }
  std::string out;
  append_definition(out, "Log", files);
  append_definition(out, "Clock", clock);
  append_definition(out, "Seeds", seeds);
  if (!context.command_line.empty()) {
    append_definition(out, "Command", {"<code>" + escape(context.command_line) + "</code>"});
  }
  if (!context.software.empty()) {
    append_definition(out, "Software", {escape(context.software)});
  }
  return out.empty() ? out : "<dl>" + out + "</dl>\n";
}

}  // namespace wheelwright::report
