// SPDX-License-Identifier: Apache-2.0
#include "results/report/sections.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/assumptions.hpp"
#include "commission/physical.hpp"
#include "core/statistics.hpp"
#include "identify/noise_level.hpp"
#include "results/report/drawing.hpp"
#include "results/report/page.hpp"
#include "results/report/signals.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

using namespace words;
namespace {

std::string heading(const identify::EstimatorCandidate& c, bool chosen) {
  std::string text = escape(spaced(identify::to_string(c.estimate.estimator)));
  if (!c.origin.empty()) {
    text += "<br><small>" + escape(c.origin) + "</small>";
  }
  if (chosen) {
    text += "<br><span class=\"tag\">taken</span>";
  }
  return fmt::format("<th scope=\"col\" class=\"n\">{}</th>", text);
}

std::string cell(const identify::EstimatorCandidate& c, std::size_t j, const commission::PhysicalScale& scale) {
  const auto at = static_cast<Eigen::Index>(j);
  const double error = c.estimate.usable ? std::abs(scale.scale) * c.estimate.standard_error[at] : 0.0;
  if (!(error > 0.0)) {
    return "<td class=\"n\">–</td>";
  }
  const double half = error * core::student_quantile(0.95, std::max(c.estimate.freedom, 1.0));
  const double value = scale.scale * c.estimate.theta[at] - scale.offset;
  return fmt::format("<td class=\"n\">{} ± {}</td>", beside(value, value - half, value + half), number(half, 2));
}

}  // namespace

std::string estimator_table(const Commissioning& result) {
  const identify::EstimatorChoice& choice = result.estimators;
  if (choice.candidates.empty() || result.parameters.empty()) {
    return {};
  }
  const auto scales = commission::physical_scales(result.model.robot, result.model.model);
  const std::vector<ParameterViews> views = parameter_views(result);
  std::string out = paragraph(escape(core::capital(choice.reason)) + ".");
  out += "<div class=\"wide\"><table><thead><tr><th scope=\"col\">Parameter</th><th scope=\"col\">unit</th>";
  for (std::size_t k = 0; k < choice.candidates.size(); ++k) {
    out += heading(choice.candidates[k], k == choice.chosen);
  }
  out += "</tr></thead><tbody>\n";
  for (std::size_t j = 0; j < views.size(); ++j) {
    const commission::PhysicalScale scale = scales ? (*scales)[j] : commission::PhysicalScale{};
    out += fmt::format("<tr><th scope=\"row\">{}</th><td class=\"unit\">{}</td>", escape(views[j].best().name),
                       escape(views[j].best().unit));
    for (const identify::EstimatorCandidate& c : choice.candidates) {
      out += cell(c, j, scale);
    }
    out += "</tr>\n";
  }
  out += "</tbody></table></div>\n";
  out +=
      "<p class=\"note\">± is half of the 95 % interval, which allows for autocorrelated residuals. Noise in the "
      "measured motion pulls the least-squares estimates of inertias towards zero; instruments and bias compensation "
      "do not have that bias.</p>\n";
  std::vector<std::string> unusable;
  for (const identify::EstimatorCandidate& c : choice.candidates) {
    if (!c.estimate.usable) {
      unusable.push_back(core::capital(spaced(identify::to_string(c.estimate.estimator))) + ": " + c.estimate.reason +
                         ".");
    }
  }
  return out + bullets(unusable);
}

