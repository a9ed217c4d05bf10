// SPDX-License-Identifier: Apache-2.0
#include "model/filter/motion_bound.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "model/filter/in_order.hpp"

namespace wheelwright::filter {

using model::TermShape;

namespace {

constexpr double kUp = 1.0 + 64.0 * core::kEpsilon;  // above the rounding of a handful of sums
constexpr int kRounds = 12;                          // of functions that grow with the speed

using Intervals = std::vector<std::vector<Interval>>;

bool holds_zero(const Interval& x) { return x.lower <= 0.0 && x.upper >= 0.0; }

// 1/x for an interval without zero.
Interval inverse(const Interval& x) { return {core::round_down(1.0 / x.upper), core::round_up(1.0 / x.lower)}; }

Intervals inertia(const Model& model, std::span<const Interval> sides) {
  Intervals m(model.n(), std::vector<Interval>(model.coordinates.size(), core::point(0.0)));
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::acceleration) {
      Interval& entry = m[term.output][term.coordinate];
      entry = entry + core::point(term.scale) * sides[term.parameter];
    }
  }
  return m;
}

bool is_zero(const Interval& x) { return std::abs(x.lower) <= core::kTiny && std::abs(x.upper) <= core::kTiny; }

// |M⁻¹| where every coordinate has an output of its own; nothing where it has not.
Eigen::MatrixXd uncoupled(const Intervals& m) {
  const std::size_t n = m.size();
  Eigen::MatrixXd mobility = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n));
  std::vector<bool> taken(n, false);
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t own = n;
    for (std::size_t c = 0; c < n; ++c) {
      if (!is_zero(m[i][c])) {
        if (own != n) {
          return {};
        }
        own = c;
      }
    }
    if (own == n || taken[own] || holds_zero(m[i][own])) {
      return {};
    }
    taken[own] = true;
    mobility(static_cast<Eigen::Index>(own), static_cast<Eigen::Index>(i)) = core::magnitude(inverse(m[i][own]));
  }
  return mobility;
}

// |M⁻¹| of two coupled coordinates, by the determinant.
Eigen::MatrixXd coupled(const Intervals& m) {
  if (m.size() != 2) {
    return {};
  }
  const Interval determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
  if (holds_zero(determinant)) {
    return {};
  }
  const Interval d = inverse(determinant);
  return (Eigen::Matrix2d() << core::magnitude(m[1][1] * d), core::magnitude(m[0][1] * d), core::magnitude(m[1][0] * d),
          core::magnitude(m[0][0] * d))
      .finished();
}

}  // namespace

MotionBound motion_bound(const Model& model, std::span<const Interval> sides) {
  check::that(sides.size() == model.p(), "motion_bound sides", "one interval for each parameter");
  MotionBound bound;
  if (model.n() != model.coordinates.size()) {
    return bound;
  }
  const Intervals m = inertia(model, sides);
  bound.mobility = uncoupled(m);
  if (bound.mobility.size() == 0) {
    bound.mobility = coupled(m);
  }
  if (bound.mobility.size() == 0 || !bound.mobility.allFinite()) {
    return {};
  }
  bound.largest.resize(static_cast<Eigen::Index>(model.p()));
  for (std::size_t j = 0; j < model.p(); ++j) {
    bound.largest[static_cast<Eigen::Index>(j)] = core::magnitude(sides[j]);
  }
  return bound;
}

