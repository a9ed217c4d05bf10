// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/fleet_drawings.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

constexpr double kWidth = 860.0, kHeight = 240.0, kLeft = 74.0, kRight = 10.0, kTop = 10.0, kBottom = 30.0;
constexpr std::size_t kColumns = 400;

struct Axis {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void take(double x) {
    if (std::isfinite(x)) {
      low = std::min(low, x);
      high = std::max(high, x);
    }
  }
  void pad(double share) {
    const double more = high > low ? share * (high - low) : std::max(1e-9, 0.1 * std::abs(high));
    low -= more;
    high += more;
  }
  // Height of a value; what lies beyond is put at the edge.
  [[nodiscard]] double y(double x) const {
    const double share = (std::clamp(x, low, high) - low) / (high - low);
    return kHeight - kBottom - share * (kHeight - kBottom - kTop);
  }
};

std::string frame(const Axis& axis, const std::string& label, const std::string& unit, const std::string& below) {
  std::string out =
      fmt::format("<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"{2}\">", kWidth,
                  kHeight, escape(label));
  for (int k = 0; k <= 4; ++k) {
    const double x = axis.low + 0.25 * k * (axis.high - axis.low);
    out += fmt::format(
        "<line class=\"axis\" x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\"/><text x=\"{}\" y=\"{:.1f}\" "
        "text-anchor=\"end\">{}</text>",
        kLeft, kWidth - kRight, axis.y(x), axis.y(x), kLeft - 5.0, axis.y(x) + 4.0, escape(number(x)));
  }
  return out + fmt::format(
                   "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text><text x=\"12\" y=\"{:.0f}\" "
                   "transform=\"rotate(-90 12 {:.0f})\" text-anchor=\"middle\">{}</text>",
                   0.5 * (kLeft + kWidth), kHeight - 8.0, escape(below), 0.5 * kHeight, 0.5 * kHeight, escape(unit));
}

// Robots of one column of the drawing.
struct Bin {
  Axis bounds, estimates;
};

}  // namespace

