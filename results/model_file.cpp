// SPDX-License-Identifier: Apache-2.0
#include "results/model_file.hpp"

#include <algorithm>
#include <limits>

#include <nlohmann/json.hpp>

#include "core/limits.hpp"
#include "formats/files/json.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_json.hpp"

namespace wheelwright::results {

using files::JsonPlace;

namespace {

// Position of the text at `place` in `names`.
std::size_t place_of(const JsonPlace& place, const std::vector<std::string>& names) {
  const auto found = std::ranges::find(names, place.text());
  if (found == names.end()) {
    place.fail("a name of the robot's model");
  }
  return static_cast<std::size_t>(found - names.begin());
}

bounds::RowOrigin read_origin(const JsonPlace& place, const SetClaims& claims) {
  bounds::RowOrigin origin;
  origin.side = files::value_of(kSideWords, place.at("side"));
  origin.is_prior = place.has("prior");
  if (origin.is_prior) {
    origin.parameter = place_of(place.at("prior"), claims.parameter_names);
  } else {
    origin.sample = place.at("row").count();
    origin.t = place.at("t").number();
    origin.output = place_of(place.at("output"), claims.output_names);
  }
  return origin;
}

std::vector<NamedRow> read_proof(const JsonPlace& place, const SetClaims& claims) {
  std::vector<NamedRow> rows;
  for (std::size_t k = 0; k < place.size(); ++k) {
    rows.push_back({read_origin(place.at(k), claims), place.at(k).at("multiplier").number()});
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
  if (!(claims.errors.output.array() >= 0.0).all()) {
    outputs.fail("bounds >= 0");
  }
  claims.left_out.assign(claims.model.p(), false);
  if (noise.has("left_out")) {
    const JsonPlace names = noise.at("left_out");
    if (std::ranges::find(claims.origin, core::NoiseOrigin::declared) != claims.origin.end()) {
      names.fail("no such member where noise is declared");
    }
    for (std::size_t k = 0; k < names.size(); ++k) {
      claims.left_out[place_of(names.at(k), claims.parameter_names)] = true;
    }
  }
}

void read_parameters(const JsonPlace& place, SetClaims& claims) {
  if (place.size() != claims.parameter_names.size()) {
    place.fail("one entry for each of the " + std::to_string(claims.parameter_names.size()) + " parameters");
  }
  for (std::size_t j = 0; j < place.size(); ++j) {
    const JsonPlace parameter = place.at(j), samples = parameter.at("binding_samples");
    if (parameter.at("name").text() != claims.parameter_names[j]) {
      parameter.at("name").fail(claims.parameter_names[j] + ", as the robot's model has it");
    }
    claims.lower.push_back({parameter.at("lower").number(), read_proof(samples.at("lower"), claims)});
    claims.upper.push_back({parameter.at("upper").number(), read_proof(samples.at("upper"), claims)});
    claims.guaranteed =
        claims.guaranteed ||
        (parameter.has("warrant") && parameter.at("warrant").text() == core::warrant_word(core::Warrant::guaranteed));
  }
}

// Facets and hull.
void read_half_spaces(const JsonPlace& place, SetClaims& claims) {
  const std::size_t p = claims.parameter_names.size();
  claims.hull = robots::box_at(place.at("hull"), p);
  claims.facets = robots::facets_at(place, p);
  const JsonPlace origin = place.at("origin");
  if (origin.size() != claims.facets.size()) {
    origin.fail("one entry for each of the " + std::to_string(claims.facets.size()) + " rows of A");
  }
  for (std::size_t k = 0; k < origin.size(); ++k) {
    claims.facets[k].origin = read_origin(origin.at(k), claims);
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
    claims.contradiction = read_proof(place.at("contradiction"), claims);
    claims.hull = claims.prior;
    return;
  }
  read_half_spaces(place, claims);
}

void read_kinematic(const JsonPlace& place, const detector::KinematicModel& model, ModelClaims& all) {
  const JsonPlace set = place.at("feasible_set"), outputs = place.at("noise").at("outputs");
  if (!set.has("origin")) {
    all.unproved_kinematic = true;
    return;
  }
  KinematicClaims& claims = all.kinematic.emplace();
  claims.key = "kinematic.feasible_set";
  claims.parameter_names = model.measurement.parameters();
  claims.output_names = model.measurement.outputs();
  claims.model = model;
  claims.errors = model.errors;
  if (outputs.size() != claims.output_names.size()) {
    outputs.fail("one entry for each of the " + std::to_string(claims.output_names.size()) + " outputs");
  }
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    claims.origin.push_back(files::value_of(robots::kNoiseOriginWords, outputs.at(i).at("origin")));
    if (claims.origin.back() == core::NoiseOrigin::estimated) {
      const JsonPlace learning = outputs.at(i).at("learning");
      if (!(learning.number() >= 0.0) || claims.errors.estimated.size() == 0) {
        learning.fail("a bound >= 0, and detector.error_bounds.estimated");
      }
      claims.errors.estimated[static_cast<Eigen::Index>(i)] =
          std::max(learning.number(), std::numeric_limits<double>::min());
    }
  }
  claims.prior = robots::box_at(set.at("prior"), claims.parameter_names.size());
  read_half_spaces(set, claims);
  read_parameters(place.at("parameters"), claims);
  if (!place.has("at_risk") || !place.at("at_risk").has("binding")) {
    return;
  }
  const JsonPlace at_risk = place.at("at_risk"), binding = at_risk.at("binding");
  SetClaims& narrower = claims.at_risk.emplace();
  narrower.key = "kinematic.at_risk.feasible_set";
  narrower.parameter_names = claims.parameter_names;
  narrower.output_names = {kPoseSum};
  narrower.prior = claims.hull;
  read_half_spaces(at_risk.at("feasible_set"), narrower);
  claims.learning = at_risk.at("learning").number();
  if (binding.size() != narrower.parameter_names.size()) {
    binding.fail("one entry for each of the " + std::to_string(narrower.parameter_names.size()) + " parameters");
  }
  for (std::size_t j = 0; j < binding.size(); ++j) {
    const Interval& side = narrower.hull.sides[j];
    narrower.lower.push_back({side.lower, read_proof(binding.at(j).at("lower"), narrower)});
    narrower.upper.push_back({side.upper, read_proof(binding.at(j).at("upper"), narrower)});
  }
}

// A number below `size`.
std::size_t number_at(const JsonPlace& place, std::size_t size, const std::string& of) {
  const std::size_t number = place.count();
  if (number >= size) {
    place.fail("the number of one of the " + std::to_string(size) + " " + of);
  }
  return number;
}

commission::RiskOrigin read_risk_origin(const JsonPlace& place, const ModelClaims& claims) {
  using Kind = commission::RiskOrigin::Kind;
  if (place.has("facet")) {
    return {.kind = Kind::guaranteed,
            .number = number_at(place.at("facet"), claims.facets.size(), "rows of feasible_set.A")};
  }
  const bounds::Side side = files::value_of(kSideWords, place.at("side"));
  if (place.has("box")) {
    return {Kind::box, place_of(place.at("box"), claims.parameter_names), side};
  }
  return {Kind::sum, number_at(place.at("sum"), claims.at_risk->sums.size(), "at_risk.sums"), side};
}

std::vector<NamedRiskRow> read_risk_proof(const JsonPlace& place, const ModelClaims& claims) {
  std::vector<NamedRiskRow> rows;
  for (std::size_t k = 0; k < place.size(); ++k) {
    rows.push_back({read_risk_origin(place.at(k), claims), place.at(k).at("multiplier").number()});
  }
  return rows;
}

commission::RiskEllipsoid read_ellipsoid(const JsonPlace& place, const ModelClaims& claims) {
  // A radius that is not finite bounds nothing.
  const auto number = [&](const char* key) { return place.has(key) ? place.at(key).number() : core::kInfinity; };
  commission::RiskEllipsoid ellipsoid{.delay = place.at("delay").number(),
                                      .parameters = {},
                                      .risk = place.at("risk").number(),
                                      .log_volume = number("log_volume"),
                                      .squared_radius = number("squared_radius")};
  const JsonPlace names = place.at("parameters");
  for (std::size_t k = 0; k < names.size(); ++k) {
    ellipsoid.parameters.push_back(place_of(names.at(k), claims.parameter_names));
  }
  return ellipsoid;
}

commission::RiskFacet read_sum(const JsonPlace& place, const ModelClaims& claims) {
  const std::vector<commission::RiskEllipsoid>& ellipsoids = claims.at_risk->ellipsoids;
  commission::RiskFacet sum;
  sum.ellipsoid = number_at(place.at("ellipsoid"), ellipsoids.size(), "at_risk.ellipsoids");
  const std::vector<std::size_t>& block = ellipsoids[sum.ellipsoid].parameters;
  const auto of_block = [&](const char* key) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(claims.model.p()));
    all(block) = files::vector_at(place.at(key), block.size());
    return all;
  };
  sum.weights = of_block("weights");
  sum.Y = of_block("Y");
  sum.dY = of_block("dY");
  sum.y = place.at("y").number();
  sum.dy = place.at("dy").number();
  sum.radius = place.at("radius").number();
  sum.share = {.straight = place.at("straight").number(), .worst = place.at("worst").number()};
  return sum;
}