namespace {

constexpr double binding_margin = 1.0;  // s, shown on either side of a binding sample

// "12.3 s, 45.6 s sum, 7.8 s difference": each output once.
std::string binding_samples(const std::vector<bounds::RowOrigin>& rows, const Model& model, const TimeAxis& axis) {
  std::map<std::size_t, std::string> by_output;
  for (const bounds::RowOrigin& row : rows) {
    if (!row.is_prior) {
      std::string& times = by_output[row.output];
      times += times.empty() ? "" : ", ";
      times += time_button(row.t - binding_margin, row.t + binding_margin, axis.text(row.t), axis);
    }
  }
  std::string out;
  for (const auto& [output, times] : by_output) {
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", times, escape(output_name(model, output)));
  }
  return out;
}

std::string set_by(const char* side, const std::vector<bounds::RowOrigin>& rows, bool is_prior,
                   const Commissioning& result, const TimeAxis& axis) {
  const std::string samples = binding_samples(rows, result.model.model, axis);
  const bool touches_prior =
      std::any_of(rows.begin(), rows.end(), [](const bounds::RowOrigin& row) { return row.is_prior; });
  std::string text = samples;
  if (is_prior) {
    text = "<span class=\"tag\">the prior’s own</span>";
  } else if (touches_prior && !samples.empty()) {
    text += " with the prior";
  }
  return fmt::format("<small>{}: {}</small>", side, text.empty() ? "–" : text);
}

std::string interval_cells(const ParameterView& v, bool with_nominal) {
  std::string bounds = "–";
  if (v.has_set) {
    const auto [lower, upper] = outward(v.lower, v.upper);
    bounds = lower + " to " + upper;
  }
  const std::string statistical =
      v.estimate && v.spread
          ? fmt::format("{} to {}", beside(*v.estimate - *v.spread, *v.estimate - *v.spread, *v.estimate + *v.spread),
                        beside(*v.estimate + *v.spread, *v.estimate - *v.spread, *v.estimate + *v.spread))
          : "–";
  std::string at_risk;
  if (v.at_risk) {
    const auto [lower, upper] = outward(v.at_risk->lower, v.at_risk->upper);
    at_risk = fmt::format("<td class=\"n\">{} to {}</td>", lower, upper);
  }
  std::string out =
      fmt::format("<td class=\"n\">{}</td><td class=\"n\">{}</td>{}<td class=\"n\">{}</td><td class=\"n\">{}</td>",
                  estimate_text(v), bounds, at_risk, statistical, centre_text(v));
  if (with_nominal) {
    out += fmt::format("<td class=\"n\">{}</td>", v.nominal ? number(*v.nominal, 4) : "–");
  }
  return out;
}

std::string head_cell(const ParameterView& v) {
  return fmt::format("<th scope=\"row\">{}</th><td class=\"unit\">{}</td>", escape(v.name), escape(v.unit));
}

std::string rows_of(const ParameterViews& views, const commission::ParameterResult& r, bool with_nominal,
                    const Commissioning& result, const TimeAxis& axis) {
  const int span = views.physical ? 2 : 1;
  std::string out = fmt::format("<tr{}>", span == 2 ? " class=\"joined\"" : "");
  out += head_cell(views.best()) + interval_cells(views.best(), with_nominal);
  out += fmt::format("<td rowspan=\"{}\">{}</td>", span, interval_bar(views.best()));
  out += fmt::format("<td rowspan=\"{}\" class=\"from\">{}{}</td></tr>\n", span,
                     views.theta.has_set ? set_by("lower", r.lower_binding, r.lower_is_prior, result, axis) : "–",
                     views.theta.has_set ? set_by("upper", r.upper_binding, r.upper_is_prior, result, axis) : "");
  if (views.physical) {
    out += fmt::format("<tr class=\"theta\">{}{}</tr>\n", head_cell(views.theta),
                       interval_cells(views.theta, with_nominal));
  }
  return out;
}

std::string remarks(const Commissioning& result, const std::vector<ParameterViews>& views) {
  std::vector<std::string> items;
  for (std::size_t j = 0; j < views.size(); ++j) {
    const commission::ParameterResult& r = result.parameters[j];
    const std::string& name = views[j].best().name;
    if (r.excitation != identify::Excitation::identified && !r.reason.empty()) {
      items.push_back(name + ": " + r.reason + ".");
    }
    if (!r.estimate_inside && views[j].theta.has_set) {
      items.push_back("The estimate of " + name +
                      fmt::format(" lies outside the {} interval; the Chebyshev centre lies inside.",
                                  core::warrant_word(r.warrant)));
    }
  }
  if (physical_values_unknown(result)) {
    items.push_back(
        "Physical values (kg, kg·m², N·s/m) are not identifiable: the effort is not a torque, and the robot file does "
        "not "
        "give the motor’s constants (motor: torque_constant, resistance, back_emf, gear_ratio).");
  }
  return bullets(items);
}

}  // namespace

