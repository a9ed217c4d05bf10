// SPDX-License-Identifier: Apache-2.0
#include "results/report/identify_report.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/statistics.hpp"
#include "identify/noise_level.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/report/signals.hpp"
#include "results/words/identification_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using commission::Identification;

using namespace words;
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

std::string tick_text(double x, double step) {
  const int decimals = std::max(0, -static_cast<int>(std::floor(std::log10(step) + 1e-9)));
  return decimal(std::abs(x) < 1e-9 * step ? 0.0 : x, std::min(decimals, 9));
}

// Vertical rules with numbers below.
std::string ticks_below(const Axis& x, double top, double bottom, double unit, double parts) {
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

std::string information_bars(const inference::InformationOverTime& information, const std::vector<std::string>& names,
                             const TimeAxis& axis) {
  const std::size_t windows = information.windows.size();
  const bool any = std::ranges::any_of(information.parameters,
                                       [](const inference::ParameterInformation& p) { return p.information > 0.0; });
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
  const Axis x{{edge(0, false), edge(windows - 1, true)}, left, width - 14.0};
  if (!(x.high > x.low)) {
    return {};
  }
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" role=\"img\" aria-label=\"information over time\">",
      width, bottom + 34.0);
  out += ticks_below(x, top, bottom, 1.0, 10.0);
  for (std::size_t j = 0; j < information.parameters.size(); ++j) {
    const inference::ParameterInformation& p = information.parameters[j];
    const double base = top + row * static_cast<double>(j + 1) - 6.0, full = row - 12.0;
    out += fmt::format("<text class=\"ink\" x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>", left - 8.0,
                       base - 0.5 * full + 4.0, escape(spaced(j < names.size() ? names[j] : "")));
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

std::string shape_curve(const commission::ShapeFinding& shape) {
  Axis y{150.0, 12.0};
  std::vector<commission::ShapePoint> points;
  for (const commission::ShapePoint& point : shape.curve) {
    if (std::isfinite(point.residual_ratio) && std::isfinite(point.shape)) {
      points.push_back(point);
      y.take(point.residual_ratio);
    }
  }
  if (points.size() < 2 || !(points.back().shape > points.front().shape)) {
    return {};
  }
  const double margin = std::max(0.06 * (y.high - y.low), 0.005);
  y.low = std::max(y.low - margin, 0.0);
  y.high += margin;
  constexpr double width = 420.0, left = 56.0, bottom = 150.0;
  const Axis x{{points.front().shape, points.back().shape}, left, width - 14.0};
  const double unit = shape.unit == "s" ? 1e3 : 1.0;
  std::string out = fmt::format(
      "<svg viewBox=\"0 0 {0} 186\" width=\"{0}\" height=\"186\" role=\"img\" aria-label=\"residual over {1}\">", width,
      escape(spaced(shape.name)));
  out += ticks_below(x, 12.0, bottom, unit, 6.0);
  const double step = round_step(100.0 * (y.high - y.low), 4.0);
  for (double at = std::ceil(100.0 * y.low / step) * step; at <= 100.0 * y.high; at += step) {
    out += fmt::format(
        "<line class=\"axis\" x1=\"{0}\" x2=\"{1}\" y1=\"{2:.1f}\" y2=\"{2:.1f}\"/><text x=\"{3}\" y=\"{4:.1f}\" "
        "text-anchor=\"end\">{5} %</text>",
        left, width - 14.0, y(at / 100.0), left - 5.0, y(at / 100.0) + 4.0, tick_text(at, step));
  }
  out += "<polyline class=\"curve\" points=\"";
  for (const commission::ShapePoint& point : points) {
    out += fmt::format("{:.1f},{:.1f} ", x(point.shape), y(point.residual_ratio));
  }
  out += "\"/>";
  if (shape.converged && shape.state == identify::ShapeState::identified) {
    out += fmt::format("<circle class=\"dot chosen\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\"/>", x(shape.estimate),
                       y(shape.residual_ratio));
  }
  return out + fmt::format("<text x=\"{:.1f}\" y=\"180\" text-anchor=\"middle\">{}, {}</text></svg>",
                           0.5 * (left + width), escape(spaced(shape.name)),
                           escape(shape.unit == "s" ? "ms" : shape.unit));
}

namespace {

std::string name_of(std::string_view identifier) { return core::capital(spaced(identifier)); }

bool excluded(const Identification& r, std::size_t j) {
  return j < r.fit.excitation.size() && r.fit.excitation[j].state == identify::Excitation::not_excited;
}

std::string plus_minus(double value, double half) {
  return std::isfinite(half) && half > 0.0 ? beside(value, value - half, value + half) + " ± " + number(half, 2)
                                           : number(value, 5);
}

// A line of estimates with half of their 95 % interval by Student's t.
std::vector<Cell> estimate_row(const Identification& r, std::string name, const Eigen::VectorXd& theta,
                               const Eigen::VectorXd& error, double freedom) {
  const std::vector<ShownParameter> shown = shown_parameters(r);
  const double t = core::student_quantile(r.confidence, std::max(freedom, 1.0));
  std::vector<Cell> row = {std::move(name)};
  for (std::size_t j = 0; j < shown.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double half = at < error.size() ? t * std::abs(shown[j].scale.scale) * error[at] : 0.0;
    row.push_back(numeric(excluded(r, j) || at >= theta.size() ? "–" : plus_minus(shown[j].value(theta[at]), half)));
  }
  return row;
}

std::vector<Cell> region_row(const Identification& r, const inference::RegionRow& region) {
  const std::vector<ShownParameter> shown = shown_parameters(r);
  std::vector<Cell> row = {fmt::format("{}<small>{} %{}</small>", escape(name_of(inference::to_string(region.method))),
                                       number(100.0 * region.confidence, 3),
                                       region.all_at_once ? ", all at once" : "")};
  for (std::size_t j = 0; j < shown.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    if (excluded(r, j) || at >= region.lower.size()) {
      row.push_back(numeric("–"));
      continue;
    }
    const auto [low, high] = std::minmax({shown[j].value(region.lower[at]), shown[j].value(region.upper[at])});
    const auto [a, b] = outward(low, high);
    row.push_back(numeric(a + " to " + b));
  }
  return row;
}

std::string test_words(const identify::EstimatorChoice& choice) {
  if (!choice.tested_against || !choice.test.made) {
    return {};
  }
  const std::string other = spaced(identify::to_string(choice.candidates[*choice.tested_against].estimate.estimator));
  const double p = choice.test.p_value;
  return paragraph(
      fmt::format("Least squares against {} (Durbin, Wu and Hausman’s test): p = {}, {}.", escape(other), number(p, 2),
                  p < 0.05 ? "a difference that chance hardly makes: the noise of the motion is not without effect"
                           : "no more than chance makes"));
}

std::string combinations(const std::vector<inference::KnownCombination>& list) {
  std::vector<std::vector<Cell>> rows;
  for (const inference::KnownCombination& c : list) {
    rows.push_back({escape(c.words), numeric(c.relative_error > 0.0 ? "± " + percent(c.relative_error, 2) : "–")});
  }
  return rows.empty() ? "" : table({"Combination", numeric("standard error, relative")}, rows);
}

}  // namespace

std::string comparison_section(const Identification& r) {
  const identify::EstimatorChoice& choice = r.fit.choice;
  if (choice.candidates.empty()) {
    return {};
  }
  std::vector<Cell> header = {"By"};
  for (const ShownParameter& p : shown_parameters(r)) {
    header.push_back(numeric(escape(spaced(p.name)) + "<small>" + escape(p.unit) + "</small>"));
  }
  std::vector<std::vector<Cell>> rows;
  std::vector<std::string> remarks;
  for (std::size_t c = 0; c < choice.candidates.size(); ++c) {
    const identify::Estimate& e = choice.candidates[c].estimate;
    if (!e.usable) {
      remarks.push_back(name_of(identify::to_string(e.estimator)) + ": " + e.reason + ".");
      continue;
    }
    rows.push_back(estimate_row(r,
                                escape(name_of(identify::to_string(e.estimator))) + "<small>" +
                                    escape(choice.candidates[c].origin) + "</small>" +
                                    (c == choice.chosen ? "<span class=\"tag\">taken</span>" : ""),
                                e.theta, e.standard_error, e.freedom));
  }
  rows.push_back(estimate_row(r, "Robust<small>Huber’s loss, physically consistent</small>", r.robust.estimate,
                              r.robust.standard_error, r.robust.freedom));
  if (!binding(r.constrained).empty()) {
    rows.push_back(estimate_row(r, "Physically consistent", r.constrained.estimate, {}, 1.0));
  }
  for (const inference::RegionRow& region : r.regions.rows) {
    if (region.available) {
      rows.push_back(region_row(r, region));
      remarks.push_back(name_of(inference::to_string(region.method)) + ": " + region.promise + ".");
    }
    if (!region.remark.empty()) {
      remarks.push_back(name_of(inference::to_string(region.method)) + ": " + region.remark + ".");
    }
  }
  return paragraph(escape(core::capital(choice.reason)) + ".") + test_words(choice) + table(header, rows) +
         paragraph(
             "± is half of the 95 % interval of Student’s t, which allows for autocorrelated residuals. The intervals "
             "below are about the estimate that was taken; what each of them promises:") +
         bullets(remarks);
}

std::string identifiability_section(const Identification& r) {
  const inference::Identifiability& i = r.identifiability;
  if (i.singular_values.size() == 0) {
    return {};
  }
  const auto p = static_cast<std::size_t>(i.singular_values.size());
  std::string out = paragraph(fmt::format(
      "Of {} the motion in the log shows {}, {} of them beyond what sensor noise would show. With columns of "
      "length one the condition is {}: 1 is best, and beyond some hundreds two parameters are hardly told apart.",
      plural(p, "direction"), i.rank, i.noise_rank, number(i.condition, 3)));
  std::vector<std::string> missing;
  for (const inference::UnseenDirection& u : i.unseen) {
    std::string text = core::capital(u.words);
    text += text.ends_with('.') ? "" : ".";
    for (const std::string& m : u.manoeuvres) {
      text.append(" ").append(core::capital(m)).append(".");
    }
    missing.push_back(text);
  }
  out += missing.empty() ? paragraph("Nothing is missing.") : "<h3>Not seen</h3>\n" + bullets(missing);
  if (i.rank < static_cast<int>(p) && !i.seen.empty()) {
    out += "<h3>What is estimated in place of single parameters</h3>\n" + combinations(i.seen);
  }
  const std::string known = combinations(i.known);
  return out + (known.empty() ? "" : "<h3>Combinations, best known first</h3>\n" + known);
}

std::string information_section(const Identification& r, const TimeAxis& axis) {
  std::vector<std::string> names;
  for (const ShownParameter& p : shown_parameters(r)) {
    names.push_back(p.name);
  }
  const std::string bars = information_bars(r.information, names, axis);
  if (bars.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  for (std::size_t j = 0; j < r.information.parameters.size() && j < names.size(); ++j) {
    const inference::ParameterInformation& p = r.information.parameters[j];
    std::string spans;
    for (const auto& [first, last] : p.spans) {
      spans += (spans.empty() ? "" : ", ") +
               time_button(first, last, decimal(axis.shown(first), 1) + " to " + decimal(axis.shown(last), 1), axis);
    }
    rows.push_back({escape(spaced(names[j])), numeric(p.information > 0.0 ? number(p.seconds) : "–"),
                    p.information > 0.0 ? spans : "no information"});
  }
  return paragraph(
             "Share of the information on each parameter that each window of the log carries: what its column holds "
             "beyond all the others. Filled: the fewest windows that carry 80 % together. A log that is to be "
             "shortened "
             "keeps those; a parameter that lives on few seconds depends on what happened in them.") +
         "<div class=\"wide\">" + bars + "</div>\n" +
         table({"Parameter", numeric("seconds for 80 %"), "they are, s"}, rows);
}

std::string robust_section(const Identification& r, const TimeAxis& axis) {
  if (r.robust.instants == 0) {
    return {};
  }
  const Model& model = r.setting.model;
  const auto output = [&](std::size_t i) { return i < model.outputs.size() ? model.outputs[i] : std::string(); };
  std::vector<std::vector<Cell>> weights, episodes;
  for (std::size_t i = 0; i < r.robust.outputs.size(); ++i) {
    const inference::OutputWeights& w = r.robust.outputs[i];
    weights.push_back({escape(output(i)), numeric(number(w.scale)), numeric(percent(w.down_weighted, 2)),
                       numeric(percent(w.gaussian_share, 2))});
  }
  for (const inference::Episode& e : r.robust.episodes) {
    episodes.push_back({time_button(e.first_time, e.last_time, axis.text(e.worst_time), axis), escape(output(e.output)),
                        numeric(number(e.worst)), numeric(count(e.instants)), numeric(std::to_string(e.worst_sample))});
  }
  std::vector<std::string> bound;
  for (const inference::ActiveConstraint& a : binding(r.constrained)) {
    bound.push_back(core::capital(a.words));
  }
  return paragraph(
             "A fit with Huber’s loss gives little weight to what is far off. Many more small weights than Gaussian "
             "residuals would have mean knocks, slip, glitches, or a model that lacks something.") +
         table({"Output", numeric("robust standard deviation"), numeric("weight below 1/2"), numeric("if Gaussian")},
               weights) +
         (episodes.empty()
              ? ""
              : "<h3>Worst moments</h3>\n" + table({"At", "output", numeric("residual in standard deviations"),
                                                    numeric("instants"), numeric("row")},
                                                   episodes)) +
         (bound.empty() ? paragraph("No physical constraint binds: mass, inertia and friction come out positive.")
                        : "<h3>Physical constraints that bind</h3>\n" + bullets(bound));
}

std::string shapes_section(const Identification& r) {
  if (r.shapes.empty()) {
    return {};
  }
  std::string out = paragraph(
      "Each of these was added alone to the model. Curves: rms of the residual with the quantity held at each value, "
      "over that without it. A curve that hardly moves is one that the log does not show.");
  for (const commission::ShapeFinding& shape : r.shapes) {
    out += paragraph(escape(in_words(shape)));
    const std::string curve = shape_curve(shape);
    out += curve.empty() ? "" : "<div class=\"wide\">" + curve + "</div>\n";
  }
  return out;
}

std::string kinematics_section(const Identification& r) {
  if (!r.kinematics) {
    return {};
  }
  const inference::KinematicCalibration& k = *r.kinematics;
  std::vector<std::vector<Cell>> rows;
  const auto add = [&](const char* name, const inference::KinematicQuantity& q, const char* unit) {
    const bool told = q.state == inference::KinematicState::identified;
    rows.push_back({name, unit, numeric(told ? beside(q.estimate, q.lower, q.upper) : "–"),
                    numeric(told ? outward(q.lower, q.upper).first + " to " + outward(q.lower, q.upper).second : "–"),
                    escape(q.state == inference::KinematicState::fixed ? "not looked for" : q.reason)});
  };
  add("Track width at the robot file’s wheel radius", k.track_at_nominal_radius, "m");
  add("Track width with the radii below", k.track_width, "m");
  add("Radius of the right wheel", k.radius_right, "m");
  add("Radius of the left wheel", k.radius_left, "m");
  add("Mean radius over the robot file’s", k.radius_scale, "1");
  add("Difference of the radii over their sum", k.asymmetry, "1");
  add("Pose’s point ahead of the axle", k.axle_offset, "m");
  return paragraph(fmt::format("From {} poses in {}. A robot that skids turns as one with a wider track: the track "
                               "width is the effective "
                               "one, an average over this driving.",
                               count(k.poses), plural(k.windows, "window"))) +
         table({"Quantity", "unit", numeric("estimate"), numeric("95 %"), "remark"}, rows);
}

std::string column_noise_section(const Identification& r) {
  std::vector<std::vector<Cell>> rows;
  for (const commission::ColumnNoise& n : r.noise) {
    const bool found = n.choice.method != inference::NoiseMethod::none;
    const bool effort =
        std::ranges::find(r.setting.measurement.effort_columns, n.column) != r.setting.measurement.effort_columns.end();
    const bool counts = n.known && !effort && r.setting.measurement.motion != MotionKind::speed;
    rows.push_back({escape(n.column),
                    n.known ? fmt::format("± {} {}<small>{}</small>", number(n.known->bound, 2), escape(n.known->unit),
                                          escape(n.known->origin))
                            : std::string("–"),
                    counts || !found ? numeric("–") : numeric(number(n.choice.sd, 2) + " " + escape(n.unit)),
                    counts || !found ? "–" : escape(std::string(inference::to_string(n.choice.method))),
                    escape(counts ? "what rounding does is known; at rest and in differences it does not show"
                                  : n.choice.assumption),
                    counts ? "" : escape(n.choice.reason)});
  }
  return rows.empty()
             ? ""
             : table({"Column", "known", numeric("standard deviation found"), "by", "assuming", "because"}, rows);
}

namespace {

const char* status_class(IdentificationStanding standing) {
  switch (standing) {
    case IdentificationStanding::good: return "good";
    case IdentificationStanding::caution: return "caution";
    case IdentificationStanding::bad: break;
  }
  return "bad";
}

}  // namespace

std::string identify_report(const Identification& result, const ReportContext& context) {
  const TimeAxis axis = context.signals && context.signals->rows() > 0 ? TimeAxis(context.signals->t) : TimeAxis();
  PageContent content;
  content.title = context.title.empty() ? "Identification of " + result.setting.robot.name : context.title;
  content.status = status_class(standing(result));
  content.verdict = verdict(result);
  content.sentences = findings(result);
  content.software = context.software;
  const auto add = [&](const char* id, const char* heading, std::string body) {
    if (!body.empty()) {
      content.sections.push_back({id, heading, std::move(body)});
    }
  };
  add("next", "What to do next", bullets(next_steps(result)));
  add("estimates", "Estimates and intervals", comparison_section(result));
  add("identifiability", "What the log can tell", identifiability_section(result));
  add("information", "Which seconds tell it", information_section(result, axis));
  add("shapes", "Beside the model", shapes_section(result));
  add("kinematics", "Kinematics", kinematics_section(result));
  add("robust", "Outliers and physical sense", robust_section(result, axis));
  add("noise", "Noise", column_noise_section(result));
  add("signals", "Raw signals",
      context.signals ? signal_charts(*context.signals, {}, axis, context.rows) : std::string());
  std::vector<std::string> remarks = result.notes;
  remarks.insert(remarks.end(), context.warnings.begin(), context.warnings.end());
  add("data", "Data", provenance(context, axis) + bullets(remarks));
  return page(content);
}

}  // namespace wheelwright::report
