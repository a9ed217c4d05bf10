// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/fault_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::detector {
namespace {

// What an instantaneous part of the signature is made of.
struct Instant {
  double profile = 0.0;
  const Eigen::VectorXd& v;            // coordinate speeds
  const Eigen::VectorXd& joint_speed;  // of all joints
  double heading = 0.0;
  const Eigen::VectorXd& acceleration;  // v̇
  const Eigen::VectorXd& moved;         // s u, u = K v + a: motion beyond v
  const Eigen::VectorXd& moved_rate;    // its derivative
  const Eigen::VectorXd& joint_moved;   // of the joints
  const Eigen::VectorXd& seen;          // s S v
  const Eigen::VectorXd& seen_rate;
  const Eigen::VectorXd& joint_seen;  // of the joints
  bool sets_in = false;               // the fault sets in between the steps about this instant ...
  bool only_changes = false;  // ... and this is the step before: it has what changes, nothing of what was before
};

// Joint speeds of coordinate speeds; what is rounding beside the others is 0.
Eigen::VectorXd joints_of(const Eigen::MatrixXd& inverse, const Eigen::VectorXd& v) {
  const double floor = 1e-12 * (inverse.cwiseAbs() * v.cwiseAbs()).maxCoeff();
  return (inverse * v).unaryExpr([floor](double x) { return std::abs(x) <= floor ? 0.0 : x; });
}

// Joint speeds from coordinate speeds.
Eigen::MatrixXd inverse_of(const Model& model) { return core::pseudo_inverse(model.motion); }

Eigen::MatrixXd or_zero(const Eigen::MatrixXd& matrix, std::size_t size) {
  const auto n = static_cast<Eigen::Index>(size);
  return matrix.size() > 0 ? matrix : Eigen::MatrixXd::Zero(n, n);
}

// What a fault whose profile is at `s` adds to the speeds v, and to those of the joints.
void extra_motion(const FaultType& fault, const Eigen::MatrixXd& inverse, const Eigen::VectorXd& v,
                  const Eigen::VectorXd& joints, double s, ExtraMotion& extra) {
  extra.moved.setZero(v.size());
  extra.joint_moved.setZero(joints.size());
  extra.seen.setZero(v.size());
  extra.joint_seen.setZero(joints.size());
  if (fault.motion.size() > 0) {
    extra.moved += s * fault.motion * v;
  }
  if (fault.slip.size() > 0) {
    extra.moved += s * fault.slip;
  }
  if (fault.of_reading) {
    extra.joint_moved = joints_of(inverse, extra.moved);
  }
  if (fault.seen.size() > 0) {
    extra.seen += s * fault.seen * v;
    extra.joint_seen =
        fault.whole ? Eigen::VectorXd(joints_of(inverse, v + extra.seen) - joints) : joints_of(inverse, extra.seen);
  }
}

double evaluate(const Term& term, const Eigen::VectorXd& v, const Eigen::VectorXd& joints, double heading) {
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(std::max(v.size(), joints.size()));
  const auto span = [](const Eigen::VectorXd& x, Eigen::Index size) {
    return std::span<const double>(x.data(), static_cast<std::size_t>(size));
  };
  return term
      .function({span(v, v.size()), span(none, v.size()), span(joints, joints.size()), span(none, joints.size()),
                 heading, 0.0})
      .value;
}

// A term of Y: healthy, without what dry friction in the wheels has, of the motion beyond v (times κ, times κ²), of the
// motion seen.
struct Parts {
  double healthy = 0.0, ground = 0.0, moved = 0.0, moved_twice = 0.0, seen = 0.0;
};

// What motion beyond v, κ times `by`, adds to a function: κ `once` + κ² `twice` through κ = ±1/2.
struct Growth {
  double once = 0.0, twice = 0.0;
};

Growth growth(const Term& term, const Eigen::VectorXd& v, const Eigen::VectorXd& joints, double heading,
              const Eigen::VectorXd& by, const Eigen::VectorXd& joints_by) {
  if (by.isZero(0.0) && joints_by.isZero(0.0)) {
    return {};
  }
  const double now = evaluate(term, v, joints, heading),
               more = evaluate(term, v + 0.5 * by, joints + 0.5 * joints_by, heading),
               less = evaluate(term, v - 0.5 * by, joints - 0.5 * joints_by, heading);
  return {more - less, 2.0 * ((more - now) + (less - now))};
}

Parts parts_of(const Term& term, const FaultType& fault, const Instant& at) {
  const auto c = static_cast<Eigen::Index>(term.coordinate);
  Parts parts;
  if (at.only_changes && term.kind != Term::Kind::acceleration) {
    return parts;
  }
  switch (term.kind) {
    case Term::Kind::acceleration:
      parts.ground = at.acceleration[c];
      parts.healthy = at.only_changes ? 0.0 : at.acceleration[c];
      // Motion across the heading, d to the left, takes w2 d from the forward acceleration.
      parts.moved = at.moved_rate[c] - (c == 0 && fault.lateral != 0.0 ? at.profile * fault.lateral * at.v[1] : 0.0);
      parts.seen = at.seen_rate[c];
      break;
    case Term::Kind::speed:
      parts.healthy = parts.ground = at.v[c];
      parts.moved = at.moved[c];
      parts.seen = at.seen[c];
      break;
    case Term::Kind::function: {
      const Eigen::VectorXd rest = Eigen::VectorXd::Zero(at.v.size());
      parts.healthy = evaluate(term, at.v, at.joint_speed, at.heading);
      parts.ground = parts.healthy - evaluate(term, rest, at.joint_speed, at.heading);
      const Growth beyond = growth(term, at.v, at.joint_speed, at.heading, at.moved, at.joint_moved);
      parts.moved = beyond.once;
      parts.moved_twice = beyond.twice;
      if (fault.seen.size() > 0 && fault.whole) {
        // An encoder that stands still shows no sign.
        parts.seen = evaluate(term, at.v + at.seen, at.joint_speed + at.joint_seen, at.heading) - parts.healthy;
      } else if (fault.seen.size() > 0) {
        parts.seen = growth(term, at.v, at.joint_speed, at.heading, at.seen, at.joint_seen).once;
      }
      break;
    }
  }
  parts.healthy *= term.scale;
  parts.ground *= term.scale;
  parts.moved *= term.scale;
  parts.moved_twice *= term.scale;
  parts.seen *= term.scale;
  return parts;
}

// Signature at one instant; `held` is what a reading that stands still shows.
void signature(const FaultType& fault, const Model& model, const Instant& at, const core::RowMatrix& held,
               FaultSignals& out) {
  out.g1.setZero();
  out.g2.setZero();
  out.s.setZero();
  out.c.setZero();
  const auto n = static_cast<Eigen::Index>(model.n());
  const double s = at.profile;
  // Where a fault sets in encoders jump and the robot's own speed goes on: no acceleration that the ground could share.
  for (const Term& term : model.terms) {
    const Parts parts = parts_of(term, fault, at);
    const auto k = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter);
    out.g1(k, j) += parts.moved;
    out.g2(k, j) += parts.moved_twice;
    out.s(k, j) += parts.seen;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (fault.effort.size() > 0) {
        out.g1(i, j) += s * fault.effort(i, k) * parts.healthy;
        out.g2(i, j) += s * fault.effort(i, k) * parts.moved;
      }
      if (fault.ground.size() > 0 && !(at.sets_in && term.kind == Term::Kind::acceleration)) {
        out.g1(i, j) += s * fault.ground(i, k) * parts.ground;
        out.g2(i, j) += s * fault.ground(i, k) * parts.moved;
      }
    }
    if (fault.theta.size() > 0) {
      out.c[k] += s * fault.theta[j] * parts.healthy;
    }
  }
  if (at.only_changes) {
    return;
  }
  if (fault.held_effort) {
    out.g1 -= s * fault.effort * held;
  }
  if (fault.offset.size() > 0) {
    out.c += s * fault.offset;
  }
}

}  // namespace