std::string parameter_table(const Commissioning& result, const TimeAxis& axis) {
  if (result.parameters.empty()) {
    return {};
  }
  const std::vector<ParameterViews> views = parameter_views(result);
  const bool with_nominal =
      std::any_of(views.begin(), views.end(), [](const ParameterViews& v) { return v.theta.nominal.has_value(); });
  const bool at_risk = result.at_risk && result.at_risk->set;
  std::string out = fmt::format(
      "<div class=\"wide\"><table class=\"parameters\"><thead><tr><th scope=\"col\">Parameter</th><th "
      "scope=\"col\">unit"
      "</th><th scope=\"col\" class=\"n\">estimate</th><th scope=\"col\" class=\"n\">{}</th>{}"
      "<th scope=\"col\" class=\"n\">95 % statistical</th><th scope=\"col\" class=\"n\">centre</th>{}"
      "<th scope=\"col\">intervals</th><th scope=\"col\">bound set by</th></tr></thead><tbody>\n",
      result.little.why.empty() ? warrant_badge(commission::interval_warrant(result)) : "bounds",
      at_risk ? "<th scope=\"col\" class=\"n\">at a stated risk</th>" : "",
      with_nominal ? "<th scope=\"col\" class=\"n\">nominal</th>" : "");
  for (std::size_t j = 0; j < views.size(); ++j) {
    out += rows_of(views[j], result.parameters[j], with_nominal, result, axis);
  }
  out += "</tbody></table></div>\n";
  out += "<p class=\"note\">" + escape(core::statistical_remark()) + "</p>\n";
  if (at_risk) {
    out += "<p class=\"note\">" + escape(words::risk_remark(*result.at_risk)) + "</p>\n";
  }
  out +=
      "<p class=\"note\">Box: interval of the bounds (dashed: a side is the prior’s; arrow: it goes on beyond the "
      "drawing). Black dot and whiskers: estimate with its 95 % interval. Ring: Chebyshev centre of the "
      "feasible set. Dashed "
      "line: nominal value. “Bound set by” names the samples that prove each bound: those moments of the log decide. ";
  out += fmt::format("The regressor has rank {} of {} and condition number {}.</p>\n", result.rank,
                     result.parameters.size(), number(result.condition));
  return out + remarks(result, views);
}

namespace {

std::string unit_cell(const Commissioning& result, std::size_t i) {
  return escape(output_name(result.model.model, i)) + "<small>" +
         escape(output_unit_of(result.model.robot, result.model.model, i)) + "</small>";
}

std::string ratio(double part, double whole) { return whole > 0.0 ? number(part / whole) : "–"; }

std::string smallest_change(const Commissioning& result, double kappa) {
  if (!(kappa > 0.0) || !std::isfinite(kappa)) {
    return "none";
  }
  return model::on_two_wheels(result.model.robot) ? percent(radius_change(kappa)) : "–";
}

std::string joint_list(const std::vector<double>& values) {
  std::vector<std::string> items;
  for (const double x : values) {
    items.push_back(number(x));
  }
  return items.empty() ? "–" : core::enumerated(items);
}

}  // namespace

std::string validation_section(const Commissioning& result) {
  if (result.validation.empty()) {
    return paragraph("The thresholds were not tried on held-out driving.");
  }
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < result.validation.size(); ++i) {
    const commission::OutputValidation& v = result.validation[i];
    rows.push_back({unit_cell(result, i), numeric(count(v.instants)), numeric(count(v.outside)),
                    numeric(percent(v.coverage, 4)), numeric(percent(v.coverage_noise_free)), numeric(percent(v.nrmse)),
                    numeric(percent(v.utilisation)), numeric(ratio(v.median_width, v.torque_rms)),
                    numeric(ratio(v.median_width_box, v.torque_rms)),
                    numeric(v.smallest_kappa > 0.0 ? number(v.smallest_kappa) : "–"),
                    numeric(smallest_change(result, v.smallest_kappa))});
  }
  std::string out =
      paragraph(fmt::format("A model was made from part of the log ({} blocks; every {}{} is held out, and {} s at the "
                            "beginning of each block are "
                            "purged, so that nothing is shared with its neighbour) and tried on the rest.",
                            result.folds.blocks, result.folds.hold_out_every,
                            result.folds.hold_out_every == 2   ? "nd"
                            : result.folds.hold_out_every == 3 ? "rd"
                                                               : "th",
                            number(result.folds.purge)));
  out += table({"Output", numeric("instants"), numeric("false<br>alarms"), numeric("coverage"),
                numeric("noise-free<br>coverage"), numeric("NRMSE"), numeric("utilisation"),
                numeric("width / torque,<br>polytope"), numeric("width / torque,<br>box"),
                numeric("smallest<br>certain κ"), numeric("wheel radius<br>change")},
               rows);
  out += bullets({
      "Coverage: share of instants with the residual inside [l, u]. Noise-free coverage: the same with the parameters’ "
      "uncertainty alone, no noise allowed.",
      "NRMSE: rms of the residual over rms of the filtered effort.",
      "Utilisation: how far the residual went towards its threshold at most. Near 0 the threshold can never fire; at "
      "100 % "
      "the residual touched it.",
      "Width / torque: median of u − l over the rms of the filtered effort, with the feasible set itself and with its "
      "interval hull. Smallest certain κ: change of all forces ζ = κ·Yθ that some instant shows for every admissible "
      "parameter and noise; a change of both wheel radii has |δ1|/r = √(1+κ) − 1.",
  });
  return out;
}

