// SPDX-License-Identifier: Apache-2.0
#include "model/model.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "core/check.hpp"

namespace wheelwright::model {
namespace {

std::string entry(const char* field, std::size_t index) {
  return std::string("Model::") + field + "[" + std::to_string(index) + "]";
}

void validate_term(const Model& model, std::size_t k) {
  const Term& term = model.terms[k];
  check::that(term.output < model.n(), entry("terms", k) + ".output", "the index of an output");
  check::that(term.parameter < model.p(), entry("terms", k) + ".parameter", "the index of a parameter");
  check::finite(term.scale, entry("terms", k) + ".scale");
  if (term.kind == Term::Kind::function) {
    const TermShape shape = term.function.shape();
    check::that(term.function != nullptr, entry("terms", k) + ".function", "a function");
    check::that(
        (shape != TermShape::sum_of_signs && shape != TermShape::difference_of_signs) || model.joints.size() >= 2,
        entry("terms", k) + ".function", "a function of the joints that there are");
  } else {
    check::that(term.coordinate < model.coordinates.size(), entry("terms", k) + ".coordinate",
                "the index of a coordinate");
  }
}

void validate_parameter(const Model& model, std::size_t j) {
  const Parameter& parameter = model.parameters[j];
  check::that(!parameter.name.empty(), entry("parameters", j) + ".name", "a name");
  for (std::size_t i = 0; i < j; ++i) {
    check::that(model.parameters[i].name != parameter.name, entry("parameters", j) + ".name", "a name used once");
  }
  check::finite(parameter.per_physical, entry("parameters", j) + ".per_physical");
  check::that(parameter.per_physical != 0.0, entry("parameters", j) + ".per_physical", "a number other than 0");
  check::finite(parameter.prior.lower, entry("parameters", j) + ".prior.lower");
  check::finite(parameter.prior.upper, entry("parameters", j) + ".prior.upper");
  check::that(parameter.prior.lower <= parameter.prior.upper, entry("parameters", j) + ".prior", "lower <= upper");
  bool used = false;
  for (const Term& term : model.terms) {
    used = used || term.parameter == j;
  }
  check::that(used, entry("parameters", j) + " (" + parameter.name + ")", "at least one term that it multiplies");
}

}  // namespace

double softened(const TermFunction& function, const MotionState& state) {
  constexpr int points = 8;
  std::vector<double> speed(state.speed.size()), joint_speed(state.joint_speed.size());
  const auto move = [](std::span<const double> from, std::span<const double> error, double by,
                       std::vector<double>& to) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      to[i] = from[i] + by * error[i];
    }
  };
  const std::vector<double> exact(std::max(speed.size(), joint_speed.size()), 0.0);
  MotionState moved = state;
  moved.speed = speed;
  moved.joint_speed = joint_speed;
  moved.speed_error = std::span(exact).first(speed.size());
  moved.joint_error = std::span(exact).first(joint_speed.size());
  moved.heading_error = 0.0;
  double sum = 0.0;
  for (int k = 0; k < points; ++k) {
    const double by = (2.0 * k + 1.0) / points - 1.0;
    move(state.speed, state.speed_error, by, speed);
    move(state.joint_speed, state.joint_error, by, joint_speed);
    sum += function(moved).value;
  }
  return sum / points;
}

void validate(const Model& model) {
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  check::that(model.n() > 0, "Model::outputs", "at least one output");
  check::that(model.p() > 0, "Model::parameters", "at least one parameter");
  check::that(!model.coordinates.empty(), "Model::coordinates", "at least one coordinate");
  check::that(joints > 0, "Model::joints", "at least one joint");
  check::that(model.output_units.size() == model.n(), "Model::output_units", "one unit per output");
  check::that(
      model.motion.rows() == static_cast<Eigen::Index>(model.coordinates.size()) && model.motion.cols() == joints,
      "Model::motion", "a matrix of coordinates × joints");
  check::that(model.input.rows() == static_cast<Eigen::Index>(model.n()) && model.input.cols() == joints,
              "Model::input", "a matrix of outputs × joints");
  check::that(model.motion.allFinite(), "Model::motion", "finite entries");
  check::that(model.input.allFinite(), "Model::input", "finite entries");
  check::that(model.heading_coordinate >= -1 && model.heading_coordinate < static_cast<int>(model.coordinates.size()),
              "Model::heading_coordinate", "−1 or the index of a coordinate");
  for (std::size_t k = 0; k < model.terms.size(); ++k) {
    validate_term(model, k);
  }
  for (std::size_t j = 0; j < model.p(); ++j) {
    validate_parameter(model, j);
  }
}

Eigen::MatrixXd regressor(const Model& model, const MotionState& state, std::span<const double> acceleration) {
  const std::size_t coordinates = model.coordinates.size();
  check::that(state.speed.size() == coordinates, "MotionState::speed", "one value per coordinate");
  check::that(state.speed_error.size() == coordinates, "MotionState::speed_error", "one value per coordinate");
  check::that(acceleration.size() == coordinates, "acceleration", "one value per coordinate");
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model.n()), static_cast<Eigen::Index>(model.p()));
  for (const Term& term : model.terms) {
    double value = 0.0;
    switch (term.kind) {
      case Term::Kind::acceleration: value = acceleration[term.coordinate]; break;
      case Term::Kind::speed: value = state.speed[term.coordinate]; break;
      case Term::Kind::function: value = term.function(state).value; break;
    }
    y(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.parameter)) += term.scale * value;
  }
  return y;
}

}  // namespace wheelwright::model