void read_risk(const JsonPlace& place, ModelClaims& claims) {
  const std::size_t p = claims.model.p();
  if (!place.has("sums")) {
    throw InputError(place.where() +
                     ": no member 'sums': this model was written before the set at a stated risk carried "
                     "certificates; commission again to have one that can be checked");
  }
  RiskClaims& risk = claims.at_risk.emplace();
  risk.model = robots::risk_at(place, claims.model);
  const JsonPlace set = place.at("feasible_set"), ellipsoids = place.at("ellipsoids"), sums = place.at("sums"),
                  origin = set.at("origin"), binding = place.at("binding");
  risk.box = robots::box_at(set.at("box"), p);
  risk.learning = place.at("learning").number();
  for (std::size_t k = 0; k < ellipsoids.size(); ++k) {
    risk.ellipsoids.push_back(read_ellipsoid(ellipsoids.at(k), claims));
  }
  for (std::size_t k = 0; k < sums.size(); ++k) {
    risk.sums.push_back(read_sum(sums.at(k), claims));
  }
  if (origin.size() != risk.model.facets.size()) {
    origin.fail("one entry for each of the " + std::to_string(risk.model.facets.size()) + " rows of A");
  }
  for (std::size_t k = 0; k < origin.size(); ++k) {
    risk.origin.push_back(read_risk_origin(origin.at(k), claims));
  }
  if (binding.size() != p) {
    binding.fail("one entry for each of the " + std::to_string(p) + " parameters");
  }
  for (std::size_t j = 0; j < p; ++j) {
    risk.lower.push_back(read_risk_proof(binding.at(j).at("lower"), claims));
    risk.upper.push_back(read_risk_proof(binding.at(j).at("upper"), claims));
  }
}