FlowKind flow_kind(const Model& model) {
  const std::size_t n = model.coordinates.size();
  const bool wheels = n == 2 && model.joints.size() == 2 && model.motion(0, 0) > 0.0 && model.motion(1, 0) > 0.0 &&
                      model.motion(0, 1) == model.motion(0, 0) && model.motion(1, 1) == -model.motion(1, 0);
  FlowKind kind = model.n() == n ? FlowKind::separate : FlowKind::none;
  for (const Term& term : model.terms) {
    const TermShape shape = term.function.shape();
    const bool function = term.kind == Term::Kind::function;
    if (function && shape == TermShape::constant) {
      continue;
    }
    const bool resists = term.scale > 0.0 && model.parameters[term.parameter].never_negative;
    const bool own = !function ? term.output == term.coordinate : shape == TermShape::sign_of_speed && n == 1;
    const bool of_wheels = function && wheels &&
                           ((shape == TermShape::sum_of_signs && term.output == 0) ||
                            (shape == TermShape::difference_of_signs && term.output == 1));
    if (!resists || !(own || of_wheels)) {
      return FlowKind::none;
    }
    if (of_wheels && kind == FlowKind::separate) {
      kind = FlowKind::by_signs;
    }
  }
  return kind;
}

StepMotion::StepMotion(const Model& model) {
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  speed = speed_error = gain = acceleration = departure = bow = Eigen::VectorXd::Zero(coordinates);
  joint_speed = joint_error = Eigen::VectorXd::Zero(joints);
  effort = effort_error = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.n()));
  moving.assign(model.joints.size(), 0);
  values.resize(static_cast<std::size_t>(std::count_if(
      model.terms.begin(), model.terms.end(), [](const Term& term) { return term.kind == Term::Kind::function; })));
}

StepEnclosure::StepEnclosure(const Model& model, MotionBound bound)
    : bound_(std::move(bound)), flow_(flow_kind(model)) {
  signs_ = std::ranges::any_of(model.terms, [](const Term& term) {
    const TermShape shape = term.function.shape();
    return term.kind == Term::Kind::function && shape != TermShape::constant && shape != TermShape::along_x &&
           shape != TermShape::along_y;
  });
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  const auto n = static_cast<Eigen::Index>(model.n());
  force_ = low_ = Eigen::VectorXd::Zero(n);
  next_ = speed_ = speed_error_ = Eigen::VectorXd::Zero(coordinates);
  joint_speed_ = joint_error_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  const Eigen::MatrixXd inverse = core::pseudo_inverse(model.motion);
  const bool determined =
      (inverse * model.motion - Eigen::MatrixXd::Identity(inverse.rows(), inverse.rows())).cwiseAbs().maxCoeff() < 1e-9;
  joint_from_ = Eigen::MatrixXd::Constant(inverse.rows(), coordinates + 1, core::kInfinity);
  if (determined) {
    joint_from_.leftCols(coordinates) = kUp * inverse.cwiseAbs();
  }
  if (bound_.limit.size() > 0) {
    joint_from_.col(coordinates)
        .setConstant(kUp * bound_.limit.cwiseQuotient(model.motion.cwiseAbs().rowwise().sum()).minCoeff());
  }
  if (bound_.mobility.size() > 0) {
    Eigen::MatrixXd friction = Eigen::MatrixXd::Zero(n, coordinates);
    for (const Term& term : model.terms) {
      if (term.kind == Term::Kind::speed) {
        friction(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.coordinate)) +=
            std::abs(term.scale) * bound_.largest[static_cast<Eigen::Index>(term.parameter)];
      }
    }
    rate_.resize(coordinates, coordinates);
    Eigen::VectorXd column(coordinates);
    for (Eigen::Index d = 0; d < coordinates; ++d) {
      multiply(bound_.mobility, friction.col(d), column);
      rate_.col(d) = kUp * column;
    }
    apart_ = rate_.isDiagonal(0.0);
  }
}

// By how much the speed of `joint` may differ from its mean in the samples, where coordinates stay within `departure`.
double StepEnclosure::joint_reach(std::size_t joint, const StepMotion& step, const Eigen::VectorXd& departure) const {
  const auto j = static_cast<Eigen::Index>(joint);
  double faster = 0.0;
  for (Eigen::Index c = 0; c < departure.size(); ++c) {
    faster += departure[c] > 0.0 ? joint_from_(j, c) * departure[c] : 0.0;
  }
  return kUp * (step.joint_error[j] + std::min(faster, 0.5 * step.length * joint_from_(j, departure.size())));
}