std::string noise_section(const Commissioning& result) {
  std::vector<std::vector<Cell>> rows;
  for (std::size_t i = 0; i < result.noise.size(); ++i) {
    const commission::OutputNoise& n = result.noise[i];
    std::string how;
    if (n.origin == core::NoiseOrigin::declared) {
      how = result.noise_mode == filter::NoiseMode::worst_case
                ? "declared bounds of the sensors, worst case through the filter"
                : "declared bounds of the sensors, statistical: independent samples at the stated confidence";
    } else {
      how = fmt::format("extrapolated from this log’s residuals: {} × the largest, {} × rms; {} tail",
                        number(n.how.over_largest), number(n.how.over_rms),
                        n.how.heavy_tail ? "heavier than Gaussian, hence exponential" : "Gaussian");
    }
    std::string rms = "–", largest = "–";
    if (i < result.residuals.outputs.size()) {
      rms = number(result.residuals.outputs[i].rms);
      largest = number(result.residuals.outputs[i].largest);
    }
    rows.push_back({unit_cell(result, i), numeric(number(n.bound)), numeric(number(n.learning)), numeric(rms),
                    numeric(largest),
                    (result.little.why.empty() ? warrant_badge(n.warrant) : std::string()) + "<small>" + escape(how) +
                        "</small>"});
  }
  if (rows.empty()) {
    return paragraph("No noise bound was reached.");
  }
  return paragraph(
             "The bound of the thresholds is for driving to come; the bound of the parameter set is for the rows of "
             "this "
             "log, which need no extrapolation.") +
         table({"Output", numeric("bound of the<br>thresholds"), numeric("bound of the<br>parameter set"),
                numeric("residual<br>rms"), numeric("largest<br>residual"), "where it comes from"},
               rows);
}

std::string filter_section(const Commissioning& result) {
  const FilterDesign& f = result.filter_choice.curve.empty() ? result.model.filter : result.filter_choice.design;
  std::string out = paragraph(fmt::format(
      "Order {}, α = {} 1/s, β = {} 1/s: a slow change is seen {} late. {}", f.order, number(f.alpha), number(f.beta),
      with_unit(number(f.delay()), "s"),
      f.order == 1
          ? "This is the paper’s filter f(t) = α e<sup>−βt</sup>."
          : "This is the paper’s filter applied twice, f₂(t) = α² t e<sup>−βt</sup>, so that wheel angles suffice."));
  const std::string curve = filter_curve(result.filter_choice);
  if (curve.empty()) {
    return out + paragraph("The constants were given, not chosen.");
  }
  out += paragraph("Chosen from the data: the fastest candidate that is nearly as quiet as the quietest one.");
  return out + "<figure>" + curve + "</figure>\n";
}

std::string contradiction_section(const Commissioning& result, const TimeAxis& axis) {
  if (result.feasible.contradiction.empty()) {
    return {};
  }
  std::vector<std::vector<Cell>> rows;
  const std::vector<ParameterViews> views = parameter_views(result);
  std::vector<bounds::WeightedRow> in_time = result.feasible.contradiction;
  std::stable_sort(in_time.begin(), in_time.end(), [](const bounds::WeightedRow& a, const bounds::WeightedRow& b) {
    const bounds::RowOrigin &x = a.row.origin, &y = b.row.origin;
    return x.is_prior != y.is_prior ? y.is_prior : x.t < y.t;
  });
  for (const bounds::WeightedRow& w : in_time) {
    const bounds::RowOrigin& o = w.row.origin;
    const std::string side = o.side == bounds::Side::upper ? "upper" : "lower";
    if (o.is_prior) {
      const std::string name =
          o.parameter < views.size() ? views[o.parameter].theta.name : "parameter " + std::to_string(o.parameter + 1);
      rows.push_back({side + " side of the prior", escape(name), numeric("–"), numeric(number(w.multiplier))});
    } else {
      rows.push_back({time_button(o.t - 1.0, o.t + 1.0, axis.text(o.t), axis),
                      escape(output_name(result.model.model, o.output)) + ", " + side + " bound",
                      numeric(count(o.sample)), numeric(number(w.multiplier))});
    }
  }
  return paragraph(
             "These constraints exclude one another: no parameter satisfies all of them, and none of them can be left "
             "out. The multipliers prove it (Farkas).") +
         table({"Time", "constraint", numeric("row of the log"), numeric("multiplier")}, rows);
}

