// SPDX-License-Identifier: Apache-2.0
#include "results/model_json.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "commission/physical.hpp"
#include "formats/files/json.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/assumptions_json.hpp"
#include "results/model_file.hpp"

namespace wheelwright::results {

using files::word_of;

Json numbers(const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); }

Json files_json(const logs::LogReport& data) {
  Json files = Json::array();
  for (const logs::LogFileReport& f : data.files) {
    files.push_back({{"path", f.path}, {"hash", f.hash}, {"bytes", f.bytes}, {"rows", f.rows}});
  }
  return files;
}

Json constant_thresholds_json(const detector::ConstantThresholds& thresholds, const std::vector<std::string>& outputs) {
  Json list = Json::array();
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const detector::ConstantThreshold& t = thresholds.outputs[i];
    list.push_back({{"output", outputs[i]},
                    {"value", t.value},
                    {"stated", t.stated},
                    {"held_out", t.held_out},
                    {"exceeded", t.exceeded},
                    {"chance", t.chance}});
  }
  return {{"block", thresholds.block},       {"blocks", thresholds.blocks},
          {"learning", thresholds.learning}, {"false_alarms", files::or_null(thresholds.false_alarms())},
          {"refuted", thresholds.refuted()}, {"outputs", std::move(list)}};
}

Json candidates_json(const identify::EstimatorChoice& choice) {
  Json list = Json::array();
  for (const identify::EstimatorCandidate& c : choice.candidates) {
    Json candidate = {{"estimator", identify::to_string(c.estimate.estimator)},
                      {"origin", c.origin},
                      {"usable", c.estimate.usable},
                      {"reason", c.estimate.reason},
                      {"estimate", numbers(c.estimate.theta)},
                      {"standard_error", numbers(c.estimate.standard_error)},
                      {"freedom", c.estimate.freedom}};
    if (c.strength.size() > 0) {
      candidate["instrument_strength"] = numbers(c.strength);
      candidate["instrument_relevance"] = numbers(c.relevance);
    }
    list.push_back(candidate);
  }
  return list;
}

Json endogeneity_json(const identify::EstimatorChoice& choice) {
  if (!choice.tested_against || !choice.test.made) {
    return nullptr;
  }
  return {{"against", identify::to_string(choice.candidates[*choice.tested_against].estimate.estimator)},
          {"F", choice.test.statistic},
          {"p_value", choice.test.p_value}};
}

Json sides_json(const Box& box) {
  Json json = Json::array();
  for (const Interval& side : box.sides) {
    json.push_back({side.lower, side.upper});
  }
  return json;
}

Json error_class_json(const filter::ErrorClass& c) {
  Json json = {{"bound", c.bound}, {"bias", c.bias}, {"correlation", c.correlation}};
  if (c.deviation < c.bound) {
    json["deviation"] = c.deviation;
  }
  return json;
}

Json assumptions_json(const std::vector<core::Assumption>& assumptions) {
  Json list = Json::array();
  for (const core::Assumption& a : assumptions) {
    list.push_back({{"id", a.id},
                    {"statement", a.statement},
                    {"declared_by", a.declared_by},
                    {"test", a.test},
                    {"verdict", word_of(robots::kVerdictWords, a.verdict)},
                    {"detail", a.detail}});
  }
  return list;
}

Json error_classes_json(const filter::ErrorClasses& classes) {
  return {{"motion", error_class_json(classes.motion)},
          {"effort", error_class_json(classes.effort)},
          {"count", classes.count},
          {"shortest_step", classes.shortest_step}};
}

std::vector<std::string> parameter_names(const Model& model) {
  std::vector<std::string> names;
  for (const model::Parameter& parameter : model.parameters) {
    names.push_back(parameter.name);
  }
  return names;
}

Json origin_json(const bounds::RowOrigin& origin, const std::vector<std::string>& parameters,
                 const std::vector<std::string>& outputs) {
  if (origin.is_prior) {
    return {{"prior", parameters[origin.parameter]}, {"side", word_of(kSideWords, origin.side)}};
  }
  return {{"row", origin.sample},
          {"t", origin.t},
          {"output", outputs[origin.output]},
          {"side", word_of(kSideWords, origin.side)}};
}

Json proof_json(const std::vector<bounds::WeightedRow>& rows, const std::vector<std::string>& parameters,
                const std::vector<std::string>& outputs) {
  Json list = Json::array();
  for (const bounds::WeightedRow& weighted : rows) {
    if (weighted.multiplier > 0.0) {
      Json row = origin_json(weighted.row.origin, parameters, outputs);
      row["multiplier"] = weighted.multiplier;
      list.push_back(row);
    }
  }
  return list;
}

