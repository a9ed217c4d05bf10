// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "formats/files/json.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_file.hpp"
#include "results/model_json.hpp"

namespace wheelwright::results {
namespace {

using Status = commission::KinematicCommissioning::Status;

constexpr files::Words<Status, 4> kKinematicStatusWords{
    {{Status::done, "done"}, {Status::partial, "partial"}, {Status::absent, "absent"}, {Status::nothing, "nothing"}}};

Json measurement_json(const filter::OdometryMeasurement& m) {
  return {{"motion", files::word_of(robots::kMotionWords, m.motion)},
          {"motion_columns", m.motion_columns},
          {"position", m.position},
          {"heading", m.heading},
          {"gyro", m.gyro},
          {"held_pose", m.held_pose},
          {"count", m.count},
          {"nominal_step", m.nominal_step}};
}

Json noise_json(const commission::KinematicCommissioning& r, const filter::OdometryMeasurement& m) {
  const auto outputs = m.outputs(), units = m.output_units();
  Json list = Json::array();
  for (std::size_t i = 0; i < r.noise.size(); ++i) {
    const commission::OutputNoise& n = r.noise[i];
    list.push_back({{"output", outputs[i]},
                    {"unit", units[i]},
                    {"origin", files::word_of(robots::kNoiseOriginWords, n.origin)},
                    {"bound", n.bound},
                    {"learning", n.learning},
                    {"warrant", core::warrant_word(n.warrant)}});
  }
  return {{"outputs", list}, {"declared_too_small", r.declared_too_small}, {"raise", r.raise}};
}

Json parameters_json(const commission::KinematicCommissioning& r, const filter::OdometryMeasurement& m) {
  const auto names = m.parameters(), outputs = m.outputs();
  Json list = Json::array();
  for (std::size_t j = 0; j < r.parameters.size(); ++j) {
    const commission::KinematicParameter& p = r.parameters[j];
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"estimate", files::or_null(p.estimate)},
                    {"lower", p.lower},
                    {"upper", p.upper},
                    {"warrant", core::warrant_word(p.warrant)},
                    {"standard_error", files::or_null(p.standard_error)},
                    {"nominal", p.nominal},
                    {"excitation", files::word_of(kExcitationWords, p.excitation)},
                    {"reason", p.reason},
                    {"binding_samples",
                     {{"lower", proof_json(r.lower[j].binding, names, outputs)},
                      {"upper", proof_json(r.upper[j].binding, names, outputs)}}}});
  }
  return list;
}

Json validation_json(const commission::KinematicCommissioning& r, const filter::OdometryMeasurement& m,
                     const commission::FoldOptions& folds, double window) {
  const auto names = m.outputs();
  Json outputs = Json::array();
  for (std::size_t i = 0; i < r.validation.size(); ++i) {
    const commission::OutputValidation& v = r.validation[i];
    outputs.push_back({{"output", names[i]},
                       {"instants", v.instants},
                       {"coverage", v.coverage},
                       {"false_alarms", v.outside},
                       {"utilisation", v.utilisation},
                       {"rms", v.torque_rms},
                       {"residual_rms", v.residual_rms},
                       {"median_width", v.median_width},
                       {"median_width_box", v.median_width_box}});
  }
  return {{"blocks", folds.blocks}, {"held_out_every", folds.hold_out_every}, {"purge", window}, {"outputs", outputs}};
}

// Facets and hull of a set.
Json half_spaces_json(const std::vector<bounds::HalfSpace>& facets, const Box& hull,
                      const std::vector<std::string>& parameters, const std::vector<std::string>& outputs) {
  Json a = Json::array(), b = Json::array(), origin = Json::array();
  for (const bounds::HalfSpace& facet : facets) {
    a.push_back(numbers(facet.a));
    b.push_back(facet.b);
    origin.push_back(origin_json(facet.origin, parameters, outputs));
  }
  return {{"A", std::move(a)}, {"b", std::move(b)}, {"origin", std::move(origin)}, {"hull", sides_json(hull)}};
}

Json pose_risk_json(const detector::PoseRiskModel& risk, const commission::PoseRiskProof& proof,
                    const std::vector<std::string>& parameters) {
  const std::vector<std::string> outputs{kPoseSum};
  Json binding = Json::array();
  for (std::size_t j = 0; j < proof.lower.size(); ++j) {
    binding.push_back({{"lower", proof_json(proof.lower[j].binding, parameters, outputs)},
                       {"upper", proof_json(proof.upper[j].binding, parameters, outputs)}});
  }
  const auto table = [](const Eigen::MatrixXd& values) {
    Json rows = Json::array();
    for (Eigen::Index w = 0; w < values.rows(); ++w) {
      rows.push_back(numbers(values.row(w)));
    }
    return rows;
  };
  return {{"risk", risk.risk},
          {"warrant", core::warrant_word(risk.warrant)},
          {"errors",
           {{"position", error_class_json(risk.errors.position)},
            {"heading", error_class_json(risk.errors.heading)},
            {"shortest_step", risk.errors.shortest_step}}},
          {"feasible_set", half_spaces_json(risk.facets, risk.box, parameters, outputs)},
          {"binding", std::move(binding)},
          {"learning", proof.learning},
          {"scales", risk.scales},
          {"delay", risk.delay},
          {"usual", {{"position", table(risk.usual_position)}, {"heading", table(risk.usual_heading)}}}};
}

}  // namespace

std::optional<Json> kinematic_json(const commission::KinematicCommissioning& r, const commission::FoldOptions& folds) {
  if (r.status == Status::absent) {
    return std::nullopt;
  }
  Json json = {{"status", files::word_of(kKinematicStatusWords, r.status)}, {"message", r.message}};
  if (!r.model) {
    return json;
  }
  const detector::KinematicModel& m = *r.model;
  json["warrant"] = core::warrant_word(m.warrant);
  json["window"] = m.window;
  json["outputs"] = m.measurement.outputs();
  json["measurement"] = measurement_json(m.measurement);
  json["noise"] = noise_json(r, m.measurement);
  json["parameters"] = parameters_json(r, m.measurement);
  json["feasible_set"] = {{"rows", r.rows}, {"prior", sides_json(r.prior)}};
  json["feasible_set"].update(half_spaces_json(m.facets, m.box, m.measurement.parameters(), m.measurement.outputs()));
  json["detector"] = {{"estimate", numbers(m.estimate)},
                      {"error_bounds",
                       {{"motion", m.errors.motion},
                        {"position", m.errors.position},
                        {"heading", m.errors.heading},
                        {"acceleration", m.errors.acceleration},
                        {"yaw_gain", m.errors.yaw_gain},
                        {"estimated", numbers(m.errors.estimated)}}},
                      {"persistence", {{"k", m.persistence.k}, {"n", m.persistence.n}}}};
  if (m.constant) {
    json["detector"]["constant_thresholds"] = constant_thresholds_json(*m.constant, m.measurement.outputs());
  }
  if (m.errors.gyro > 0.0) {
    json["detector"]["error_bounds"]["gyro"] = m.errors.gyro;
  }
  json["validation"] = validation_json(r, m.measurement, folds, m.window);
  if (m.at_risk) {
    json["at_risk"] = pose_risk_json(*m.at_risk, r.at_risk, m.measurement.parameters());
  }
  return json;
}

}  // namespace wheelwright::results
