// SPDX-License-Identifier: Apache-2.0
#include "bounds/support_walk.hpp"
#include "results/report/gap_report.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "gap/where.hpp"
#include "results/report/drawing.hpp"
#include "results/words/gap_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {
using namespace words;
namespace {

std::string line(double x1, double y1, double x2, double y2, const std::string& style) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>", x1, y1, x2, y2, style);
}

std::string rectangle(double x, double y, double width, double height, const std::string& style) {
  return fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" {}/>", x, y, width, height,
                     style);
}

struct Look {
  const char* colour;
  const char* dash;
  double width;
};
// before, re-fitted, after, floor: as in the charts over time
constexpr std::array<Look, 4> kLooks = {
    {{"--second", "7 3", 1.6}, {"--third", "2 2", 2.2}, {"--first", "none", 1.6}, {"--ink", "none", 0.8}}};
constexpr std::array kStages = {"before", "θ fitted again", "after", "noise floor"};

std::string stroke(const Look& look) {
  return fmt::format("style=\"fill:none;stroke:var({});stroke-width:{};stroke-dasharray:{}\"", look.colour, look.width,
                     look.dash);
}

const char* figure_words(const std::string& name) {
  static const std::map<std::string, const char*> all = {
      {"velocity_1s", "speed after 1 s"},    {"velocity_5s", "speed after 5 s"},
      {"yaw_rate_1s", "yaw rate after 1 s"}, {"yaw_rate_5s", "yaw rate after 5 s"},
      {"position_1s", "position after 1 s"}, {"position_5s", "position after 5 s"},
      {"heading_1s", "heading after 1 s"},   {"heading_5s", "heading after 5 s"}};
  const auto found = all.find(name);
  return found == all.end() ? nullptr : found->second;
}

}  // namespace

std::string shrink_bars(const std::vector<gap::ShrinkFigure>& figures) {
  if (figures.empty()) {
    return {};
  }
  constexpr double left = 130.0, longest = 170.0, height = 11.0, group = 50.0, width = left + longest + 240.0;
  std::string out = open_svg(width, group * static_cast<double>(figures.size()) + 6.0, "before, after and floor");
  double y = 8.0;
  for (const gap::ShrinkFigure& f : figures) {
    const double largest = std::max({std::isfinite(f.before) ? f.before : 0.0, std::isfinite(f.after) ? f.after : 0.0,
                                     std::isfinite(f.upper) ? f.upper : 0.0, f.floor, 1e-300});
    const char* known = figure_words(f.name);
    out += svg_text(left - 10.0, y + 18.0, "end", known != nullptr ? known : spaced(f.name), true);
    const auto size = [&](double value) { return f.unit == "1" ? percent(value) : with_unit(number(value), f.unit); };
    const auto bar = [&](double value, const char* name, const char* style, const std::string& note) {
      if (!std::isfinite(value)) {
        out += svg_text(left + 4.0, y + 9.5, "start", fmt::format("{}: none", name));
      } else {
        const double length = longest * std::max(0.0, value) / largest;
        out += rectangle(left, y, std::max(length, 0.8), height, style);
        out += svg_text(left + longest + 12.0, y + 9.5, "start", fmt::format("{} {}{}", name, size(value), note));
      }
    };
    bar(f.before, "before", "class=\"bar\" style=\"stroke-dasharray:3 2\"", "");
    y += height + 2.0;
    const bool interval = std::isfinite(f.lower) && std::isfinite(f.upper) && f.upper > f.lower;
    bar(f.after, "after", "class=\"full\"",
        interval ? fmt::format(" [{}, {}]", f.unit == "1" ? percent(f.lower) : number(f.lower),
                               f.unit == "1" ? percent(f.upper) : number(f.upper))
                 : std::string());
    if (interval) {
      const double a = left + longest * std::max(0.0, f.lower) / largest, b = left + longest * f.upper / largest;
      out += fmt::format("<path class=\"whisker\" d=\"M{0:.1f} {2:.1f}v6M{1:.1f} {2:.1f}v6M{0:.1f} {3:.1f}H{1:.1f}\"/>",
                         a, b, y + 2.5, y + 5.5);
    }
    y += height + 2.0;
    if (f.floor > 0.0) {
      bar(f.floor, "floor", "style=\"fill:var(--tolerance);stroke:var(--bound)\"", "");
    }
    y += group - 2.0 * (height + 2.0);
  }
  return out + "</svg>";
}