namespace {

constexpr std::size_t kMostVertices = 256;

Json origin_json(const bounds::RowOrigin& origin, const Model& model) {
  return results::origin_json(origin, parameter_names(model), model.outputs);
}

Json proof_json(const std::vector<bounds::WeightedRow>& rows, const Model& model) {
  return results::proof_json(rows, parameter_names(model), model.outputs);
}

// What bounds motion and efforts between samples; null where the rows do not hold it.
Json between_samples_json(const filter::SignalErrors& errors) {
  if (!errors.between_samples) {
    return nullptr;
  }
  Json mobility = Json::array();
  for (Eigen::Index c = 0; c < errors.motion.mobility.rows(); ++c) {
    mobility.push_back(numbers(Eigen::VectorXd(errors.motion.mobility.row(c))));
  }
  return {{"acceleration", numbers(errors.motion.limit)},
          {"mobility", std::move(mobility)},
          {"largest", numbers(errors.motion.largest)},
          {"effort", numbers(errors.motion.effort)}};
}

// What the motion in the rows can be wrong by; what the effort can is said elsewhere.
Json motion_errors_json(const filter::SignalErrors& errors) {
  Json json = {{"acceleration", numbers(errors.acceleration)},
               {"speed", numbers(errors.speed)},
               {"speed_sample", numbers(errors.speed_sample)},
               {"joint_sample", errors.joint_sample},
               {"heading", errors.heading},
               {"between_samples", between_samples_json(errors)}};
  if (errors.held_between) {
    json["held_between"] = true;
  }
  return json;
}

Json filter_json(const FilterDesign& filter, const commission::FilterChoice& choice) {
  Json json = {{"order", filter.order},   {"alpha", filter.alpha},   {"beta", filter.beta},
               {"settle", filter.settle}, {"delay", filter.delay()}, {"chosen", !choice.curve.empty()}};
  for (const commission::FilterCandidate& c : choice.curve) {
    json["curve"].push_back({{"beta", c.design.beta}, {"criterion", c.criterion}});
  }
  return json;
}

Json measurement_json(const Measurement& m) {
  return {{"motion", word_of(robots::kMotionWords, m.motion)},
          {"motion_columns", m.motion_columns},
          {"effort_columns", m.effort_columns},
          {"heading_column", m.heading_column},
          {"hold", word_of(robots::kHoldWords, m.hold)},
          {"effort_unsigned", m.effort_unsigned},
          {"count", m.count},
          {"nominal_step", m.nominal_step},
          {"shortest_step", m.shortest_step}};
}

Json noise_json(const Commissioning& r, const Model& model) {
  Json json = {{"mode", word_of(robots::kNoiseModeWords, r.noise_mode)}, {"outputs", Json::array()}};
  for (std::size_t i = 0; i < r.noise.size(); ++i) {
    const commission::OutputNoise& n = r.noise[i];
    Json output = {{"output", model.outputs[i]},
                   {"unit", commission::output_unit(r.model.robot, model.output_units[i])},
                   {"origin", word_of(robots::kNoiseOriginWords, n.origin)},
                   {"bound", n.bound},
                   {"learning", n.learning},
                   {"warrant", core::warrant_word(n.warrant)}};
    if (n.origin == core::NoiseOrigin::estimated) {
      output["over_rms"] = n.how.over_rms;
      output["over_largest"] = n.how.over_largest;
      output["heavy_tail"] = n.how.heavy_tail;
    }
    json["outputs"].push_back(output);
  }
  json["motion"] = motion_errors_json(r.row_errors);
  for (std::size_t j = 0; j < r.left_out.size(); ++j) {
    if (r.left_out[j]) {
      json["left_out"].push_back(model.parameters[j].name);
    }
  }
  return json;
}

Json parameter_json(const Commissioning& r, std::size_t j, const Robot& robot, const Model& model) {
  const commission::ParameterResult& p = r.parameters[j];
  const auto proof = [&](const std::vector<bounds::CertifiedBound>& bounds) {
    return j < bounds.size() ? proof_json(bounds[j].binding, model) : Json::array();
  };
  Json json{{"name", p.parameter.name},
            {"unit", commission::parameter_unit(robot, p.parameter)},
            {"estimate", files::or_null(p.estimate)},
            {"lower", p.lower},
            {"upper", p.upper},
            {"warrant", core::warrant_word(p.warrant)},
            {"standard_error", files::or_null(p.standard_error)},
            {"chebyshev_centre", p.chebyshev},
            {"excitation", word_of(kExcitationWords, p.excitation)},
            {"reason", p.reason},
            {"lower_is_prior", p.lower_is_prior},
            {"upper_is_prior", p.upper_is_prior},
            {"estimate_inside", p.estimate_inside},
            {"binding_samples", {{"lower", proof(r.feasible.lower)}, {"upper", proof(r.feasible.upper)}}}};
  if (r.at_risk && r.at_risk->set) {
    const Interval& side = r.at_risk->set->hull().sides[j];
    json["at_risk"] = {side.lower, side.upper};
  }
  return json;
}

Json physical_json(const Commissioning& r, const Robot& robot, const Model& model) {
  const auto scales = commission::physical_scales(robot, model);
  if (!scales) {
    return nullptr;
  }
  Json json = Json::object();
  for (std::size_t j = 0; j < r.parameters.size(); ++j) {
    const commission::ParameterResult& p = r.parameters[j];
    const commission::PhysicalScale& s = (*scales)[j];
    const auto physical = [&](double theta) { return s.scale * theta - s.offset; };
    const Interval scaled = Interval{s.scale, s.scale} * Interval{p.lower, p.upper} - Interval{s.offset, s.offset};
    Json entry = {{"unit", p.parameter.physical_unit},
                  {"estimate", p.estimate ? Json(physical(*p.estimate)) : Json(nullptr)},
                  {"lower", scaled.lower},
                  {"upper", scaled.upper},
                  {"warrant", core::warrant_word(p.warrant)},
                  {"standard_error", p.standard_error ? Json(s.scale * *p.standard_error) : Json(nullptr)}};
    if (r.at_risk && r.at_risk->set) {
      const Interval at_risk =
          Interval{s.scale, s.scale} * r.at_risk->set->hull().sides[j] - Interval{s.offset, s.offset};
      entry["at_risk"] = {at_risk.lower, at_risk.upper};
    }
    if (const auto nominal = robot.nominal.find(p.parameter.physical); nominal != robot.nominal.end()) {
      entry["nominal"] = nominal->second;
    }
    json[p.parameter.physical] = entry;
  }
  return json;
}

Json identification_json(const Commissioning& r) {
  Json json = {{"rank", r.rank}, {"condition", r.condition}, {"freedom", r.residuals.freedom}};
  const identify::EstimatorChoice& choice = r.estimators;
  if (choice.candidates.empty()) {
    return json;
  }
  json["estimator"] = identify::to_string(choice.best().estimator);
  json["reason"] = choice.reason;
  json["in_doubt"] = choice.in_doubt;
  if (const Json test = endogeneity_json(choice); !test.is_null()) {
    json["endogeneity_test"] = test;
  }
  json["candidates"] = candidates_json(choice);
  return json;
}

Json set_json(const Commissioning& r, const Model& model) {
  Json json = {{"status", r.feasible.status == FeasibleSet::Status::nonempty ? "nonempty" : "empty"},
               {"rows", r.feasible.rows},
               {"passes", r.feasible.passes},
               {"sign_parts", r.feasible.sign_parts},
               {"convexified", r.feasible.convexified},
               {"dropped", r.dropped}};
  for (const Interval& side : r.prior.sides) {
    json["prior"].push_back({side.lower, side.upper});
  }
  if (!r.feasible.polytope) {
    json["contradiction"] = proof_json(r.feasible.contradiction, model);
    json["noise_factor_needed"] = r.minimax;
    return json;
  }
  Json a = Json::array(), b = Json::array(), origin = Json::array();
  for (const bounds::HalfSpace& facet : r.feasible.polytope->facets()) {
    a.push_back(numbers(facet.a));
    b.push_back(facet.b);
    origin.push_back(origin_json(facet.origin, model));
  }
  json["A"] = a;
  json["b"] = b;
  json["origin"] = origin;
  for (const Interval& side : r.feasible.hull.sides) {
    json["hull"].push_back({side.lower, side.upper});
  }
  if (r.feasible.polytope->has_vertices() && r.feasible.polytope->vertex_count() <= kMostVertices) {
    json["blocks"] = Json::array();
    for (const Polytope::Block& block : r.feasible.polytope->blocks()) {
      Json vertices = Json::array();
      const Eigen::MatrixXd points = block.vertices ? block.vertices->points : Eigen::MatrixXd();
      for (Eigen::Index k = 0; k < points.cols(); ++k) {
        vertices.push_back(numbers(points.col(k)));
      }
      json["blocks"].push_back({{"parameters", block.parameters}, {"vertices", vertices}});
    }
  }
  return json;
}

// The proof of a set at a stated risk: the sums that it needs, and what names them.
class RiskProof {
 public:
  RiskProof(const commission::RiskSet& risk, const Model& model) : risk_(risk), model_(model) {
    const auto need = [&](const bounds::RowOrigin& name) {
      const commission::RiskOrigin origin = commission::risk_origin(risk, name);
      if (origin.kind == commission::RiskOrigin::Kind::sum) {
        numbers_.emplace(origin.number, 0);
      }
    };
    for (const bounds::HalfSpace& facet : risk.set->facets()) {
      need(facet.origin);
    }
    for (const auto* ends : {&risk.set->lower(), &risk.set->upper()}) {
      for (const bounds::CertifiedBound& bound : *ends) {
        std::ranges::for_each(bound.binding, [&](const bounds::WeightedRow& row) { need(row.row.origin); });
      }
    }
    std::size_t next = 0;
    for (auto& [sum, number] : numbers_) {
      number = next++;
    }
  }

