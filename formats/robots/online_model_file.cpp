// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/online_model_file.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <variant>

#include <nlohmann/json.hpp>

#include "bounds/polytope.hpp"
#include "core/error.hpp"
#include "core/words.hpp"
#include "detector/multiscale/pose_sums.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "detector/online_model.hpp"
#include "formats/files/bytes.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_keys.hpp"
#include "model/robot.hpp"

namespace wheelwright::robots {

using core::Warrant;
using files::JsonPlace;
using files::vector_at;

namespace {

double bound_at(const JsonPlace& place) {
  const double value = place.number();
  if (!(value >= 0.0)) {
    place.fail("a number >= 0");
  }
  return value;
}

Eigen::VectorXd bounds_at(const JsonPlace& place, std::size_t size) {
  Eigen::VectorXd values = vector_at(place, size);
  if (!(values.array() >= 0.0).all()) {
    place.fail("numbers >= 0");
  }
  return values;
}

detector::Persistence persistence_at(const JsonPlace& place) {
  const detector::Persistence rule{place.at("k").count(64), place.at("n").count(64)};
  if (rule.k < 1 || rule.k > rule.n) {
    place.fail("1 <= k <= n");
  }
  return rule;
}

/// Constant thresholds of `outputs` in the detector at `place`; nothing where it has none.
std::optional<detector::ConstantThresholds> constant_at(const JsonPlace& place,
                                                        const std::vector<std::string>& outputs) {
  if (!place.has("constant_thresholds")) {
    return std::nullopt;
  }
  const JsonPlace all = place.at("constant_thresholds"), list = all.at("outputs");
  detector::ConstantThresholds thresholds{
      bound_at(all.at("block")), all.at("blocks").count(), all.at("learning").count(), {}};
  if (list.size() != outputs.size()) {
    list.fail("one threshold for each of the outputs " + core::listed(outputs));
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const JsonPlace each = list.at(i);
    if (each.at("output").text() != outputs[i]) {
      each.at("output").fail(outputs[i]);
    }
    thresholds.outputs.push_back({bound_at(each.at("value")), each.at("stated").boolean(), each.at("held_out").count(),
                                  each.at("exceeded").count(), bound_at(each.at("chance"))});
  }
  return thresholds;
}

/// What bounds motion and efforts between samples; null where nothing does.
void read_between_samples(const JsonPlace& place, const Model& model, filter::SignalErrors& errors) {
  const JsonPlace between = place.at("between_samples");
  if (between.value().is_null()) {
    return;
  }
  errors.between_samples = errors.bridges = true;
  filter::MotionBound& bound = errors.motion;
  bound.limit = vector_at(between.at("acceleration"));
  bound.largest = vector_at(between.at("largest"));
  bound.effort = vector_at(between.at("effort"), model.n());
  const JsonPlace mobility = between.at("mobility");
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  if (mobility.size() > 0) {
    bound.mobility.resize(coordinates, static_cast<Eigen::Index>(model.n()));
    if (mobility.size() != model.coordinates.size()) {
      mobility.fail("one row for each of the " + std::to_string(coordinates) + " coordinates, or none");
    }
    for (Eigen::Index c = 0; c < coordinates; ++c) {
      bound.mobility.row(c) = vector_at(mobility.at(static_cast<std::size_t>(c)), model.n());
    }
  }
  const auto fits = [](const Eigen::MatrixXd& values, std::size_t size) {
    return (values.size() == 0 || static_cast<std::size_t>(values.size()) == size) && (values.array() >= 0.0).all();
  };
  if (!fits(bound.limit, model.coordinates.size()) || !fits(bound.mobility, model.coordinates.size() * model.n()) ||
      !fits(bound.largest, bound.mobility.size() > 0 ? model.p() : 0) || !fits(bound.effort, model.n())) {
    between.fail("bounds >= 0, acceleration for each coordinate, largest for each parameter where there is a mobility");
  }
}

filter::SignalErrors read_errors(const JsonPlace& place, const Model& model) {
  filter::SignalErrors errors = motion_errors_at(place, model);
  errors.output = bounds_at(place.at("output"), model.n());
  errors.bridges = true;
  return errors;
}

filter::OdometryMeasurement read_odometry(const JsonPlace& place, const Robot& robot) {
  filter::OdometryMeasurement m;
  m.motion = files::value_of(kMotionWords, place.at("motion"));
  m.motion_columns = place.at("motion_columns").texts();
  m.position = place.at("position").boolean();
  m.heading = place.at("heading").boolean();
  m.gyro = place.at("gyro").boolean();
  m.held_pose = place.at("held_pose").boolean();
  m.count = bound_at(place.at("count"));
  m.nominal_step = bound_at(place.at("nominal_step"));
  if (m.motion == MotionKind::speed) {
    m.cut = robot.speed_cut;
  }
  return m;
}

/// What the numbers stand on; of a model from before it said so, what its noise tells.
Warrant kinematic_warrant(const JsonPlace& place) {
  const bool told = place.has("warrant") || !place.has("noise");
  return warrant_at(place, !told && all_declared(place.at("noise")) ? Warrant::guaranteed : Warrant::extrapolated);
}

/// What is remembered of a drive is as long as errors are correlated: `step` is the shortest between samples.
void demand_short_correlation(const JsonPlace& errors, double correlation, double step) {
  constexpr double most_steps = 1e6;
  if (correlation > 0.0 && !(correlation <= most_steps * step)) {
    errors.fail("correlation times of at most 10⁶ steps between samples");
  }
}

filter::ErrorClass error_class_at(const JsonPlace& place) {
  filter::ErrorClass c{bound_at(place.at("bound")), bound_at(place.at("bias")), bound_at(place.at("correlation"))};
  if (place.has("deviation")) {
    c.deviation = bound_at(place.at("deviation"));
  }
  return c;
}

/// Facets and hull of the set at `place`, which is not empty.
void take_set(const JsonPlace& place, std::size_t p, std::vector<bounds::HalfSpace>& facets, Box& hull) {
  facets = facets_at(place, p);
  hull = box_at(place.at("hull"), p);
  if (!std::holds_alternative<bounds::Polytope>(bounds::Polytope::intersect(facets, hull))) {
    place.fail("half-spaces and a hull that have a point in common");
  }
}

/// What both residuals say at a stated risk: everything but their errors and usual variances.
template <typename Risk>
Risk risk_model_at(const JsonPlace& place, std::size_t p) {
  Risk risk;
  risk.risk = place.at("risk").number();
  if (!(risk.risk > 0.0 && risk.risk < 1.0)) {
    place.at("risk").fail("a number between 0 and 1");
  }
  risk.warrant = warrant_at(place, core::Warrant::guaranteed);
  const JsonPlace set = place.at("feasible_set");
  take_set(set, p, risk.facets, risk.box);
  const Eigen::VectorXd scales = vector_at(place.at("scales"));
  if (scales.size() == 0 || !(scales.array() > 0.0).all()) {
    place.at("scales").fail("times > 0 in s");
  }
  risk.scales.assign(scales.begin(), scales.end());
  risk.delay = bound_at(place.at("delay"));
  return risk;
}

/// weights × scales.
Eigen::MatrixXd variances_at(const JsonPlace& rows, std::size_t weights, std::size_t scales) {
  if (rows.size() != weights) {
    rows.fail("one row for each of the " + std::to_string(weights) + " weights");
  }
  Eigen::MatrixXd values(static_cast<Eigen::Index>(weights), static_cast<Eigen::Index>(scales));
  for (std::size_t w = 0; w < weights; ++w) {
    values.row(static_cast<Eigen::Index>(w)) = vector_at(rows.at(w), scales);
  }
  if (!(values.array() >= 0.0).all()) {
    rows.fail("variances >= 0");
  }
  return values;
}

detector::PoseRiskModel pose_risk_at(const JsonPlace& place, const filter::OdometryMeasurement& measurement) {
  auto risk = risk_model_at<detector::PoseRiskModel>(place, measurement.parameters().size());
  const JsonPlace errors = place.at("errors"), usual = place.at("usual");
  risk.errors.position = error_class_at(errors.at("position"));
  risk.errors.heading = error_class_at(errors.at("heading"));
  risk.errors.shortest_step = bound_at(errors.at("shortest_step"));
  demand_short_correlation(errors, std::max(risk.errors.position.correlation, risk.errors.heading.correlation),
                           risk.errors.shortest_step);
  const std::size_t weights = detector::pose_weights(measurement).size();
  risk.usual_position = variances_at(usual.at("position"), weights, risk.scales.size());
  risk.usual_heading = variances_at(usual.at("heading"), weights, risk.scales.size());
  return risk;
}

}  // namespace

Warrant warrant_at(const JsonPlace& place, Warrant absent) {
  return place.has("warrant") ? files::value_of(kWarrantWords, place.at("warrant")) : absent;
}

std::vector<core::Assumption> assumptions_at(const JsonPlace& place) {
  std::vector<core::Assumption> list;
  if (!place.has("assumptions")) {
    return list;
  }
  const JsonPlace all = place.at("assumptions");
  for (std::size_t k = 0; k < all.size(); ++k) {
    const JsonPlace each = all.at(k);
    list.push_back({.id = each.at("id").text(),
                    .statement = each.at("statement").text(),
                    .declared_by = each.at("declared_by").text(),
                    .test = each.at("test").text(),
                    .verdict = files::value_of(kVerdictWords, each.at("verdict")),
                    .detail = each.at("detail").text()});
  }
  return list;
}

FilterDesign filter_at(const JsonPlace& place) {
  FilterDesign filter{.order = static_cast<int>(place.at("order").count(2)),
                      .alpha = place.at("alpha").number(),
                      .beta = place.at("beta").number(),
                      .settle = place.at("settle").number()};
  try {
    filter::validate(filter);
  } catch (const InvalidArgument& error) {
    throw InputError(place.where() + ": " + error.what());
  }
  return filter;
}

Measurement measurement_at(const JsonPlace& place, const Model& model, const Robot& robot) {
  Measurement m;
  m.motion = files::value_of(kMotionWords, place.at("motion"));
  m.motion_columns = place.at("motion_columns").texts();
  m.effort_columns = place.at("effort_columns").texts();
  m.heading_column = place.at("heading_column").text();
  m.hold = files::value_of(kHoldWords, place.at("hold"));
  m.effort_unsigned = place.at("effort_unsigned").boolean();
  m.count = bound_at(place.at("count"));
  m.nominal_step = bound_at(place.at("nominal_step"));
  m.shortest_step = bound_at(place.at("shortest_step"));
  m.changes = robot.effort_changes;
  m.delay = robot.effort_delay;
  m.smoothing = robot.effort_smoothing;
  m.clock_drift = robot.clock ? robot.clock->drift : 0.0;
  m.correction = filter::effort_correction(robot, m.motion != MotionKind::angle);
  if (m.motion == MotionKind::speed) {
    m.cut = robot.speed_cut;
  }
  if (m.motion_columns.size() != model.joints.size() || m.effort_columns.size() != model.joints.size()) {
    place.fail("one motion column and one effort column for each joint of the model");
  }
  return m;
}

filter::SignalErrors motion_errors_at(const JsonPlace& place, const Model& model) {
  const auto optional_vector = [&](std::string_view key) {
    const JsonPlace values = place.at(key);
    return bounds_at(values, values.size() == 0 ? 0 : model.coordinates.size());
  };
  filter::SignalErrors errors;
  errors.acceleration = optional_vector("acceleration");
  errors.speed = optional_vector("speed");
  errors.speed_sample = optional_vector("speed_sample");
  errors.joint_sample = bound_at(place.at("joint_sample"));
  errors.heading = bound_at(place.at("heading"));
  errors.held_between = place.has("held_between") && place.at("held_between").boolean();
  read_between_samples(place, model, errors);
  return errors;
}

std::vector<bounds::HalfSpace> facets_at(const JsonPlace& place, std::size_t p) {
  const JsonPlace a = place.at("A");
  const Eigen::VectorXd b = vector_at(place.at("b"), a.size());
  std::vector<bounds::HalfSpace> facets;
  for (std::size_t k = 0; k < a.size(); ++k) {
    facets.push_back({vector_at(a.at(k), p), b[static_cast<Eigen::Index>(k)], {}});
  }
  return facets;
}

Box box_at(const JsonPlace& place, std::size_t p) {
  if (place.size() != p) {
    place.fail("an array of " + std::to_string(p) + " intervals");
  }
  Box box;
  for (std::size_t j = 0; j < p; ++j) {
    const Eigen::VectorXd side = vector_at(place.at(j), 2);
    if (!(side[0] <= side[1])) {
      place.at(j).fail("[lower, upper] with lower <= upper");
    }
    box.sides.push_back({side[0], side[1]});
  }
  return box;
}

detector::RiskModel risk_at(const JsonPlace& place, const Model& model) {
  auto risk = risk_model_at<detector::RiskModel>(place, model.p());
  const JsonPlace errors = place.at("errors");
  risk.errors.motion = error_class_at(errors.at("motion"));
  risk.errors.effort = error_class_at(errors.at("effort"));
  risk.errors.count = bound_at(errors.at("count"));
  risk.errors.shortest_step = bound_at(errors.at("shortest_step"));
  risk.usual = variances_at(place.at("usual"), detector::sum_weights(model).size(), risk.scales.size());
  return risk;
}

bool all_declared(const JsonPlace& noise) {
  const JsonPlace outputs = noise.at("outputs");
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (files::value_of(kNoiseOriginWords, outputs.at(i).at("origin")) != core::NoiseOrigin::declared) {
      return false;
    }
  }
  return outputs.size() > 0;
}

