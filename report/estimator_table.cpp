// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/report/estimator_table.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include <wheelwright/commission/physical.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/identify/noise_level.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/parameter_view.hpp>
#include <wheelwright/report/text.hpp>

namespace wheelwright::report {
namespace {

std::string heading(const EstimatorCandidate& c, bool chosen) {
  std::string text = escape(words(to_string(c.estimate.estimator)));
  if (!c.origin.empty()) {
    text += "<br><small>" + escape(c.origin) + "</small>";
  }
  if (chosen) {
    text += "<br><span class=\"tag\">taken</span>";
  }
  return fmt::format("<th scope=\"col\" class=\"n\">{}</th>", text);
}

std::string cell(const EstimatorCandidate& c, std::size_t j, const PhysicalScale& scale) {
  const auto at = static_cast<Eigen::Index>(j);
  const double error = c.estimate.usable ? std::abs(scale.scale) * c.estimate.standard_error[at] : 0.0;
  if (!(error > 0.0)) {
    return "<td class=\"n\">–</td>";
  }
  const double half = error * student_quantile(0.95, std::max(c.estimate.freedom, 1.0));
  const double value = scale.scale * c.estimate.theta[at] - scale.offset;
  return fmt::format("<td class=\"n\">{} ± {}</td>", beside(value, value - half, value + half), number(half, 2));
}

}  // namespace

std::string estimator_table(const Commissioning& result) {
  const EstimatorChoice& choice = result.estimators;
  if (choice.candidates.empty() || result.parameters.empty()) {
    return {};
  }
  const auto scales = physical_scales(result.model.robot, result.model.model);
  const std::vector<ParameterViews> views = parameter_views(result);
  std::string out = paragraph(escape(capital(choice.reason)) + ".");
  out += "<div class=\"wide\"><table><thead><tr><th scope=\"col\">Parameter</th><th scope=\"col\">unit</th>";
  for (std::size_t k = 0; k < choice.candidates.size(); ++k) {
    out += heading(choice.candidates[k], k == choice.chosen);
  }
  out += "</tr></thead><tbody>\n";
  for (std::size_t j = 0; j < views.size(); ++j) {
    const PhysicalScale scale = scales ? (*scales)[j] : PhysicalScale{};
    out += fmt::format("<tr><th scope=\"row\">{}</th><td class=\"unit\">{}</td>", escape(views[j].best().name),
                       escape(views[j].best().unit));
    for (const EstimatorCandidate& c : choice.candidates) {
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
  for (const EstimatorCandidate& c : choice.candidates) {
    if (!c.estimate.usable) {
      unusable.push_back(capital(words(to_string(c.estimate.estimator))) + ": " + c.estimate.reason + ".");
    }
  }
  return out + bullets(unusable);
}

}  // namespace wheelwright::report
