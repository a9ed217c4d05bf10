// SPDX-License-Identifier: Apache-2.0
/// \file
/// The effects that a robot file can carry, as data: what they are called, their parameters, and which part of the
/// toolkit accounts for them.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// How an effect is accounted for when a log is read. A simulator takes them all.
enum class EffectMechanism {
  term,        ///< terms of Y, linear in the parameters, which are then bounded from the log (effect_terms.hpp)
  effort,      ///< a correction of the measured effort with fixed numbers, before the filter (effort_correction.hpp)
  geometry,    ///< fixed numbers in the motion and input matrices (effect_geometry.hpp)
  simulation,  ///< in a simulator only
};

/// One parameter of an effect.
struct EffectParameterLaw {
  std::string name;
  std::string unit;     ///< for a single axis that is linear, N for N·m and m/s for rad/s
  bool linear = false;  ///< it multiplies terms: an interval may be given, and one of an effect's linear parameters is
                        ///< enough (the others are 0); every other parameter is needed, as a single value
  double lower = -std::numeric_limits<double>::infinity();  ///< least value that makes sense
  double upper = std::numeric_limits<double>::infinity();   ///< largest one
  bool positive = false;                                    ///< and not 0
};

/// One effect. An effect's δ is the effort that the motors have to supply in addition to the basic model's.
struct EffectLaw {
  std::string name;
  EffectMechanism mechanism = EffectMechanism::term;
  std::vector<EffectParameterLaw> parameters;  ///< of a differential drive; empty: it has no such effect
  std::vector<EffectParameterLaw> of_axis;     ///< of a single axis; empty: it has no such effect
  std::string remedy;  ///< for Mechanism::simulation: why a log cannot be corrected for it, and what to do instead

  /// The parameters for a robot of the model `model`.
  [[nodiscard]] const std::vector<EffectParameterLaw>& parameters_of(const std::string& model) const {
    return model == "single_axis" ? of_axis : parameters;
  }
};

/// All effects, in the order of the catalogue.
[[nodiscard]] const std::vector<EffectLaw>& effect_laws();

/// The law called `name`. Throws InvalidArgument, listing the names, where there is none.
[[nodiscard]] const EffectLaw& effect_law(const std::string& name);

/// Names of the effects that a robot of the model `model` can have.
[[nodiscard]] std::vector<std::string> effect_names(const std::string& model);

/// Throws InvalidArgument, naming the effect and its parameter, unless every effect of `robot` is one that its model can
/// have, stands there once and has the parameters that its law asks for, within their limits; and unless efforts are
/// torques, or the motor's constants make torques of them, where an effect is an effort.
void validate_effects(const Robot& robot);

/// Whether `robot` has the effect `name`.
[[nodiscard]] bool has_effect(const Robot& robot, const std::string& name);

/// Value (mid-point) of a parameter of the robot's effect `effect`; 0 where the robot does not have it.
[[nodiscard]] double effect_value(const Robot& robot, const std::string& effect, const std::string& parameter);

}  // namespace wheelwright
