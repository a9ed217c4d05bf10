// SPDX-License-Identifier: Apache-2.0
#include "results/report/drawing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "detector/multiscale/scale_detector.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;

std::string open_svg(double width, double height, const std::string& label) {
  return fmt::format(
      "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" aria-label=\"{2}\">",
      width, height, escape(label));
}

std::string svg_text(double x, double y, const char* anchor, const std::string& what, bool ink) {
  return fmt::format("<text{} x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>", ink ? " class=\"ink\"" : "", x,
                     y, anchor, escape(what));
}

void Range::take(double x) {
  if (std::isfinite(x)) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
}

std::vector<double> logarithmic_ticks(double low, double high, bool fine) {
  std::vector<double> out;
  if (!(low > 0.0) || !std::isfinite(high)) {
    return out;
  }
  const double least = std::max(low, std::numeric_limits<double>::min());
  for (double power = std::pow(10.0, std::floor(std::log10(least))); power <= high; power *= 10.0) {
    for (const double m : {1.0, 2.0, 5.0}) {
      if ((fine || m == 1.0) && m * power >= low * (1.0 - 1e-9) && m * power <= high * (1.0 + 1e-9)) {
        out.push_back(m * power);
      }
    }
  }
  return out;
}

void Axis::pad(double share) {
  if (empty()) {
    low = 0.0;
    high = 1.0;
  }
  const double margin = high > low ? share * (high - low) : (high != 0.0 ? 0.1 * std::abs(high) : 1.0);
  low -= margin;
  high += margin;
}

double Axis::operator()(double x) const {
  return logarithmic ? from + (to - from) * std::log(x / low) / std::log(high / low)
                     : from + (to - from) * (x - low) / (high - low);
}

double Axis::inside(double x) const { return (*this)(std::clamp(x, low, high)); }

std::vector<double> Axis::ticks() const {
  if (logarithmic) {
    return logarithmic_ticks(low, high, high / low < 300.0);
  }
  std::vector<double> out;
  const double rough = (high - low) / 5.0, power = std::pow(10.0, std::floor(std::log10(rough)));
  const double step = power * (rough < 1.5 * power   ? 1.0
                               : rough < 3.5 * power ? 2.0
                               : rough < 7.5 * power ? 5.0
                                                     : 10.0);
  const double first = std::ceil(low / step);
  for (int k = 0; k < 12 && (first + k) * step <= high; ++k) {
    out.push_back((first + k) * step);
  }
  return out;
}

namespace {

// A tip at (x, y) that points right (direction 1) or left (−1).
std::string arrow(double x, double y, double direction) {
  return fmt::format("<path class=\"whisker\" d=\"M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}L{0:.1f} {4:.1f}\"/>",
                     x - 5.0 * direction, y - 4.0, x, y, y + 4.0);
}

}  // namespace