FaultSignals FaultSignals::none(const Model& model) {
  const auto n = static_cast<Eigen::Index>(model.n()), p = static_cast<Eigen::Index>(model.p());
  return {core::RowMatrix::Zero(n, p), core::RowMatrix::Zero(n, p), core::RowMatrix::Zero(n, p),
          Eigen::VectorXd::Zero(n)};
}

bool polynomial(const FaultType& fault, const Model& model) {
  if (fault.held_effort) {
    return false;
  }
  const auto size = static_cast<Eigen::Index>(model.coordinates.size());
  const Eigen::MatrixXd K = fault.motion.size() > 0 ? fault.motion : Eigen::MatrixXd::Zero(size, size),
                        S = fault.seen.size() > 0 ? fault.seen : Eigen::MatrixXd::Zero(size, size);
  const Eigen::VectorXd a = fault.slip.size() > 0 ? fault.slip : Eigen::VectorXd::Zero(size);
  const Eigen::MatrixXd inverse = inverse_of(model);
  const bool gain = fault.effort.size() > 0 || fault.ground.size() > 0;
  const Interval range{fault.kappa(fault.range.lower), fault.kappa(fault.range.upper)};
  constexpr double kHeading = 0.7, kTolerance = 1e-9;
  constexpr std::array<double, 3> kSpeeds = {0.01, 0.3, 5.0};        // m/s, rad/s
  constexpr std::array<double, 3> kTurns = {-0.6, 0.1, 1.7};         // of the other coordinates, over the first
  constexpr std::array<double, 4> kShares = {0.05, 0.3, 0.7, 0.95};  // of the range
  for (const Term& term : model.terms) {
    if (term.kind != Term::Kind::function) {
      continue;
    }
    for (std::size_t k = 0; k < kSpeeds.size() * kTurns.size(); ++k) {
      Eigen::VectorXd v = Eigen::VectorXd::Constant(size, kSpeeds[k / kTurns.size()]);
      v.tail(size - 1) *= kTurns[k % kTurns.size()];
      const Eigen::VectorXd joints = joints_of(inverse, v), moved = K * v + a, seen = S * v,
                            still = Eigen::VectorXd::Zero(joints.size());
      const double now = evaluate(term, v, joints, kHeading);
      const auto follows = [&](const Eigen::VectorXd& by, const Eigen::VectorXd& joints_by, bool twice) {
        const Growth g = growth(term, v, joints, kHeading, by, joints_by);
        const double scale = std::abs(now) + std::abs(g.once) + std::abs(g.twice);
        bool good = twice || std::abs(g.twice) <= kTolerance * scale;
        for (const double share : kShares) {
          for (const double kappa : {share * range.lower, share * range.upper}) {
            const double value = evaluate(term, v + kappa * by, joints + kappa * joints_by, kHeading);
            const double expected = now + kappa * g.once + kappa * kappa * g.twice;
            good = good && std::abs(value - expected) <= kTolerance * scale * (1.0 + kappa * kappa);
          }
        }
        return good;
      };
      if (!follows(moved, fault.of_reading ? joints_of(inverse, moved) : still, !gain) ||
          !(fault.whole || follows(seen, joints_of(inverse, seen), false))) {
        return false;
      }
    }
  }
  return true;
}

