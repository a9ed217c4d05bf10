// SPDX-License-Identifier: Apache-2.0
/// \file
/// A robot as linear-in-parameters dynamics: u(t) = Y(q, v, v̇) θ_L (20), stated as data that the filter can walk.
///
/// A model names its joints (what the log measures), the motion coordinates (fixed linear combinations of the joint
/// motions: v1, v2), the outputs (fixed linear combinations of the joint efforts: the left side of (15)), and the
/// terms of Y: speed or acceleration of a coordinate, or any instantaneous function of the motion. A new robot is one
/// function or small type that fills this struct; see examples/own_model.cpp.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"

namespace wheelwright::model {

/// One entry θ_L,j of the parameter vector (20).
struct Parameter {
  std::string name;           ///< as in results, e.g. "r_mass"
  std::string unit;           ///< unit with torque as effort, e.g. "kg·m"
  std::string physical;       ///< the physical quantity behind it, e.g. "mass"
  std::string physical_unit;  ///< e.g. "kg"
  double per_physical =
      1.0;             ///< θ_L,j = per_physical · physical quantity (the wheel radius r for the robot of the paper)
  Interval prior;      ///< wide physical default of the physical quantity, in physical_unit
  std::string excite;  ///< what to do when a log does not show it, e.g. "drive in curves"
  bool on_request = false;    ///< in a robot's model only where it is asked for
  bool dry_friction = false;  ///< equal at all joints, of the signs of their speeds: at rest it is any number up to it
  bool never_negative = false;  ///< the quantity is >= 0 in every robot: a mass, an inertia, friction
  bool moved_mass = false;      ///< inertia of the first coordinate: a robot's mass, an axis's inertia
};

/// A measured joint: which columns of the log hold its angle, speed and effort.
struct Joint {
  std::string angle;    ///< e.g. "phi_r"
  std::string speed;    ///< e.g. "omega_r"
  std::string torque;   ///< e.g. "tau_r"
  std::string current;  ///< e.g. "current_r"
  std::string voltage;  ///< e.g. "voltage_r"
  std::string command;  ///< commanded speed, e.g. "command_r"; empty where no column is known for it
};

/// Motion at one instant, the argument of an instantaneous term.
struct MotionState {
  std::span<const double> speed{};        ///< speed of each motion coordinate (v1, v2), m/s, rad/s
  std::span<const double> speed_error{};  ///< bound on the error of each speed (0 where nothing is declared)
  std::span<const double> joint_speed{};  ///< speed of each joint, rad/s or m/s
  std::span<const double> joint_error{};  ///< bound on the error of each joint speed
  double heading = 0.0;                   ///< θ of the pose, rad: measured where the log has it, else odometry
  double heading_error = 0.0;             ///< bound on its error, rad
};

/// A value of a term with a bound on its error.
struct TermValue {
  double value = 0.0;
  double error = 0.0;  ///< >= 0: the exact value is within `error` of `value`
};

/// Instantaneous functions that models have in common. Where a sign is in doubt by the error of its speed, it is any
/// number in [−1, 1].
enum class TermShape {
  own,                  ///< none of these: a function that a model or an effect brings with it
  along_x,              ///< v1 cos²θ
  along_y,              ///< v1 sin²θ
  sum_of_signs,         ///< sgn ω1 + sgn ω2, of the first two joints
  difference_of_signs,  ///< sgn ω1 − sgn ω2
  sign_of_speed,        ///< sgn v1, in doubt at rest, too
  constant,             ///< 1
};

/// An instantaneous function of the motion, with up to two constants of its own (a joint's number, a shape parameter).
/// Two are equal when they are the same function with the same constants.
class TermFunction {
 public:
  using Plain = TermValue (*)(const MotionState&);
  using Shaped = TermValue (*)(const MotionState&, const std::array<double, 2>& constants);

  TermFunction() = default;
  /// A function without constants (a function, or a lambda without capture; nullptr for none).
  template <typename F>
  requires(std::convertible_to<F, Plain> && !std::same_as<std::remove_cvref_t<F>, TermFunction>)
      TermFunction(F&& function)
      : plain_(static_cast<Plain>(function)) {}
  /// The function of `shape`; none for TermShape::own.
  TermFunction(TermShape shape);
  /// `function` with `constants`.
  TermFunction(Shaped function, const std::array<double, 2>& constants) : shaped_(function), constants_(constants) {}

  /// The value at one instant. There must be a function.
  TermValue operator()(const MotionState& state) const {
    return shaped_ != nullptr ? shaped_(state, constants_) : plain_(state);
  }
  /// What it is, for those who write the function down instead of calling it.
  [[nodiscard]] TermShape shape() const { return shape_; }
  friend bool operator==(const TermFunction&, const TermFunction&) = default;

 private:
  TermShape shape_ = TermShape::own;
  Plain plain_ = nullptr;
  Shaped shaped_ = nullptr;
  std::array<double, 2> constants_{};
};

/// Mean of `function` over the errors of `state`: eight points on the way of all its speeds from −error to +error.
/// Where it jumps with the sign of a speed, as dry friction does, it goes over from one value to the other, which
/// simulators and fits of measured speeds need.
[[nodiscard]] double softened(const TermFunction& function, const MotionState& state);

/// One non-zero entry of Y: what stands at (output, parameter).
struct Term {
  /// What the entry is made of.
  enum class Kind {
    acceleration,  ///< scale · d²/dt² of a coordinate
    speed,         ///< scale · d/dt of a coordinate
    function,      ///< scale · function(state)
  };
  std::size_t output = 0;
  std::size_t parameter = 0;
  Kind kind = Kind::speed;
  std::size_t coordinate = 0;  ///< for acceleration and speed
  double scale = 1.0;
  TermFunction function{};  ///< for Kind::function
};

/// Linear-in-parameters dynamics of a robot.
struct Model {
  std::string name;
  std::vector<Parameter> parameters;      ///< p entries of θ_L
  std::vector<std::string> outputs;       ///< n names of channels, e.g. "sum", "difference"
  std::vector<std::string> output_units;  ///< n units with torque as effort
  std::vector<std::string> coordinates;   ///< names of the motion coordinates, e.g. "v1", "v2"
  std::vector<Joint> joints;
  Eigen::MatrixXd motion;       ///< coordinates × joints: coordinate speeds = motion · joint speeds, (5)
  Eigen::MatrixXd input;        ///< outputs × joints: left side of (15) = input · joint efforts
  std::vector<Term> terms;      ///< the non-zero entries of Y
  int heading_coordinate = -1;  ///< coordinate whose integral is the heading, −1 where there is none
  bool heading_used = false;    ///< whether a term looks at the heading
  bool on_two_wheels = false;   ///< drives on a right and a left wheel: has a heading, a pose, faults of its wheels

  /// n.
  [[nodiscard]] std::size_t n() const { return outputs.size(); }
  /// p.
  [[nodiscard]] std::size_t p() const { return parameters.size(); }
};

/// Throws InvalidArgument, naming the field, unless the shapes and indices of `model` agree, every parameter has a
/// term, and every number is finite.
void validate(const Model& model);

/// Y(v, v̇) (n × p) of (20) at one instant: what the filtered regressor is the filter of. `acceleration` has one value
/// per coordinate.
[[nodiscard]] Eigen::MatrixXd regressor(const Model& model, const MotionState& state,
                                        std::span<const double> acceleration);

}  // namespace wheelwright::model

namespace wheelwright {
using model::Model;
using model::Term;
}  // namespace wheelwright