// The interval that `place` publishes at a stated risk, where it does.
void read_published(const JsonPlace& place, const std::string& name, std::map<std::string, Interval>& to) {
  if (place.has("at_risk")) {
    const Eigen::VectorXd ends = files::vector_at(place.at("at_risk"), 2);
    to[name] = {ends[0], ends[1]};
  }
}

void read_published_at_risk(const JsonPlace& root, ModelClaims& claims) {
  RiskClaims none;
  RiskClaims& risk = claims.at_risk ? *claims.at_risk : none;
  const JsonPlace parameters = root.at("parameters");
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    read_published(parameters.at(j), claims.model.parameters[j].name, risk.parameters);
  }
  if (root.has("physical")) {
    const JsonPlace physical = root.at("physical");
    for (const std::string& name : physical.keys()) {
      read_published(physical.at(name), name, risk.physical);
    }
  }
  if (!none.parameters.empty() || !none.physical.empty()) {
    throw InputError(root.where() + ": no member 'at_risk', on which the intervals at a stated risk stand");
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
  std::optional<OnlineModel> online;
  if (root.has("detector")) {
    online = robots::model_from_json(json, file);  // what detectors refuse is not proved
    claims.detector_errors = online->errors;
  }
  claims.robot = robots::robot_from_json(root.at("robot").value(), root.at("robot").where());
  claims.model = model::make_model(claims.robot);
  claims.key = "feasible_set";
  claims.output_names = claims.model.outputs;
  claims.parameter_names = parameter_names(claims.model);
  claims.filter = robots::filter_at(root.at("filter"));
  claims.measurement = robots::measurement_at(root.at("measurement"), claims.model, claims.robot);
  read_noise(root.at("noise"), claims);
  read_set(root.at("feasible_set"), claims);
  read_parameters(root.at("parameters"), claims);
  claims.warrant = robots::model_warrant(root);
  claims.guaranteed = claims.guaranteed || claims.warrant == core::Warrant::guaranteed;
  claims.assumptions = robots::assumptions_at(root);
  if (root.has("physical")) {
    const JsonPlace physical = root.at("physical");
    for (const std::string& name : physical.keys()) {
      claims.physical[name] = {physical.at(name).at("lower").number(), physical.at(name).at("upper").number()};
    }
  }
  if (root.has("at_risk")) {
    read_risk(root.at("at_risk"), claims);
  }
  read_published_at_risk(root, claims);
  if (online && online->kinematic) {
    read_kinematic(root.at("kinematic"), *online->kinematic, claims);
  }
  read_data(root.at("data"), claims);
  return claims;
}

ModelClaims read_claims(const std::filesystem::path& path) {
  return claims_from_json(files::read_json(path), path.string());
}

}  // namespace wheelwright::results