SignatureErrors::SignatureErrors(const FaultType& fault, const Model& model, const FilterDesign& design,
                                 const ReferenceMotion& motion)
    : model_(&model),
      reference_(&motion),
      design_(design),
      kernel_(design, motion.kind, motion.nominal_step),
      motion_(or_zero(fault.motion, model.coordinates.size()).cwiseAbs()),
      effort_(or_zero(fault.effort, model.n()).cwiseAbs() + or_zero(fault.ground, model.n()).cwiseAbs()),
      seen_(or_zero(fault.seen, model.coordinates.size()).cwiseAbs()),
      theta_(fault.theta.cwiseAbs()),
      lateral_(std::abs(fault.lateral)),
      moves_(fault.motion.size() > 0 || fault.slip.size() > 0),
      whole_(fault.whole && fault.seen.size() > 0) {
  const filter::SignalErrors& errors = motion.errors;
  double shortest = motion.nominal_step;
  for (const double step : motion.step) {
    shortest = step > 0.0 ? std::min(shortest, step) : shortest;
  }
  sample_ = shorter(shortest) * errors.speed_sample;
  if (sample_.size() > 0) {
    moved_sample_ = motion_ * sample_;
    seen_sample_ = seen_ * sample_;
  }
  slope_ = Eigen::VectorXd::Zero(errors.speed.size());
  if (fault.profile.kind == FaultProfile::Kind::ramp) {
    slope_ = errors.speed / fault.profile.rise;
  } else if (fault.profile.kind == FaultProfile::Kind::bump && motion.joint_speed.size() > 0) {
    const double fastest = motion.joint_speed.row(static_cast<Eigen::Index>(fault.profile.joint)).cwiseAbs().maxCoeff();
    slope_ =
        design.static_gain() * std::numbers::pi / fault.profile.arc * fastest * shorter(shortest) * errors.speed_sample;
  }
  begin(0);
}

