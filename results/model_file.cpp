// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/model_file.hpp>

#include <nlohmann/json.hpp>

#include <wheelwright/files/json.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/robots/robot_file.hpp>

namespace wheelwright::results {

using files::JsonPlace;

namespace {

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

bounds::RowOrigin read_origin(const JsonPlace& place, const Model& model) {
  bounds::RowOrigin origin;
  origin.side = files::value_of(kSideWords, place.at("side"));
  origin.is_prior = place.has("prior");
  if (origin.is_prior) {
    origin.parameter = position(
        model.parameters, [](const model::Parameter& p) { return p.name; }, place.at("prior"));
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
  claims.errors = robots::motion_errors_at(noise.at("motion"), claims.model);
  const JsonPlace outputs = noise.at("outputs");
  if (outputs.size() != claims.model.n()) {
    outputs.fail("one entry for each of the " + std::to_string(claims.model.n()) + " outputs");
  }
  claims.errors.output.resize(static_cast<Eigen::Index>(outputs.size()));
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    claims.errors.output[static_cast<Eigen::Index>(i)] = outputs.at(i).at("learning").number();
    claims.origin.push_back(files::value_of(robots::kNoiseOriginWords, outputs.at(i).at("origin")));
  }
  const filter::SignalErrors& e = claims.errors;
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
  claims.prior = robots::box_at(place.at("prior"), p);
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
  claims.hull = robots::box_at(place.at("hull"), p);
  claims.facets = robots::facets_at(place, p);
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
    logs::LogFileReport file;
    file.path = files.at(k).at("path").text();
    file.hash = files.at(k).at("hash").text();
    file.bytes = files.at(k).at("bytes").count();
    file.rows = files.at(k).at("rows").count();
    claims.files.push_back(std::move(file));
  }
  claims.rows = place.at("rows").count();
  claims.segments = place.at("segments").count();
}

}  // namespace

ModelClaims claims_from_json(const Json& json, const std::string& file) {
  const JsonPlace root = robots::model_root(json, file);
  ModelClaims claims;
  claims.robot = robots::robot_from_json(root.at("robot").value(), root.at("robot").where());
  claims.model = model::make_model(claims.robot);
  claims.filter = robots::filter_at(root.at("filter"));
  claims.measurement = robots::measurement_at(root.at("measurement"), claims.model, claims.robot);
  read_noise(root.at("noise"), claims);
  read_set(root.at("feasible_set"), claims);
  read_parameters(root.at("parameters"), claims);
  claims.warrant = robots::model_warrant(root);
  claims.assumptions = robots::assumptions_at(root);
  if (root.has("physical")) {
    const JsonPlace physical = root.at("physical");
    for (const std::string& name : physical.keys()) {
      claims.physical[name] = {physical.at(name).at("lower").number(), physical.at(name).at("upper").number()};
    }
  }
  read_data(root.at("data"), claims);
  return claims;
}

ModelClaims read_claims(const std::filesystem::path& path) {
  return claims_from_json(files::read_json(path), path.string());
}

}  // namespace wheelwright::results
