// SPDX-License-Identifier: Apache-2.0
#include "design_result.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/physical.hpp>

namespace wheelwright::app {
namespace {

const char* name(WidthCriterion criterion) {
  switch (criterion) {
    case WidthCriterion::geometric_mean: return "geometric_mean";
    case WidthCriterion::mean: return "mean";
    case WidthCriterion::largest: break;
  }
  return "largest";
}

Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

double largest_distance(const Plan& plan) {
  return std::sqrt(plan.pose.topRows<2>().colwise().squaredNorm().maxCoeff());
}

}  // namespace

Json to_json(const BoundsDesign& design, const DesignSubject& subject, const MotionLimits& limits) {
  const auto scales = physical_scales(subject.robot, subject.model);
  Json out = {{"schema", "wheelwright/design/1"}, {"for", "bounds"}, {"criterion", name(design.criterion)}};
  out["limits"] = {{"duration", limits.duration},
                   {"speed", limits.joint_speed},
                   {"acceleration", optional(limits.joint_acceleration)},
                   {"effort", optional(limits.effort)},
                   {"radius", optional(limits.radius)},
                   {"box", nullptr}};
  if (limits.box) {
    const auto& [x, y] = *limits.box;
    out["limits"]["box"] = {x.lower, x.upper, y.lower, y.upper};
  }
  const LimitUse& use = design.manoeuvre.use;
  out["use"] = {{"speed", use.speed}, {"acceleration", use.acceleration}, {"effort", use.effort}, {"space", use.space}};
  out["largest_distance"] = largest_distance(design.manoeuvre.plan);
  out["objective"] = design.manoeuvre.objective;
  out["evaluations"] = design.manoeuvre.evaluations;
  out["figure_eight"] = nullptr;
  if (design.figure_eight) {
    out["figure_eight"] = {{"speed", design.figure_eight->speed}, {"period", design.figure_eight->period}};
  }
  out["parameters"] = Json::array();
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const Parameter& parameter = subject.model.parameters[j];
    const auto bounds = [&](const Box& box) {
      const Interval& side = box.sides[j];
      return Json{{"lower", side.lower},
                  {"upper", side.upper},
                  {"physical_half_width",
                   scales ? Json(0.5 * (side.upper - side.lower) * std::abs((*scales)[j].scale)) : Json(nullptr)}};
    };
    out["parameters"].push_back(
        {{"name", parameter.name},
         {"unit", parameter_unit(subject.robot, parameter)},
         {"physical", parameter.physical},
         {"physical_unit", parameter.physical_unit},
         {"believed", subject.theta[static_cast<Eigen::Index>(j)]},
         {"promised", bounds(design.promised)},
         {"model", subject.known ? bounds(*subject.known) : Json(nullptr)},
         {"figure_eight", design.figure_eight ? bounds(design.promised_eight) : Json(nullptr)}});
  }
  return out;
}

std::string summary(const BoundsDesign& design, const DesignSubject& subject) {
  const auto scales = physical_scales(subject.robot, subject.model);
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                design.manoeuvre.plan.t(design.manoeuvre.plan.samples() - 1),
                                largest_distance(design.manoeuvre.plan), design.manoeuvre.evaluations);
  out += fmt::format("  {:<20} {:>12}{}{}\n", "half widths", "promised",
                     subject.known ? fmt::format(" {:>12}", "model now") : "",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const Parameter& parameter = subject.model.parameters[j];
    const double scale = scales ? std::abs((*scales)[j].scale) : 1.0;
    const auto half = [&](const Box& box) { return 0.5 * scale * (box.sides[j].upper - box.sides[j].lower); };
    out += fmt::format("  {:<20} {:>12.4g}", scales ? parameter.physical : parameter.name, half(design.promised));
    if (subject.known) {
      out += fmt::format(" {:>12.4g}", half(*subject.known));
    }
    if (design.figure_eight) {
      out += fmt::format(" {:>14.4g}", half(design.promised_eight));
    }
    out += "  " + (scales ? parameter.physical_unit : parameter_unit(subject.robot, parameter)) + "\n";
  }
  return out;
}

}  // namespace wheelwright::app