// By how much the error of a mean speed is larger than in a nominal step.
double SignatureErrors::shorter(double step) const {
  const bool means = reference_->kind != MotionKind::speed && reference_->nominal_step > 0.0 && step > 0.0;
  return means ? std::max(1.0, reference_->nominal_step / step) : 1.0;
}

void SignatureErrors::begin(std::size_t onset) {
  const std::vector<double>& step = reference_->step;
  const double next = onset + 1 < step.size() ? step[onset + 1] : 0.0;
  onset_ = std::max(shorter(onset < step.size() ? step[onset] : 0.0), shorter(next)) * reference_->errors.speed_sample;
}

const SignatureErrors::Row& SignatureErrors::row(std::size_t k, std::size_t i, double since) {
  const filter::SignalErrors& errors = reference_->errors;
  const auto n = static_cast<Eigen::Index>(model_->n());
  const auto dY = reference_->rows.dY.middleRows(static_cast<Eigen::Index>(k) * n, n);
  const bool angles = reference_->kind != MotionKind::speed;
  const double decay = std::exp(-design_.beta * since);
  const double newest = angles ? kernel_.gain() * (design_.order == 1 ? decay : kernel_.slow() * since * decay) : 0.0;
  cut_ = newest * onset_ + slope_;
  const auto at = static_cast<Eigen::Index>(i), p = static_cast<Eigen::Index>(model_->p());
  const auto own_error = [&](const Term& term) {
    return dY(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.parameter));
  };
  of_acceleration_ = errors.acceleration;
  of_speed_ = errors.speed;
  for (const Term& term : model_->terms) {
    if (term.kind != Term::Kind::function && term.scale != 0.0) {
      double& most =
          (term.kind == Term::Kind::speed ? of_speed_ : of_acceleration_)[static_cast<Eigen::Index>(term.coordinate)];
      most = std::max(most, own_error(term) / std::abs(term.scale));
    }
  }
  acceleration_.noalias() = motion_ * of_acceleration_;
  speed_.noalias() = motion_ * of_speed_;
  out_.e1.setZero(p);
  out_.e2.setZero(p);
  out_.es.setZero(p);
  out_.ec = 0.0;
  for (const Term& term : model_->terms) {
    const auto o = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter),
               c = static_cast<Eigen::Index>(term.coordinate);
    const double scale = std::abs(term.scale);
    // Errors of this entry, of its motion part and of what is seen: filtered, and what the cut at the onset adds.
    double own = own_error(term), moved = 0.0, seen = 0.0, own_cut = 0.0, moved_cut = 0.0;
    switch (term.kind) {
      case Term::Kind::acceleration:
        moved = scale * (acceleration_[c] + (c == 0 && lateral_ > 0.0 ? lateral_ * of_speed_[1] : 0.0));
        seen = scale * seen_.row(c).dot(of_acceleration_);
        own_cut = scale * cut_[c];
        moved_cut = scale * motion_.row(c).dot(cut_);
        break;
      case Term::Kind::speed:
        moved = scale * speed_[c];
        seen = scale * seen_.row(c).dot(of_speed_);
        break;
      case Term::Kind::function: {
        // Functions of the motion are at most proportional to it, or do not depend on it but by signs.
        const auto beyond = [&](const Eigen::MatrixXd& share, const Eigen::VectorXd& error) {
          return scale * design_.static_gain() * (error.maxCoeff() + errors.heading * (1.0 + share.maxCoeff()));
        };
        moved = moves_ ? beyond(motion_, moved_sample_) : 0.0;
        seen = whole_ ? own : seen_.isZero(0.0) ? 0.0 : beyond(seen_, seen_sample_);
        own *= 2.0;
        break;
      }
    }
    if (o == at) {
      out_.e1[j] += moved;
      out_.es[j] += seen;
      out_.ec += theta_.size() > 0 ? theta_[j] * (own + own_cut) : 0.0;
    }
    out_.e1[j] += effort_(at, o) * (own + own_cut);
    out_.e2[j] += effort_(at, o) * (moved + moved_cut);
  }
  return out_;
}