  [[nodiscard]] Json origin(const bounds::RowOrigin& name) const {
    using Kind = commission::RiskOrigin::Kind;
    const commission::RiskOrigin origin = commission::risk_origin(risk_, name);
    switch (origin.kind) {
      case Kind::guaranteed: return {{"facet", origin.number}};
      case Kind::sum: return {{"sum", numbers_.at(origin.number)}, {"side", word_of(kSideWords, origin.side)}};
      case Kind::box: break;
    }
    return {{"box", model_.parameters[origin.number].name}, {"side", word_of(kSideWords, origin.side)}};
  }

  [[nodiscard]] Json of(const bounds::CertifiedBound& bound) const {
    Json list = Json::array();
    for (const bounds::WeightedRow& weighted : bound.binding) {
      if (weighted.multiplier > 0.0) {
        list.push_back(origin(weighted.row.origin));
        list.back()["multiplier"] = weighted.multiplier;
      }
    }
    return list;
  }

  [[nodiscard]] Json ellipsoids() const {
    Json list = Json::array();
    for (const commission::RiskEllipsoid& e : risk_.ellipsoids) {
      Json names = Json::array();
      for (const std::size_t j : e.parameters) {
        names.push_back(model_.parameters[j].name);
      }
      list.push_back({{"delay", e.delay},
                      {"parameters", std::move(names)},
                      {"risk", e.risk},
                      {"log_volume", files::or_null(e.log_volume)},
                      {"squared_radius", files::or_null(e.squared_radius)}});
    }
    return list;
  }

