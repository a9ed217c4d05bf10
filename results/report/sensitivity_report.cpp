// SPDX-License-Identifier: Apache-2.0
#include "results/report/sensitivity_report.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "core/check.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using namespace words;
namespace {

std::string upright(double y, const std::string& what) {
  return fmt::format(
      "<text x=\"14\" y=\"{0:.1f}\" transform=\"rotate(-90 14 {0:.1f})\" text-anchor=\"middle\">{1}</text>", y,
      escape(what));
}

std::string stroke(double x1, double y1, double x2, double y2, const char* style) {
  return fmt::format("<line {} x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>", style, x1, y1, x2, y2);
}

std::string bar(double from, double to, double y, double height, const char* style) {
  return fmt::format("<rect {} x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\"/>", style,
                     std::min(from, to), y, std::max(std::abs(to - from), 0.8), height);
}

std::string whisker(double from, double to, double y) {
  return fmt::format("<path class=\"whisker\" d=\"M{0:.1f} {2:.1f}v6M{1:.1f} {2:.1f}v6M{0:.1f} {3:.1f}H{1:.1f}\"/>",
                     from, to, y - 3.0, y);
}

std::string label_words(const AxisLabel& label) {
  return label.unit.empty() ? label.name : label.name + ", " + label.unit;
}

std::string across(const Axis& x, double top, double bottom) {
  std::string out;
  for (const double tick : x.ticks()) {
    out += stroke(x(tick), top, x(tick), bottom, "class=\"axis\"") +
           svg_text(x(tick), bottom + 14.0, "middle", fmt::format("{:.4g}", tick));
  }
  return out;
}

std::string up(const Axis& y, double left, double right) {
  std::string out;
  for (const double tick : y.ticks()) {
    out += stroke(left, y(tick), right, y(tick), "class=\"axis\"") +
           svg_text(left - 6.0, y(tick) + 4.0, "end", fmt::format("{:.4g}", tick));
  }
  return out;
}

// Room for names of inputs at the left; bytes stand for letters.
double room(const std::vector<std::string>& names) {
  std::size_t longest = 0;
  for (const std::string& name : names) {
    longest = std::max(longest, name.size());
  }
  return std::clamp(6.4 * static_cast<double>(longest) + 16.0, 90.0, 300.0);
}

void names_fit(const std::vector<std::string>& names, std::size_t inputs) {
  check::that(names.size() == inputs, fmt::format("{} names of inputs", names.size()),
              fmt::format("{}, one for each input", inputs));
}

}  // namespace

std::string tornado(const study::OneAtATime& study, const std::vector<std::string>& inputs, const AxisLabel& quantity,
                    std::size_t most) {
  names_fit(inputs, study.inputs.size());
  constexpr double row = 22.0, top = 6.0, span = 340.0;
  const double left = room(inputs);
  Axis x{left, left + span};
  const std::size_t n = std::min(most, study.order.size());
  for (std::size_t k = 0; k < n; ++k) {
    for (const double y : study.inputs[study.order[k]].values) {
      x.take(y);
    }
  }
  if (n == 0 || x.empty() || !std::isfinite(study.nominal)) {
    return {};
  }
  x.take(study.nominal);
  x.pad(0.05);
  const double bottom = top + row * static_cast<double>(n);
  std::string out = open_svg(left + span + 20.0, bottom + 58.0, quantity.name + " at both ends of each input");
  out += across(x, top, bottom);
  for (std::size_t k = 0; k < n; ++k) {
    const study::InputCurve& curve = study.inputs[study.order[k]];
    const double y = top + row * static_cast<double>(k) + 4.0, middle = y + 7.0;
    out += svg_text(left - 8.0, y + 11.5, "end", inputs[study.order[k]], true);
    double least = study.nominal, greatest = study.nominal;
    for (const double value : curve.values) {
      least = std::fmin(least, value);
      greatest = std::fmax(greatest, value);
    }
    const bool same_side = (curve.low - study.nominal) * (curve.high - study.nominal) > 0.0;
    if (std::isfinite(curve.high)) {
      out += bar(x(study.nominal), x(curve.high), y, same_side ? 7.0 : 14.0, "class=\"full\"");
    }
    if (std::isfinite(curve.low)) {
      out += bar(x(study.nominal), x(curve.low), same_side ? middle : y, same_side ? 7.0 : 14.0, "class=\"bar\"");
    }
    if (least < std::fmin(study.nominal, std::fmin(curve.low, curve.high)) ||
        greatest > std::fmax(study.nominal, std::fmax(curve.low, curve.high))) {
      out += whisker(x(least), x(greatest), middle);
    }
    if (curve.missing > 0) {
      out += svg_text(left + span + 4.0, y + 11.5, "start", "*");
    }
  }
  out += stroke(x(study.nominal), top, x(study.nominal), bottom, "class=\"nominal\"");
  out += svg_text(left + 0.5 * span, bottom + 31.0, "middle", label_words(quantity));
  out += svg_text(left + 0.5 * span, bottom + 49.0, "middle",
                  "pale: input at its lower end, full: at its upper end; * gaps");
  return out + "</svg>";
}

