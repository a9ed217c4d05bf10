// SPDX-License-Identifier: Apache-2.0
#include "results/report/outlook.hpp"

#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "bounds/kernels.hpp"
#include "core/words.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using namespace words;

namespace {

constexpr std::array kTimes = {0.5, 1.0, 5.0, 20.0};  // s, columns of the table
constexpr double kFrom = 0.1, kTo = 20.0;             // s, of the pictures

using Points = std::vector<std::pair<double, double>>;

// Log-log picture of one fault; empty where neither guarantee has a size.
std::string outlook_picture(const DetectionCurve& curve, bool with_risk) {
  Range sizes;
  for (const Points* points : {&curve.every_noise, &curve.at_risk}) {
    for (const auto& [delay, size] : *points) {
      sizes.take(size);
    }
  }
  if (!(sizes.low <= sizes.high)) {
    return {};
  }
  constexpr double width = 330.0, height = 210.0, left = 46.0, right = 12.0, top = 10.0, bottom = 36.0;
  const double scale = curve.fault.unit == "1" ? 100.0 : 1.0;
  const double low = scale * sizes.low / 1.25, high = scale * sizes.high * 1.25;
  const Axis x{{kFrom, kTo}, left, width - right, true}, y{{low, high}, height - bottom, top, true};
  std::string out = open_svg(width, height, "smallest certain size over the time to detection");
  for (const double tick : logarithmic_ticks(kFrom, kTo, true)) {
    out += fmt::format("<line class=\"axis\" x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\"/>", x(tick), top,
                       height - bottom) +
           svg_text(x(tick), height - bottom + 14.0, "middle", fmt::format("{:g}", tick));
  }
  for (const double tick : logarithmic_ticks(low, high, true)) {
    out += fmt::format("<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/>", left,
                       width - right, y(tick)) +
           svg_text(left - 5.0, y(tick) + 4.0, "end", fmt::format("{:g}", tick));
  }
  out += svg_text(0.5 * (left + width - right), height - 6.0, "middle", "time to detection, s");
  const auto line = [&](const Points& points, const char* style) {
    std::string d;
    for (const auto& [delay, size] : points) {
      if (delay >= kFrom * (1.0 - 1e-9) && delay <= kTo * (1.0 + 1e-9)) {
        d += fmt::format("{}{:.1f} {:.1f}", d.empty() ? "M" : "L", x(delay), y(scale * size));
        out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.2\" style=\"fill:{}\"/>", x(delay),
                           y(scale * size), style);
      }
    }
    return d;
  };
  const auto draw = [&](const Points& points, const char* colour, const char* dashes) {
    const std::string d = line(points, colour);
    if (!d.empty()) {
      out += fmt::format("<path d=\"{}\" style=\"fill:none;stroke:{};stroke-width:2;stroke-dasharray:{}\"/>", d, colour,
                         dashes);
    }
  };
  draw(curve.every_noise, "var(--first)", "none");
  draw(curve.at_risk, "var(--second)", "6 3");
  double at = top + 12.0;
  const auto key = [&](const char* colour, const char* dashes, const char* what) {
    out += fmt::format(
        "<line x1=\"{0}\" x2=\"{1}\" y1=\"{2}\" y2=\"{2}\" style=\"stroke:{3};stroke-width:2;stroke-dasharray:{4}\"/>",
        width - right - 128.0, width - right - 102.0, at, colour, dashes);
    out += svg_text(width - right - 97.0, at + 4.0, "start", what, true);
    at += 15.0;
  };
  key("var(--first)", "none", "every noise");
  if (with_risk) {
    key("var(--second)", "6 3", "at the stated risk");
  }
  return out + "</svg>";
}

}  // namespace

std::string outlook(const commission::MarginSurvey& survey, const OnlineModel& model) {
  const std::vector<DetectionCurve> curves = detection_curves(survey, commission::telling_faults(model));
  std::string pictures;
  std::vector<std::vector<Cell>> rows;
  for (const DetectionCurve& curve : curves) {
    const std::string picture = outlook_picture(curve, survey.at_risk.has_value());
    if (picture.empty()) {
      continue;
    }
    const std::string name = core::capital(spaced(curve.fault.name));
    const std::string unit = curve.fault.unit == "1" ? "%" : curve.fault.unit;
    pictures += "<div><h3>" + escape(name + ", " + unit) + "</h3>" + picture + "</div>";
    const auto row = [&](const char* guarantee, const Points& points) {
      std::vector<Cell> cells = {escape(name) + "<small>" + guarantee + "</small>"};
      for (const double within : kTimes) {
        cells.push_back(numeric(escape(magnitude_words(curve.fault, DetectionCurve::size_within(points, within)))));
      }
      rows.push_back(std::move(cells));
    };
    row("every noise", curve.every_noise);
    if (survey.at_risk) {
      row("at the stated risk", curve.at_risk);
    }
  }
  if (pictures.empty()) {
    return {};
  }
  std::vector<Cell> header = {"Seen for certain within"};
  for (const double within : kTimes) {
    header.push_back(numeric(with_unit(fmt::format("{:g}", within), "s")));
  }
  const auto [every_noise, at_risk] = how_sure(survey);
  return "<h3>What this detector will see, how soon, how sure</h3>\n<div class=\"pairs\">" + pictures + "</div>\n" +
         paragraph(escape(every_noise)) + paragraph(escape(at_risk)) + table(header, rows) +
         note(
             "Smallest size that is certain to raise an alarm so long after it set in, at half of the moments of such "
             "a "
             "drive. <code>wheelwright margins</code> says it for every fault, and while doing what.");
}

}  // namespace wheelwright::report
