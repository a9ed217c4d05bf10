// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the causes of a gap are in a rigid-body simulator: masses, friction, geometry, limits.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "gap/diagnosis.hpp"
#include "gap/rows/drive.hpp"
#include "model/robot.hpp"
#include "model/simulator_change.hpp"

namespace wheelwright::gap {

/// The changes of a simulator of `robot` that `found` asks for. `drive` has the θ that the causes' columns were made
/// with. θ holds the wheels' 2J/r² in its mass; a simulator keeps J, so causes are changes of bodies and joints, and
/// what only accompanies a cause in θ (Parameter::beside) follows in the simulator by itself:
///
/// - payload: its mass and moment, on the axle; payload_offset and com_*: first moments, r·m·a of the model over r.
/// - coulomb*, viscous*, armature: torques at each joint. A changed f1 and f3 are one damping c of both joints,
///   f1 = 2c/r² and f3 = c D²/(2r²); where they contradict each other, the mean by their intervals, and the rest is
///   told.
/// - torque_gain*: the command's excess e over what the model needs makes the gain 1/(1 + e).
/// - wheel_radius*: 1 + ε; track_width: D(1 + ε) = D/(1 − c) of the share c by which the robot turns slower.
/// - saturation: the limit of a wheel's torque.
///
/// Everything else is in `not_expressed` with its numbers, and so are torques where the log's efforts are currents or
/// voltages and the robot file has no motor constants. Causes that have no fit (play above the band) are there, too.
/// Throws InvalidArgument for a robot that is not on two driven wheels.
[[nodiscard]] model::SimulatorChange simulator_change(const Robot& robot, const Drive& drive, const Diagnosis& found);

}  // namespace wheelwright::gap