Warrant model_warrant(const JsonPlace& root) {
  if (root.has("warrant") || !root.has("noise")) {
    return warrant_at(root, Warrant::extrapolated);
  }
  const bool worst_case =
      files::value_of(kNoiseModeWords, root.at("noise").at("mode")) == filter::NoiseMode::worst_case;
  return !all_declared(root.at("noise")) ? Warrant::extrapolated
         : worst_case                    ? Warrant::guaranteed
                                         : Warrant::statistical;
}

JsonPlace model_root(const Json& json, const std::string& file) {
  JsonPlace root(json, file);
  if (!root.has("schema") || root.at("schema").text() != kModelSchema) {
    throw InputError(file + ": expected a model written by `wheelwright commission`, with \"schema\": \"" +
                     kModelSchema + "\"");
  }
  return root;
}

std::optional<detector::KinematicModel> kinematic_from_json(const JsonPlace& place, const Robot& robot) {
  if (!place.has("detector")) {
    return std::nullopt;
  }
  detector::KinematicModel model;
  model.measurement = read_odometry(place.at("measurement"), robot);
  model.window = place.at("window").number();
  model.warrant = kinematic_warrant(place);
  const std::size_t p = model.measurement.parameters().size(), n = model.measurement.outputs().size();
  const JsonPlace detector = place.at("detector"), errors = detector.at("error_bounds"), set = place.at("feasible_set");
  model.estimate = vector_at(detector.at("estimate"), p);
  model.errors.motion = bound_at(errors.at("motion"));
  model.errors.position = bound_at(errors.at("position"));
  model.errors.heading = bound_at(errors.at("heading"));
  model.errors.gyro = errors.has("gyro") ? bound_at(errors.at("gyro")) : 0.0;
  model.errors.acceleration = bound_at(errors.at("acceleration"));
  model.errors.yaw_gain = bound_at(errors.at("yaw_gain"));
  model.errors.estimated = bounds_at(errors.at("estimated"), n);
  model.persistence = persistence_at(detector.at("persistence"));
  model.constant = constant_at(detector, model.measurement.outputs());
  take_set(set, p, model.facets, model.box);
  try {
    static_cast<void>(detector::make_filter(model));
    if (place.has("at_risk")) {
      model.at_risk = pose_risk_at(place.at("at_risk"), model.measurement);
      static_cast<void>(detector::PoseSumDetector(model));
    }
  } catch (const InvalidArgument& error) {
    throw InputError(place.where() + ": " + error.what());
  }
  return model;
}