std::string interval_bar(const ParameterView& v) {
  constexpr double width = 230.0, height = 34.0, middle = 15.0, left = 10.0, right = width - 10.0;
  Axis scale{left, right};
  if (v.has_set && !v.lower_is_prior) {
    scale.take(v.lower);
  }
  if (v.has_set && !v.upper_is_prior) {
    scale.take(v.upper);
  }
  if (v.estimate) {
    scale.take(*v.estimate);
    scale.take(*v.estimate - v.spread.value_or(0.0));
    scale.take(*v.estimate + v.spread.value_or(0.0));
  }
  if (v.nominal) {
    scale.take(*v.nominal);
  }
  const double span = scale.low < scale.high ? scale.high - scale.low : std::numeric_limits<double>::infinity();
  for (const double bound : {v.lower, v.upper}) {
    if (v.has_set && bound >= scale.low - span && bound <= scale.high + span) {
      scale.take(bound);
    }
  }
  scale.pad(0.12);
  const bool beyond_left = v.lower<scale.low, beyond_right = v.upper> scale.high;
  const double x0 = scale(std::clamp(v.lower, scale.low, scale.high));
  const double x1 = scale(std::clamp(v.upper, scale.low, scale.high));
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" "
      "aria-label=\"intervals of {2}\"><line class=\"axis\" x1=\"{3}\" x2=\"{4}\" y1=\"{5}\" "
      "y2=\"{5}\"/>",
      width, height, escape(v.name), left, right, middle);
  if (v.has_set) {
    const bool open = v.lower_is_prior || v.upper_is_prior;
    out += fmt::format("<rect class=\"bar{}\" x=\"{:.1f}\" y=\"{}\" width=\"{:.1f}\" height=\"14\"/>",
                       open ? " open" : "", x0, middle - 7.0, std::max(x1 - x0, 1.0));
    out += beyond_left ? arrow(left - 6.0, middle, -1.0) : "";
    out += beyond_right ? arrow(right + 6.0, middle, 1.0) : "";
  }
  if (v.nominal) {
    out += fmt::format("<line class=\"nominal\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"1\" y2=\"{1}\"/>", scale(*v.nominal),
                       middle + 13.0);
  }
  if (v.estimate) {
    const double s = v.spread.value_or(0.0);
    out += fmt::format("<path class=\"whisker\" d=\"M{0:.1f} {2}v6M{1:.1f} {2}v6M{0:.1f} {3}H{1:.1f}\"/>",
                       scale(*v.estimate - s), scale(*v.estimate + s), middle - 3.0, middle);
    out += fmt::format("<circle class=\"point\" cx=\"{:.1f}\" cy=\"{}\" r=\"2.6\"/>", scale(*v.estimate), middle);
  }
  if (v.has_set && !(v.lower_is_prior && v.upper_is_prior) && v.centre >= scale.low && v.centre <= scale.high) {
    out += fmt::format("<circle class=\"centre\" cx=\"{:.1f}\" cy=\"{}\" r=\"4.2\"/>", scale(v.centre), middle);
  }
  return out + "</svg>";
}

std::string filter_curve(const commission::FilterChoice& choice) {
  std::vector<std::pair<double, double>> points;  // log10 β, log10 criterion
  for (const commission::FilterCandidate& c : choice.curve) {
    if (c.design.beta > 0.0 && c.criterion > 0.0 && std::isfinite(c.criterion) && std::isfinite(c.design.beta)) {
      points.emplace_back(std::log10(c.design.beta), std::log10(c.criterion));
    }
  }
  if (points.size() < 2) {
    return {};
  }
  std::sort(points.begin(), points.end());
  constexpr double width = 520.0, height = 230.0;
  Axis x{62.0, width - 14.0}, y{height - 40.0, 14.0};
  for (const auto& [b, c] : points) {
    x.take(b);
    y.take(c);
  }
  x.pad(0.05);
  y.pad(0.1);
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" "
      "aria-label=\"residual over torque for each candidate filter\">",
      width, height);
  // Decades, with 2 and 5 between them.
  for (const double m : {1.0, 2.0, 5.0}) {
    for (int e = -9; e <= 9; ++e) {
      const double at = std::log10(m) + e;
      const std::string label = number(m * std::pow(10.0, e), 1);
      if (at > x.low && at < x.high) {
        out += fmt::format(
            "<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"14\" y2=\"{1}\"/><text x=\"{0:.1f}\" "
            "y=\"{2}\" text-anchor=\"middle\">{3}</text>",
            x(at), height - 40.0, height - 25.0, label);
      }
      if (at > y.low && at < y.high) {
        out += fmt::format(
            "<line class=\"axis\" x1=\"62\" x2=\"{1}\" y1=\"{0:.1f}\" y2=\"{0:.1f}\"/><text x=\"57\" "
            "y=\"{2:.1f}\" text-anchor=\"end\">{3}</text>",
            y(at), width - 14.0, y(at) + 4.0, label);
      }
    }
  }
  out += "<polyline class=\"curve\" points=\"";
  for (const auto& [b, c] : points) {
    out += fmt::format("{:.1f},{:.1f} ", x(b), y(c));
  }
  out += "\"/>";
  for (const auto& [b, c] : points) {
    const bool chosen = std::abs(b - std::log10(choice.design.beta)) < 1e-9;
    out += fmt::format("<circle class=\"dot{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\"/>", chosen ? " chosen" : "", x(b),
                       y(c), chosen ? 5 : 3);
    if (chosen) {
      out += fmt::format("<text class=\"ink\" x=\"{:.1f}\" y=\"{:.1f}\">chosen</text>", x(b) + 8.0, y(c) + 13.0);
    }
  }
  out += fmt::format("<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\">β, 1/s</text>", 0.5 * (62.0 + width),
                     height - 8.0);
  out += fmt::format(
      "<text x=\"14\" y=\"{0}\" transform=\"rotate(-90 14 {0})\" text-anchor=\"middle\">residual rms / "
      "torque rms</text></svg>",
      0.5 * (height - 26.0));
  return out;
}

