// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/words/parameter_view.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/commission/physical.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/words/text.hpp>

namespace wheelwright::words {
namespace {

Model model_of(const Commissioning& result) {
  Model model;
  for (const commission::ParameterResult& r : result.parameters) {
    model.parameters.push_back(r.parameter);
  }
  return model;
}

// θ_L = r·m is told as such.
std::string label(const model::Parameter& parameter) {
  return parameter.name == "r_" + parameter.physical ? "r·" + spaced(parameter.physical) : spaced(parameter.name);
}

// Interval that decides on the digits of a number: a prior bound is wide, and says nothing of what is known.
std::pair<double, double> uncertainty(const ParameterView& v) {
  if ((v.lower_is_prior || v.upper_is_prior) && v.estimate && v.spread) {
    return {*v.estimate - *v.spread, *v.estimate + *v.spread};
  }
  return {v.lower, v.upper};
}

ParameterView theta_view(const Commissioning& result, const commission::ParameterResult& r) {
  ParameterView view{.name = label(r.parameter),
                     .unit = commission::parameter_unit(result.model.robot, r.parameter),
                     .estimate = r.estimate,
                     .spread = {},
                     .lower = r.lower,
                     .upper = r.upper,
                     .centre = r.chebyshev,
                     .nominal = {},
                     .lower_is_prior = r.lower_is_prior,
                     .upper_is_prior = r.upper_is_prior,
                     .has_set = result.status != Commissioning::Status::empty,
                     .warrant = r.warrant,
                     .at_risk = {}};
  if (result.at_risk && result.at_risk->set) {
    view.at_risk = result.at_risk->set->hull().sides[static_cast<std::size_t>(&r - result.parameters.data())];
  }
  if (r.estimate && r.standard_error) {
    view.spread = core::student_quantile(0.95, std::max(result.residuals.freedom, 1.0)) * *r.standard_error;
  }
  return view;
}

ParameterView physical_view(ParameterView view, const commission::PhysicalScale& scale,
                            const model::Parameter& parameter) {
  const auto physical = [&](double theta) { return scale.scale * theta - scale.offset; };
  view.name = spaced(parameter.physical);
  view.unit = parameter.physical_unit;
  view.lower = physical(view.lower);
  view.upper = physical(view.upper);
  view.centre = physical(view.centre);
  if (view.estimate) {
    view.estimate = physical(*view.estimate);
  }
  if (view.spread) {
    view.spread = std::abs(scale.scale) * *view.spread;
  }
  if (view.at_risk) {
    view.at_risk = Interval{scale.scale, scale.scale} * *view.at_risk - Interval{scale.offset, scale.offset};
  }
  if (scale.scale < 0.0) {
    std::swap(view.lower, view.upper);
    std::swap(view.lower_is_prior, view.upper_is_prior);
  }
  return view;
}

}  // namespace

std::string risk_remark(const commission::RiskSet& set) {
  return fmt::format(
      "At a stated risk: the true values lie inside all of these intervals, unless a chance of {:g} came "
      "true; for errors that have no more than the {}, whatever their law.",
      set.risk,
      set.warrant == core::Warrant::guaranteed ? "declared bias" : "bias and deviation that were estimated from this log");
}

std::string estimate_text(const ParameterView& view) {
  const auto [low, high] = uncertainty(view);
  return view.estimate ? beside(*view.estimate, low, high) : "–";
}

std::string centre_text(const ParameterView& view) {
  const auto [low, high] = uncertainty(view);
  const bool known = view.has_set && !(view.lower_is_prior && view.upper_is_prior);
  return known ? beside(view.centre, low, high) : "–";
}

bool physical_values_unknown(const Commissioning& result) {
  return !commission::physical_scales(result.model.robot, model_of(result)).has_value();
}

std::vector<ParameterViews> parameter_views(const Commissioning& result) {
  const auto scales = commission::physical_scales(result.model.robot, model_of(result));
  std::vector<ParameterViews> views;
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const commission::ParameterResult& r = result.parameters[j];
    ParameterViews v{.theta = theta_view(result, r), .physical = {}};
    if (scales) {
      const commission::PhysicalScale& scale = (*scales)[j];
      const auto nominal = result.model.robot.nominal.find(r.parameter.physical);
      const bool known = nominal != result.model.robot.nominal.end();
      if (known) {
        v.theta.nominal = (nominal->second + scale.offset) / scale.scale;
      }
      if (r.parameter.physical != r.parameter.name || scale.scale != 1.0 || scale.offset != 0.0) {
        v.physical = physical_view(v.theta, scale, r.parameter);
        v.physical->nominal = known ? std::optional(nominal->second) : std::nullopt;
      }
    }
    views.push_back(std::move(v));
  }
  return views;
}

std::string output_name(const Model& model, std::size_t i) {
  return i < model.outputs.size() ? spaced(model.outputs[i]) : "output " + std::to_string(i + 1);
}

std::string output_unit_of(const Robot& robot, const Model& model, std::size_t i) {
  return i < model.output_units.size() ? commission::output_unit(robot, model.output_units[i]) : std::string();
}

}  // namespace wheelwright::words
