// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/parameter_table.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/commission/assumptions.hpp>
#include <wheelwright/commission/physical.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/identify/noise_level.hpp>
#include <wheelwright/report/data_sections.hpp>
#include <wheelwright/report/drawing.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/words/text.hpp>

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
      warrant_badge(commission::interval_warrant(result)),
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

}  // namespace wheelwright::report