std::string step_bars(const Diagnosis& d) {
  const std::vector<GapStep> steps = gap_steps(d);
  if (steps.empty()) {
    return {};
  }
  std::size_t longest_name = 0;
  for (const GapStep& step : steps) {
    longest_name = std::max(longest_name, step.name.size());
  }
  const double left = std::clamp(5.8 * static_cast<double>(longest_name) + 12.0, 110.0, 280.0), longest = 300.0,
               row = 20.0;
  std::string out = open_svg(left + longest + 60.0, row * static_cast<double>(steps.size()) + 8.0,
                             "the gap before, what each cause takes off it, and after");
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const GapStep& step = steps[k];
    const double y = 4.0 + row * static_cast<double>(k);
    out += svg_text(left - 8.0, y + 11.5, "end", step.name, true);
    out += rectangle(left + longest * step.from, y, std::max(0.8, longest * (step.to - step.from)), 14.0,
                     k == 0 ? "class=\"bar open\"" : "class=\"full\"");
    out += svg_text(left + longest + 12.0, y + 11.5, "start", fmt::format("{:.0f} %", 100.0 * (step.to - step.from)),
                    true);
  }
  return out + "</svg>";
}

std::string share_bars(const std::vector<gap::GapShare>& shares, std::size_t most) {
  const std::size_t n = std::min(most, shares.size());
  if (n == 0) {
    return {};
  }
  std::size_t longest_name = 0;
  for (std::size_t k = 0; k < n; ++k) {
    longest_name = std::max(longest_name, shares[k].regime.size());
  }
  const double left = std::clamp(5.8 * static_cast<double>(longest_name) + 12.0, 110.0, 240.0), longest = 150.0,
               row = 20.0;
  std::string out =
      open_svg(left + longest + 145.0, row * static_cast<double>(n) + 8.0, "share of the structural part");
  for (std::size_t k = 0; k < n; ++k) {
    const gap::GapShare& s = shares[k];
    const double y = 4.0 + row * static_cast<double>(k);
    const bool finding = gap::is_finding(s);
    out += svg_text(left - 8.0, y + 11.5, "end", s.regime, finding);
    out +=
        rectangle(left, y, std::max(0.8, longest * s.share), 14.0, finding ? "class=\"full\"" : "class=\"bar open\"");
    const bool part = s.kind != "channel";
    if (part) {
      out += line(left + longest * s.presence, y - 2.0, left + longest * s.presence, y + 16.0, "class=\"whisker\"");
    }
    out += svg_text(
        left + longest + 12.0, y + 11.5, "start",
        fmt::format("{:.0f} %{}, p {}", 100.0 * s.share, part ? fmt::format(" in {:.0f} %", 100.0 * s.presence) : "",
                    s.p_value < 0.001 ? "< 0.001" : "= " + decimal(s.p_value, 3)),
        finding);
  }
  return out + line(left, 0.0, left, row * static_cast<double>(n) + 6.0, "class=\"axis\"") + "</svg>";
}