std::string driven_path(const LogTable& signals) {
  const std::vector<double>*x = signals.find("x"), *y = signals.find("y");
  if (x == nullptr || y == nullptr) {
    return {};
  }
  Range across, up;
  for (std::size_t i = 0; i < x->size(); ++i) {
    across.take((*x)[i]);
    up.take((*y)[i]);
  }
  const double span = std::max(across.high - across.low, up.high - up.low);
  if (!(span > 0.0) || !std::isfinite(span)) {
    return {};
  }
  constexpr double longest = 340.0, margin = 8.0;
  const double unit = longest / span;
  const double width = (across.high - across.low) * unit + 2.0 * margin;
  const double height = (up.high - up.low) * unit + 2.0 * margin;
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" "
      "aria-label=\"driven path\"><path class=\"path\" d=\"",
      width, height);
  const std::size_t step = std::max<std::size_t>(1, x->size() / 1500);
  std::string start;
  bool pen = false;
  std::size_t next_segment = 0;
  for (std::size_t i = 0; i < x->size(); i += step) {
    while (next_segment < signals.segment_starts.size() && signals.segment_starts[next_segment] <= i) {
      pen = false;
      ++next_segment;
    }
    if (!std::isfinite((*x)[i]) || !std::isfinite((*y)[i])) {
      pen = false;
      continue;
    }
    const double right = margin + ((*x)[i] - across.low) * unit, down = margin + (up.high - (*y)[i]) * unit;
    fmt::format_to(std::back_inserter(out), "{}{:.1f} {:.1f}", pen ? 'L' : 'M', right, down);
    if (start.empty()) {
      start = fmt::format("<circle class=\"dot\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", right, down);
    }
    pen = true;
  }
  return out + "\"/>" + start + "</svg>";
}

namespace {

constexpr std::size_t kDirections = 90;
constexpr std::size_t kMostPairs = 10;
constexpr double kSize = 190.0, kLeft = 66.0, kTop = 10.0, kBottom = 40.0;

// A quantity along an axis of the drawing: its interval fills it.
struct Side {
  const ParameterView* view;
  Interval theta;

  [[nodiscard]] double share(double value, double low, double high) const { return (value - low) / (high - low); }
  [[nodiscard]] double of_theta(double value) const { return share(value, theta.lower, theta.upper); }
  [[nodiscard]] double of_view(double value) const { return share(value, view->lower, view->upper); }
};

std::string outline(const Polytope& set, std::size_t i, std::size_t j, const Side& across, const Side& up) {
  std::string points;
  std::vector<double> a(set.dimension(), 0.0), most(set.dimension());
  for (std::size_t k = 0; k < kDirections; ++k) {
    const double angle = 2.0 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(kDirections);
    a[i] = std::cos(angle) / across.theta.width();
    a[j] = std::sin(angle) / up.theta.width();
    static_cast<void>(set.support(a, most));
    fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", kLeft + kSize * across.of_theta(most[i]),
                   kTop + kSize * (1.0 - up.of_theta(most[j])));
  }
  return points;
}

