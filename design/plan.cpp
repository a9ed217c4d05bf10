// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/plan.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/design/effort.hpp>

namespace wheelwright {
namespace {

// θ of the next sample's heading and the chord driven, from the mean twist of a step.
Eigen::Vector3d arc(const Eigen::Vector3d& pose, double way, double turn) {
  const double half = 0.5 * turn;
  const double chord = way * (std::abs(half) < 1e-4 ? 1.0 - half * half / 6.0 : std::sin(half) / half);
  return {pose[0] + chord * std::cos(pose[2] + half), pose[1] + chord * std::sin(pose[2] + half), pose[2] + turn};
}

}  // namespace

double LimitUse::largest() const { return std::max({speed, acceleration, effort, space}); }

void integrate_pose(Plan& plan, const Model& model) {
  plan.pose.resize(3, plan.samples());
  Eigen::Vector3d pose = Eigen::Vector3d::Zero();
  for (Eigen::Index k = 0; k < plan.samples(); ++k) {
    if (k > 0) {
      const Eigen::VectorXd way = 0.5 * plan.step * (plan.speed.col(k - 1) + plan.speed.col(k));
      pose = arc(pose, way[0], model.heading_coordinate >= 0 ? way[model.heading_coordinate] : 0.0);
    }
    plan.pose.col(k) = pose;
  }
}

double space_use(const Plan& plan, const MotionLimits& limits) {
  double use = 0.0;
  if (limits.radius) {
    use = std::sqrt(plan.pose.topRows<2>().colwise().squaredNorm().maxCoeff()) / *limits.radius;
  }
  if (limits.box) {
    for (Eigen::Index i = 0; i < 2; ++i) {
      const Interval& side = (*limits.box)[static_cast<std::size_t>(i)];
      use = std::max({use, plan.pose.row(i).maxCoeff() / side.upper, plan.pose.row(i).minCoeff() / side.lower});
    }
  }
  return use;
}

LimitUse limit_use(const Plan& plan, const DesignSubject& subject, const MotionLimits& limits) {
  LimitUse use;
  const Eigen::MatrixXd inverse = pseudo_inverse(subject.model.motion);
  use.speed = (inverse * plan.speed).cwiseAbs().maxCoeff() / limits.joint_speed;
  if (limits.joint_acceleration) {
    use.acceleration = (inverse * plan.acceleration).cwiseAbs().maxCoeff() / *limits.joint_acceleration;
  }
  use.space = space_use(plan, limits);
  if (limits.effort) {
    EffortModel effort(subject);
    for (Eigen::Index k = 0; k < plan.samples(); ++k) {
      use.effort =
          std::max(use.effort, effort.largest(plan.speed.col(k), plan.acceleration.col(k), plan.pose(2, k)).maxCoeff());
    }
    use.effort /= *limits.effort;
  }
  return use;
}

Eigen::MatrixXd joint_speeds(const Plan& plan, const Model& model) { return pseudo_inverse(model.motion) * plan.speed; }

LogTable command_table(const Plan& plan, const Model& model) {
  const bool wheels = model.name == "differential_drive" && model.joints.size() == 2;
  check::that(wheels || model.joints.size() == 1, "command_table: the model '" + model.name + "'",
              "a differential drive or a single axis");
  const Eigen::MatrixXd joints = joint_speeds(plan, model);
  LogTable table;
  table.segment_starts = {0};
  const auto add = [&table](const char* name, const auto& row) {
    table.names.emplace_back(name);
    table.columns.emplace_back();
    for (Eigen::Index k = 0; k < row.size(); ++k) {
      table.columns.back().push_back(row[k]);
    }
  };
  for (Eigen::Index k = 0; k < plan.samples(); ++k) {
    table.t.push_back(plan.t(k));
  }
  if (!wheels) {
    add("command", joints.row(0));
    add("position", plan.pose.row(0));
    return table;
  }
  add("command_r", joints.row(0));
  add("command_l", joints.row(1));
  add("v1", plan.speed.row(0));
  add("v2", plan.speed.row(1));
  add("x", plan.pose.row(0));
  add("y", plan.pose.row(1));
  add("theta", plan.pose.row(2));
  return table;
}

}  // namespace wheelwright