FaultElements::FaultElements(FaultType fault, const Model& model, double static_gain, const ReferenceMotion& motion)
    : fault_(std::move(fault)),
      model_(&model),
      static_gain_(static_gain),
      motion_(&motion),
      held_(core::RowMatrix::Zero(static_cast<Eigen::Index>(model.n()), static_cast<Eigen::Index>(model.p()))),
      from_motion_(inverse_of(model)),
      jump_(FaultSignals::none(model)),
      begin_(jump_),
      end_signals_(jump_) {
  validate(fault_, model);
}

void FaultElements::take_point(std::size_t k, Point& point) {
  const auto i = static_cast<Eigen::Index>(k), joint = static_cast<Eigen::Index>(fault_.profile.joint);
  point.profile =
      fault_.profile.at(motion_->instant[k] - motion_->instant[onset_],
                        motion_->joint_angle(joint, i) - motion_->joint_angle(joint, static_cast<Eigen::Index>(onset_)),
                        motion_->joint_speed(joint, i));
  v1_ = motion_->speed.col(i);
  joints1_ = motion_->joint_speed.col(i);
  extra_motion(fault_, from_motion_, v1_, joints1_, point.profile, point.extra);
}

void FaultElements::begin(std::size_t onset) {
  begin_broken(onset);
  fresh_ = fault_.profile.jumps() && motion_->kind != MotionKind::speed;
  if (fault_.profile.jumps()) {
    // Motion beyond v, and what is seen, are there at once: their derivatives have an impulse.
    for (const Term& term : model_->terms) {
      if (term.kind == Term::Kind::acceleration) {
        const auto o = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter),
                   c = static_cast<Eigen::Index>(term.coordinate);
        jump_.g1(o, j) += term.scale * before_.extra.moved[c];
        jump_.s(o, j) += term.scale * before_.extra.seen[c];
      }
    }
  }
}

void FaultElements::begin_broken(std::size_t first) {
  check::that(first < motion_->instants(), "onset", "an instant of the motion");
  const auto next = std::upper_bound(motion_->segment_starts.begin(), motion_->segment_starts.end(), first);
  last_ = next == motion_->segment_starts.end() ? motion_->instants() : *next;
  onset_ = k_ = first;
  fresh_ = false;
  jump_ = begin_ = end_signals_ = FaultSignals::none(*model_);
  take_point(first, before_);
  if (fault_.held_effort) {
    const auto n = static_cast<Eigen::Index>(model_->n());
    held_ = motion_->rows.Y.middleRows(static_cast<Eigen::Index>(first) * n, n) / static_gain_;
  }
}

bool FaultElements::next() {
  if (k_ + 1 >= last_) {
    return false;
  }
  const auto a = static_cast<Eigen::Index>(k_);
  shares_ = motion_->shares(k_);
  const double h = shares_[0] + shares_[1];
  v0_ = motion_->speed.col(a);
  joints0_ = motion_->joint_speed.col(a);
  take_point(k_ + 1, after_);
  acceleration_ = (v1_ - v0_) / h;
  moved_rate_ = (after_.extra.moved - before_.extra.moved) / h;
  seen_rate_ = (after_.extra.seen - before_.extra.seen) / h;
  // The step that ends at the onset of a jump is still healthy.
  const bool healthy = sets_in_ = fresh_ && k_ == onset_;
  signature(fault_, *model_,
            {before_.profile, v0_, joints0_, motion_->heading[k_], acceleration_, before_.extra.moved, moved_rate_,
             before_.extra.joint_moved, before_.extra.seen, seen_rate_, before_.extra.joint_seen, healthy, healthy},
            held_, begin_);
  signature(fault_, *model_,
            {after_.profile, v1_, joints1_, motion_->heading[k_ + 1], acceleration_, after_.extra.moved, moved_rate_,
             after_.extra.joint_moved, after_.extra.seen, seen_rate_, after_.extra.joint_seen, healthy},
            held_, end_signals_);
  std::swap(before_, after_);
  ++k_;
  return true;
}