std::string data_section(const Commissioning& result, const ReportContext& context, const TimeAxis& axis) {
  const commission::Survey& s = result.survey;
  std::string out = definitions({
      {"Rows", count(s.rows) + " in " + plural(s.segments, "segment")},
      {"Driving time",
       with_unit(number(s.seconds, 4), "s") + ", longest segment " + with_unit(number(s.longest_segment, 4), "s")},
      {"Steps", "median " + with_unit(number(s.median_step), "s") + ", largest within a segment " +
                    with_unit(number(s.largest_step), "s")},
      {"Regression", count(result.residuals.instants) + " instants"},
      {"Joints", "largest speeds " + joint_list(s.largest_speed) + " per s, largest accelerations " +
                     joint_list(s.largest_acceleration) + " per s², reversals " + joint_list(s.reversals)},
  });
  out += provenance(context, axis);
  if (!context.warnings.empty()) {
    out += "<h3>Repairs and remarks of the log reader</h3>\n" + bullets(context.warnings);
  } else {
    out += paragraph("The log reader had nothing to repair or to remark.");
  }
  if (!result.notes.empty()) {
    std::vector<std::string> notes;
    for (const std::string& note : result.notes) {
      notes.push_back(core::capital(note) + (note.ends_with('.') ? "" : "."));
    }
    out += "<h3>Assumptions and choices</h3>\n" + bullets(notes);
  }
  return out;
}

namespace {

// Classes of the style sheet, which is in every page: none of them is one of the words.
const char* badge_class(core::Warrant warrant) {
  switch (warrant) {
    case core::Warrant::guaranteed: return "from-sensors";
    case core::Warrant::extrapolated: return "from-log";
    case core::Warrant::statistical: return "from-chance";
  }
  return "from-log";
}

}  // namespace

std::string warrant_badge(core::Warrant warrant) {
  return fmt::format("<span class=\"badge {}\">{}</span>", badge_class(warrant), core::warrant_word(warrant));
}

std::string warrant_note(core::Warrant warrant) {
  std::string meaning(core::warrant_meaning(warrant));
  meaning.erase(0, meaning.find(' ') + 1);  // the word itself is in the badge
  return paragraph(warrant_badge(warrant) + " " + escape(core::capital(meaning)));
}

std::string assumptions_section(const std::vector<core::Assumption>& assumptions) {
  if (assumptions.empty()) {
    return {};
  }
  std::vector<core::Assumption> sorted = assumptions;
  std::stable_partition(sorted.begin(), sorted.end(),
                        [](const core::Assumption& a) { return a.verdict == core::AssumptionVerdict::fails; });
  std::vector<std::vector<Cell>> rows;
  for (const core::Assumption& a : sorted) {
    const char* status = a.verdict == core::AssumptionVerdict::holds   ? "holds"
                         : a.verdict == core::AssumptionVerdict::fails ? "broken"
                                                                       : "open";
    rows.push_back({escape(a.statement), a.declared_by.empty() ? "–" : "<code>" + escape(a.declared_by) + "</code>",
                    a.test.empty() ? "none" : escape(a.test),
                    fmt::format("<span class=\"verdict-{}\">{}</span>", status, core::verdict_word(a.verdict)) +
                        (a.detail.empty() ? "" : "<small>" + escape(a.detail) + "</small>")});
  }
  return paragraph(
             "What is taken as given, where it is declared, how the commissioning log was tested for it, and what "
             "it said. What is not tested is for whoever relies on the numbers to know.") +
         table({"Assumption", "declared by", "test", "this log"}, rows);
}

std::string signals_section(const ReportContext& context, const std::vector<ChartMark>& marks, const TimeAxis& axis) {
  return context.signals ? signal_charts(*context.signals, marks, axis, context.rows)
                         : paragraph("The raw signals were not handed to this page.");
}

}  // namespace wheelwright::report
