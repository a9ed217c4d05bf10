// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/planned_drive.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

constexpr double kShortestRest = 0.1;  // s
constexpr double kStill = 1e-9;        // of the largest speed

Mask rests(const Eigen::VectorXd& speed, double step) {
  Mask still = speed.array().abs() <= kStill * speed.cwiseAbs().maxCoeff();
  const auto fewest = static_cast<Eigen::Index>(std::ceil(kShortestRest / step * (1.0 - 1e-9)));
  for (Eigen::Index k = 0; k < still.size();) {
    Eigen::Index end = k;
    while (end < still.size() && still[end]) {
      ++end;
    }
    if (end - k < fewest) {
      still.segment(k, end - k).setConstant(false);
    }
    k = std::max(end, k + 1);
  }
  return still;
}

}  // namespace

Drive planned_drive(const Plan& plan, const DesignSubject& subject) {
  const Model& model = subject.model;
  const Robot& robot = subject.robot;
  check::that(plan.samples() >= 3, "plan", "at least three samples");
  check::that(plan.speed.rows() == model.motion.rows(), "plan", "a speed for each coordinate of the model");
  Drive drive;
  drive.model = model;
  drive.step = check::positive(plan.step, "plan.step");
  drive.window = 1;
  if (robot.wheel_radius > 0.0 && robot.track_width > 0.0) {
    drive.wheel_radius = robot.wheel_radius;
    drive.track_width = robot.track_width;
    drive.lever_arm = robot.lever_arm_is_track ? robot.track_width : 0.5 * robot.track_width;
  }
  drive.t = Eigen::VectorXd::LinSpaced(plan.samples(), 0.0, plan.t(plan.samples() - 1));
  drive.segment_starts = {0};
  const Eigen::MatrixXd inverse = pseudo_inverse(model.motion);
  const Eigen::MatrixXd speed = inverse * plan.speed, acceleration = inverse * plan.acceleration;
  for (Eigen::Index j = 0; j < speed.rows(); ++j) {
    JointSignals joint;
    joint.speed = joint.smooth_speed = speed.row(j).transpose();
    joint.smooth_acceleration = acceleration.row(j).transpose();
    joint.angle = Eigen::VectorXd::Zero(plan.samples());
    for (Eigen::Index k = 1; k < plan.samples(); ++k) {
      joint.angle[k] = joint.angle[k - 1] + 0.5 * plan.step * (joint.speed[k - 1] + joint.speed[k]);
    }
    joint.resting = rests(joint.speed, plan.step);
    drive.joints.push_back(std::move(joint));
  }
  for (Eigen::Index c = 0; c < plan.speed.rows(); ++c) {
    const Eigen::VectorXd v = plan.speed.row(c).transpose();
    drive.coordinates.push_back({v, v, plan.acceleration.row(c).transpose()});
  }
  if (model.heading_coordinate >= 0) {
    drive.x = plan.pose.row(0).transpose();
    drive.y = plan.pose.row(1).transpose();
    drive.heading = plan.pose.row(2).transpose();
  }
  predict_efforts(drive, subject.theta);
  for (JointSignals& joint : drive.joints) {
    joint.effort = joint.smooth_effort = joint.predicted_effort;
  }
  return drive;
}

}  // namespace wheelwright
