// SPDX-License-Identifier: Apache-2.0
/// \file
/// Bound on the acceleration between two samples, from the model, the efforts and a set of parameters.
#pragma once

#include <span>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "model/model.hpp"

namespace wheelwright::filter {

/// Bounds on the accelerations of a model's coordinates at every instant, samples or not. With M(θ)q̈ = u − F(θ, q̇)
/// the dynamics (20), M what multiplies accelerations, |q̈| <= |M⁻¹|(|u| + |F|) for every θ of a set; and whatever else
/// is known, a limit.
struct MotionBound {
  Eigen::VectorXd limit;     ///< per coordinate: |q̈| <= limit, and of each joint |acceleration| <= limit_c / Σ_j
                             ///< |motion_cj| for every coordinate c; empty: none
  Eigen::MatrixXd mobility;  ///< coordinates × outputs: sup |M(θ)⁻¹| over the set, entry by entry; empty: not known
  Eigen::VectorXd largest;   ///< p: sup |θ_j| over the set
  Eigen::VectorXd effort;    ///< per output: bound on the error of the unfiltered effort

  /// True if nothing at all is known: then rows take the motion between samples as interpolated without error.
  [[nodiscard]] bool empty() const { return limit.size() == 0 && mobility.size() == 0; }
};

/// What of a model's motion is a gradient flow while its efforts are held: outputs have a coordinate each, whose
/// inertia and friction are not negative, and the only functions are constants and signs of speeds.
enum class FlowKind {
  none,      ///< not of this kind
  separate,  ///< each coordinate goes by itself whatever the others do
  by_signs,  ///< coordinates go by themselves while no sign of a joint's speed changes: two wheels
};

[[nodiscard]] FlowKind flow_kind(const Model& model);

/// `mobility` and `largest` for all θ inside the box `sides` (p), rounded outward. Both stay empty where M may be
/// singular in the box, or couples more than two coordinates. Throws InvalidArgument unless there is one side for each
/// parameter.
[[nodiscard]] MotionBound motion_bound(const Model& model, std::span<const Interval> sides);

/// One step between two samples, as far as its samples tell; the last members are what enclose() finds.
struct StepMotion {
  double length = 0.0;           ///< s
  bool known = true;             ///< false: nothing is known of the effort in it, the rest is not to be looked at
  bool ends = false;             ///< speeds are means of those at both ends, else means over the step
  bool held = false;             ///< the effort is the same at every instant of the step
  Eigen::VectorXd speed;         ///< per coordinate, mean
  Eigen::VectorXd speed_error;   ///< bound on its error, what the samples are wrong by
  Eigen::VectorXd gain;          ///< per coordinate, where `ends`: speed at the end less speed at the beginning
  Eigen::VectorXd joint_speed;   ///< per joint
  Eigen::VectorXd joint_error;   ///< per joint
  Eigen::VectorXd effort;        ///< per output: middle of what u may be in the step
  Eigen::VectorXd effort_error;  ///< per output: by how much u may differ from it, errors included
  double heading = 0.0;          ///< rad, in its middle
  double heading_error = 0.0;    ///< rad
  bool steady = false;           ///< every coordinate goes one way, less and less fast
  Eigen::VectorXd acceleration;  ///< per coordinate: |q̈| is at most this in the step; infinite where it is not known
  Eigen::VectorXd departure;     ///< per coordinate: the speed in the step is within this of its mean
  Eigen::VectorXd bow;           ///< per coordinate, where `ends`: the mean over the step is within this of `speed`
  std::vector<char> moving;      ///< per joint: not 0 where it is certain never to stand or turn round in the step
  std::vector<model::TermValue>
      values;  ///< of the model's function terms, in their order, for every instant of the step

  StepMotion() = default;
  /// Room for the signals of `model`.
  explicit StepMotion(const Model& model);
};

/// Fills in what a step's samples, and a MotionBound, say of the time between them.
class StepEnclosure {
 public:
  StepEnclosure() = default;
  StepEnclosure(const Model& model, MotionBound bound);

  /// Bounds the motion in `step` (as if its speed were constant where the bound is empty) and evaluates the model's
  /// functions so that they hold at every instant of it. `before`: the step that ends where it begins, enclosed, of
  /// known effort; nullptr for none. Returns false where nothing bounds the motion: the step is too long for the
  /// model's friction (|M⁻¹F| h/2 >= 1), there is no limit, and its effort is not held. Does not allocate.
  ///
  /// A joint whose mean speed is w moves on through the whole step if |w| > a h/2, where a bounds its acceleration
  /// *while it moves as w does*: its friction is then known, that of other joints may be anything. Where efforts are
  /// held and coordinates are coupled by signs of joints' speeds only, the motion is a gradient flow: of one coordinate
  /// (or of all, where no sign changes) speeds go one way, less and less fast, and lie between those at both ends. On
  /// two wheels whose signs at both ends are the same none changes if the box of the coordinates' ranges has none that
  /// does: docs/methods/guarantee.md has the proof.
  bool enclose(const Model& model, StepMotion& step, const StepMotion* before) const;

  /// Per coordinate: by how much an acceleration can change within `step`, where the efforts change by at most
  /// `effort_change` (per output) in it.
  [[nodiscard]] double change(std::size_t coordinate, const Model& model, const StepMotion& step,
                              const Eigen::VectorXd& effort_change) const;

 private:
  void evaluate(const Model& model, StepMotion& step) const;
  void force(const Model& model, const StepMotion& step) const;
  bool solve(const Model& model, const StepMotion& step) const;
  bool by_dynamics(const Model& model, StepMotion& step) const;
  bool find_moving(const Model& model, StepMotion& step) const;
  void follow_flow(StepMotion& step, const StepMotion* before) const;
  [[nodiscard]] double joint_reach(std::size_t joint, const StepMotion& step, const Eigen::VectorXd& departure) const;
  [[nodiscard]] bool moves(std::size_t joint, const StepMotion& step, const Eigen::VectorXd& departure) const;
  [[nodiscard]] bool all_move(const StepMotion& step, const Eigen::VectorXd& departure) const;

  MotionBound bound_;
  FlowKind flow_ = FlowKind::none;
  bool signs_ = false;    // functions look at signs of joints' speeds
  bool apart_ = false;    // friction of a coordinate acts on no other
  Eigen::MatrixXd rate_;  // coordinates × coordinates: mobility times the largest viscous friction
  // joints × (coordinates + 1): |joint acceleration| from |coordinate acceleration|; the joint's own limit
  Eigen::MatrixXd joint_from_;
  mutable Eigen::VectorXd force_, low_, next_, speed_, speed_error_, joint_speed_, joint_error_;
};

}  // namespace wheelwright::filter
