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

namespace wheelwright {
namespace {

using Status = KinematicCommissioning::Status;

constexpr Words<Status, 4> kKinematicStatusWords{
    {{Status::done, "done"}, {Status::partial, "partial"}, {Status::absent, "absent"}, {Status::nothing, "nothing"}}};

Json box_json(const Box& box) {
  Json sides = Json::array();
  for (const Interval& side : box.sides) {
    sides.push_back({side.lower, side.upper});
  }
  return sides;
}

Json measurement_json(const OdometryMeasurement& m) {
  return {{"motion", word_of(kMotionWords, m.motion)},
          {"motion_columns", m.motion_columns},
          {"position", m.position},
          {"heading", m.heading},
          {"gyro", m.gyro},
          {"held_pose", m.held_pose},
          {"count", m.count},
          {"nominal_step", m.nominal_step}};
}

Json noise_json(const KinematicCommissioning& r, const OdometryMeasurement& m) {
  const auto outputs = m.outputs(), units = m.output_units();
  Json list = Json::array();
  for (std::size_t i = 0; i < r.noise.size(); ++i) {
    const OutputNoise& n = r.noise[i];
    list.push_back({{"output", outputs[i]},
                    {"unit", units[i]},
                    {"origin", word_of(kNoiseOriginWords, n.origin)},
                    {"bound", n.bound},
                    {"learning", n.learning},
                    {"warrant", warrant_word(n.warrant)}});
  }
  return {{"outputs", list}, {"declared_too_small", r.declared_too_small}, {"raise", r.raise}};
}

Json parameters_json(const KinematicCommissioning& r) {
  Json list = Json::array();
  for (const KinematicParameter& p : r.parameters) {
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"estimate", or_null(p.estimate)},
                    {"lower", p.lower},
                    {"upper", p.upper},
                    {"warrant", warrant_word(p.warrant)},
                    {"standard_error", or_null(p.standard_error)},
                    {"nominal", p.nominal},
                    {"excitation", word_of(kExcitationWords, p.excitation)},
                    {"reason", p.reason}});
  }
  return list;
}

Json validation_json(const KinematicCommissioning& r, const OdometryMeasurement& m, const FoldOptions& folds,
                     double window) {
  const auto names = m.outputs();
  Json outputs = Json::array();
  for (std::size_t i = 0; i < r.validation.size(); ++i) {
    const OutputValidation& v = r.validation[i];
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

double bound_at(const JsonPlace& place) {
  const double value = place.number();
  if (!(value >= 0.0)) {
    place.fail("a number >= 0");
  }
  return value;
}

OdometryMeasurement read_measurement(const JsonPlace& place) {
  OdometryMeasurement m;
  m.motion = value_of(kMotionWords, place.at("motion"));
  m.motion_columns = place.at("motion_columns").texts();
  m.position = place.at("position").boolean();
  m.heading = place.at("heading").boolean();
  m.gyro = place.at("gyro").boolean();
  m.held_pose = place.at("held_pose").boolean();
  m.count = place.at("count").number();
  m.nominal_step = place.at("nominal_step").number();
  return m;
}

/// What the numbers stand on; of a model from before it said so, what its noise tells.
Warrant kinematic_warrant(const JsonPlace& place) {
  const bool told = place.has("warrant") || !place.has("noise");
  return warrant_at(place, !told && all_declared(place.at("noise")) ? Warrant::guaranteed : Warrant::extrapolated);
}

}  // namespace

bool all_declared(const JsonPlace& noise) {
  const JsonPlace outputs = noise.at("outputs");
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (value_of(kNoiseOriginWords, outputs.at(i).at("origin")) != NoiseOrigin::declared) {
      return false;
    }
  }
  return outputs.size() > 0;
}

std::optional<Json> kinematic_json(const KinematicCommissioning& r, const FoldOptions& folds) {
  if (r.status == Status::absent) {
    return std::nullopt;
  }
  Json json = {{"status", word_of(kKinematicStatusWords, r.status)}, {"message", r.message}};
  if (!r.model) {
    return json;
  }
  const KinematicModel& m = *r.model;
  Json a = Json::array(), b = Json::array();
  for (const HalfSpace& facet : m.facets) {
    a.push_back(numbers(facet.a));
    b.push_back(facet.b);
  }
  json["warrant"] = warrant_word(m.warrant);
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

std::optional<KinematicModel> kinematic_from_json(const JsonPlace& place) {
  if (!place.has("detector")) {
    return std::nullopt;
  }
  KinematicModel model;
  model.measurement = read_measurement(place.at("measurement"));
  model.window = place.at("window").number();
  model.warrant = kinematic_warrant(place);
  const std::size_t p = model.measurement.parameters().size(), n = model.measurement.outputs().size();
  const JsonPlace detector = place.at("detector"), errors = detector.at("error_bounds"), set = place.at("feasible_set");
  model.estimate = vector_at(detector.at("estimate"), p);
  model.errors.motion = bound_at(errors.at("motion"));
  model.errors.position = bound_at(errors.at("position"));
  model.errors.heading = bound_at(errors.at("heading"));
  model.errors.acceleration = bound_at(errors.at("acceleration"));
  model.errors.yaw_gain = bound_at(errors.at("yaw_gain"));
  model.errors.estimated = vector_at(errors.at("estimated"), n);
  model.persistence = {detector.at("persistence").at("k").count(), detector.at("persistence").at("n").count()};
  const JsonPlace a = set.at("A");
  const Eigen::VectorXd b = vector_at(set.at("b"), a.size());
  for (std::size_t k = 0; k < a.size(); ++k) {
    model.facets.push_back({vector_at(a.at(k), p), b[static_cast<Eigen::Index>(k)], {}});
  }
  const JsonPlace hull = set.at("hull");
  if (hull.size() != p) {
    hull.fail("an array of " + std::to_string(p) + " intervals");
  }
  for (std::size_t j = 0; j < p; ++j) {
    const Eigen::VectorXd side = vector_at(hull.at(j), 2);
    if (!(side[0] <= side[1])) {
      hull.at(j).fail("[lower, upper] with lower <= upper");
    }
    model.box.sides.push_back({side[0], side[1]});
  }
  try {
    static_cast<void>(OdometryFilter(model.measurement, model.window, model.errors));
  } catch (const InvalidArgument& error) {
    throw InputError(place.where() + ": " + error.what());
  }
  return model;
}

}  // namespace wheelwright
