// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/kinematic_json.hpp>

#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include <wheelwright/files/json.hpp>
#include <wheelwright/results/identification_json.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/results/model_words.hpp>

namespace wheelwright::results {
namespace {

using Status = commission::KinematicCommissioning::Status;

constexpr files::Words<Status, 4> kKinematicStatusWords{
    {{Status::done, "done"}, {Status::partial, "partial"}, {Status::absent, "absent"}, {Status::nothing, "nothing"}}};

Json box_json(const Box& box) {
  Json sides = Json::array();
  for (const Interval& side : box.sides) {
    sides.push_back({side.lower, side.upper});
  }
  return sides;
}

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

Json parameters_json(const commission::KinematicCommissioning& r) {
  Json list = Json::array();
  for (const commission::KinematicParameter& p : r.parameters) {
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"estimate", files::or_null(p.estimate)},
                    {"lower", p.lower},
                    {"upper", p.upper},
                    {"warrant", core::warrant_word(p.warrant)},
                    {"standard_error", files::or_null(p.standard_error)},
                    {"nominal", p.nominal},
                    {"excitation", files::word_of(kExcitationWords, p.excitation)},
                    {"reason", p.reason}});
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
  Json a = Json::array(), b = Json::array();
  for (const bounds::HalfSpace& facet : m.facets) {
    a.push_back(numbers(facet.a));
    b.push_back(facet.b);
  }
  json["warrant"] = core::warrant_word(m.warrant);
  json["window"] = m.window;
  json["outputs"] = m.measurement.outputs();
  json["measurement"] = measurement_json(m.measurement);
  json["noise"] = noise_json(r, m.measurement);
  json["parameters"] = parameters_json(r);
  json["feasible_set"] = {
      {"rows", r.rows}, {"prior", box_json(r.prior)}, {"A", a}, {"b", b}, {"hull", box_json(m.box)}};
  json["detector"] = {{"estimate", numbers(m.estimate)},
                      {"error_bounds",
                       {{"motion", m.errors.motion},
                        {"position", m.errors.position},
                        {"heading", m.errors.heading},
                        {"acceleration", m.errors.acceleration},
                        {"yaw_gain", m.errors.yaw_gain},
                        {"estimated", numbers(m.errors.estimated)}}},
                      {"persistence", {{"k", m.persistence.k}, {"n", m.persistence.n}}}};
  json["validation"] = validation_json(r, m.measurement, folds, m.window);
  return json;
}

}  // namespace wheelwright::results
