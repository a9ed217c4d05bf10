// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/single_axis.hpp>

#include <cmath>

namespace wheelwright::model {
namespace {

// At rest, and where the sign of the speed is in doubt, dry friction is anywhere in [−1, 1].
TermValue sign_of_speed(const MotionState& state) {
  const double v = state.speed[0];
  if (std::abs(v) <= state.speed_error[0]) {
    return {0.0, 1.0};
  }
  return {v > 0.0 ? 1.0 : -1.0, 0.0};
}

TermValue constant_term(const MotionState&) { return {1.0, 0.0}; }

}  // namespace

Model SingleAxis::model() const {
  Model m;
  m.name = "single_axis";
  m.outputs = {"effort"};
  m.output_units = {"N (rotary: N·m)"};
  m.coordinates = {"velocity"};
  m.joints = {{"position", "velocity", "effort", "effort", "effort", ""}};
  m.motion = Eigen::MatrixXd::Ones(1, 1);
  m.input = Eigen::MatrixXd::Ones(1, 1);

  const auto add = [&m](const char* name, const char* unit, Interval prior, const char* excite, Term term) {
    term.parameter = m.parameters.size();
    m.parameters.push_back({name, unit, name, unit, 1.0, prior, excite, false, false});
    m.terms.push_back(term);
  };
  add("inertia", "kg (rotary: kg·m²)", {0.0, 1e6}, "accelerate and brake", {.kind = Term::Kind::acceleration});
  add("viscous", "N·s/m (rotary: N·m·s/rad)", {0.0, 1e7}, "move at different speeds", {.kind = Term::Kind::speed});
  if (coulomb) {
    add("coulomb", "N (rotary: N·m)", {0.0, 1e7}, "move in both directions",
        {.kind = Term::Kind::function, .function = sign_of_speed});
    m.parameters.back().on_request = m.parameters.back().dry_friction = true;
  }
  if (offset) {
    add("offset", "N (rotary: N·m)", {-1e7, 1e7}, "move in both directions",
        {.kind = Term::Kind::function, .function = constant_term});
    m.parameters.back().on_request = true;
  }
  return m;
}

}  // namespace wheelwright::model