FaultFilter::FaultFilter(FaultType fault, const Model& model, const FilterDesign& design, const ReferenceMotion& motion)
    : fault_(std::move(fault)),
      model_(&model),
      motion_(&motion),
      elements_(fault_, model, design.static_gain(), motion),
      filtered_(FaultSignals::none(model)) {
  filter::validate(design);
  kernel_ = filter::FilterKernel(design, motion.kind, motion.nominal_step);
  if (!motion.cuts.empty()) {
    kernel_.soften();
  }
  cascades_ = filter::KernelBank(model.n() * (3 * model.p() + 1));
  const auto n = static_cast<Eigen::Index>(model.n());
  from_motion_ = inverse_of(model);
  to_joints_ = core::pseudo_inverse(model.input);
  gain_only_ = fault_.effort.size() > 0 && fault_.motion.size() == 0 && fault_.ground.size() == 0 &&
               fault_.slip.size() == 0 && fault_.seen.size() == 0 && fault_.theta.size() == 0 &&
               fault_.offset.size() == 0 && fault_.lateral == 0.0;
  gain_ = Eigen::VectorXd::Ones(n);
  if (gain_only_) {
    const Eigen::MatrixXd joints = (to_joints_ * fault_.effort * model.input).cwiseAbs();
    const Eigen::MatrixXd input = model.input.cwiseAbs();
    const Eigen::MatrixXd widened = input * joints;
    for (Eigen::Index i = 0; i < n; ++i) {
      gain_[i] = 0.0;
      for (Eigen::Index m = 0; m < input.cols(); ++m) {
        // A joint that does not reach this output by itself has no range here: the largest of the others stands for it.
        const double own = input(i, m) > 0.0 ? input(i, m) : input.row(i).maxCoeff();
        gain_[i] = std::max(gain_[i], widened(i, m) / own);
      }
    }
  }
  const auto norm = [](const Eigen::MatrixXd& back, const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& joints) {
    return matrix.size() > 0 ? (back * matrix * joints).cwiseAbs().rowwise().sum().maxCoeff() : 0.0;
  };
  most_kappa_ = std::max(std::abs(fault_.kappa(fault_.range.lower)), std::abs(fault_.kappa(fault_.range.upper)));
  proportional_ = fault_.slip.size() == 0 && fault_.theta.size() == 0 && fault_.offset.size() == 0 &&
                  fault_.lateral == 0.0 && !fault_.held_effort;
  const double gains = norm(to_joints_, fault_.effort, model.input) + norm(to_joints_, fault_.ground, model.input);
  const double motions =
      norm(from_motion_, fault_.motion, model.motion) + norm(from_motion_, fault_.seen, model.motion);
  growth_ = gains + motions + most_kappa_ * gains * motions;
  if (motion.measured) {
    read_errors_.emplace(fault_, model, design, motion);
  }
  last_ = FaultSignals::none(model);
  widened_ = filter::KernelBank(model.n() * (model.p() + 1));
  range_ = last_.g1;
  widened_c_ = last_.c;
}

namespace {

// `signals` from numbers that stand one after the other.
void fill(FaultSignals& signals, const double* from) {
  const auto take = [&](auto& to) {
    std::copy_n(from, to.size(), to.data());
    from += to.size();
  };
  take(signals.g1);
  take(signals.g2);
  take(signals.s);
  take(signals.c);
}

}  // namespace

void FaultFilter::begin(std::size_t onset) {
  begin_filter(onset);
  elements_.begin(onset);
  const double held = motion_->held_jump(onset);
  const FaultSignals& jumps = elements_.jump();
  const std::size_t size = static_cast<std::size_t>(jumps.g1.size());
  const auto jump = [&](std::size_t e, double by) {
    cascades_.z1()[e] += by;
    cascades_.fast()[e] += by;
    cascades_.soft()[e] += by;
  };
  for (std::size_t e = 0; e < size; ++e) {
    jump(e, held * jumps.g1.data()[e]);
    jump(2 * size + e, held * jumps.s.data()[e]);
  }
}

void FaultFilter::begin_filter(std::size_t onset) {
  check::that(onset < motion_->instants(), "onset", "an instant of the motion");
  onset_ = k_ = onset;
  if (read_errors_) {
    read_errors_->begin(onset);
  }
  cascades_.clear();
  filtered_ = last_ = FaultSignals::none(*model_);
  widened_.clear();
  range_.setZero();
  widened_c_.setZero();
  added_ = since_ = 0.0;
  row_range_ = row_dY_ = range_;
}

void FaultFilter::begin_broken(std::size_t first) {
  begin_filter(first);
  elements_.begin_broken(first);
}

