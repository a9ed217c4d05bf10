// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/model_file.hpp>

#include <nlohmann/json.hpp>

#include <wheelwright/io/model_words.hpp>
#include <wheelwright/io/robot_file.hpp>

namespace wheelwright {
namespace {

Eigen::VectorXd vector_at(const JsonPlace& place) {
  const std::vector<double> values = place.numbers();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Eigen::VectorXd vector_at(const JsonPlace& place, std::size_t size) {
  Eigen::VectorXd values = vector_at(place);
  if (static_cast<std::size_t>(values.size()) != size) {
    place.fail("an array of " + std::to_string(size) + " numbers");
  }
  return values;
}

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

Measurement read_measurement(const JsonPlace& place, const Model& model) {
  Measurement m;
  m.motion = value_of(kMotionWords, place.at("motion"));
  m.motion_columns = place.at("motion_columns").texts();
  m.effort_columns = place.at("effort_columns").texts();
  m.heading_column = place.at("heading_column").text();
  m.hold = value_of(kHoldWords, place.at("hold"));
  m.effort_unsigned = place.at("effort_unsigned").boolean();
  m.count = place.at("count").number();
  m.nominal_step = place.at("nominal_step").number();
  if (m.motion_columns.size() != model.joints.size() || m.effort_columns.size() != model.joints.size()) {
    place.fail("one motion column and one effort column for each joint of the model");
  }
  return m;
}

SignalErrors read_errors(const JsonPlace& place, const Model& model) {
  const auto optional_vector = [&](std::string_view key) {
    const Eigen::VectorXd values = vector_at(place.at(key));
    return values.size() == 0 ? values : vector_at(place.at(key), model.coordinates.size());
  };
  SignalErrors errors;
  errors.acceleration = optional_vector("acceleration");
  errors.speed = optional_vector("speed");
  errors.speed_sample = optional_vector("speed_sample");
  errors.output = vector_at(place.at("output"), model.n());
  errors.joint_sample = place.at("joint_sample").number();
  errors.heading = place.at("heading").number();
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

Box read_hull(const JsonPlace& place, std::size_t p) {
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

}  // namespace

CommissionedModel model_from_json(const Json& json, const std::string& file) {
  const JsonPlace root(json, file);
  if (!root.has("schema") || root.at("schema").text() != kModelSchema) {
    throw InputError(file + ": expected a model written by `wheelwright commission`, with \"schema\": \"" +
                     kModelSchema + "\"");
  }
  if (!root.has("detector")) {
    throw InputError(file + ": holds no model: " + root.at("message").text());
  }
  CommissionedModel model;
  model.robot = robot_from_json(root.at("robot").value(), root.at("robot").where());
  model.model = make_model(model.robot);
  const std::size_t p = model.model.p();
  model.filter = read_filter(root.at("filter"));
  model.measurement = read_measurement(root.at("measurement"), model.model);
  const JsonPlace detector = root.at("detector");
  model.estimate = vector_at(detector.at("estimate"), p);
  model.errors = read_errors(detector.at("error_bounds"), model.model);
  model.persistence = {detector.at("persistence").at("k").count(), detector.at("persistence").at("n").count()};
  model.facets = read_facets(root.at("feasible_set"), p);
  model.box = read_hull(root.at("feasible_set").at("hull"), p);
  return model;
}

CommissionedModel read_model(const std::filesystem::path& path) {
  return model_from_json(read_json(path), path.string());
}

}  // namespace wheelwright
