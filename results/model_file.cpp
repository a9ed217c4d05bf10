// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/model_file.hpp>

#include <nlohmann/json.hpp>

#include <wheelwright/files/json.hpp>
#include <wheelwright/results/kinematic_json.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/results/model_words.hpp>
#include <wheelwright/robots/robot_file.hpp>

namespace wheelwright {
namespace {

FilterDesign read_filter(const JsonPlace& place) {
  FilterDesign filter{.order = static_cast<int>(place.at("order").count()),
                      .alpha = place.at("alpha").number(),
                      .beta = place.at("beta").number(),
                      .settle = place.at("settle").number()};
  try {
    validate(filter);
  } catch (const InvalidArgument& error) {
    throw InputError(place.where() + ": " + error.what());
  }
  return filter;
}

Measurement read_measurement(const JsonPlace& place, const Model& model, const Robot& robot) {
  Measurement m;
  m.motion = value_of(kMotionWords, place.at("motion"));
  m.motion_columns = place.at("motion_columns").texts();
  m.effort_columns = place.at("effort_columns").texts();
  m.heading_column = place.at("heading_column").text();
  m.hold = value_of(kHoldWords, place.at("hold"));
  m.effort_unsigned = place.at("effort_unsigned").boolean();
  m.count = place.at("count").number();
  m.nominal_step = place.at("nominal_step").number();
  m.shortest_step = place.at("shortest_step").number();
  m.changes = robot.effort_changes;
  m.delay = robot.effort_delay;
  m.correction = effort_correction(robot);
  if (m.motion_columns.size() != model.joints.size() || m.effort_columns.size() != model.joints.size()) {
    place.fail("one motion column and one effort column for each joint of the model");
  }
  return m;
}

/// What bounds motion and efforts between samples; null where nothing does.
void read_between_samples(const JsonPlace& place, const Model& model, SignalErrors& errors) {
  const JsonPlace between = place.at("between_samples");
  if (between.value().is_null()) {
    return;
  }
  errors.between_samples = true;
  MotionBound& bound = errors.motion;
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

/// Bounds on the motion, those on the effort left out.
SignalErrors read_motion_errors(const JsonPlace& place, const Model& model) {
  const auto optional_vector = [&](std::string_view key) {
    const Eigen::VectorXd values = vector_at(place.at(key));
    return values.size() == 0 ? values : vector_at(place.at(key), model.coordinates.size());
  };
  SignalErrors errors;
  errors.acceleration = optional_vector("acceleration");
  errors.speed = optional_vector("speed");
  errors.speed_sample = optional_vector("speed_sample");
  errors.joint_sample = place.at("joint_sample").number();
  errors.heading = place.at("heading").number();
  read_between_samples(place, model, errors);
  return errors;
}

SignalErrors read_errors(const JsonPlace& place, const Model& model) {
  SignalErrors errors = read_motion_errors(place, model);
  errors.output = vector_at(place.at("output"), model.n());
  return errors;
}

std::vector<HalfSpace> read_facets(const JsonPlace& place, std::size_t p) {
  const JsonPlace a = place.at("A");
  const Eigen::VectorXd b = vector_at(place.at("b"), a.size());
  std::vector<HalfSpace> facets;
  for (std::size_t k = 0; k < a.size(); ++k) {
    facets.push_back({vector_at(a.at(k), p), b[static_cast<Eigen::Index>(k)], {}});
  }
  return facets;
}

Box read_box(const JsonPlace& place, std::size_t p) {
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

/// Position in `list` of an entry whose name (`name_of`) is the text at `place`.
template <typename List, typename NameOf>
std::size_t position(const List& list, NameOf name_of, const JsonPlace& place) {
  const std::string name = place.text();
  for (std::size_t k = 0; k < list.size(); ++k) {
    if (name_of(list[k]) == name) {
      return k;
    }
  }
  place.fail("a name of the robot's model");
}

RowOrigin read_origin(const JsonPlace& place, const Model& model) {
  RowOrigin origin;
  origin.side = value_of(kSideWords, place.at("side"));
  origin.is_prior = place.has("prior");
  if (origin.is_prior) {
    origin.parameter = position(
        model.parameters, [](const Parameter& p) { return p.name; }, place.at("prior"));
  } else {
    origin.sample = place.at("row").count();
    origin.t = place.at("t").number();
    origin.output = position(
        model.outputs, [](const std::string& o) { return o; }, place.at("output"));
  }
  return origin;
}

std::vector<NamedRow> read_proof(const JsonPlace& place, const Model& model) {
  std::vector<NamedRow> rows;
  for (std::size_t k = 0; k < place.size(); ++k) {
    rows.push_back({read_origin(place.at(k), model), place.at(k).at("multiplier").number()});
  }
  return rows;
}

void read_noise(const JsonPlace& noise, ModelClaims& claims) {
  if (!noise.has("motion")) {
    throw InputError(noise.where() +
                     ": no member 'motion': this model was written before models carried certificates; commission "
                     "again to have one that can be checked");
  }
  claims.errors = read_motion_errors(noise.at("motion"), claims.model);
  const JsonPlace outputs = noise.at("outputs");
  if (outputs.size() != claims.model.n()) {
    outputs.fail("one entry for each of the " + std::to_string(claims.model.n()) + " outputs");
  }
  claims.errors.output.resize(static_cast<Eigen::Index>(outputs.size()));
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    claims.errors.output[static_cast<Eigen::Index>(i)] = outputs.at(i).at("learning").number();
    claims.origin.push_back(value_of(kNoiseOriginWords, outputs.at(i).at("origin")));
  }
  const SignalErrors& e = claims.errors;
  const auto bounds = {e.output,
                       e.acceleration,
                       e.speed,
                       e.speed_sample,
                       Eigen::VectorXd::Constant(1, e.joint_sample).eval(),
                       Eigen::VectorXd::Constant(1, e.heading).eval()};
  if (!std::ranges::all_of(bounds, [](const Eigen::VectorXd& v) { return (v.array() >= 0.0).all(); })) {
    noise.fail("bounds >= 0");
  }
}

void read_parameters(const JsonPlace& place, ModelClaims& claims) {
  if (place.size() != claims.model.p()) {
    place.fail("one entry for each of the " + std::to_string(claims.model.p()) + " parameters");
  }
  for (std::size_t j = 0; j < place.size(); ++j) {
    const JsonPlace parameter = place.at(j), samples = parameter.at("binding_samples");
    if (parameter.at("name").text() != claims.model.parameters[j].name) {
      parameter.at("name").fail(claims.model.parameters[j].name + ", as the robot's model has it");
    }
    claims.lower.push_back({parameter.at("lower").number(), read_proof(samples.at("lower"), claims.model)});
    claims.upper.push_back({parameter.at("upper").number(), read_proof(samples.at("upper"), claims.model)});
  }
}

void read_set(const JsonPlace& place, ModelClaims& claims) {
  const std::size_t p = claims.model.p();
  const std::string status = place.at("status").text();
  if (status != "nonempty" && status != "empty") {
    place.at("status").fail("nonempty or empty");
  }
  claims.prior = read_box(place.at("prior"), p);
  claims.sign_parts = place.at("sign_parts").count();
  const JsonPlace dropped = place.at("dropped");
  for (std::size_t k = 0; k < dropped.size(); ++k) {
    claims.dropped.push_back(dropped.at(k).count());
  }
  if (status == "empty") {
    claims.set = FeasibleSet::Status::empty;
    claims.contradiction = read_proof(place.at("contradiction"), claims.model);
    claims.hull = claims.prior;
    return;
  }
  claims.hull = read_box(place.at("hull"), p);
  claims.facets = read_facets(place, p);
  const JsonPlace origin = place.at("origin");
  if (origin.size() != claims.facets.size()) {
    origin.fail("one entry for each of the " + std::to_string(claims.facets.size()) + " rows of A");
  }
  for (std::size_t k = 0; k < origin.size(); ++k) {
    claims.facets[k].origin = read_origin(origin.at(k), claims.model);
  }
}

void read_data(const JsonPlace& place, ModelClaims& claims) {
  const JsonPlace files = place.at("files");
  for (std::size_t k = 0; k < files.size(); ++k) {
    LogFileReport file;
    file.path = files.at(k).at("path").text();
    file.hash = files.at(k).at("hash").text();
    file.bytes = files.at(k).at("bytes").count();
    file.rows = files.at(k).at("rows").count();
    claims.files.push_back(std::move(file));
  }
  claims.rows = place.at("rows").count();
  claims.segments = place.at("segments").count();
}

/// What the numbers of a model stand on; of a model from before it said so, what its noise tells.
Warrant warrant_of_model(const JsonPlace& root) {
  if (root.has("warrant") || !root.has("noise")) {
    return warrant_at(root, Warrant::extrapolated);
  }
  const bool worst_case = value_of(kNoiseModeWords, root.at("noise").at("mode")) == NoiseMode::worst_case;
  return !all_declared(root.at("noise")) ? Warrant::extrapolated
         : worst_case                    ? Warrant::guaranteed
                                         : Warrant::statistical;
}

/// The document's root, after a look at its schema.
JsonPlace root_of(const Json& json, const std::string& file) {
  JsonPlace root(json, file);
  if (!root.has("schema") || root.at("schema").text() != kModelSchema) {
    throw InputError(file + ": expected a model written by `wheelwright commission`, with \"schema\": \"" +
                     kModelSchema + "\"");
  }
  return root;
}

}  // namespace

CommissionedModel model_from_json(const Json& json, const std::string& file) {
  const JsonPlace root = root_of(json, file);
  if (!root.has("detector")) {
    throw InputError(file + ": holds no model: " + root.at("message").text());
  }
  CommissionedModel model;
  model.robot = robot_from_json(root.at("robot").value(), root.at("robot").where());
  model.model = make_model(model.robot);
  const std::size_t p = model.model.p();
  model.filter = read_filter(root.at("filter"));
  model.measurement = read_measurement(root.at("measurement"), model.model, model.robot);
  const JsonPlace detector = root.at("detector");
  model.estimate = vector_at(detector.at("estimate"), p);
  model.errors = read_errors(detector.at("error_bounds"), model.model);
  model.persistence = {detector.at("persistence").at("k").count(), detector.at("persistence").at("n").count()};
  model.facets = read_facets(root.at("feasible_set"), p);
  model.box = read_box(root.at("feasible_set").at("hull"), p);
  if (root.has("kinematic")) {
    model.kinematic = kinematic_from_json(root.at("kinematic"));
  }
  model.warrant = warrant_of_model(root);
  model.assumptions = assumptions_at(root);
  return model;
}

CommissionedModel read_model(const std::filesystem::path& path) {
  return model_from_json(read_json(path), path.string());
}

ModelClaims claims_from_json(const Json& json, const std::string& file) {
  const JsonPlace root = root_of(json, file);
  ModelClaims claims;
  claims.robot = robot_from_json(root.at("robot").value(), root.at("robot").where());
  claims.model = make_model(claims.robot);
  claims.filter = read_filter(root.at("filter"));
  claims.measurement = read_measurement(root.at("measurement"), claims.model, claims.robot);
  read_noise(root.at("noise"), claims);
  read_set(root.at("feasible_set"), claims);
  read_parameters(root.at("parameters"), claims);
  claims.warrant = warrant_of_model(root);
  claims.assumptions = assumptions_at(root);
  if (root.has("physical")) {
    const JsonPlace physical = root.at("physical");
    for (const std::string& name : physical.keys()) {
      claims.physical[name] = {physical.at(name).at("lower").number(), physical.at(name).at("upper").number()};
    }
  }
  read_data(root.at("data"), claims);
  return claims;
}

ModelClaims read_claims(const std::filesystem::path& path) { return claims_from_json(read_json(path), path.string()); }

}  // namespace wheelwright