void FaultFilter::filter(const FaultSignals& begin, const FaultSignals& end, const std::array<double, 2>& shares,
                         double h) {
  kernel_.prepare(h);
  double* in = cascades_.in();
  const auto put = [&](const auto& from, const auto& to) {
    for (Eigen::Index e = 0; e < from.size(); ++e) {
      *in++ = shares[0] * from.data()[e] + shares[1] * to.data()[e];
    }
  };
  put(begin.g1, end.g1);
  put(begin.g2, end.g2);
  put(begin.s, end.s);
  put(begin.c, end.c);
  if ((k_ - onset_) % filter::kFade == 0) {
    cascades_.fade();
    widened_.fade();
  }
  kernel_.take(cascades_);
  fill(filtered_, cascades_.out());
}

// Half of what the efforts that the fault adds change by, in every step in which a sample counts, as if from the first.
void FaultFilter::widen(const FaultSignals& begin, const FaultSignals& end, bool sets_in, double h) {
  if (motion_->effort_reach == 0) {
    return;
  }
  const Eigen::MatrixXd input = model_->input.cwiseAbs();
  const double steps = static_cast<double>(motion_->effort_reach);
  const auto change = [&](const auto& signals) {
    const auto from = signals(last_), first = signals(begin), last = signals(end);
    // What a gain does beyond its onset is in gain_.
    using Joints = Eigen::MatrixXd;
    const Joints jump = (to_joints_ * (first - from)).cwiseAbs(), on = (to_joints_ * (last - first)).cwiseAbs();
    return Joints(0.5 * steps * h *
                  (input * (gain_only_ ? (sets_in ? Joints(jump + on) : Joints(0.0 * on)) : jump + on)));
  };
  const Eigen::MatrixXd g =
      change([](const FaultSignals& s) { return s.g1; }) + change([](const FaultSignals& s) { return s.g2; });
  const Eigen::MatrixXd c = change([](const FaultSignals& s) { return s.c; });
  std::size_t at = 0;
  const auto add = [&](const Eigen::MatrixXd& by) {
    for (Eigen::Index i = 0; i < by.rows(); ++i) {
      for (Eigen::Index j = 0; j < by.cols(); ++j, ++at) {
        widened_.z1()[at] += by(i, j);
        widened_.z2()[at] += steps * h * by(i, j);
        widened_.fast()[at] += by(i, j);
      }
    }
  };
  add(g);
  add(c);
  kernel_.take(widened_);
  std::copy_n(widened_.out(), range_.size(), range_.data());
  std::copy_n(widened_.out() + range_.size(), widened_c_.size(), widened_c_.data());
  last_ = end;
}

// The largest effort of any output per unit of κ, for every θ of the set.
double FaultFilter::most_added(const FaultSignals& signals) const {
  Eigen::VectorXd sum = signals.c.cwiseAbs();
  if (motion_->largest.size() == signals.g1.cols()) {
    sum += (signals.g1.cwiseAbs() + most_kappa_ * signals.g2.cwiseAbs()) * motion_->largest;
  }
  return sum.maxCoeff();
}

// The next element through the filter of the signature.
bool FaultFilter::pass_element() {
  if (!elements_.next()) {
    return false;
  }
  const std::array<double, 2>& shares = elements_.shares();
  const FaultSignals &begin = elements_.at_begin(), &end = elements_.at_end();
  const double held = motion_->held(k_);
  if (motion_->cut_at(k_)) {
    cascades_.cut(static_cast<std::size_t>(3 * begin.g1.size() + begin.c.size()));
  }
  filter(begin, end, {held * shares[0], held * shares[1]}, motion_->step[k_ + 1]);
  return true;
}

bool FaultFilter::next_state() {
  if (!pass_element()) {
    return false;
  }
  ++k_;
  return true;
}

