// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/effect_geometry.hpp>

#include <algorithm>

#include <wheelwright/model/effect_law.hpp>
#include <wheelwright/model/effect_terms.hpp>

namespace wheelwright {

DriveGeometry drive_geometry(const Robot& robot) {
  const double r = robot.wheel_radius * (1.0 + effect_value(robot, "wheel_radius", "eps"));
  const double eps = effect_value(robot, "wheel_radius_asymmetric", "eps");
  return {{r * (1.0 + eps), r * (1.0 - eps)},
          robot.track_width * (1.0 + effect_value(robot, "track_width", "eps")),
          {1.0 + effect_value(robot, "encoder_scale", "s_R"), 1.0 + effect_value(robot, "encoder_scale", "s_L")}};
}

void apply_geometry(Model& model, const Robot& robot) {
  const bool changed = std::ranges::any_of(robot.effects, [](const RobotEffect& effect) {
    return effect_law(effect.name).mechanism == EffectMechanism::geometry;
  });
  if (!changed) {
    return;
  }
  const DriveGeometry g = drive_geometry(robot);
  model.motion << 0.5 * g.radius[0], 0.5 * g.radius[1], g.radius[0] / g.track_width, -g.radius[1] / g.track_width;
  model.motion.array().rowwise() /= g.encoder_scale.transpose().array();
  model.input.array().rowwise() *= robot.wheel_radius / g.radius.transpose().array();
  for (std::size_t j = 0; j < model.p(); ++j) {
    if (model.parameters[j].physical == "coulomb") {
      std::erase_if(model.terms, [&](const Term& term) { return term.parameter == j; });
      add_dry_friction(model, j);
    }
  }
}

}  // namespace wheelwright
