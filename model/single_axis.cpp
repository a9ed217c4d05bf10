// SPDX-License-Identifier: Apache-2.0
#include "model/single_axis.hpp"

namespace wheelwright::model {

Model SingleAxis::model() const {
  Model m;
  m.name = "single_axis";
  m.outputs = {"effort"};
  m.output_units = {"N (rotary: N·m)"};
  m.coordinates = {"velocity"};
  m.joints = {{"position", "velocity", "effort", "effort", "effort", ""}};
  m.motion = Eigen::MatrixXd::Ones(1, 1);
  m.input = Eigen::MatrixXd::Ones(1, 1);

  const auto add = [&m](const char* name, const char* unit, Interval prior, const char* excite,
                        Term term) -> Parameter& {
    term.parameter = m.parameters.size();
    m.terms.push_back(term);
    return m.parameters.emplace_back(Parameter{
        .name = name, .unit = unit, .physical = name, .physical_unit = unit, .prior = prior, .excite = excite});
  };
  Parameter& inertia =
      add("inertia", "kg (rotary: kg·m²)", {0.0, 1e6}, "accelerate and brake", {.kind = Term::Kind::acceleration});
  inertia.never_negative = inertia.moved_mass = true;
  add("viscous", "N·s/m (rotary: N·m·s/rad)", {0.0, 1e7}, "move at different speeds", {.kind = Term::Kind::speed})
      .never_negative = true;
  if (coulomb) {
    Parameter& friction = add("coulomb", "N (rotary: N·m)", {0.0, 1e7}, "move in both directions",
                              {.kind = Term::Kind::function, .function = TermShape::sign_of_speed});
    friction.on_request = friction.dry_friction = friction.never_negative = true;
  }
  if (offset) {
    add("offset", "N (rotary: N·m)", {-1e7, 1e7}, "move in both directions",
        {.kind = Term::Kind::function, .function = TermShape::constant})
        .on_request = true;
  }
  return m;
}

}  // namespace wheelwright::model