bool FaultFilter::next() {
  if (!pass_element()) {
    return false;
  }
  const std::array<double, 2>& shares = elements_.shares();
  const FaultSignals &begin = elements_.at_begin(), &end = elements_.at_end();
  widen(begin, end, k_ == onset_ || elements_.sets_in(), std::max(shares[0] + shares[1], motion_->step[k_ + 1]));
  ++k_;
  const auto n = static_cast<Eigen::Index>(model_->n());
  const Eigen::Index first = static_cast<Eigen::Index>(k_) * n;
  row_range_ = 2.0 * range_;
  row_doubt_ = 2.0 * widened_c_;
  row_dY_ = motion_->any_dY.middleRows(first, n);
  if (fault_.seen.size() > 0 && motion_->effort_doubt.rows() > 0) {
    row_dY_ += motion_->effort_doubt.middleRows(first, n);
  }
  if (motion_->between_dY.rows() > 0 && proportional_) {
    const Eigen::VectorXd by = gain_only_ ? gain_ : Eigen::VectorXd::Constant(n, growth_);
    row_range_ += 2.0 * by.asDiagonal() * motion_->between_dY.middleRows(first, n);
  } else if (motion_->effort_dY.rows() > 0) {
    for (const FaultSignals* at : {&begin, &end}) {
      added_ = std::max(added_, most_added(*at));
    }
    if (added_ > 0.0) {
      row_range_ += 2.0 * added_ * motion_->effort_dY.middleRows(first, n);
      row_dY_ += motion_->effort_doubt.middleRows(first, n);
    }
  }
  if (gain_only_ && motion_->between_dy.size() > 0) {
    row_doubt_ += 2.0 * gain_.cwiseProduct(motion_->between_dy.segment(first, n));
  }
  if (read_errors_) {
    since_ += motion_->step[k_];
    for (Eigen::Index i = 0; i < n; ++i) {
      const SignatureErrors::Row& e = read_errors_->row(k_, static_cast<std::size_t>(i), since_);
      row_range_.row(i) += e.e1 + most_kappa_ * e.e2 + e.es;
      row_doubt_[i] += e.ec;
    }
  }
  return true;
}

FaultRow FaultFilter::row(std::size_t i) const {
  const std::size_t p = model_->p();
  const auto at = static_cast<Eigen::Index>(k_ * model_->n() + i), r = static_cast<Eigen::Index>(i);
  FaultRow row{.y = {motion_->rows.Y.row(at).data(), p},
               .g1 = {filtered_.g1.row(r).data(), p},
               .g2 = {filtered_.g2.row(r).data(), p},
               .s = {filtered_.s.row(r).data(), p},
               .dY = {row_dY_.row(r).data(), p},
               .c = filtered_.c[r],
               .dy = motion_->any_dy[at],
               .doubt = row_doubt_[r],
               .range = {row_range_.row(r).data(), p}};
  if (motion_->measured) {
    row.read = {motion_->rows.dY.row(at).data(), p};
  }
  return row;
}

SettledRows settled_rows(const FaultType& fault, const Model& model, const FilterDesign& design,
                         const Eigen::VectorXd& v, const Eigen::VectorXd& a) {
  validate(fault, model);
  const auto c = static_cast<Eigen::Index>(model.coordinates.size());
  check::that(v.size() == c && a.size() == c, "operating point", "one speed and one acceleration for each coordinate");
  const Eigen::MatrixXd inverse = inverse_of(model);
  const Eigen::VectorXd joints = joints_of(inverse, v);
  ExtraMotion extra;
  extra_motion(fault, inverse, v, joints, 1.0, extra);
  Eigen::VectorXd moved_rate = Eigen::VectorXd::Zero(c), seen_rate = moved_rate;
  if (fault.motion.size() > 0) {
    moved_rate += fault.motion * a;
  }
  if (fault.seen.size() > 0) {
    seen_rate += fault.seen * a;
  }
  SettledRows rows;
  const std::vector<double> joint_list(joints.data(), joints.data() + joints.size()),
      speed_list(v.data(), v.data() + v.size()), none(std::max(joint_list.size(), speed_list.size()), 0.0);
  rows.Y = design.static_gain() *
           model::regressor(
               model, {speed_list, {none.data(), speed_list.size()}, joint_list, {none.data(), joint_list.size()}},
               {a.data(), static_cast<std::size_t>(a.size())});
  rows.signature = FaultSignals::none(model);
  signature(
      fault, model,
      {1.0, v, joints, 0.0, a, extra.moved, moved_rate, extra.joint_moved, extra.seen, seen_rate, extra.joint_seen},
      rows.Y / design.static_gain(), rows.signature);
  rows.signature.g1 *= design.static_gain();
  rows.signature.g2 *= design.static_gain();
  rows.signature.s *= design.static_gain();
  rows.signature.c *= design.static_gain();
  return rows;
}

}  // namespace wheelwright::detector