std::string spectrum_drawing(const gap::ResidualSeries& series, double beta) {
  std::array<gap::Spectrum, 4> lines;
  const std::array<const Eigen::VectorXd*, 3> values = {&series.nominal, &series.refitted, &series.after};
  double low = 1e300, high = 0.0, first = 0.0, last = 0.0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k]->size() == series.t.size()) {
      lines[k] = gap::spectrum(series.t, *values[k]);
    }
  }
  const gap::Spectrum& one = lines[1].frequency.size() > 0 ? lines[1] : lines[0];
  if (one.frequency.size() < 4) {
    return {};
  }
  first = one.frequency[0];
  last = one.frequency[one.frequency.size() - 1];
  if (series.space == gap::GapSpace::dynamic && series.floor > 0.0 && beta > 0.0) {
    lines[3].frequency = one.frequency;
    lines[3].density =
        one.frequency.unaryExpr([&](double f) { return gap::filtered_noise_density(beta, series.floor, f); });
  }
  for (const gap::Spectrum& s : lines) {
    for (const double d : s.density) {
      if (d > 0.0) {
        low = std::min(low, d);
        high = std::max(high, d);
      }
    }
  }
  if (!(high > 0.0)) {
    return {};
  }
  low = std::max(low, high * 1e-9);
  constexpr double width = 525.0, height = 270.0, left = 78.0, right = 130.0, top = 10.0, bottom = 42.0;
  const Axis x{{first, last}, left, width - right, true}, y{{low / 1.5, high * 1.5}, height - bottom, top, true};
  std::string out = open_svg(width, height, "spectrum before, re-fitted, after, and of the floor");
  for (const double tick : x.ticks()) {
    out += line(x(tick), top, x(tick), height - bottom, "class=\"axis\"") +
           svg_text(x(tick), height - bottom + 14.0, "middle", fmt::format("{:g}", tick));
  }
  for (const double tick : y.ticks()) {
    out += line(left, y(tick), width - right, y(tick), "class=\"axis\"") +
           svg_text(left - 6.0, y(tick) + 4.0, "end", number(tick, 1));
  }
  double at = top + 12.0;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const gap::Spectrum& s = lines[k];
    if (s.frequency.size() == 0) {
      continue;
    }
    // Bins are averaged to at most 24 in a decade, so that the line is one.
    std::string d;
    for (Eigen::Index b = 0; b < s.frequency.size();) {
      Eigen::Index end = b + 1;
      while (end < s.frequency.size() && s.frequency[end] < s.frequency[b] * 1.1) {
        ++end;
      }
      fmt::format_to(std::back_inserter(d), "{}{:.1f} {:.1f}", d.empty() ? "M" : "L",
                     x.inside(s.frequency.segment(b, end - b).mean()),
                     y.inside(std::max(s.density.segment(b, end - b).mean(), low)));
      b = end;
    }
    out += fmt::format("<path d=\"{}\" {}/>", d, stroke(kLooks[k]));
    out += line(width - right + 10.0, at, width - right + 38.0, at, stroke(kLooks[k]));
    out += svg_text(width - right + 44.0, at + 4.0, "start", kStages[k], true);
    at += 18.0;
  }
  out += svg_text(0.5 * (left + width - right), height - 6.0, "middle", "frequency, Hz");
  out += fmt::format(
      "<text x=\"14\" y=\"{0:.0f}\" transform=\"rotate(-90 14 {0:.0f})\" text-anchor=\"middle\">density, "
      "({1})²/Hz</text>",
      0.5 * (top + height - bottom), escape(series.unit));
  return out + "</svg>";
}

std::string position_map(const gap::ResidualSeries& series, const LogTable& signals, double delay) {
  const std::vector<double>*xs = signals.find("x"), *ys = signals.find("y");
  if (xs == nullptr || ys == nullptr || signals.t.empty() || series.refitted.size() != series.t.size()) {
    return {};
  }
  struct Place {
    double x, y, square;
  };
  std::vector<Place> places;
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  for (Eigen::Index k = 0; k < series.t.size(); ++k) {
    const auto after = std::upper_bound(signals.t.begin(), signals.t.end(), series.t[k] - delay);
    const auto row = static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, after - signals.t.begin()) - 1);
    const double x = (*xs)[row], y = (*ys)[row];
    if (std::isfinite(x) && std::isfinite(y)) {
      places.push_back({x, y, series.refitted[k] * series.refitted[k]});
      x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
    }
  }
  const double span = std::max(x1 - x0, y1 - y0);
  if (places.size() < 64 || !(span > 0.0)) {
    return {};
  }
  constexpr int cells = 18;  // along the longer side
  constexpr double side = 320.0, left = 46.0, top = 8.0, size = side / cells;
  const double cell = span / cells * (1.0 + 1e-9);
  std::map<std::pair<int, int>, std::pair<double, std::size_t>> sums;
  for (const Place& p : places) {
    auto& [sum, count] = sums[{static_cast<int>((p.x - x0) / cell), static_cast<int>((p.y - y0) / cell)}];
    sum += p.square;
    ++count;
  }
  double high = 0.0, low = 1e300;
  for (const auto& [at, sum] : sums) {
    const double rms = std::sqrt(sum.first / static_cast<double>(sum.second));
    high = std::max(high, rms);
    low = std::min(low, rms);
  }
  const double width = size * std::ceil((x1 - x0) / cell), height = size * std::ceil((y1 - y0) / cell);
  std::string out = open_svg(left + std::max(width, 200.0) + 20.0, top + height + 56.0, "residual over the place");
  for (const auto& [at, sum] : sums) {
    const double rms = std::sqrt(sum.first / static_cast<double>(sum.second));
    const double shade = high > low ? (rms - low) / (high - low) : 0.0;
    out += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
        "style=\"fill:var(--first);fill-opacity:{:.2f}\"><title>x = {:.2f}, y = {:.2f} m: {} {}</title></rect>",
        left + size * at.first, top + height - size * (at.second + 1), size - 0.5, size - 0.5, 0.08 + 0.92 * shade,
        x0 + cell * (at.first + 0.5), y0 + cell * (at.second + 0.5), number(rms, 2), escape(series.unit));
  }
  out += svg_text(left, top + height + 14.0, "start", number(x0, 2)) +
         svg_text(left + width, top + height + 14.0, "end", number(x1, 2)) +
         svg_text(left + 0.5 * width, top + height + 14.0, "middle", "x, m") +
         svg_text(left - 5.0, top + height, "end", number(y0, 2)) +
         svg_text(left - 5.0, top + 10.0, "end", number(y1, 2)) +
         svg_text(left - 5.0, top + 0.5 * height, "end", "y, m") +
         svg_text(left, top + height + 36.0, "start",
                  fmt::format("dark {0} {2}, pale {1} {2}", number(high, 2), number(low, 2), series.unit));
  return out + "</svg>";
}