std::string sensitivity_curve(const Eigen::VectorXd& x, const Eigen::VectorXd& y, double nominal_x, double nominal_y,
                              bool logarithmic, const AxisLabel& input, const AxisLabel& quantity) {
  check::that(x.size() == y.size(), fmt::format("{} values of a curve", y.size()),
              fmt::format("{}, one for each place", x.size()));
  check::that(!logarithmic || (x.array() > 0.0).all(), "places on a logarithmic axis", "numbers > 0");
  constexpr double width = 320.0, height = 210.0, left = 70.0, top = 10.0, bottom = height - 42.0, right = width - 14.0;
  Axis across_axis{left, right, logarithmic}, up_axis{bottom, top};
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    across_axis.take(x[k]);
    up_axis.take(y[k]);
  }
  if (up_axis.empty() || !(across_axis.low < across_axis.high)) {
    return {};
  }
  up_axis.take(nominal_y);
  up_axis.pad(0.05);
  std::string out = open_svg(width, height, quantity.name + " over " + input.name);
  out += across(across_axis, top, bottom) + up(up_axis, left, right);
  std::string path, dots;
  bool pen = false;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    if (!std::isfinite(y[k])) {
      pen = false;
      continue;
    }
    path += fmt::format("{}{:.1f} {:.1f}", pen ? 'L' : 'M', across_axis(x[k]), up_axis(y[k]));
    dots +=
        fmt::format("<circle class=\"dot\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.5\"/>", across_axis(x[k]), up_axis(y[k]));
    pen = true;
  }
  out += fmt::format("<path class=\"path\" d=\"{}\"/>{}", path, dots);
  if (std::isfinite(nominal_y) && nominal_x >= across_axis.low && nominal_x <= across_axis.high) {
    out += fmt::format("<circle class=\"centre\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4.5\"/>", across_axis(nominal_x),
                       up_axis(nominal_y));
  }
  out += svg_text(0.5 * (left + right), height - 6.0, "middle", label_words(input)) +
         upright(0.5 * (top + bottom), label_words(quantity));
  return out + "</svg>";
}

std::string sobol_bars(const study::SobolIndices& indices, const std::vector<std::string>& inputs, std::size_t most) {
  names_fit(inputs, indices.total.size());
  const std::size_t n = std::min(most, indices.total.size());
  if (indices.status != study::SobolStatus::estimated || n == 0) {
    return {};
  }
  std::vector<std::size_t> order(indices.total.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return indices.total[a].estimate > indices.total[b].estimate; });
  constexpr double row = 34.0, top = 6.0, span = 300.0;
  const double left = room(inputs), bottom = top + row * static_cast<double>(n);
  Axis x{left, left + span};
  x.take(0.0);
  x.take(1.0);
  for (std::size_t k = 0; k < n; ++k) {
    for (const study::SobolIndex& index : {indices.first[order[k]], indices.total[order[k]]}) {
      x.take(index.estimate);
      x.take(std::max(index.lower, -0.5));
      x.take(std::min(index.upper, 1.5));
    }
  }
  std::string out = open_svg(left + span + 20.0, bottom + 56.0, "first-order and total index of each input");
  out += across(x, top, bottom);
  for (std::size_t k = 0; k < n; ++k) {
    const double y = top + row * static_cast<double>(k) + 4.0;
    out += svg_text(left - 8.0, y + 17.0, "end", inputs[order[k]], true);
    const auto draw = [&](const study::SobolIndex& index, double at, const char* style) {
      out += bar(x(0.0), x(index.estimate), at, 11.0, style) +
             whisker(x(std::max(index.lower, x.low)), x(std::min(index.upper, x.high)), at + 5.5);
    };
    draw(indices.first[order[k]], y, "class=\"full\"");
    draw(indices.total[order[k]], y + 13.0, "class=\"bar\"");
  }
  out += stroke(x(0.0), top, x(0.0), bottom, "class=\"nominal\"");
  out += svg_text(left + 0.5 * span, bottom + 31.0, "middle", "share of the variance");
  out += svg_text(left + 0.5 * span, bottom + 48.0, "middle", "full: by itself, pale: with its interactions");
  return out + "</svg>";
}

