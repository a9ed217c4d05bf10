// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/effort.hpp>

#include <vector>

#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {

EffortModel::EffortModel(const DesignSubject& subject)
    : subject_(&subject),
      input_inverse_(pseudo_inverse(subject.model.input)),
      joint_of_coordinate_(pseudo_inverse(subject.model.motion)),
      centre_(subject.theta.size()),
      half_(subject.theta.size()) {
  for (Eigen::Index j = 0; j < centre_.size(); ++j) {
    const Interval& side = subject.effort_box.sides[static_cast<std::size_t>(j)];
    centre_[j] = 0.5 * (side.lower + side.upper);
    half_[j] = 0.5 * (side.upper - side.lower);
  }
}

Eigen::MatrixXd EffortModel::per_parameter(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const {
  const Eigen::VectorXd joint = joint_of_coordinate_ * v;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(std::max(v.size(), joint.size()));
  const auto view = [](const Eigen::VectorXd& x, Eigen::Index n) {
    return std::span<const double>(x.data(), static_cast<std::size_t>(n));
  };
  MotionState state;
  state.speed = view(v, v.size());
  state.speed_error = view(none, v.size());
  state.joint_speed = view(joint, joint.size());
  state.joint_error = view(none, joint.size());
  state.heading = heading;
  return input_inverse_ * regressor(subject_->model, state, view(a, a.size()));
}

Eigen::VectorXd EffortModel::largest(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const {
  const Eigen::MatrixXd rows = per_parameter(v, a, heading);
  return (rows * centre_).cwiseAbs() + rows.cwiseAbs() * half_;
}

Eigen::VectorXd EffortModel::believed(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const {
  return per_parameter(v, a, heading) * subject_->theta;
}

}  // namespace wheelwright
