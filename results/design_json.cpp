// SPDX-License-Identifier: Apache-2.0
#include "results/design_json.hpp"

#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "commission/design/subject.hpp"
#include "commission/physical.hpp"

namespace wheelwright::results {
namespace {

const char* name(design::WidthCriterion criterion) {
  switch (criterion) {
    case design::WidthCriterion::geometric_mean: return "geometric_mean";
    case design::WidthCriterion::mean: return "mean";
    case design::WidthCriterion::largest: break;
  }
  return "largest";
}

const char* name(design::Promise guarantee) {
  return guarantee == design::Promise::at_risk ? "at_risk" : "every_noise";
}

// What all designs have.
Json frame(const design::Manoeuvre& manoeuvre, const std::optional<design::FigureEight>& eight,
           const design::MotionLimits& limits) {
  Json out = {{"schema", "wheelwright/design/1"}};
  out["limits"] = {{"duration", limits.duration},
                   {"speed", limits.joint_speed},
                   {"acceleration", files::or_null(limits.joint_acceleration)},
                   {"effort", files::or_null(limits.effort)},
                   {"radius", files::or_null(limits.radius)},
                   {"box", nullptr}};
  if (limits.box) {
    const auto& [x, y] = *limits.box;
    out["limits"]["box"] = {x.lower, x.upper, y.lower, y.upper};
  }
  const design::LimitUse& use = manoeuvre.use;
  out["use"] = {{"speed", use.speed}, {"acceleration", use.acceleration}, {"effort", use.effort}, {"space", use.space}};
  out["largest_distance"] = manoeuvre.plan.reach();
  out["objective"] = manoeuvre.objective;
  out["evaluations"] = manoeuvre.evaluations;
  out["figure_eight"] = nullptr;
  if (eight) {
    out["figure_eight"] = {{"speed", eight->speed}, {"period", eight->period}};
  }
  return out;
}

}  // namespace

Json to_json(const design::BoundsDesign& design, const design::DesignSubject& subject,
             const design::MotionLimits& limits) {
  const auto scales = commission::physical_scales(subject.robot, subject.model);
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "bounds";
  out["criterion"] = name(design.criterion);
  out["guarantee"] = name(design.guarantee);
  out["at_risk"] = design.at_risk ? Json{{"risk", design.risk}, {"warrant", core::warrant_word(design.at_risk_warrant)}}
                                  : Json(nullptr);
  out["parameters"] = Json::array();
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const model::Parameter& parameter = subject.model.parameters[j];
    const auto bounds = [&](const Box& box) {
      const Interval& side = box.sides[j];
      return Json{{"lower", side.lower},
                  {"upper", side.upper},
                  {"physical_half_width",
                   scales ? Json(0.5 * (side.upper - side.lower) * std::abs((*scales)[j].scale)) : Json(nullptr)}};
    };
    out["parameters"].push_back(
        {{"name", parameter.name},
         {"unit", commission::parameter_unit(subject.robot, parameter)},
         {"physical", parameter.physical},
         {"physical_unit", parameter.physical_unit},
         {"believed", subject.theta[static_cast<Eigen::Index>(j)]},
         {"promised", bounds(design.promised)},
         {"model", subject.known ? bounds(*subject.known) : Json(nullptr)},
         {"figure_eight", design.figure_eight ? bounds(design.promised_eight) : Json(nullptr)},
         {"at_risk", design.at_risk
                         ? Json{{"promised", bounds(*design.at_risk)},
                                {"figure_eight", design.at_risk_eight ? bounds(*design.at_risk_eight) : Json(nullptr)}}
                         : Json(nullptr)}});
  }
  return out;
}

Json to_json(const design::DetectionDesign& design, const design::MotionLimits& limits) {
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "detection";
  out["guarantee"] = name(design.guarantee);
  out["at_risk"] = design.at_risk.empty()
                       ? Json(nullptr)
                       : Json{{"miss", design.miss}, {"warrant", core::warrant_word(design.at_risk_warrant)}};
  out["faults"] = Json::array();
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const design::PromisedFault& p = design.promised[k];
    const auto size = [](const design::PromisedFault& of) {
      return std::isfinite(of.smallest) ? Json{{"smallest", of.smallest}, {"t", of.t}} : Json(nullptr);
    };
    out["faults"].push_back(
        {{"fault", p.fault.name},
         {"side", p.side > 0.0 ? "positive" : "negative"},
         {"unit", p.fault.unit},
         {"asked", p.asked},
         {"promised", size(p)},
         {"figure_eight", design.figure_eight ? size(design.promised_eight[k]) : Json(nullptr)},
         {"at_risk",
          design.at_risk.empty()
              ? Json(nullptr)
              : Json{{"promised", size(design.at_risk[k])},
                     {"figure_eight", design.at_risk_eight.empty() ? Json(nullptr) : size(design.at_risk_eight[k])}}}});
  }
  return out;
}

Json to_json(const gap::DiscriminationDesign& design, const design::MotionLimits& limits) {
  Json out = frame(design.manoeuvre, design.figure_eight, limits);
  out["for"] = "discrimination";
  out["rivals"] = Json::array();
  for (const gap::Rival& rival : design.rivals) {
    Json causes = Json::array();
    for (const gap::RivalCause& cause : rival.causes) {
      causes.push_back({{"effect", cause.effect}, {"coefficients", cause.coefficients}, {"shape", cause.shape}});
    }
    out["rivals"].push_back({{"name", rival.name()}, {"causes", std::move(causes)}});
  }
  const auto promise = [](const std::vector<gap::RivalSeparation>& of, std::size_t k) {
    return of.empty() ? Json(nullptr)
                      : Json{{"delta", of[k].delta},
                             {"deviations", of[k].deviations()},
                             {"probability", of[k].probability()},
                             {"residual_ratio", of[k].ratio()}};
  };
  out["pairs"] = Json::array();
  for (std::size_t k = 0; k < design.promised.size(); ++k) {
    const gap::RivalSeparation& pair = design.promised[k];
    out["pairs"].push_back({{"true", design.rivals[pair.truth].name()},
                            {"other", design.rivals[pair.other].name()},
                            {"decidable", static_cast<bool>(design.decidable[k])},
                            {"promised", promise(design.promised, k)},
                            {"figure_eight", promise(design.promised_eight, k)},
                            {"analysed", promise(design.analysed, k)}});
  }
  out["inseparable"] = Json::array();
  for (const gap::InseparablePair& pair : design.inseparable) {
    out["inseparable"].push_back({{"rivals", {design.rivals[pair.first].name(), design.rivals[pair.second].name()}},
                                  {"by_any_motion", pair.by_any_motion},
                                  {"special_case", pair.special_case},
                                  {"measurement", pair.measurement}});
  }
  out["stages"] = design.stages;
  out["sentences"] = design.sentences;
  return out;
}

}  // namespace wheelwright::results
