// SPDX-License-Identifier: Apache-2.0
#include "results/identification_json.hpp"

#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

#include "commission/physical.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_json.hpp"
#include "results/words/identification_words.hpp"

namespace wheelwright::results {

using files::word_of;

using namespace words;

namespace {

constexpr files::Words<IdentificationStanding, 3> kStandingWords{{{IdentificationStanding::good, "good"},
                                                                  {IdentificationStanding::caution, "caution"},
                                                                  {IdentificationStanding::bad, "bad"}}};
constexpr files::Words<inference::NoiseMeaning, 4> kMeaningWords{{{inference::NoiseMeaning::estimate, "estimate"},
                                                                  {inference::NoiseMeaning::upper_limit, "upper_limit"},
                                                                  {inference::NoiseMeaning::lower_limit, "lower_limit"},
                                                                  {inference::NoiseMeaning::unknown, "unknown"}}};
constexpr files::Words<inference::RobustStatus, 3> kRobustWords{
    {{inference::RobustStatus::converged, "converged"},
     {inference::RobustStatus::not_converged, "not_converged"},
     {inference::RobustStatus::infeasible, "infeasible"}}};
constexpr files::Words<inference::ConstrainedStatus, 3> kConstrainedWords{
    {{inference::ConstrainedStatus::solved, "solved"},
     {inference::ConstrainedStatus::undetermined, "undetermined"},
     {inference::ConstrainedStatus::infeasible, "infeasible"}}};
constexpr files::Words<inference::Unseen, 4> kUnseenWords{{{inference::Unseen::not_moved, "not_moved"},
                                                           {inference::Unseen::not_separated, "not_separated"},
                                                           {inference::Unseen::noise, "noise"},
                                                           {inference::Unseen::imprecise, "imprecise"}}};
constexpr files::Words<identify::ShapeState, 4> kShapeWords{{{identify::ShapeState::identified, "identified"},
                                                             {identify::ShapeState::at_lower, "at_lower"},
                                                             {identify::ShapeState::at_upper, "at_upper"},
                                                             {identify::ShapeState::flat, "flat"}}};
constexpr files::Words<inference::KinematicState, 3> kKinematicWords{
    {{inference::KinematicState::identified, "identified"},
     {inference::KinematicState::not_identified, "not_identified"},
     {inference::KinematicState::fixed, "fixed"}}};

using Scales = std::optional<std::vector<commission::PhysicalScale>>;

// θ as physical quantities; null where there is no scale or no θ.
Json physical(const Eigen::VectorXd& theta, const Scales& scales) {
  if (!scales || static_cast<std::size_t>(theta.size()) != scales->size()) {
    return nullptr;
  }
  Json list = Json::array();
  for (std::size_t j = 0; j < scales->size(); ++j) {
    list.push_back((*scales)[j].scale * theta[static_cast<Eigen::Index>(j)] - (*scales)[j].offset);
  }
  return list;
}

Json parameters_json(const commission::Identification& r, const Scales& scales) {
  Json list = Json::array();
  const commission::Fit& fit = r.fit;
  for (std::size_t j = 0; j < fit.excitation.size(); ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const model::Parameter& p = r.setting.model.parameters[j];
    const bool given = fit.excitation[j].state != identify::Excitation::not_excited;
    const double error = fit.residuals.standard_error.size() > at ? fit.residuals.standard_error[at] : NAN;
    Json entry = {{"name", p.name},
                  {"unit", commission::parameter_unit(r.setting.robot, p)},
                  {"excitation", word_of(kExcitationWords, fit.excitation[j].state)},
                  {"reason", fit.excitation[j].reason},
                  {"estimate", given ? Json(fit.estimate[at]) : Json(nullptr)},
                  {"standard_error", given ? Json(error) : Json(nullptr)},
                  {"physical", nullptr}};
    if (scales) {
      const commission::PhysicalScale& s = (*scales)[j];
      entry["physical"] = {{"name", p.physical},
                           {"unit", p.physical_unit},
                           {"scale", s.scale},
                           {"offset", s.offset},
                           {"estimate", given ? Json(s.scale * fit.estimate[at] - s.offset) : Json(nullptr)},
                           {"standard_error", given ? Json(std::abs(s.scale) * error) : Json(nullptr)}};
    }
    list.push_back(entry);
  }
  return list;
}

Json estimators_json(const identify::EstimatorChoice& choice) {
  if (choice.candidates.empty()) {
    return nullptr;
  }
  Json json = {{"chosen", identify::to_string(choice.best().estimator)},
               {"reason", choice.reason},
               {"in_doubt", choice.in_doubt},
               {"predicted_bias", nullptr},
               {"endogeneity_test", endogeneity_json(choice)},
               {"candidates", candidates_json(choice)}};
  if (choice.predicted_bias.size() > 0) {
    json["predicted_bias"] = numbers(choice.predicted_bias);
  }
  return json;
}

Json regions_json(const inference::RegionComparison& regions, const Scales& scales) {
  Json methods = Json::array();
  for (const inference::RegionRow& row : regions.rows) {
    methods.push_back({{"method", inference::to_string(row.method)},
                       {"available", row.available},
                       {"all_at_once", row.all_at_once},
                       {"confidence", row.confidence},
                       {"promise", row.promise},
                       {"remark", row.remark},
                       {"lower", row.available ? numbers(row.lower) : Json(nullptr)},
                       {"upper", row.available ? numbers(row.upper) : Json(nullptr)},
                       {"physical_lower", row.available ? physical(row.lower, scales) : Json(nullptr)},
                       {"physical_upper", row.available ? physical(row.upper, scales) : Json(nullptr)}});
  }
  return {{"bootstrap_seconds", regions.bootstrap_seconds},
          {"sign_seconds", regions.sign_seconds},
          {"sign_groups", regions.sign_groups},
          {"methods", methods}};
}

Json active_json(const std::vector<inference::ActiveConstraint>& active) {
  Json list = Json::array();
  for (const inference::ActiveConstraint& a : active) {
    list.push_back({{"words", a.words},
                    {"multiplier", a.multiplier},
                    {"excess", a.excess},
                    {"excess_in_errors", a.excess_in_errors}});
  }
  return list;
}

Json robust_json(const inference::RobustFit& fit, const commission::Setting& s, const Scales& scales) {
  if (fit.instants == 0) {
    return nullptr;
  }
  Json json = {{"loss", "huber"},
               {"status", word_of(kRobustWords, fit.status)},
               {"estimate", numbers(fit.estimate)},
               {"physical", physical(fit.estimate, scales)},
               {"standard_error", numbers(fit.standard_error)},
               {"freedom", fit.freedom},
               {"outputs", Json::array()},
               {"episodes", Json::array()},
               {"active", active_json(fit.active)}};
  for (std::size_t i = 0; i < fit.outputs.size(); ++i) {
    const inference::OutputWeights& w = fit.outputs[i];
    json["outputs"].push_back({{"output", s.model.outputs[i]},
                               {"unit", commission::output_unit(s.robot, s.model.output_units[i])},
                               {"scale", w.scale},
                               {"down_weighted", w.down_weighted},
                               {"gaussian_share", w.gaussian_share}});
  }
  for (const inference::Episode& e : fit.episodes) {
    json["episodes"].push_back({{"output", s.model.outputs[e.output]},
                                {"first", e.first_time},
                                {"last", e.last_time},
                                {"instants", e.instants},
                                {"worst_row", e.worst_sample},
                                {"worst_time", e.worst_time},
                                {"worst", e.worst}});
  }
  return json;
}

Json constrained_json(const inference::ConstrainedFit& fit, const Scales& scales) {
  if (fit.estimate.size() == 0 && fit.active.empty()) {
    return nullptr;
  }
  return {{"status", word_of(kConstrainedWords, fit.status)},
          {"estimate", numbers(fit.estimate)},
          {"physical", physical(fit.estimate, scales)},
          {"free_estimate", numbers(fit.free_estimate)},
          {"active", active_json(fit.active)}};
}

Json noise_json(const std::vector<commission::ColumnNoise>& noise) {
  Json list = Json::array();
  for (const commission::ColumnNoise& n : noise) {
    Json entry = {{"column", n.column},
                  {"known", nullptr},
                  {"found",
                   {{"method", inference::to_string(n.choice.method)},
                    {"meaning", word_of(kMeaningWords, n.choice.meaning)},
                    {"unit", n.unit},
                    {"sd", n.choice.sd},
                    {"relative_sd", n.choice.relative_sd},
                    {"bound", n.choice.bound.bound},
                    {"assumption", n.choice.assumption},
                    {"reason", n.choice.reason}}}};
    if (n.known) {
      entry["known"] = {{"bound", n.known->bound}, {"unit", n.known->unit}, {"origin", n.known->origin}};
    }
    list.push_back(entry);
  }
  return list;
}

Json combinations_json(const std::vector<inference::KnownCombination>& list) {
  Json json = Json::array();
  for (const inference::KnownCombination& c : list) {
    json.push_back(
        {{"words", c.words}, {"coefficients", numbers(c.coefficients)}, {"relative_error", c.relative_error}});
  }
  return json;
}

Json identifiability_json(const inference::Identifiability& i, bool physical_words) {
  if (i.singular_values.size() == 0) {
    return nullptr;
  }
  Json unseen = Json::array();
  for (const inference::UnseenDirection& u : i.unseen) {
    unseen.push_back({{"why", word_of(kUnseenWords, u.why)},
                      {"words", u.words},
                      {"manoeuvres", u.manoeuvres},
                      {"direction", numbers(u.direction)},
                      {"parameters", std::vector<std::size_t>(u.members.begin(), u.members.end())}});
  }
  return {{"coordinates", physical_words ? "physical" : "theta"},
          {"rank", i.rank},
          {"noise_rank", i.noise_rank},
          {"condition", i.condition},
          {"singular_values", numbers(i.singular_values)},
          {"tolerance", i.tolerance},
          {"base", std::vector<std::size_t>(i.base.begin(), i.base.end())},
          {"seen", combinations_json(i.seen)},
          {"unseen", unseen},
          {"known", combinations_json(i.known)}};
}

Json information_json(const inference::InformationOverTime& information) {
  Json windows = Json::array(), parameters = Json::array();
  for (const identify::MomentBlock& w : information.windows) {
    windows.push_back({w.first, w.last});
  }
  for (const inference::ParameterInformation& p : information.parameters) {
    Json spans = Json::array();
    for (const auto& [first, last] : p.spans) {
      spans.push_back({first, last});
    }
    parameters.push_back(
        {{"information", p.information}, {"seconds", p.seconds}, {"spans", spans}, {"share", numbers(p.share)}});
  }
  return {{"coverage", inference::InformationOptions{}.coverage}, {"windows", windows}, {"parameters", parameters}};
}

Json shapes_json(const std::vector<commission::ShapeFinding>& shapes) {
  Json list = Json::array();
  for (const commission::ShapeFinding& f : shapes) {
    Json curve = Json::array();
    for (const commission::ShapePoint& point : f.curve) {
      curve.push_back({point.shape, point.residual_ratio});
    }
    const bool told = f.converged && f.state == identify::ShapeState::identified;
    list.push_back({{"name", f.name},
                    {"unit", f.unit},
                    {"state", word_of(kShapeWords, f.state)},
                    {"converged", f.converged},
                    {"matters", matters(f)},
                    {"words", in_words(f)},
                    {"estimate", f.estimate},
                    {"standard_error", told ? Json(f.standard_error) : Json(nullptr)},
                    {"freedom", f.freedom},
                    {"residual_ratio", f.residual_ratio},
                    {"searched", {f.searched.lower, f.searched.upper}},
                    {"curve", curve}});
  }
  return list;
}

Json kinematics_json(const std::optional<inference::KinematicCalibration>& k) {
  if (!k) {
    return nullptr;
  }
  const auto quantity = [](const inference::KinematicQuantity& q, const char* unit) -> Json {
    return {{"unit", unit},           {"state", word_of(kKinematicWords, q.state)},
            {"estimate", q.estimate}, {"standard_error", q.standard_error},
            {"lower", q.lower},       {"upper", q.upper},
            {"reason", q.reason}};
  };
  return {{"converged", k->converged},
          {"windows", k->windows},
          {"poses", k->poses},
          {"held_poses", k->held_poses},
          {"outlying_poses", k->outlying_poses},
          {"radius_right", quantity(k->radius_right, "m")},
          {"radius_left", quantity(k->radius_left, "m")},
          {"track_width", quantity(k->track_width, "m")},
          {"track_at_nominal_radius", quantity(k->track_at_nominal_radius, "m")},
          {"radius_scale", quantity(k->radius_scale, "1")},
          {"asymmetry", quantity(k->asymmetry, "1")},
          {"axle_offset", quantity(k->axle_offset, "m")},
          {"heading_spread", k->heading_spread},
          {"position_spread", k->position_spread}};
}

Json data_json(const commission::Survey& survey, const logs::LogReport& data) {
  return {{"files", files_json(data)},         {"rows", survey.rows},
          {"segments", survey.segments},       {"seconds", survey.seconds},
          {"median_step", survey.median_step}, {"repairs", logs::sentences(data)}};
}

}  // namespace

Json to_json(const commission::Identification& r, const logs::LogReport& data, const std::string& software,
             std::uint64_t seed) {
  const commission::Setting& s = r.setting;
  const Scales scales = commission::physical_scales(s.robot, s.model);
  const FilterDesign& f = s.filter;
  return {{"schema", kIdentificationSchema},
          {"software", software},
          {"seed", seed},
          {"confidence", r.confidence},
          {"standing", word_of(kStandingWords, standing(r))},
          {"message", words::verdict(r)},
          {"findings", words::findings(r)},
          {"next", next_steps(r)},
          {"robot", robots::to_json(s.robot)},
          {"filter", r.effort ? Json{{"order", f.order},
                                     {"alpha", f.alpha},
                                     {"beta", f.beta},
                                     {"delay", f.delay()},
                                     {"chosen", !s.filter_choice.curve.empty()}}
                              : Json(nullptr)},
          {"parameters", parameters_json(r, scales)},
          {"estimators", estimators_json(r.fit.choice)},
          {"regions", regions_json(r.regions, scales)},
          {"robust", robust_json(r.robust, s, scales)},
          {"constrained", constrained_json(r.constrained, scales)},
          {"noise", noise_json(r.noise)},
          {"identifiability", identifiability_json(r.identifiability, scales.has_value())},
          {"information", information_json(r.information)},
          {"shapes", shapes_json(r.shapes)},
          {"kinematics", kinematics_json(r.kinematics)},
          {"data", data_json(s.survey, data)},
          {"notes", r.notes}};
}

}  // namespace wheelwright::results