OnlineModel model_from_json(const Json& json, const std::string& file) {
  const JsonPlace root = model_root(json, file);
  if (!root.has("detector")) {
    const std::string why = root.at("message").text();
    throw InputError(file + (why.starts_with("no model: ") ? ": holds " : ": holds no model: ") + why);
  }
  OnlineModel model;
  model.robot = robot_from_json(root.at("robot").value(), root.at("robot").where());
  model.model = model::make_model(model.robot);
  const std::size_t p = model.model.p();
  model.filter = filter_at(root.at("filter"));
  model.measurement = measurement_at(root.at("measurement"), model.model, model.robot);
  const JsonPlace detector = root.at("detector");
  model.estimate = vector_at(detector.at("estimate"), p);
  model.errors = read_errors(detector.at("error_bounds"), model.model);
  model.persistence = persistence_at(detector.at("persistence"));
  model.constant = constant_at(detector, model.model.outputs);
  take_set(root.at("feasible_set"), p, model.facets, model.box);
  if (root.has("kinematic")) {
    model.kinematic = kinematic_from_json(root.at("kinematic"), model.robot);
  }
  if (root.has("at_risk")) {
    model.at_risk = risk_at(root.at("at_risk"), model.model);
    const filter::ErrorClasses& errors = model.at_risk->errors;
    demand_short_correlation(root.at("at_risk").at("errors"),
                             std::max(errors.motion.correlation, errors.effort.correlation),
                             std::min(errors.shortest_step, model.measurement.nominal_step));
  }
  model.warrant = model_warrant(root);
  model.assumptions = assumptions_at(root);
  return model;
}

OnlineModel read_model(const std::filesystem::path& path) {
  const std::string text = files::read_bytes(path, longest_model_file);
  if (!text.empty() && !files::is_json_object(text)) {
    throw InputError(path.string() +
                     ": is no model.json: expected the file that `wheelwright commission` writes into --out (from a "
                     "robot file, --robot, and a log)");
  }
  return model_from_json(files::parse_json(text, path.string()), path.string());
}

}  // namespace wheelwright::robots