std::string morris_scatter(const std::vector<study::ElementaryEffects>& effects, const std::vector<std::string>& inputs,
                           const AxisLabel& quantity) {
  names_fit(inputs, effects.size());
  constexpr double left = 70.0, top = 10.0, side = 280.0, right = left + side;
  const double bottom = std::max(top + 220.0, top + 16.0 * static_cast<double>(effects.size()));
  Axis x{left, right}, y{bottom, top};
  x.take(0.0);
  y.take(0.0);
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < effects.size(); ++i) {
    if (std::isfinite(effects[i].mean_absolute) && std::isfinite(effects[i].deviation)) {
      order.push_back(i);
      x.take(effects[i].upper);
      x.take(effects[i].mean_absolute);
      y.take(effects[i].deviation);
    }
  }
  if (order.empty()) {
    return {};
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return effects[a].mean_absolute > effects[b].mean_absolute; });
  x.high = x.high > 0.0 ? 1.05 * x.high : 1.0;
  y.high = std::max(1.1 * y.high, 0.25 * x.high);
  std::string out = open_svg(right + 20.0 + room(inputs), bottom + 44.0, "size and spread of each input's effect");
  out += across(x, top, bottom) + up(y, left, right);
  const double diagonal = std::min(x.high, y.high);
  out += stroke(x(0.0), y(0.0), x(diagonal), y(diagonal), "class=\"nominal\"");
  for (std::size_t k = 0; k < order.size(); ++k) {
    const study::ElementaryEffects& e = effects[order[k]];
    const std::string label = std::to_string(k + 1);
    out += whisker(x(std::max(e.lower, 0.0)), x(e.upper), y(e.deviation));
    out +=
        fmt::format("<circle class=\"dot\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\"/>", x(e.mean_absolute), y(e.deviation));
    out += svg_text(x(e.mean_absolute) + 5.0, y(e.deviation) - 5.0, "start", label, true);
    out += svg_text(right + 14.0, top + 12.0 + 16.0 * static_cast<double>(k), "start",
                    fmt::format("{} {}", label, inputs[order[k]]), true);
  }
  out +=
      svg_text(0.5 * (left + right), bottom + 32.0, "middle", "mean absolute effect μ* on " + label_words(quantity)) +
      upright(0.5 * (top + bottom), "spread σ");
  return out + "</svg>";
}

