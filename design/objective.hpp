// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a manoeuvre is good for, as a function of the rows that its log would give.
///
/// **Guaranteed bounds, before the drive.** A log driven along a plan gives rows Y_k with y_k = Y_k θ° + e_k, |e_k| <= ē_k,
/// and commissioning publishes the interval hull of P(e) = { θ : |y_k − Y_k θ| <= ē_k }. With d = θ − θ°,
///
///     P(e) − θ° = { d : |Y_k d − e_k| <= ē_k },
///
/// and two members of one P(e) differ by a d with |Y_k d| <= 2 ē_k, whatever e is. So parameter j has a width of at most
///
///     max { 2 d_j : |Y_k d| <= ē_k for all k },
///
/// which is just the width of P(0). The *worst case over the noise* is therefore the log without noise: an upper bound on
/// the width that will be found, attained, and a function of Y alone. It is what is promised and minimised here. (The
/// expected width would need a distribution of the noise, which bounds do not give, and is no promise.)
///
/// Errors in variables keep the form: ē_k = n̄_k + Δ_k|θ| for the regressor's error bound Δ, by which P(0) is the feasible
/// set of the planned rows with their dY; the promise then holds up to terms Δ_k|θ − θ°| of second order. Planned and
/// driven rows differ as far as the robot does not follow its commands.
#pragma once

#include <functional>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/core/regression.hpp>
#include <wheelwright/design/plan.hpp>
#include <wheelwright/design/subject.hpp>

namespace wheelwright {

/// A number to be minimised, of the planned rows (planned_rows()). It must be a pure function: searches call it from
/// several threads. Other aims (certain detection of a fault, telling two effects apart) are other functions of the rows.
using RowObjective = std::function<double(const RegressionBlock&)>;

/// The same of the plan itself, for aims that need more than its rows.
using PlanObjective = std::function<double(const Plan&)>;

/// An objective of the planned rows as one of the plan. Keeps a reference to `subject`.
[[nodiscard]] PlanObjective of_rows(RowObjective objective, const DesignSubject& subject);

/// How widths of several parameters become one number. Relative width: (upper − lower)/|θ°|.
enum class WidthCriterion {
  geometric_mean,  ///< of the relative widths; which plan is best does not depend on what the widths are relative to
  mean,            ///< of the relative widths
  largest,         ///< relative width
};

/// The bounds that a log along the plan is promised to give at least: the interval hull of P(0), certified, in the prior
/// box of the subject.
[[nodiscard]] Box promised_bounds(const RegressionBlock& rows, const DesignSubject& subject);

/// Relative widths (upper − lower)/|θ°| of each side of `bounds`; where θ° is 0, relative to the prior's width.
[[nodiscard]] Eigen::VectorXd relative_widths(const Box& bounds, const DesignSubject& subject);

/// The criterion of some widths.
[[nodiscard]] double combined(const Eigen::VectorXd& widths, WidthCriterion criterion);

/// The objective "narrow bounds": combined(relative_widths(promised_bounds(rows))). Keeps a reference to `subject`.
[[nodiscard]] RowObjective narrow_bounds(const DesignSubject& subject, WidthCriterion criterion);

}  // namespace wheelwright
