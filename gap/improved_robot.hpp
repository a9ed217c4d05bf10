// SPDX-License-Identifier: Apache-2.0
/// \file
/// Improved robot file: the causes that were found, and nominal values fitted with them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// `robot` with the nominal values of `theta` (p entries in the order of `model`, which is make_model(robot)): physical
/// quantities in `nominal`, friction below 0 taken as 0, and the numbers of its own effects where they are in θ. A
/// declared prior that does not hold a new value is widened to twice or half of it. Throws InvalidArgument unless θ has
/// p finite entries.
[[nodiscard]] Robot with_nominal(const Robot& robot, const Model& model, const Eigen::VectorXd& theta);

/// The file of `robot`, whose efforts are torques, with `causes`, fitted on `drive` (made of it) beside `theta`: what
/// the causes explain is in addition to Yθ, parametric ones included.
///
/// - Parametric causes and what comes beside an effect (a changed inertia) become nominal values; wheel_radius and
///   track_width change these keys. Friction that is in the joints as they were found (catalogue::friction_on_body):
///   viscous values follow the geometry so that it stays; where the wheels' radii differ this takes a
///   viscous_asymmetric too, and their inertia a com_lateral.
/// - All others become `effects:` in the parametrisation of effect_law.hpp. With e_R, e_L at the wheels:
///   torque_gain_asymmetric has g = (e_L − e_R)/(2 + e_R + e_L) and θ·2(1 + e_R)(1 + e_L)/(2 + e_R + e_L),
///   wheel_radius_asymmetric ε = (e_R − e_L)/(2 + e_R + e_L) and r(1 + (e_R + e_L)/2), viscous_asymmetric b = e_R − e_L
///   and the mean at both wheels, encoder_scale −e/(1 + e). The efforts of com_* and slope keep their size when the
///   mass is another than that of `drive.theta`.
/// - The eccentric radius of wheel_out_of_round is left out: the robot file has its torque only. A backlash is given
///   the gap that has the found product with the inertia of the simulator's rotor.
/// - `intervals` has the 95 % interval of each cause's coefficients, or is empty. Linear parameters get an interval
///   about the estimate, three times as wide and at least as wide as the estimate (a prior that is to hold for
///   certain); without, the estimate alone. A parameter that is 0, or has the wrong sign, is left out.
///
/// Nothing, with the reason in `why_not`, where the robot file cannot carry a cause. Throws InvalidArgument for θ or
/// coefficients of the wrong size.
[[nodiscard]] std::optional<Robot> improved_robot(const Robot& robot, const Drive& drive, const Eigen::VectorXd& theta,
                                                  const std::vector<FittedEffect>& causes,
                                                  const std::vector<std::vector<Interval>>& intervals,
                                                  std::string& why_not);

}  // namespace wheelwright::gap