std::string fleet_strip(const FleetResult& fleet, std::size_t parameter) {
  const ParameterPopulation& population = fleet.population.parameters.at(parameter);
  const FleetColumn& column = fleet.table.columns[population.column];
  std::vector<const FleetEntry*> shown;
  for (const FleetEntry& e : column.entries) {
    if (std::isfinite(e.estimate)) {
      shown.push_back(&e);
    }
  }
  if (shown.empty()) {
    return {};
  }
  std::stable_sort(shown.begin(), shown.end(), [](const auto* a, const auto* b) { return a->estimate < b->estimate; });
  std::set<std::size_t> outside;
  for (const RobotOutside& o : fleet.population.outside) {
    if (o.column == population.column) {
      outside.insert(o.robot);
    }
  }
  Axis axis;
  std::vector<double> lower, upper;
  for (const FleetEntry* e : shown) {
    axis.take(e->estimate);
    lower.push_back(e->lower);
    upper.push_back(e->upper);
  }
  // Most robots' bounds; those of a robot whose log shows next to nothing would flatten the rest.
  const std::size_t tenth = shown.size() / 10;
  std::sort(lower.begin(), lower.end());
  std::sort(upper.begin(), upper.end());
  axis.take(lower[tenth]);
  axis.take(upper[shown.size() - 1 - tenth]);
  axis.pad(0.08);
  std::string out = frame(axis, "bounds of " + words(column.name) + " of all robots", column.unit,
                          fmt::format("{}, sorted by estimate", plural(shown.size(), "robot")));
  if (population.described) {
    const double two = 2.0 * population.fit.spread;
    const double y0 = axis.y(population.fit.centre + two), y1 = axis.y(population.fit.centre - two);
    out += fmt::format(
        "<rect x=\"{}\" width=\"{}\" y=\"{:.1f}\" height=\"{:.1f}\" style=\"fill:var(--pale)\"/><line x1=\"{}\" "
        "x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" style=\"stroke:var(--second);stroke-dasharray:6 4\"/>",
        kLeft, kWidth - kLeft - kRight, y0, std::max(y1 - y0, 0.5), kLeft, kWidth - kRight,
        axis.y(population.fit.centre), axis.y(population.fit.centre));
  }
  const std::size_t bins = std::min(shown.size(), kColumns);
  const double step = (kWidth - kLeft - kRight) / static_cast<double>(bins);
  std::string bars, dots, marks;
  std::vector<Bin> content(bins);
  const auto x_of = [&](std::size_t bin) { return kLeft + (static_cast<double>(bin) + 0.5) * step; };
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const std::size_t at = i * bins / shown.size();
    Bin& bin = content[at];
    bin.bounds.take(shown[i]->lower);
    bin.bounds.take(shown[i]->upper);
    bin.estimates.take(shown[i]->estimate);
    if (outside.contains(shown[i]->robot)) {
      marks += fmt::format(
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" style=\"fill:none;stroke:var(--bad);stroke-width:2\">"
          "<title>{}</title></circle>",
          x_of(at), axis.y(shown[i]->estimate), escape(fleet.table.robots[shown[i]->robot]));
    }
  }
  for (std::size_t b = 0; b < bins; ++b) {
    bars +=
        fmt::format("M{:.1f} {:.1f}V{:.1f}", x_of(b), axis.y(content[b].bounds.low), axis.y(content[b].bounds.high));
    const double y = axis.y(content[b].estimates.low), to = axis.y(content[b].estimates.high);
    dots += fmt::format("M{:.1f} {:.1f}V{:.1f}", x_of(b), y + 1.0, to - 1.0);
  }
  const double thick = std::clamp(0.7 * step, 0.8, 6.0);
  return out +
         fmt::format(
             "<path d=\"{}\" style=\"stroke:var(--first);stroke-opacity:.45;stroke-width:{:.1f}\"/><path d=\"{}\" "
             "style=\"stroke:var(--ink);stroke-width:{:.1f}\"/>{}</svg>",
             bars, thick, dots, thick, marks);
}

std::string slope_strip(const FleetResult& fleet, std::size_t column, std::size_t most) {
  std::vector<const ParameterDrift*> shown;
  for (const ParameterDrift& d : fleet.drift) {
    if (d.column == column && d.has_trend && shown.size() < most) {
      shown.push_back(&d);
    }
  }
  if (shown.empty()) {
    return {};
  }
  Axis axis;
  axis.take(0.0);
  for (const ParameterDrift* d : shown) {
    axis.take(d->slope - 2.0 * d->slope_error);
    axis.take(d->slope + 2.0 * d->slope_error);
  }
  axis.pad(0.05);
  const FleetColumn& of = fleet.table.columns[column];
  std::string out =
      frame(axis, "slopes of " + words(of.name), of.unit + (shown.front()->dated ? " per week" : " per log"),
            fmt::format("{}, worst first", plural(shown.size(), "robot")));
  const double step = (kWidth - kLeft - kRight) / static_cast<double>(shown.size());
  out += fmt::format("<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" style=\"stroke:var(--ink)\"/>", kLeft,
                     kWidth - kRight, axis.y(0.0), axis.y(0.0));
  for (std::size_t k = 0; k < shown.size(); ++k) {
    const ParameterDrift& d = *shown[k];
    const double x = kLeft + (static_cast<double>(k) + 0.5) * step;
    out += fmt::format(
        "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" style=\"stroke:var(--first);stroke-width:{3:.1f}\"/><circle "
        "cx=\"{0:.1f}\" "
        "cy=\"{4:.1f}\" r=\"3\" style=\"fill:var({5})\"><title>{6}</title></circle>",
        x, axis.y(d.lower), axis.y(d.upper), std::clamp(0.4 * step, 1.0, 5.0), axis.y(d.slope),
        d.drifts(fleet.drift_level) ? "--bad" : "--ink", escape(fleet.table.robots[d.robot]));
  }
  return out + "</svg>";
}

}  // namespace wheelwright::report
