// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/identify_drawings.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

// 1, 2 or 5 times a power of ten, so that about `parts` of them make up `span`.
double round_step(double span, double parts) {
  const double raw = span / parts, power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double m : {1.0, 2.0, 5.0}) {
    if (m * power >= raw * (1.0 - 1e-9)) {
      return m * power;
    }
  }
  return 10.0 * power;
}

struct Span {
  double low = 0.0, high = 1.0;   // of numbers
  double from = 0.0, to = 100.0;  // of pixels
  [[nodiscard]] double operator()(double x) const { return from + (to - from) * (x - low) / (high - low); }
};

std::string tick_text(double x, double step) {
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  return decimal(std::abs(x) < 1e-9 * step ? 0.0 : x, std::min(decimals, 9));
}

// Vertical rules with numbers below.
std::string ticks_below(const Span& x, double top, double bottom, double unit, double parts) {
  std::string out;
  const double step = round_step(x.high * unit - x.low * unit, parts);
  for (double at = std::ceil(x.low * unit / step - 1e-9) * step; at <= x.high * unit + 1e-9 * step; at += step) {
    out += fmt::format(
        "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\"/><text x=\"{0:.1f}\" "
        "y=\"{3:.1f}\" text-anchor=\"middle\">{4}</text>",
        x(at / unit), top, bottom, bottom + 14.0, tick_text(at, step));
  }
  return out;
}

}  // namespace

std::string information_bars(const InformationOverTime& information, const std::vector<std::string>& names,
                             const TimeAxis& axis) {
  const std::size_t windows = information.windows.size();
  const bool any =
      std::ranges::any_of(information.parameters, [](const ParameterInformation& p) { return p.information > 0.0; });
  if (windows == 0 || !any) {
    return {};
  }
  constexpr double width = 900.0, left = 120.0, row = 46.0, top = 6.0;
  const double bottom = top + row * static_cast<double>(information.parameters.size());
  const auto edge = [&](std::size_t k, bool end) {
    if (axis.repeats()) {
      return static_cast<double>(end ? k + 1 : k);
    }
    return axis.shown(end ? information.windows[k].last : information.windows[k].first);
  };
  Span x{edge(0, false), edge(windows - 1, true), left, width - 14.0};
  if (!(x.high > x.low)) {
    return {};
  }
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"information over time\">",
      width, bottom + 34.0);
  out += ticks_below(x, top, bottom, 1.0, 10.0);
  for (std::size_t j = 0; j < information.parameters.size(); ++j) {
    const ParameterInformation& p = information.parameters[j];
    const double base = top + row * static_cast<double>(j + 1) - 6.0, full = row - 12.0;
    out += fmt::format("<text class=\"ink\" x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", left - 8.0,
                       base - 0.5 * full + 4.0, escape(words(j < names.size() ? names[j] : "")));
    out += fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>", left, width - 14.0,
                       base);
    const double largest = p.share.size() > 0 ? p.share.maxCoeff() : 0.0;
    for (Eigen::Index k = 0; largest > 0.0 && k < p.share.size(); ++k) {
      const auto window = static_cast<std::size_t>(k);
      const double x0 = x(edge(window, false)), x1 = x(edge(window, true)), high = full * p.share[k] / largest;
      const bool carries = std::ranges::binary_search(p.shortest, window);
      out += fmt::format("<rect class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>",
                         carries ? "full" : "bar", x0, base - high, std::max(x1 - x0 - 0.5, 0.5), high);
    }
  }
  return out + fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text></svg>",
                           0.5 * (left + width), bottom + 30.0,
                           axis.repeats() ? "window of the log, in order" : "time, s");
}

std::string shape_curve(const ShapeFinding& shape) {
  Span y{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(), 150.0, 12.0};
  std::vector<ShapePoint> points;
  for (const ShapePoint& point : shape.curve) {
    if (std::isfinite(point.residual_ratio) && std::isfinite(point.shape)) {
      points.push_back(point);
      y.low = std::min(y.low, point.residual_ratio);
      y.high = std::max(y.high, point.residual_ratio);
    }
  }
  if (points.size() < 2 || !(points.back().shape > points.front().shape)) {
    return {};
  }
  const double margin = std::max(0.06 * (y.high - y.low), 0.005);
  y.low = std::max(y.low - margin, 0.0);
  y.high += margin;
  constexpr double width = 420.0, left = 56.0, bottom = 150.0;
  const Span x{points.front().shape, points.back().shape, left, width - 14.0};
  const double unit = shape.unit == "s" ? 1e3 : 1.0;
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} 186\" width=\"{0}\" height=\"186\" role=\"img\" aria-label=\"residual over {1}\">", width,
      escape(words(shape.name)));
  out += ticks_below(x, 12.0, bottom, unit, 6.0);
  const double step = round_step(100.0 * (y.high - y.low), 4.0);
  for (double at = std::ceil(100.0 * y.low / step) * step; at <= 100.0 * y.high; at += step) {
    out += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5} %</text>",
        left, width - 14.0, y(at / 100.0), left - 5.0, y(at / 100.0) + 4.0, tick_text(at, step));
  }
  out += "<polyline class=\"curve\" points=\"";
  for (const ShapePoint& point : points) {
    out += fmt::format("{:.1f},{:.1f} ", x(point.shape), y(point.residual_ratio));
  }
  out += "\"/>";
  if (shape.converged && shape.state == ShapeState::identified) {
    out += fmt::format("<circle class=\"dot chosen\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", x(shape.estimate),
                       y(shape.residual_ratio));
  }
  return out + fmt::format("<text x=\"{:.1f}\" y=\"180\" text-anchor=\"middle\">{}, {}</text></svg>",
                           0.5 * (left + width), escape(words(shape.name)),
                           escape(shape.unit == "s" ? "ms" : shape.unit));
}

}  // namespace wheelwright::report
