// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects that a robot file can carry, as data: names, parameters, regressor terms, geometry, and the part of the
/// toolkit that accounts for each.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::model {

/// The wheels as the effects of a robot leave them.
struct DriveGeometry {
  Eigen::Vector2d radius = Eigen::Vector2d::Zero();         ///< [r_R, r_L], m
  double track_width = 0.0;                                 ///< D, m
  Eigen::Vector2d encoder_scale = Eigen::Vector2d::Ones();  ///< what an encoder shows per unit of what is
};

/// The geometry of a differential drive: `wheel_radius_asymmetric` r(1 ± ε) (right, left), `wheel_radius` r(1 + ε),
/// `track_width` D(1 + ε), `encoder_scale` 1 + s_R, 1 + s_L. Without these effects that of the robot file.
[[nodiscard]] DriveGeometry drive_geometry(const Robot& robot);

/// Gives `model` (of a differential drive, made with the track width of the geometry) the robot's geometry: with r the
/// nominal radius,
///   v = [r_R/2 r_L/2; r_R/D −r_L/D] ω,   [r/r_R r/r_L; ℓ r/r_R −ℓ r/r_L] τ = Y θ_L,
/// so that θ_L = r·[m, I, f1, f3] keeps its meaning; dry friction at the wheels follows the input matrix. The model is
/// left as it is where the robot has no such effect.
void apply_geometry(Model& model, const Robot& robot);

/// Appends the parameters and terms of the robot's effects to `model`, which has the robot's geometry. With ℓ the
/// model's lever arm, k = ℓ/(D/2), and [δs; δd] the additional effort of (15) per unit of the entry of θ_L; ±ℓ stands
/// for the same at both wheels with the signs of the input matrix:
///   coulomb_asymmetric   sgn ω_R (c_R), sgn ω_L (c_L), at the wheel
///   stribeck             e^{−(ω/ω_s)²} sgn ω at both wheels, ω_s fixed
///   viscous_asymmetric   v2 D/(2r) ; ℓ v1/r
///   quadratic_drag       v1|v1| ; 0 (c) and 0 ; k v2|v2| (c2)
///   com_longitudinal     −v2² ; k v1 v2, θ = r·m·a
///   com_lateral          −v̇2 ; −k v̇1, θ = r·m·b
///   torque_bias          1 at the right (b_R), the left wheel (b_L)
///   slope                cos θ ; 0 (θ = r·m·g_x) and sin θ ; 0 (θ = r·m·g_y)
///   caster_drag          v1/V ; k p² v2/V, V² = v1² + p² v2², p fixed
///   lateral_scrub        0 ; k sgn v2
/// and for a single axis stribeck and quadratic_drag of its one speed. `coulomb` is the model's own parameter, and
/// `torque_bias` of a single axis its `offset`. A parameter that the robot file does not name has no entry.
/// Where a sign is in doubt, by the error of the speed, the term is any number in [−1, 1].
void add_effect_terms(Model& model, const Robot& robot);

/// The parameters and terms of the robot's effects alone: `model` without its own, and then as add_effect_terms.
[[nodiscard]] Model effect_terms(Model model, const Robot& robot);

/// Adds dry friction of the parameter `parameter` at every joint: sgn ω_j times the column of the input matrix.
void add_dry_friction(Model& model, std::size_t parameter);

/// Prior of the model parameter with the physical name `physical`, where it is one of the robot's effects: the interval
/// of the robot file; [v/3, 3v] for a single value v; for com_* and slope times the mass, which is that of the robot's
/// prior, else [m/3, 3m] of the nominal m, else anything up to 10⁶ kg.
[[nodiscard]] std::optional<Interval> effect_prior(const Robot& robot, const std::string& physical);

/// The physical quantity that a simulator with the mass `mass` (kg) takes for the same parameter; nothing where it is
/// of no effect.
[[nodiscard]] std::optional<double> effect_truth(const Robot& robot, const std::string& physical, double mass);

/// Mechanism by which an effect is accounted for when a log is read. A simulator takes them all.
enum class EffectMechanism {
  term,        ///< terms of Y, linear in the parameters, which are then bounded from the log (effect_law.hpp)
  effort,      ///< a correction of the measured effort with fixed numbers, before the filter (effort_correction.hpp)
  geometry,    ///< fixed numbers in the motion and input matrices (effect_law.hpp)
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
  bool optional = false;                                    ///< not linear, and not needed: without it the effect has 0
  std::string physical{};   ///< linear: the quantity of the model's parameter, e.g. "coulomb_asymmetric_c_R"
  bool times_mass = false;  ///< linear: that quantity is this times the mass
  Interval search{};        ///< not linear: where a gap analysis looks for it, > 0 in its unit, where the effect has no
                            ///< columns of its own in the catalogue of gap
};

class EffectTerms;

/// One effect. An effect's δ is the effort that the motors have to supply in addition to the basic model's.
struct EffectLaw {
  std::string name;
  std::string noun;  ///< as sentences call it: "dry friction that fades with speed"
  EffectMechanism mechanism = EffectMechanism::term;
  std::vector<EffectParameterLaw> parameters;  ///< of a differential drive; empty: it has no such effect
  std::vector<EffectParameterLaw> of_axis;     ///< of a single axis; empty: it has no such effect
  std::string remedy{};  ///< for Mechanism::simulation: why a log cannot be corrected for it, and what to do instead
  /// Appends the terms of one robot's effect to its model (add_effect_terms); nothing where they are the model's own.
  void (*add_terms)(EffectTerms& terms, const RobotEffect& effect) = nullptr;
  void (*add_terms_of_axis)(EffectTerms& terms, const RobotEffect& effect) = nullptr;
  std::string of_each_wheel{};  ///< the effect that says the same with a parameter for each wheel; empty: there is none

  /// The parameters for a robot of the model that `robot` names.
  [[nodiscard]] const std::vector<EffectParameterLaw>& parameters_of(const Robot& robot) const {
    return on_two_wheels(robot) ? parameters : of_axis;
  }
};

/// All effects, in the order of the catalogue.
[[nodiscard]] const std::vector<EffectLaw>& effect_laws();

/// The law called `name`. Throws InvalidArgument, listing the names, where there is none.
[[nodiscard]] const EffectLaw& effect_law(const std::string& name);

/// Names of the effects that a robot of the model that `robot` names can have.
[[nodiscard]] std::vector<std::string> effect_names(const Robot& robot);

/// Throws InvalidArgument, naming the effect and its parameter, unless every effect of `robot` is one that its model
/// can have, stands there once and has the parameters that its law asks for, within their limits; and unless efforts
/// are torques, or the motor's constants make torques of them, where an effect is an effort.
void validate_effects(const Robot& robot);

/// True if `robot` has the effect `name`.
[[nodiscard]] bool has_effect(const Robot& robot, const std::string& name);

/// Value (mid-point) of a parameter of the robot's effect `effect`; 0 where the robot does not have it.
[[nodiscard]] double effect_value(const Robot& robot, const std::string& effect, const std::string& parameter);

}  // namespace wheelwright::model
