// SPDX-License-Identifier: Apache-2.0
/// \file
/// Weights of the sums over time scales, for torque and pose: which fault each of them is like.
#pragma once

#include <cstddef>
#include <string>

namespace wheelwright::detector {

/// What the weights of a sum are like: the shape of what a fault adds to the torque, as it is foreseen.
struct SumWeight {
  /// Shape.
  enum class Shape {
    constant,   ///< of the joint's effort: a bias; a jump of the speed, over short scales
    effort,     ///< the joint's effort: a share of it is lost
    parameter,  ///< the torque of one parameter: it has changed
  };
  Shape shape = Shape::constant;
  std::size_t which = 0;  ///< joint or parameter
  std::string name{};     ///< "effort_right", "constant_left", "mass"
};

/// What the weights of a sum are like: the shape of what a fault adds to the motion, as it is foreseen.
struct PoseWeight {
  /// Shape.
  enum class Shape {
    along,     ///< a constant speed along the heading: slip of both wheels
    across,    ///< a constant speed across it: lateral slip
    turn,      ///< a constant turning rate: slip of one wheel, a sheared axle
    radius,    ///< the way that one wheel rolls: its effective radius, or the scale of its encoder
    yaw_gain,  ///< the turn that one wheel makes: radius over track width
  };
  Shape shape = Shape::along;
  std::size_t wheel = 0;  ///< 0 right, 1 left; of radius and yaw_gain
  std::string name{};     ///< "slip_along", "slip_across", "turn", "radius_right", "yaw_gain_left"

  /// True if the sum is of positions, in m; else of headings, in rad.
  [[nodiscard]] bool of_position() const { return shape != Shape::turn && shape != Shape::yaw_gain; }
};

}  // namespace wheelwright::detector