bool StepEnclosure::moves(std::size_t joint, const StepMotion& step, const Eigen::VectorXd& departure) const {
  return step.moving[joint] != 0 ||
         std::abs(step.joint_speed[static_cast<Eigen::Index>(joint)]) > joint_reach(joint, step, departure);
}

bool StepEnclosure::all_move(const StepMotion& step, const Eigen::VectorXd& departure) const {
  for (std::size_t j = 0; j < step.moving.size(); ++j) {
    if (!moves(j, step, departure)) {
      return false;
    }
  }
  return true;
}

// The functions of the motion for every instant of the step, with the departures that stand in it.
void StepEnclosure::evaluate(const Model& model, StepMotion& step) const {
  if (step.values.empty()) {
    return;
  }
  const auto coordinates = static_cast<std::size_t>(step.speed.size());
  const auto joints = static_cast<std::size_t>(step.joint_speed.size());
  // What never stands is on its side of 0.
  const auto keep_side = [](double& middle, double& error) {
    if (std::abs(middle) <= error) {
      const double reach = 0.5 * (std::abs(middle) + error);
      middle = std::copysign(reach, middle);
      error = reach * (1.0 - 4.0 * core::kEpsilon);
    }
  };
  double turned = 0.0;
  speed_ = step.speed;
  speed_error_ = step.speed_error;
  if (!bound_.empty()) {
    speed_error_ = kUp * (speed_error_ + step.departure);
  }
  for (std::size_t j = 0; j < joints; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    joint_speed_[i] = step.joint_speed[i];
    joint_error_[i] = bound_.empty() ? step.joint_error[i] : joint_reach(j, step, step.departure);
    if (step.moving[j] != 0) {
      keep_side(joint_speed_[i], joint_error_[i]);
      if (coordinates == 1 && joints == 1) {
        keep_side(speed_[0], speed_error_[0]);
      }
    }
  }
  if (model.heading_coordinate >= 0 && !bound_.empty()) {
    const auto c = static_cast<Eigen::Index>(model.heading_coordinate);
    turned = kUp * 0.5 * step.length * (std::abs(step.speed[c]) + speed_error_[c]);
  }
  const model::MotionState state{{speed_.data(), coordinates},
                                 {speed_error_.data(), coordinates},
                                 {joint_speed_.data(), joints},
                                 {joint_error_.data(), joints},
                                 step.heading,
                                 step.heading_error + turned};
  std::size_t next = 0;
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      const model::TermValue value = term.function(state);
      step.values[next++] = {term.scale * value.value, std::abs(term.scale) * value.error};
    }
  }
}

// |u − F| per output, where the speed is its mean.
void StepEnclosure::force(const Model& model, const StepMotion& step) const {
  force_ = step.effort + step.effort_error;
  low_ = step.effort_error - step.effort;
  std::size_t next = 0;
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::acceleration) {
      continue;
    }
    double value = 0.0, error = 0.0;
    if (term.kind == Term::Kind::speed) {
      const auto c = static_cast<Eigen::Index>(term.coordinate);
      value = term.scale * step.speed[c];
      error = std::abs(term.scale) * step.speed_error[c];
    } else {
      value = step.values[next].value;
      error = step.values[next++].error;
    }
    const auto i = static_cast<Eigen::Index>(term.output);
    const double largest = bound_.largest[static_cast<Eigen::Index>(term.parameter)];
    double below = error - value, above = error + value;  // how far the value goes below 0, and above
    if (!model.parameters[term.parameter].never_negative) {
      below = above = std::max(below, above);
    }
    force_[i] += largest * std::max(below, 0.0);
    low_[i] += largest * std::max(above, 0.0);
  }
  for (Eigen::Index i = 0; i < force_.size(); ++i) {
    force_[i] = std::max(force_[i], low_[i]);
  }
}

