// SPDX-License-Identifier: Apache-2.0
#include "commission/design/plan.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "bounds/interval_hull.hpp"
#include "commission/design/subject.hpp"
#include "core/check.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::design {

EffortModel::EffortModel(const DesignSubject& subject)
    : subject_(&subject),
      input_inverse_(core::pseudo_inverse(subject.model.input)),
      joint_of_coordinate_(core::pseudo_inverse(subject.model.motion)),
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
  model::MotionState state;
  state.speed = view(v, v.size());
  state.speed_error = view(none, v.size());
  state.joint_speed = view(joint, joint.size());
  state.joint_error = view(none, joint.size());
  state.heading = heading;
  return input_inverse_ * model::regressor(subject_->model, state, view(a, a.size()));
}

Eigen::VectorXd EffortModel::largest(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const {
  const Eigen::MatrixXd rows = per_parameter(v, a, heading);
  return (rows * centre_).cwiseAbs() + rows.cwiseAbs() * half_;
}

Eigen::VectorXd EffortModel::believed(const Eigen::VectorXd& v, const Eigen::VectorXd& a, double heading) const {
  return per_parameter(v, a, heading) * subject_->theta;
}

MotionLimits limits_of(const Robot& robot) {
  MotionLimits limits;
  const auto find = [&robot](const char* name) -> std::optional<double> {
    const auto found = robot.limits.find(name);
    return found == robot.limits.end() ? std::nullopt : std::optional(found->second);
  };
  limits.joint_speed = find("speed").value_or(0.0);
  limits.joint_acceleration = find("acceleration");
  limits.effort = find("effort");
  return limits;
}

void validate(const MotionLimits& limits) {
  check::positive(limits.duration, "limits.duration");
  check::positive(limits.joint_speed, "limits.joint_speed");
  check::that(limits.joint_acceleration || limits.effort, "limits.joint_acceleration",
              "a limit on the acceleration or on the effort");
  if (limits.joint_acceleration) {
    check::positive(*limits.joint_acceleration, "limits.joint_acceleration");
  }
  if (limits.effort) {
    check::positive(*limits.effort, "limits.effort");
  }
  if (limits.radius) {
    check::positive(*limits.radius, "limits.radius");
  }
  if (limits.box) {
    for (const Interval& side : *limits.box) {
      check::that(side.lower < 0.0 && side.upper > 0.0 && side.upper - side.lower < 1e9, "limits.box",
                  "finite sides with the start, [0, 0], inside");
    }
  }
}

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
  const Eigen::MatrixXd inverse = core::pseudo_inverse(subject.model.motion);
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

Eigen::MatrixXd joint_speeds(const Plan& plan, const Model& model) {
  return core::pseudo_inverse(model.motion) * plan.speed;
}

LogTable command_table(const Plan& plan, const Model& model) {
  const bool wheels = model.on_two_wheels && model.joints.size() == 2;
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

LogTable velocity_table(const LogTable& commands, const Robot& robot) {
  const std::vector<double>& right = commands.column("command_r");
  const std::vector<double>& left = commands.column("command_l");
  LogTable table;
  table.t = commands.t;
  table.segment_starts = commands.segment_starts;
  table.names = {"linear_x", "angular_z"};
  table.columns.resize(2);
  for (std::size_t k = 0; k < right.size(); ++k) {
    table.columns[0].push_back(0.5 * robot.wheel_radius * (right[k] + left[k]));
    table.columns[1].push_back(robot.wheel_radius * (right[k] - left[k]) / robot.track_width);
  }
  return table;
}

Box promised_bounds(const RegressionBlock& rows, const DesignSubject& subject) {
  core::RegressionTable table(rows);
  return bounds::interval_hull(table, subject.prior).hull;
}

Eigen::VectorXd relative_widths(const Box& bounds, const DesignSubject& subject) {
  Eigen::VectorXd widths(subject.theta.size());
  for (Eigen::Index j = 0; j < widths.size(); ++j) {
    const Interval& side = bounds.sides[static_cast<std::size_t>(j)];
    const Interval& prior = subject.prior.sides[static_cast<std::size_t>(j)];
    const double scale = subject.theta[j] != 0.0 ? std::abs(subject.theta[j]) : prior.upper - prior.lower;
    widths[j] = scale > 0.0 ? (side.upper - side.lower) / scale : 0.0;
  }
  return widths;
}

double combined(const Eigen::VectorXd& widths, WidthCriterion criterion) {
  switch (criterion) {
    case WidthCriterion::geometric_mean: return std::exp(widths.array().max(1e-300).log().mean());
    case WidthCriterion::mean: return widths.mean();
    case WidthCriterion::largest: break;
  }
  return widths.maxCoeff();
}

PlanObjective of_rows(RowObjective objective, const DesignSubject& subject) {
  return
      [objective = std::move(objective), &subject](const Plan& plan) { return objective(planned_rows(plan, subject)); };
}

RowObjective narrow_bounds(const DesignSubject& subject, WidthCriterion criterion) {
  return [&subject, criterion](const RegressionBlock& rows) {
    return combined(relative_widths(promised_bounds(rows, subject), subject), criterion);
  };
}

}  // namespace wheelwright::design
