// SPDX-License-Identifier: Apache-2.0
/// \file
/// A manoeuvre's plan: limits of the robot, objective, effort, result.
///
/// The value of a manoeuvre is a function of the rows that its log would give.
///
/// **Guaranteed bounds, before the drive.** A log driven along a plan gives rows Y_k with y_k = Y_k θ° + e_k, |e_k| <=
/// ē_k, and commissioning publishes the interval hull of P(e) = { θ : |y_k − Y_k θ| <= ē_k }. With d = θ − θ°,
///
///     P(e) − θ° = { d : |Y_k d − e_k| <= ē_k },
///
/// and two members of one P(e) differ by a d with |Y_k d| <= 2 ē_k, whatever e is. So parameter j has a width of at
/// most
///
///     max { 2 d_j : |Y_k d| <= ē_k for all k },
///
/// which is just the width of P(0). The *worst case over the noise* is therefore the log without noise: an upper bound
/// on the width that will be found, attained, and a function of Y alone. It is what is promised and minimised here.
/// (The expected width would need a distribution of the noise, which bounds do not give, and is no promise.)
///
/// Errors in variables keep the form: ē_k = n̄_k + Δ_k|θ| for the regressor's error bound Δ, by which P(0) is the
/// feasible set of the planned rows with their dY; the promise then holds up to terms Δ_k|θ − θ°| of second order.
/// Planned and driven rows differ as far as the robot does not follow its commands.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"
#include "core/regression.hpp"
#include "model/robot.hpp"

namespace wheelwright::design {

struct DesignSubject;

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

/// Limits of a manoeuvre. What is not given does not limit; a speed is needed, and an acceleration or an effort, since
/// motion has no scale without.
struct MotionLimits {
  double duration = 20.0;                      ///< s, rests at both ends included
  double joint_speed = 0.0;                    ///< of each wheel (or of the axis), > 0, rad/s (or m/s)
  std::optional<double> joint_acceleration;    ///< of each wheel, > 0, rad/s² (or m/s²)
  std::optional<double> effort;                ///< of each wheel, > 0, unit of the effort: N·m, A or V
  std::optional<double> radius;                ///< largest distance from the start, m (a single axis: travel, its unit)
  std::optional<std::array<Interval, 2>> box;  ///< x (ahead of the start) and y (to its left), m; holds [0, 0]
};

/// Limits as the robot file has them: `limits: {speed, acceleration, effort}`, those of a wheel, rad/s, rad/s² and the
/// unit of the effort. The rest keeps its default.
[[nodiscard]] MotionLimits limits_of(const Robot& robot);

/// Throws InvalidArgument, naming the field, unless all limits are > 0, the box holds the start in its interior, and
/// there is a limit on speed and one on acceleration or effort.
void validate(const MotionLimits& limits);

/// A motion at times 0, step, 2·step, …; it starts at the pose [0, 0, 0].
struct Plan {
  double step = 0.0;             ///< s
  Eigen::MatrixXd speed;         ///< coordinates × samples, m/s and rad/s
  Eigen::MatrixXd acceleration;  ///< its derivative, m/s² and rad/s²
  Eigen::Matrix3Xd pose;         ///< [x, y, θ], m, m, rad; a single axis: [position, 0, 0]

  /// Number of samples.
  [[nodiscard]] Eigen::Index samples() const { return speed.cols(); }
  /// Time of sample `k`, s.
  [[nodiscard]] double t(Eigen::Index k) const { return step * static_cast<double>(k); }
  /// Largest distance from the start, m.
  [[nodiscard]] double reach() const { return pose.topRows<2>().colwise().norm().maxCoeff(); }
};

/// Largest use of each limit as a share of it: <= 1 within the limits; 0 where there is no limit.
struct LimitUse {
  double speed = 0.0;
  double acceleration = 0.0;
  double effort = 0.0;  ///< worst case over DesignSubject::effort_box
  double space = 0.0;

  /// The largest share.
  [[nodiscard]] double largest() const;
};

/// Fills `plan.pose` from `plan.speed`: an arc of the mean twist from sample to sample, as wheels roll (error O(step³)
/// a step).
void integrate_pose(Plan& plan, const Model& model);

/// Share of `limits` that `plan` uses at its samples.
[[nodiscard]] LimitUse limit_use(const Plan& plan, const DesignSubject& subject, const MotionLimits& limits);

/// Share of the space that `plan` uses, as LimitUse::space.
[[nodiscard]] double space_use(const Plan& plan, const MotionLimits& limits);

/// Speeds of the joints, joints × samples, rad/s (or m/s): what is commanded.
[[nodiscard]] Eigen::MatrixXd joint_speeds(const Plan& plan, const Model& model);

/// The table to be driven. Differential drive: t, command_r, command_l (rad/s), v1 (m/s), v2 (rad/s), x, y (m), theta
/// (rad). One joint: t, command (rad/s or m/s), position (rad or m). Throws InvalidArgument for other models.
[[nodiscard]] LogTable command_table(const Plan& plan, const Model& model);

/// Commands of a differential drive (command_table()) as its speed and yaw rate: t, linear_x (m/s), angular_z (rad/s),
/// r(ω_r + ω_l)/2 and r(ω_r − ω_l)/D with the robot file's geometry. Throws InvalidArgument without the columns
/// command_r and command_l.
[[nodiscard]] LogTable velocity_table(const LogTable& commands, const Robot& robot);

/// A number to be minimised, of the planned rows (planned_rows()). It must be a pure function: searches call it from
/// several threads. Other aims (certain detection of a fault, telling two effects apart) are other functions of the
/// rows.
using RowObjective = std::function<double(const RegressionBlock&)>;

/// The same of the plan itself, for aims that need more than its rows.
using PlanObjective = std::function<double(const Plan&)>;

/// An objective of the planned rows as one of the plan. Keeps a reference to `subject`.
[[nodiscard]] PlanObjective of_rows(RowObjective objective, const DesignSubject& subject);

/// Criterion that makes one number of the widths of several parameters. Relative width: (upper − lower)/|θ°|.
enum class WidthCriterion {
  geometric_mean,  ///< of the relative widths; which plan is best does not depend on what the widths are relative to
  mean,            ///< of the relative widths
  largest,         ///< relative width
};

/// The bounds that a log along the plan is promised to give at least: the interval hull of P(0), certified, in the
/// prior box of the subject.
[[nodiscard]] Box promised_bounds(const RegressionBlock& rows, const DesignSubject& subject);

/// Relative widths (upper − lower)/|θ°| of each side of `bounds`; where θ° is 0, relative to the prior's width.
[[nodiscard]] Eigen::VectorXd relative_widths(const Box& bounds, const DesignSubject& subject);

/// The criterion of some widths.
[[nodiscard]] double combined(const Eigen::VectorXd& widths, WidthCriterion criterion);

/// The objective "narrow bounds": combined(relative_widths(promised_bounds(rows))). Keeps a reference to `subject`.
[[nodiscard]] RowObjective narrow_bounds(const DesignSubject& subject, WidthCriterion criterion);

}  // namespace wheelwright::design