// a = N(b(a) + F a h/2), solved for the viscous part, into next_. Where means over the step are known, departures of
// coordinates that go by themselves are at most (1/(1 − e^{−x}) − 1/x) h N b, with x = N F h.
bool StepEnclosure::solve(const Model& model, const StepMotion& step) const {
  const double half = 0.5 * step.length;
  const auto rows = rate_.rows();
  force(model, step);
  multiply(bound_.mobility, force_, next_);
  if (apart_) {
    for (Eigen::Index c = 0; c < rows; ++c) {
      if (step.ends) {
        const double left = 1.0 - half * rate_(c, c);
        if (!(left > 0.0)) return false;
        next_[c] /= left;
      } else {
        next_[c] *= std::min(1.0 + step.length * rate_(c, c) / 6.0, 2.0);
      }
    }
  } else if (rows == 2) {
    const double a = 1.0 - half * rate_(0, 0), d = 1.0 - half * rate_(1, 1);
    const double b = half * rate_(0, 1), c = half * rate_(1, 0), determinant = a * d - b * c;
    if (!(a > 0.0 && d > 0.0 && determinant > 0.0)) return false;
    const double x = (d * next_[0] + b * next_[1]) / determinant, y = (c * next_[0] + a * next_[1]) / determinant;
    next_[0] = x;
    next_[1] = y;
  } else {
    for (Eigen::Index c = 0; c < rows; ++c) {
      const double left = 1.0 - half * rate_.row(c).sum();
      if (!(left > 0.0)) return false;
      next_[c] /= left;
    }
    next_.setConstant(next_.maxCoeff());
  }
  next_ *= kUp;
  return true;
}

// Accelerations and departures by forces and inertia, and by the limit; whether there are any.
bool StepEnclosure::by_dynamics(const Model& model, StepMotion& step) const {
  const double half = 0.5 * step.length;
  const bool limited = bound_.limit.size() > 0;
  Eigen::VectorXd& found = step.acceleration;
  bool settled = false;
  const auto depart = [&] { step.departure = half * found; };
  if (bound_.mobility.size() > 0) {
    found.setZero();
    depart();
    evaluate(model, step);
    if (solve(model, step)) {
      // Widened until functions that grow with the speed agree.
      for (int round = 0; round < kRounds && !settled; ++round) {
        found = (round < 2 ? 1.0 : 1.5) * next_;
        depart();
        evaluate(model, step);
        // Without functions nothing that is solved for depends on `found`.
        settled = (step.values.empty() || solve(model, step)) && (next_.array() <= found.array()).all();
      }
    }
  }
  if (!settled && !limited) {
    found.setConstant(core::kInfinity);
    step.departure = found;
    return false;
  }
  if (limited) {
    if (settled) {
      found = found.cwiseMin(bound_.limit);
    } else {
      found = bound_.limit;
    }
    depart();
    evaluate(model, step);
  }
  return true;
}

// Joints that move on through the step, by the forces on them while they do; whether there are more than by departures.
bool StepEnclosure::find_moving(const Model& model, StepMotion& step) const {
  bool any = false, tried = false;
  for (bool more = true; more;) {
    more = false;
    for (std::size_t j = 0; j < step.moving.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      if (moves(j, step, step.departure) || !(std::abs(step.joint_speed[i]) > step.joint_error[i])) {
        continue;
      }
      tried = true;
      step.moving[j] = 1;
      evaluate(model, step);
      force(model, step);
      multiply(bound_.mobility, force_, next_);
      for (Eigen::Index c = 0; c < next_.size(); ++c) {
        for (Eigen::Index d = 0; d < next_.size(); ++d) {
          next_[c] += rate_(c, d) * step.departure[d];
        }
        next_[c] *= kUp * 0.5 * step.length;
      }
      step.moving[j] = 0;
      if (moves(j, step, next_)) {
        step.moving[j] = 1;
        any = more = true;
      }
    }
  }
  if (tried && !any) {
    evaluate(model, step);
  }
  return any;
}