  [[nodiscard]] Json sums() const {
    Json list = Json::array();
    for (const auto& [sum, number] : numbers_) {
      const commission::RiskFacet& f = risk_.facets[sum];
      const std::vector<std::size_t>& block = risk_.ellipsoids[f.ellipsoid].parameters;
      list.push_back({{"ellipsoid", f.ellipsoid},
                      {"weights", numbers(f.weights(block))},
                      {"Y", numbers(f.Y(block))},
                      {"dY", numbers(f.dY(block))},
                      {"y", f.y},
                      {"dy", f.dy},
                      {"radius", f.radius},
                      {"straight", f.share.straight},
                      {"worst", f.share.worst}});
    }
    return list;
  }

 private:
  const commission::RiskSet& risk_;
  const Model& model_;
  std::map<std::size_t, std::size_t> numbers_;  // of the sums that are written, by those that they have in the set
};

Json risk_json(const detector::RiskModel& risk, const commission::RiskSet& set, const Model& model) {
  const RiskProof proof(set, model);
  Json a = Json::array(), b = Json::array(), origin = Json::array(), binding = Json::array();
  for (const bounds::HalfSpace& facet : set.set->facets()) {
    a.push_back(numbers(facet.a));
    b.push_back(facet.b);
    origin.push_back(proof.origin(facet.origin));
  }
  for (std::size_t j = 0; j < model.p(); ++j) {
    binding.push_back({{"lower", proof.of(set.set->lower()[j])}, {"upper", proof.of(set.set->upper()[j])}});
  }
  Json json = {{"risk", risk.risk},
               {"warrant", core::warrant_word(risk.warrant)},
               {"errors", error_classes_json(risk.errors)},
               {"feasible_set",
                {{"A", std::move(a)},
                 {"b", std::move(b)},
                 {"origin", std::move(origin)},
                 {"hull", sides_json(risk.box)},
                 {"box", sides_json(set.box)}}},
               {"binding", std::move(binding)},
               {"learning", set.learning},
               {"ellipsoids", proof.ellipsoids()},
               {"sums", proof.sums()},
               {"scales", risk.scales},
               {"delay", risk.delay},
               {"usual", Json::array()}};
  for (Eigen::Index w = 0; w < risk.usual.rows(); ++w) {
    json["usual"].push_back(numbers(risk.usual.row(w)));
  }
  return json;
}

Json validation_json(const Commissioning& r, const Model& model) {
  Json outputs = Json::array();
  for (std::size_t i = 0; i < r.validation.size(); ++i) {
    const commission::OutputValidation& v = r.validation[i];
    const auto share = [&](double width) { return v.torque_rms > 0.0 ? width / v.torque_rms : 0.0; };
    outputs.push_back({{"output", model.outputs[i]},
                       {"warrant", core::warrant_word(v.warrant)},
                       {"instants", v.instants},
                       {"coverage", v.coverage},
                       {"coverage_noise_free", v.coverage_noise_free},
                       {"false_alarms", v.outside},
                       {"nrmse", v.nrmse},
                       {"utilisation", v.utilisation},
                       {"torque_rms", v.torque_rms},
                       {"residual_rms", v.residual_rms},
                       {"width_over_torque_rms", share(v.median_width)},
                       {"box_width_over_torque_rms", share(v.median_width_box)},
                       {"smallest_certain_kappa", v.smallest_kappa}});
  }
  return {{"blocks", r.folds.blocks},
          {"held_out_every", r.folds.hold_out_every},
          {"purge", r.folds.purge},
          {"outputs", outputs}};
}

Json contradictions_json(const Commissioning& r) {
  Json list = Json::array();
  for (const commission::LogContradiction& c : r.contradictions) {
    list.push_back({{"id", commission::to_string(c.kind)},
                    {"withdraws", c.withdraws},
                    {"subject", c.subject},
                    {"value", c.value},
                    {"limit", c.limit},
                    {"sentence", c.sentence},
                    {"next", c.next}});
  }
  return list;
}

Json data_json(const Commissioning& r, const logs::LogReport& data) {
  return {{"files", files_json(data)},           {"rows", r.survey.rows},
          {"segments", r.survey.segments},       {"seconds", r.survey.seconds},
          {"median_step", r.survey.median_step}, {"largest_step", r.survey.largest_step},
          {"repairs", logs::sentences(data)}};
}

}  // namespace