std::string sensitivity_map(const study::GridMap& map, const Eigen::VectorXd& x, const Eigen::VectorXd& y,
                            const AxisLabel& x_label, const AxisLabel& y_label, const AxisLabel& quantity) {
  check::that(x.size() == map.values.rows() && y.size() == map.values.cols(), "values of a map's inputs",
              fmt::format("{} and {}, as the map", map.values.rows(), map.values.cols()));
  Axis shade{0.08, 0.92};
  for (const double value : map.values.reshaped()) {
    shade.take(value);
  }
  if (shade.empty()) {
    return {};
  }
  constexpr double side = 240.0, left = 66.0, top = 10.0;
  const double width = side / static_cast<double>(x.size()), height = side / static_cast<double>(y.size());
  std::string out =
      open_svg(left + side + 60.0, top + side + 62.0, quantity.name + " over " + x_label.name + " and " + y_label.name);
  for (Eigen::Index a = 0; a < x.size(); ++a) {
    for (Eigen::Index b = 0; b < y.size(); ++b) {
      const double value = map.values(a, b), x0 = left + width * static_cast<double>(a),
                   y0 = top + side - height * static_cast<double>(b + 1);
      const bool known = std::isfinite(value);
      const double opacity = !known ? 1.0 : shade.high > shade.low ? shade(value) : 0.5;
      out += fmt::format(
          "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"{:.2f}\" "
          "style=\"fill:var({});fill-opacity:{:.3f}\"><title>{}, {}: {}</title></rect>",
          x0, y0, width - 0.5, height - 0.5, known ? "--first" : "--pale", opacity, number(x[a]), number(y[b]),
          known ? escape(with_unit(number(value), quantity.unit)) : "no value");
      if (!known) {
        out += stroke(x0, y0, x0 + width - 0.5, y0 + height - 0.5, "class=\"axis\"") +
               stroke(x0, y0 + height - 0.5, x0 + width - 0.5, y0, "class=\"axis\"");
      } else if (std::min(width, height) >= 34.0) {
        // On dark cells the paper's colour is read, on pale ones the ink's.
        out += fmt::format("<text style=\"fill:var({})\" x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>",
                           opacity > 0.6 ? "--paper" : "--ink", x0 + 0.5 * width, y0 + 0.5 * height + 4.0,
                           number(value, 2));
      }
    }
  }
  out += svg_text(left, top + side + 14.0, "start", number(x[0], 2)) +
         svg_text(left + side, top + side + 14.0, "end", number(x[x.size() - 1], 2)) +
         svg_text(left + 0.5 * side, top + side + 29.0, "middle", label_words(x_label)) +
         svg_text(left - 5.0, top + side, "end", number(y[0], 2)) +
         svg_text(left - 5.0, top + 10.0, "end", number(y[y.size() - 1], 2)) +
         upright(top + 0.5 * side, label_words(y_label)) +
         svg_text(left + 0.5 * side, top + side + 50.0, "middle",
                  fmt::format("{}: dark {}, pale {}", quantity.name, with_unit(number(shade.high), quantity.unit),
                              with_unit(number(shade.low), quantity.unit)));
  return out + "</svg>";
}

using study::Study;