std::string projection(const Polytope& set, std::size_t i, std::size_t j, const Side& across, const Side& up) {
  const std::string x_name = spaced(across.view->name), y_name = spaced(up.view->name);
  std::string out = fmt::format(
      "<div><h3>{3} and {4}</h3><svg viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" role=\"img\" "
      "aria-label=\"feasible set: {3} and {4}\"><rect x=\"{5}\" y=\"{6}\" width=\"{2}\" height=\"{2}\" "
      "class=\"axis open\" fill=\"none\"/><polygon class=\"bar\" points=\"{7}\"/>",
      kLeft + kSize + 14.0, kTop + kSize + kBottom, kSize, escape(x_name), escape(y_name), kLeft, kTop,
      outline(set, i, j, across, up));
  const auto place = [&](const char* element, double x, double y) {
    if (x > -0.02 && x < 1.02 && y > -0.02 && y < 1.02) {
      out += fmt::format(fmt::runtime(element), kLeft + kSize * x, kTop + kSize * (1.0 - y));
    }
  };
  place("<circle class=\"centre\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"5\"/>", across.of_view(across.view->centre),
        up.of_view(up.view->centre));
  if (across.view->estimate && up.view->estimate) {
    place("<circle class=\"point\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\"/>", across.of_view(*across.view->estimate),
          up.of_view(*up.view->estimate));
  }
  const auto [left, right] = outward(across.view->lower, across.view->upper);
  const auto [low, high] = outward(up.view->lower, up.view->upper);
  const double foot = kTop + kSize + 14.0;
  out += fmt::format(
      "<text x=\"{0}\" y=\"{2}\">{3}</text><text x=\"{1}\" y=\"{2}\" text-anchor=\"end\">{4}</text>"
      "<text class=\"ink\" x=\"{5}\" y=\"{6}\" text-anchor=\"middle\">{7}</text>",
      kLeft, kLeft + kSize, foot, left, right, kLeft + 0.5 * kSize, foot + 16.0,
      escape(with_unit(x_name + ",", across.view->unit)));
  out += fmt::format(
      "<text x=\"{0}\" y=\"{1}\" text-anchor=\"end\">{2}</text><text x=\"{0}\" y=\"{3}\" text-anchor=\"end\">{4}</text>"
      "<text class=\"ink\" x=\"12\" y=\"{5}\" text-anchor=\"middle\" transform=\"rotate(-90 12 {5})\">{6}</text>",
      kLeft - 5.0, kTop + 9.0, high, kTop + kSize, low, kTop + 0.5 * kSize,
      escape(with_unit(y_name + ",", up.view->unit)));
  return out + "</svg></div>";
}

}  // namespace

std::string set_projections(const Commissioning& result) {
  if (!result.feasible.polytope) {
    return {};
  }
  const Polytope& set = *result.feasible.polytope;
  const std::vector<ParameterViews> views = parameter_views(result);
  std::string out;
  std::size_t pairs = 0;
  for (const Polytope::Block& block : set.blocks()) {
    for (std::size_t b = 1; b < block.parameters.size(); ++b) {
      for (std::size_t a = 0; a < b && pairs < kMostPairs; ++a) {
        const std::size_t i = block.parameters[a], j = block.parameters[b];
        const Side across{&views.at(i).best(), set.hull().sides[i]}, up{&views.at(j).best(), set.hull().sides[j]};
        const auto drawable = [](const Side& side) {
          return side.theta.width() > 0.0 && std::isfinite(side.theta.width()) && side.view->upper > side.view->lower;
        };
        if (drawable(across) && drawable(up)) {
          out += projection(set, i, j, across, up);
          ++pairs;
        }
      }
    }
  }
  return out.empty()
             ? out
             : "<div class=\"pairs\">" + out + "</div>" +
                   paragraph(
                       "<span class=\"note\">What of the dashed box is possible: a point inside is a pair of values "
                       "that no sample of the log excludes together with some values of the others. Black dot: "
                       "estimate; ring: Chebyshev centre. Pairs that are not drawn do not limit each other.</span>");
}

}  // namespace wheelwright::report