std::string confusability_matrix(const std::vector<gap::ConfusablePair>& pairs, std::size_t most) {
  std::vector<const gap::ConfusablePair*> sorted;
  for (const gap::ConfusablePair& pair : pairs) {
    sorted.push_back(&pair);
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto* a, const auto* b) { return a->similarity > b->similarity; });
  std::vector<std::string> names;
  const auto take = [&](const std::string& name) {
    if (names.size() < most && std::find(names.begin(), names.end(), name) == names.end()) {
      names.push_back(name);
    }
  };
  for (const gap::ConfusablePair* pair : sorted) {
    take(pair->first);
    take(pair->second);
  }
  if (names.size() < 2) {
    return {};
  }
  std::size_t longest = 0;
  for (const std::string& name : names) {
    longest = std::max(longest, name.size());
  }
  const double cell = 34.0, left = std::min(6.6 * static_cast<double>(longest) + 16.0, 260.0);
  const double side = cell * static_cast<double>(names.size() - 1);
  const double slant = 0.72 * left;  // room for the slanting names above
  std::string out = open_svg(left + side + slant + 10.0, slant + side + 12.0, "how far causes look alike on this log");
  const auto index = [&](const std::string& name) {
    return static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
  };
  std::map<std::pair<std::size_t, std::size_t>, const gap::ConfusablePair*> cells;
  for (const gap::ConfusablePair* pair : sorted) {
    const std::size_t a = index(pair->first), b = index(pair->second);
    if (a < names.size() && b < names.size() && a != b) {
      cells.emplace(std::make_pair(std::max(a, b), std::min(a, b)), pair);
    }
  }
  for (std::size_t row = 1; row < names.size(); ++row) {
    const double y = slant + cell * static_cast<double>(row - 1);
    out += svg_text(left - 8.0, y + 21.0, "end", spaced(names[row]), true);
    for (std::size_t column = 0; column < row; ++column) {
      const double x = left + cell * static_cast<double>(column);
      const auto found = cells.find({row, column});
      const double similarity = found == cells.end() ? 0.0 : std::clamp(found->second->similarity, 0.0, 1.0);
      const bool framed = found != cells.end() && found->second->inseparable;
      out += rectangle(x + 1.0, y + 1.0, cell - 2.0, cell - 2.0,
                       fmt::format("style=\"fill:var(--first);fill-opacity:{:.2f};stroke:var({});stroke-width:{}\"",
                                   0.06 + 0.54 * similarity, framed ? "--ink" : "--rule", framed ? 2 : 1));
      if (found != cells.end()) {
        out += svg_text(x + 0.5 * cell, y + 21.0, "middle", fmt::format("{:.0f}", 100.0 * similarity), true);
      }
    }
  }
  for (std::size_t column = 0; column + 1 < names.size(); ++column) {
    const double x = left + cell * (static_cast<double>(column) + 0.55),
                 y = slant + cell * static_cast<double>(column) - 6.0;
    out += fmt::format("<text class=\"ink\" transform=\"translate({:.1f} {:.1f}) rotate(-45)\">{}</text>", x, y,
                       escape(spaced(names[column])));
  }
  return out + "</svg>";
}

}  // namespace wheelwright::report