namespace {

constexpr std::size_t kCurves = 4;     // of a quantity, the inputs that swing it most
constexpr std::size_t kSentences = 6;  // at the head of the page
constexpr std::size_t kFindings = 10;
constexpr double kLarge = 0.05;  // share of left-out points from which indices mean little

AxisLabel axis(const study::StudyQuantity& quantity) { return {quantity.name, unit_of(quantity.unit)}; }
AxisLabel axis(const study::StudyInput& input) { return {input.name, unit_of(input.unit)}; }

std::string range_of(const study::StudyInput& input) {
  return words::with_unit(fmt::format("{} … {}", number(input.lower), number(input.upper)), unit_of(input.unit));
}

std::vector<std::string> names_of(const Study& study) {
  std::vector<std::string> names;
  for (const study::StudyInput& input : study.inputs) {
    names.push_back(input.name);
  }
  return names;
}

// The input that matters most for a quantity, in a sentence; empty where no method says it.
std::string sentence(const Study& study, const study::StudyResult& result, std::size_t q) {
  const study::StudyQuantity& quantity = study.quantities[q];
  if (!result.sobol.empty() && result.sobol[q].status == study::SobolStatus::estimated) {
    const auto& total = result.sobol[q].total;
    const auto most = std::ranges::max_element(total, {}, &study::SobolIndex::estimate);
    return fmt::format("{}: most of its variance comes with {} (total index {}, 95 % interval {} to {})", quantity.name,
                       study.inputs[static_cast<std::size_t>(most - total.begin())].name, decimal(most->estimate, 2),
                       decimal(most->lower, 2), decimal(most->upper, 2));
  }
  if (!result.one_at_a_time.empty() && !result.one_at_a_time[q].order.empty()) {
    const study::OneAtATime& found = result.one_at_a_time[q];
    const study::InputCurve& curve = found.inputs[found.order.front()];
    if (!std::isfinite(curve.swing) || curve.swing == 0.0) {
      return {};
    }
    const study::StudyInput& input = study.inputs[found.order.front()];
    return fmt::format("{}: {} as it is; {} swings it most, {} to {} for {}", quantity.name,
                       words::with_unit(number(found.nominal), unit_of(quantity.unit)), input.name, number(curve.low),
                       number(curve.high), range_of(input));
  }
  return {};
}

std::string curves(const Study& study, const study::OneAtATime& found, const study::StudyQuantity& quantity) {
  std::string out;
  for (std::size_t k = 0; k < std::min(kCurves, found.order.size()); ++k) {
    const std::size_t i = found.order[k];
    const study::InputCurve& curve = found.inputs[i];
    if (!(curve.swing > 0.0)) {
      continue;
    }
    Eigen::VectorXd x(curve.coordinates.size());
    for (Eigen::Index at = 0; at < x.size(); ++at) {
      x[at] = study::value(study.inputs[i], curve.coordinates[at]);
    }
    out += "<div>" +
           sensitivity_curve(x, curve.values, study.inputs[i].nominal, found.nominal, study.inputs[i].logarithmic,
                             axis(study.inputs[i]), axis(quantity)) +
           "</div>";
  }
  return out;
}

std::string sobol_part(const Study& study, const study::SobolIndices& found) {
  if (found.status == study::SobolStatus::constant) {
    return paragraph("It does not depend on the inputs.");
  }
  if (found.status == study::SobolStatus::too_few) {
    return paragraph("Too few points have a value for shares of the variance.");
  }
  std::string out = "<div>" + sobol_bars(found, names_of(study)) + "</div>";
  if (found.left_out > kLarge) {
    out +=
        paragraph(escape(percent(found.left_out)) +
                  " of the base points have no value and are left out: the shares are those of the rest, whose inputs "
                  "are no longer independent; they mean little.");
  }
  return out;
}

std::string maps(const Study& study, const study::StudyResult& result, std::size_t q) {
  if (!study.methods.grid) {
    return {};
  }
  const study::Grid& grid = *study.methods.grid;
  std::vector<Eigen::Index> varied;
  for (std::size_t i = 0; i < grid.levels.size(); ++i) {
    if (grid.levels[i] > 1) {
      varied.push_back(static_cast<Eigen::Index>(i));
    }
  }
  if (varied.size() < 2) {
    return {};
  }
  std::vector<Eigen::Index> middle;
  for (const Eigen::Index levels : grid.levels) {
    middle.push_back(levels / 2);
  }
  const study::GridMap map =
      study::grid_map(grid, result.grid.col(static_cast<Eigen::Index>(q)), varied[0], varied[1], middle);
  const auto values = [&](const Eigen::VectorXd& coordinates, Eigen::Index i) {
    Eigen::VectorXd x(coordinates.size());
    for (Eigen::Index at = 0; at < x.size(); ++at) {
      x[at] = study::value(study.inputs[static_cast<std::size_t>(i)], coordinates[at]);
    }
    return x;
  };
  return "<div>" +
         sensitivity_map(map, values(map.x, varied[0]), values(map.y, varied[1]),
                         axis(study.inputs[static_cast<std::size_t>(varied[0])]),
                         axis(study.inputs[static_cast<std::size_t>(varied[1])]), axis(study.quantities[q])) +
         "</div>";
}

Section quantity_section(const Study& study, const study::StudyResult& result, std::size_t q) {
  const study::StudyQuantity& quantity = study.quantities[q];
  std::string body;
  if (!result.one_at_a_time.empty()) {
    body += "<h3>One input at a time</h3><div class=\"pairs\"><div>" +
            tornado(result.one_at_a_time[q], names_of(study), axis(quantity)) + "</div>" +
            curves(study, result.one_at_a_time[q], quantity) + "</div>";
  }
  if (!result.sobol.empty()) {
    body += "<h3>Shares of its variance</h3>" + sobol_part(study, result.sobol[q]);
  }
  if (!result.morris.empty()) {
    body += "<h3>Elementary effects</h3><div>" + morris_scatter(result.morris[q], names_of(study), axis(quantity)) +
            "</div>";
  }
  const std::string map = maps(study, result, q);
  body += map.empty() ? "" : "<h3>Map</h3>" + map;
  return {"quantity-" + std::to_string(q),
          words::with_unit(quantity.name, quantity.unit == "1" ? "" : "in " + quantity.unit), body};
}

std::string one_sided(const study::OneSided& derivative) {
  const bool both = derivative.left == derivative.right ||
                    std::abs(derivative.left - derivative.right) <= 1e-6 * std::abs(derivative.left);
  return both ? number(derivative.right) : number(derivative.left) + " / " + number(derivative.right);
}

Section local_section(const study::LocalSensitivity& local) {
  std::vector<Cell> header = {"Input"};
  for (std::size_t j = 0; j < local.parameters.size(); ++j) {
    header.push_back(
        numeric(escape(spaced(local.parameters[j])) + "<small>width, " + escape(local.units[j]) + "</small>"));
  }
  std::vector<std::vector<Cell>> rows;
  for (const study::LocalDerivative& input : local.inputs) {
    std::vector<Cell> row = {escape(input.input) + "<small>" +
                             escape(words::with_unit(number(input.value), unit_of(input.unit))) + "</small>"};
    for (const study::ParameterDerivative& d : input.parameters) {
      row.push_back(numeric(escape(one_sided(d.width)) +
                            (d.elasticity ? "<small>elasticity " + escape(number(*d.elasticity)) + "</small>"
                                          : "<small>not differentiable</small>")));
    }
    rows.push_back(std::move(row));
  }
  std::string body = local.inputs.empty() ? std::string() : table(header, rows);
  body += warrant_note(local.warrant);
  body += paragraph(
      "<span class=\"note\">Rate at which the width of each interval of bounds changes with an input, from the "
      "multipliers of the linear programs that bound it: exact for this log as long as the same samples hold the "
      "bounds. "
      "Two numbers are the rates below and above the value. Elasticity: per cent of width per per cent of the "
      "input.</span>");
  const std::vector<std::string> kinks = study::not_differentiable(local);
  if (!kinks.empty()) {
    body += "<h3>Where there is no derivative</h3>" + bullets(kinks);
  }
  return {"local", "Derivatives of the bounds", body + bullets(local.notes)};
}

Section inputs_section(const Study& study) {
  std::vector<std::vector<Cell>> rows;
  for (const study::StudyInput& input : study.inputs) {
    rows.push_back({escape(input.name), numeric(escape(number(input.lower))), numeric(escape(number(input.nominal))),
                    numeric(escape(number(input.upper))), escape(unit_of(input.unit)),
                    input.logarithmic ? "logarithmic" : "linear"});
  }
  return {"inputs", "Inputs",
          table({"Input", numeric("from"), numeric("nominal"), numeric("to"), "Unit", "Axis"}, rows)};
}

}  // namespace

