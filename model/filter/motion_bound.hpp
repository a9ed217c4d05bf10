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
  Eigen::VectorXd limit;     ///< per coordinate: |q̈| <= limit; empty: none
  Eigen::MatrixXd mobility;  ///< coordinates × outputs: sup |M(θ)⁻¹| over the set, entry by entry; empty: not known
  Eigen::VectorXd largest;   ///< p: sup |θ_j| over the set
  Eigen::VectorXd effort;    ///< per output: bound on the error of the unfiltered effort

  /// True if nothing at all is known: then rows take the motion between samples as interpolated without error.
  [[nodiscard]] bool empty() const { return limit.size() == 0 && mobility.size() == 0; }
};

/// `mobility` and `largest` for all θ inside the box `sides` (p), rounded outward. Both stay empty where M may be
/// singular in the box, or couples more than two coordinates. Throws InvalidArgument unless there is one side for each
/// parameter.
[[nodiscard]] MotionBound motion_bound(const Model& model, std::span<const Interval> sides);

/// One step between two samples, as far as its samples tell.
struct StepMotion {
  double length = 0.0;           ///< s
  bool known = true;             ///< false: nothing is known of the effort in it, the rest is not to be looked at
  Eigen::VectorXd speed;         ///< per coordinate, mean over the step
  Eigen::VectorXd speed_error;   ///< bound on its error, what the samples are wrong by
  Eigen::VectorXd joint_speed;   ///< per joint
  Eigen::VectorXd joint_error;   ///< per joint
  Eigen::VectorXd effort;        ///< per output: largest |u| in the step, errors included
  double heading = 0.0;          ///< rad, in its middle
  double heading_error = 0.0;    ///< rad
  Eigen::VectorXd acceleration;  ///< per coordinate: |q̈| is at most this in the step; what enclose() finds
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

  /// Bounds the accelerations of `step` (zero where the bound is empty) and evaluates the model's functions so that
  /// they hold at every instant of it. Returns false where no bound on an acceleration can be given: the step is too
  /// long for the model's friction (|M⁻¹F| h/2 >= 1) and there is no limit. Does not allocate.
  bool enclose(const Model& model, StepMotion& step) const;

  /// Per coordinate: by how much an acceleration can change within `step`, where the efforts change by at most
  /// `effort_change` (per output) in it.
  [[nodiscard]] double change(std::size_t coordinate, const Model& model, const StepMotion& step,
                              const Eigen::VectorXd& effort_change) const;

 private:
  void evaluate(const Model& model, StepMotion& step) const;
  void force(const Model& model, const StepMotion& step) const;

  MotionBound bound_;
  Eigen::MatrixXd rate_;        // coordinates × coordinates: mobility times the largest viscous friction
  Eigen::MatrixXd joint_from_;  // joints × coordinates: |joint acceleration| from |coordinate acceleration|
  mutable Eigen::VectorXd force_, next_, speed_error_, joint_error_;
};

}  // namespace wheelwright::filter
