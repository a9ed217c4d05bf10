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

StepMotion::StepMotion(const Model& model) {
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  const auto joints = static_cast<Eigen::Index>(model.joints.size());
  speed = speed_error = acceleration = Eigen::VectorXd::Zero(coordinates);
  joint_speed = joint_error = Eigen::VectorXd::Zero(joints);
  effort = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.n()));
  values.resize(static_cast<std::size_t>(std::count_if(
      model.terms.begin(), model.terms.end(), [](const Term& term) { return term.kind == Term::Kind::function; })));
}

StepEnclosure::StepEnclosure(const Model& model, MotionBound bound) : bound_(std::move(bound)) {
  const auto coordinates = static_cast<Eigen::Index>(model.coordinates.size());
  const auto n = static_cast<Eigen::Index>(model.n());
  force_ = Eigen::VectorXd::Zero(n);
  next_ = speed_error_ = Eigen::VectorXd::Zero(coordinates);
  joint_error_ = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.joints.size()));
  const Eigen::MatrixXd inverse = core::pseudo_inverse(model.motion);
  const bool determined =
      (inverse * model.motion - Eigen::MatrixXd::Identity(inverse.rows(), inverse.rows())).cwiseAbs().maxCoeff() < 1e-9;
  joint_from_ = determined ? Eigen::MatrixXd(kUp * inverse.cwiseAbs())
                           : Eigen::MatrixXd::Constant(inverse.rows(), inverse.cols(), core::kInfinity);
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
  }
}

// The functions of the motion for every instant of the step, with the accelerations that stand in it.
void StepEnclosure::evaluate(const Model& model, StepMotion& step) const {
  if (step.values.empty()) {
    return;
  }
  const double half = 0.5 * step.length;
  double turned = 0.0;
  if (bound_.empty()) {
    speed_error_ = step.speed_error;
    joint_error_ = step.joint_error;
  } else {
    speed_error_ = kUp * (step.speed_error + half * step.acceleration);
    for (Eigen::Index j = 0; j < joint_error_.size(); ++j) {
      double faster = 0.0;
      for (Eigen::Index c = 0; c < step.acceleration.size(); ++c) {
        faster += step.acceleration[c] > 0.0 ? joint_from_(j, c) * step.acceleration[c] : 0.0;
      }
      joint_error_[j] = kUp * (step.joint_error[j] + half * faster);
    }
    if (model.heading_coordinate >= 0) {
      const auto c = static_cast<Eigen::Index>(model.heading_coordinate);
      turned = kUp * half * (std::abs(step.speed[c]) + speed_error_[c]);
    }
  }
  const auto coordinates = static_cast<std::size_t>(step.speed.size());
  const auto joints = static_cast<std::size_t>(step.joint_speed.size());
  const model::MotionState state{{step.speed.data(), coordinates},
                                 {speed_error_.data(), coordinates},
                                 {step.joint_speed.data(), joints},
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

// |u| + |F| per output but for what viscous friction gains within the step.
void StepEnclosure::force(const Model& model, const StepMotion& step) const {
  force_ = step.effort;
  std::size_t next = 0;
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::acceleration) {
      continue;
    }
    double size = 0.0;
    if (term.kind == Term::Kind::speed) {
      const auto c = static_cast<Eigen::Index>(term.coordinate);
      size = std::abs(term.scale) * (std::abs(step.speed[c]) + step.speed_error[c]);
    } else {
      const model::TermValue& value = step.values[next++];
      size = std::abs(value.value) + value.error;
    }
    force_[static_cast<Eigen::Index>(term.output)] += bound_.largest[static_cast<Eigen::Index>(term.parameter)] * size;
  }
}

bool StepEnclosure::enclose(const Model& model, StepMotion& step) const {
  step.acceleration.setZero();
  if (bound_.empty()) {
    evaluate(model, step);
    return true;
  }
  const bool limited = bound_.limit.size() > 0;
  bool known = limited;
  if (limited) {
    step.acceleration = bound_.limit;
  }
  if (bound_.mobility.size() > 0) {
    // a = N(b(a) + F a h/2): solved for the viscous part, then widened until functions that grow with the speed agree.
    const double half = 0.5 * step.length;
    const auto rows = rate_.rows();
    const auto solve = [&]() {
      force(model, step);
      multiply(bound_.mobility, force_, next_);
      if (rows == 1) {
        const double left = 1.0 - half * rate_(0, 0);
        if (!(left > 0.0)) return false;
        next_[0] /= left;
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
    };
    Eigen::VectorXd& found = step.acceleration;
    bool settled = false;
    found.setZero();
    evaluate(model, step);
    if (solve()) {
      for (int round = 0; round < kRounds && !settled; ++round) {
        found = (round < 2 ? 1.0 : 1.5) * next_;
        evaluate(model, step);
        // Without functions nothing that is solved for depends on `found`.
        settled = (step.values.empty() || solve()) && (next_.array() <= found.array()).all();
      }
    }
    if (settled) {
      known = true;
      if (!limited) {
        return true;  // with what was evaluated last
      }
      found = found.cwiseMin(bound_.limit);
    } else if (limited) {
      found = bound_.limit;
    }
  }
  if (!known) {
    return false;
  }
  evaluate(model, step);
  return true;
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