std::string sensitivity_report(const Study& study, const study::StudyResult& result,
                               const std::optional<study::LocalSensitivity>& local,
                               const std::vector<std::string>& notes, const ReportContext& context) {
  PageContent content;
  content.title = study.name.empty() ? "Sensitivity of " + study.subject.robot.name : study.name;
  content.software = context.software;
  std::size_t without = 0;
  for (const study::StudyFinding& finding : result.findings) {
    without += finding.points;
  }
  content.status = without == 0 ? "good" : "caution";
  content.verdict =
      fmt::format("{}, {} evaluated", plural(study.inputs.size(), "input"), plural(result.points, "point"));
  for (std::size_t q = 0; q < study.quantities.size() && content.sentences.size() < kSentences; ++q) {
    const std::string said = sentence(study, result, q);
    if (!said.empty()) {
      content.sentences.push_back(said);
    }
  }
  if (without > 0) {
    content.sentences.push_back(fmt::format("{} of {} points gave no model", count(without), count(result.points)));
  }
  for (std::size_t q = 0; q < study.quantities.size(); ++q) {
    content.sections.push_back(quantity_section(study, result, q));
  }
  if (local) {
    content.sections.push_back(local_section(*local));
  }
  content.sections.push_back(inputs_section(study));
  if (without > 0) {
    std::vector<std::string> found;
    for (std::size_t k = 0; k < std::min(kFindings, result.findings.size()); ++k) {
      found.push_back(fmt::format("{}: {}", plural(result.findings[k].points, "point"), result.findings[k].sentence));
    }
    content.sections.push_back({"findings", "Points without a model", bullets(found)});
  }
  content.sections.push_back({"provenance", "Where this came from", bullets(notes) + provenance(context, TimeAxis())});
  return page(content);
}

}  // namespace wheelwright::report