Json to_json(const Commissioning& r, const logs::LogReport& data, const std::string& software) {
  const OnlineModel& m = r.model;
  const bool has_model = !m.facets.empty() && r.status != Commissioning::Status::nothing;
  Json json = {{"schema", robots::kModelSchema},
               {"software", software},
               {"status", word_of(kStatusWords, r.status)},
               {"message", r.message},
               {"warrant", core::warrant_word(m.warrant)},
               {"robot", robots::to_json(m.robot)},
               {"filter", filter_json(m.filter, r.filter_choice)},
               {"measurement", measurement_json(m.measurement)},
               {"noise", noise_json(r, m.model)},
               {"parameters", Json::array()}};
  for (std::size_t j = 0; j < r.parameters.size(); ++j) {
    json["parameters"].push_back(parameter_json(r, j, m.robot, m.model));
  }
  json["physical"] = physical_json(r, m.robot, m.model);
  json["identification"] = identification_json(r);
  json["feasible_set"] = set_json(r, m.model);
  if (has_model) {
    Json bounds = motion_errors_json(m.errors);
    bounds["output"] = numbers(m.errors.output);
    json["detector"] = {{"estimate", numbers(m.estimate)},
                        {"error_bounds", std::move(bounds)},
                        {"persistence", {{"k", m.persistence.k}, {"n", m.persistence.n}}}};
    if (m.constant) {
      json["detector"]["constant_thresholds"] = constant_thresholds_json(*m.constant, m.model.outputs);
    }
  }
  if (m.at_risk) {
    json["at_risk"] = risk_json(*m.at_risk, *r.at_risk, m.model);
    for (const commission::RiskReach& reach : r.reach) {
      Json sizes = Json::array();
      for (const double size : reach.size) {
        sizes.push_back(files::or_null(size));
      }
      json["at_risk"]["reach"].push_back(
          {{"weight", reach.weight.name}, {"unit", reach.unit}, {"within", reach.within}, {"size", std::move(sizes)}});
    }
  }
  json["validation"] = validation_json(r, m.model);
  if (auto kinematic = kinematic_json(r.kinematic, r.folds)) {
    json["kinematic"] = std::move(*kinematic);
  }
  json["contradictions"] = contradictions_json(r);
  json["data"] = data_json(r, data);
  json["assumptions"] = assumptions_json(r.assumptions);
  if (!r.little.why.empty()) {
    json["little_learned"] = {{"why", r.little.why}, {"remedies", r.little.remedies}};
  }
  json["notes"] = r.notes;
  return json;
}

}  // namespace wheelwright::results