// What a gradient flow leaves of the departures. Between samples of the speed it goes from one to the other. From mean
// to mean, s⁻ in a step of h⁻ and s in one of h, it departs by d at most at the beginning, where it is no slower to
// change than on average, 2d/h, and |N Δu| more than before, where it went the same way: |s − s⁻| is at least
// d + (2d/h − |N Δu|) h⁻/2. Where signs couple coordinates the last step tells besides how far they can go until a
// first wheel stands: at its end they were no faster to change than 2d⁻/h⁻.
void StepEnclosure::follow_flow(StepMotion& step, const StepMotion* before) const {
  const bool after = !step.ends && before != nullptr && before->steady && bound_.mobility.size() > 0;
  if (flow_ == FlowKind::none || !step.held) {
    return;
  }
  for (Eigen::Index c = 0; c < next_.size(); ++c) {
    next_[c] = core::kInfinity;
    if (step.ends) {
      next_[c] = kUp * (0.5 * std::abs(step.gain[c]) + step.speed_error[c]);
    } else if (after) {
      const double apart = std::abs(step.speed[c] - before->speed[c]) + step.speed_error[c] + before->speed_error[c];
      const double push = bound_.mobility(c, c) * (std::abs(step.effort[c] - before->effort[c]) + step.effort_error[c] +
                                                   before->effort_error[c]);
      next_[c] = kUp * (apart + 0.5 * before->length * push) / (1.0 + before->length / step.length);
      speed_error_[c] = before->departure[c] + step.length * (2.0 * before->departure[c] / before->length + push);
    }
  }
  if (after && flow_ == FlowKind::by_signs) {
    bool go_on = true;
    for (std::size_t j = 0; j < step.moving.size() && go_on; ++j) {
      const auto i = static_cast<Eigen::Index>(j);
      go_on = std::abs(before->joint_speed[i]) > joint_reach(j, *before, speed_error_) &&
              std::abs(step.joint_speed[i]) > step.joint_error[i];
    }
    if (go_on) {
      std::ranges::fill(step.moving, 1);
    }
  }
  const bool moving = !signs_ || all_move(step, step.departure) || (step.ends && all_move(step, next_));
  step.steady = flow_ == FlowKind::separate || moving;
  if (!step.steady) {
    return;
  }
  for (Eigen::Index c = 0; c < next_.size(); ++c) {
    step.departure[c] = std::min(step.departure[c], next_[c]);
    const double curved = moving && rate_.size() > 0 ? std::min(step.length * rate_(c, c) / 12.0, 0.5) : 0.5;
    step.bow[c] = step.ends ? kUp * 2.0 * next_[c] * curved : core::kInfinity;
  }
}

bool StepEnclosure::enclose(const Model& model, StepMotion& step, const StepMotion* before) const {
  step.steady = false;
  std::ranges::fill(step.moving, 0);
  if (bound_.empty()) {
    step.acceleration.setZero();
    step.departure.setZero();
    step.bow.setZero();
    evaluate(model, step);
    return true;
  }
  step.bow.setConstant(core::kInfinity);
  if (by_dynamics(model, step) && bound_.mobility.size() > 0 && signs_ && find_moving(model, step)) {
    by_dynamics(model, step);
  }
  follow_flow(step, before);
  if (step.steady) {
    evaluate(model, step);
  }
  return step.departure.allFinite();
}

double StepEnclosure::change(std::size_t coordinate, const Model& model, const StepMotion& step,
                             const Eigen::VectorXd& effort_change) const {
  const auto c = static_cast<Eigen::Index>(coordinate);
  if (bound_.mobility.size() == 0) {
    return 2.0 * step.acceleration[c];
  }
  double change = 0.0;
  for (Eigen::Index i = 0; i < effort_change.size(); ++i) {
    change += bound_.mobility(c, i) * effort_change[i];
  }
  std::size_t next = 0;
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      change += bound_.mobility(c, static_cast<Eigen::Index>(term.output)) *
                bound_.largest[static_cast<Eigen::Index>(term.parameter)] * 2.0 * step.values[next++].error;
    }
  }
  for (Eigen::Index d = 0; d < rate_.cols(); ++d) {
    change += rate_(c, d) * step.acceleration[d] * step.length;
  }
  return kUp * change;
}

}  // namespace wheelwright::filter
