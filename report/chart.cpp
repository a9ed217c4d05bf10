// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/chart.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>

#include <fmt/format.h>
#include <zlib.h>
#include <nlohmann/json.hpp>

#include <wheelwright/core/error.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/words/text.hpp>

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

}  // namespace wheelwright::report
