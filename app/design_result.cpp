// SPDX-License-Identifier: Apache-2.0
#include "design_result.hpp"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/margin_words.hpp>
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

// What all designs have.
Json frame(const Manoeuvre& manoeuvre, const std::optional<FigureEight>& eight, const MotionLimits& limits) {
  Json out = {{"schema", "wheelwright/design/1"}};
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
  const LimitUse& use = manoeuvre.use;
  out["use"] = {{"speed", use.speed}, {"acceleration", use.acceleration}, {"effort", use.effort}, {"space", use.space}};
  out["largest_distance"] = largest_distance(manoeuvre.plan);
  out["objective"] = manoeuvre.objective;
  out["evaluations"] = manoeuvre.evaluations;
  out["figure_eight"] = nullptr;
  if (eight) {
    out["figure_eight"] = {{"speed", eight->speed}, {"period", eight->period}};
  }
  return out;
}

}  // namespace

Json to_json(const BoundsDesign& design, const DesignSubject& subject, const MotionLimits& limits) {
  const auto scales = physical_scales(subject.robot, subject.model);
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "bounds";
  out["criterion"] = name(design.criterion);
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

Json to_json(const DetectionDesign& design, const MotionLimits& limits) {
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "detection";
  out["faults"] = Json::array();
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const PromisedFault& p = design.promised[k];
    const auto size = [](const PromisedFault& of) {
      return std::isfinite(of.smallest) ? Json{{"smallest", of.smallest}, {"t", of.t}} : Json(nullptr);
    };
    out["faults"].push_back({{"fault", p.fault.name},
                             {"side", p.side > 0.0 ? "positive" : "negative"},
                             {"unit", p.fault.unit},
                             {"asked", p.asked},
                             {"promised", size(p)},
                             {"figure_eight", design.figure_eight ? size(design.promised_eight[k]) : Json(nullptr)}});
  }
  return out;
}

std::string summary(const DetectionDesign& design) {
  const Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), largest_distance(plan), design.manoeuvre.evaluations);
  out += fmt::format("  {:<26} {:>10} {:>12} {:>8}{}\n", "certainly found from", "asked", "promised", "after",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const PromisedFault& p = design.promised[k];
    out += fmt::format("  {:<26} {:>10} {:>12} {:>8}", p.fault.name + (p.side > 0.0 ? " +" : " -"),
                       magnitude_words(p.fault, p.asked),
                       std::isfinite(p.smallest) ? magnitude_words(p.fault, p.smallest) : "none",
                       std::isfinite(p.smallest) ? fmt::format("{:.2f} s", p.t) : "");
    if (design.figure_eight) {
      const double eight = design.promised_eight[k].smallest;
      out += fmt::format(" {:>14}", std::isfinite(eight) ? magnitude_words(p.fault, eight) : "none");
    }
    out += "\n";
  }
  return out;
}

Json to_json(const DiscriminationDesign& design, const MotionLimits& limits) {
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "discrimination";
  out["rivals"] = Json::array();
  for (const Rival& rival : design.rivals) {
    Json causes = Json::array();
    for (const RivalCause& cause : rival.causes) {
      causes.push_back({{"effect", cause.effect}, {"coefficients", cause.coefficients}, {"shape", cause.shape}});
    }
    out["rivals"].push_back({{"name", rival.name()}, {"causes", std::move(causes)}});
  }
  const auto promise = [](const std::vector<RivalSeparation>& of, std::size_t k) {
    return of.empty() ? Json(nullptr)
                      : Json{{"delta", of[k].delta},
                             {"deviations", of[k].deviations()},
                             {"probability", of[k].probability()},
                             {"residual_ratio", of[k].ratio()}};
  };
  out["pairs"] = Json::array();
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const RivalSeparation& pair = design.promised[k];
    out["pairs"].push_back({{"true", design.rivals[pair.truth].name()},
                            {"other", design.rivals[pair.other].name()},
                            {"decidable", static_cast<bool>(design.decidable[k])},
                            {"promised", promise(design.promised, k)},
                            {"figure_eight", promise(design.promised_eight, k)},
                            {"analysed", promise(design.analysed, k)}});
  }
  out["inseparable"] = Json::array();
  for (const InseparablePair& pair : design.inseparable) {
    out["inseparable"].push_back({{"rivals", {design.rivals[pair.first].name(), design.rivals[pair.second].name()}},
                                  {"by_any_motion", pair.by_any_motion},
                                  {"special_case", pair.special_case},
                                  {"measurement", pair.measurement}});
  }
  out["stages"] = design.stages;
  out["sentences"] = design.sentences;
  return out;
}

std::string summary(const DiscriminationDesign& design) {
  const Plan& plan = design.manoeuvre.plan;
  std::string out = fmt::format("{:.1f} s, within {:.2f} m of the start; {} manoeuvres were looked at\n",
                                plan.t(plan.samples() - 1), largest_distance(plan), design.manoeuvre.evaluations);
  for (const std::string& stage : design.stages) {
    out += "  " + stage + "\n";
  }
  out += fmt::format("  {:<52} {:>12}{}\n", "standard deviations from going wrong", "promised",
                     design.figure_eight ? fmt::format(" {:>14}", "figure eight") : "");
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const RivalSeparation& pair = design.promised[k];
    out +=
        fmt::format("  {:<52} {:>12.2f}",
                    design.rivals[pair.truth].name() + ", not " + design.rivals[pair.other].name(), pair.deviations());
    out += design.figure_eight ? fmt::format(" {:>14.2f}\n", design.promised_eight[k].deviations()) : "\n";
  }
  for (const std::string& sentence : design.sentences) {
    out += sentence + "\n";
  }
  return out;
}

}  // namespace wheelwright::app
