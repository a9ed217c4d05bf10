// SPDX-License-Identifier: Apache-2.0
/// \file
/// The effort that a motion asks for, in the worst case over a box of parameters.
#pragma once

#include <Eigen/Core>

#include <wheelwright/design/subject.hpp>

namespace wheelwright {

/// Effort of each joint for one instant of a motion: |τ| <= max over θ in the subject's effort box of |B⁺ Y(v, v̇) θ|,
/// with B the model's input matrix.
class EffortModel {
 public:
  /// Keeps a reference to `subject`.
  explicit EffortModel(const DesignSubject& subject);

  /// Largest |effort| of each joint at speeds `v` (m/s, rad/s), accelerations `a` and heading (rad).
  [[nodiscard]] Eigen::VectorXd largest(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const;

  /// Effort of each joint there for θ as believed.
  [[nodiscard]] Eigen::VectorXd believed(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const;

 private:
  [[nodiscard]] Eigen::MatrixXd per_parameter(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const;

  const DesignSubject* subject_;
  Eigen::MatrixXd input_inverse_, joint_of_coordinate_;
  Eigen::VectorXd centre_, half_;
};

}  // namespace wheelwright
