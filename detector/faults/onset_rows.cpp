// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/onset_rows.hpp"

#include <algorithm>
#include <cmath>

#include "core/check.hpp"

namespace wheelwright::detector {
namespace {

// x + f y, part by part.
FaultSignals sum(const FaultSignals& x, double f, const FaultSignals& y) {
  return {x.g1 + f * y.g1, x.g2 + f * y.g2, x.s, x.c + f * y.c};
}

void raise(FaultSignals& to, const FaultSignals& from) {
  to.g1 = to.g1.cwiseMax(from.g1.cwiseAbs());
  to.g2 = to.g2.cwiseMax(from.g2.cwiseAbs());
  to.c = to.c.cwiseMax(from.c.cwiseAbs());
}

bool drifts(const FaultType& fault) { return fault.profile.kind == FaultProfile::Kind::ramp; }

}  // namespace

FaultType as_motion_of_reading(const FaultType& fault) {
  FaultType out = fault;
  out.motion = -fault.seen;
  out.seen.resize(0, 0);
  out.of_reading = true;
  const auto reduced = [&](double magnitude) {
    const double kappa = fault.kappa(magnitude);
    return kappa / (1.0 + kappa);
  };
  out.range = {reduced(fault.range.lower), reduced(fault.range.upper)};
  out.per_kappa = 1.0;
  out.share_lost = false;
  return out;
}

bool OnsetRows::knows(const FaultType& fault, const Model& model) {
  if (fault.profile.kind != FaultProfile::Kind::step && !drifts(fault)) {
    return false;
  }
  if (fault.seen.size() == 0) {
    FaultType known = fault;
    known.held_effort = false;
    return polynomial(known, model);
  }
  const bool alone = fault.motion.size() == 0 && fault.slip.size() == 0 && fault.lateral == 0.0 &&
                     fault.effort.size() == 0 && fault.ground.size() == 0 && fault.offset.size() == 0 &&
                     fault.theta.size() == 0 && !fault.whole && !drifts(fault);
  return alone && polynomial(as_motion_of_reading(fault), model) &&
         (fault.seen * fault.seen - fault.seen).cwiseAbs().maxCoeff() <= 1e-12 * fault.seen.cwiseAbs().maxCoeff();
}

OnsetRows::OnsetRows(const FaultType& fault, const Model& model, const FilterDesign& design,
                     const ReferenceMotion& motion, std::size_t first, std::size_t end)
    : fault_(fault.seen.size() > 0 ? as_motion_of_reading(fault) : fault),
      model_(&model),
      design_(design),
      kernel_(design, motion.kind, motion.nominal_step),
      errors_(fault_, model, design, motion),
      encoder_(fault.seen.size() > 0),
      motion_(&motion),
      first_(first),
      end_(end),
      gain_(std::pow(design.alpha, design.order)),
      bound_{FaultSignals::none(model), FaultSignals::none(model), FaultSignals::none(model),
             FaultSignals::none(model)} {
  check::that(knows(fault, model), "fault '" + fault.name + "'", "a step or a drift");
  check::that(first < end && end <= motion.instants(), "instants", "a range of the motion");
  fault_.held_effort = false;
  step_ = fault_;
  step_.profile = {};
  way_.assign(end - first, 0.0);
  for (std::size_t k = first + 1; k < end; ++k) {
    way_[k - first] = way_[k - first - 1] + motion.step[k];
  }
  if (!motion.cuts.empty()) {
    kernel_.soften();
  }
  state_.assign(end - first, bound_);
  state_[0].z1.g1 = state_[0].fast.g1 = state_[0].soft.g1 = jump(first);
  take(step_);
}

void OnsetRows::take(const FaultType& fault) {
  FaultFilter filter(fault, *model_, design_, *motion_);
  filter.begin(first_);
  while (filter.instant() + 1 < end_ && filter.next()) {
    state_[filter.instant() - first_] = {filter.state(&filter::KernelBank::z1), filter.state(&filter::KernelBank::z2),
                                         filter.state(&filter::KernelBank::fast),
                                         filter.state(&filter::KernelBank::soft)};
  }
}

// The impulse that motion beyond v has where a step sets in, as far as rows hold it.
core::RowMatrix OnsetRows::jump(std::size_t k) const {
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(motion_->speed.rows());
  if (fault_.motion.size() > 0) {
    moved += fault_.motion * motion_->speed.col(static_cast<Eigen::Index>(k));
  }
  if (fault_.slip.size() > 0) {
    moved += fault_.slip;
  }
  core::RowMatrix out = FaultSignals::none(*model_).g1;
  for (const Term& term : model_->terms) {
    if (term.kind == Term::Kind::acceleration) {
      out(static_cast<Eigen::Index>(term.output), static_cast<Eigen::Index>(term.parameter)) +=
          motion_->held_jump(k) * term.scale * moved[static_cast<Eigen::Index>(term.coordinate)];
    }
  }
  return out;
}

// What is left at instant `to` of a state at instant `from`.
void OnsetRows::pass(State& state, std::size_t from, std::size_t to) const {
  while (from < to) {
    if (motion_->cut_at(from)) {
      state.z1 = sum(state.z1, -1.0, state.soft);
      state.fast = sum(state.fast, -1.0, state.soft);
      state.soft = FaultSignals::none(*model_);
    }
    std::size_t end = motion_->cuts.empty() ? to : from + 1;
    while (end < to && !motion_->cut_at(end)) {
      ++end;
    }
    const double x = way(from, end), decay = std::exp(-design_.beta * x);
    const FaultSignals none = FaultSignals::none(*model_);
    state.z2 = sum(sum(none, decay, state.z2), decay * x, state.z1);
    state.z1 = sum(none, decay, state.z1);
    state.fast = sum(none, std::exp(-kernel_.gamma() * x), state.fast);
    state.soft = sum(none, std::exp(-kernel_.lambda() * x), state.soft);
    from = end;
  }
}

// The state at instant `at` of a step that set in at `from`.
OnsetRows::State OnsetRows::left(std::size_t from, std::size_t at) const {
  const State& now = state_[at - first_];
  State before = state_[from - first_];
  const core::RowMatrix impulse = jump(from);
  before.z1.g1 -= impulse;
  before.fast.g1 -= impulse;
  if (!motion_->cuts.empty()) {
    before.soft.g1 -= impulse;
    pass(before, from, at);
    return {sum(now.z1, -1.0, before.z1), sum(now.z2, -1.0, before.z2), sum(now.fast, -1.0, before.fast),
            sum(now.soft, -1.0, before.soft)};
  }
  const double x = way(from, at), decay = std::exp(-design_.beta * x);
  return {sum(now.z1, -decay, before.z1), sum(sum(now.z2, -decay, before.z2), -decay * x, before.z1),
          sum(now.fast, -std::exp(-kernel_.gamma() * x), before.fast), now.soft};
}

// The same of a fault that was there before first_: nothing jumps.
OnsetRows::State OnsetRows::broken(std::size_t at) const {
  const FaultSignals none = FaultSignals::none(*model_);
  State impulse{none, none, none, none};
  impulse.z1.g1 = impulse.fast.g1 = jump(first_);
  if (!motion_->cuts.empty()) {
    impulse.soft.g1 = impulse.z1.g1;
  }
  pass(impulse, first_, at);
  const State& now = state_[at - first_];
  return {sum(now.z1, -1.0, impulse.z1), sum(now.z2, -1.0, impulse.z2), sum(now.fast, -1.0, impulse.fast),
          sum(now.soft, -1.0, impulse.soft)};
}

void OnsetRows::between(std::size_t a, std::size_t b) {
  check::that(a >= first_ && a < b && b + 1 < end_, "onset", "instants of the motion");
  s_ = b + 1;
  errors_.begin(s_);
  const FaultSignals none = FaultSignals::none(*model_);
  bound_ = {none, none, none, none};
  const std::size_t from = a > first_ ? a - 1 : a;
  const core::RowMatrix counted = jump(s_);
  const auto hold = [&](State state) {
    state.z1.g1 -= counted;
    state.fast.g1 -= counted;
    state.soft.g1 -= counted;
    raise(bound_.soft, state.soft);
    raise(bound_.z1, state.z1);
    raise(bound_.z2, state.z2);
    raise(bound_.fast, state.fast);
  };
  for (std::size_t k = from; k <= s_; ++k) {
    hold(left(k, s_));
  }
  if (a == first_) {
    hold(broken(s_));
  }
  // The speed's own error in the impulse.
  Eigen::VectorXd error = Eigen::VectorXd::Zero(motion_->speed.rows());
  if (fault_.motion.size() > 0) {
    error = fault_.motion.cwiseAbs() * errors_.at_onset();
  }
  for (const Term& term : model_->terms) {
    if (term.kind == Term::Kind::acceleration) {
      const auto i = static_cast<Eigen::Index>(term.output), j = static_cast<Eigen::Index>(term.parameter);
      const double by = std::abs(term.scale) * error[static_cast<Eigen::Index>(term.coordinate)];
      bound_.z1.g1(i, j) += by;
      bound_.fast.g1(i, j) += by;
      bound_.soft.g1(i, j) += by;
    }
  }
  if (drifts(fault_)) {
    uncertain_ = std::min(1.0, (motion_->instant[s_] - motion_->instant[from]) / fault_.profile.rise);
    for (FaultSignals* part : {&bound_.z1, &bound_.z2, &bound_.fast, &bound_.soft}) {
      part->g1 *= uncertain_;
      part->g2 *= uncertain_;
      part->c *= uncertain_;
    }
    drifting_.assign(end_ - s_, FaultSignals::none(*model_));
    FaultFilter filter(fault_, *model_, design_, *motion_);
    filter.begin(s_);
    while (filter.instant() + 1 < end_ && filter.next()) {
      FaultSignals& out = drifting_[filter.instant() - s_];
      for (std::size_t i = 0; i < model_->n(); ++i) {
        const FaultRow row = filter.row(i);
        const auto at = static_cast<Eigen::Index>(i), p = static_cast<Eigen::Index>(row.g1.size());
        out.g1.row(at) = Eigen::Map<const Eigen::RowVectorXd>(row.g1.data(), p);
        out.g2.row(at) = Eigen::Map<const Eigen::RowVectorXd>(row.g2.data(), p);
        out.c[at] = row.c;
      }
    }
  }
}

// Filtered, of a step that sets in at s_.
FaultSignals OnsetRows::filtered(std::size_t k) const {
  const State state = left(s_, k);
  if (design_.order == 1) {
    return {gain_ * state.z1.g1, gain_ * state.z1.g2, state.z1.s, gain_ * state.z1.c};
  }
  const double slow = gain_ * kernel_.slow(), quick = slow * kernel_.apart();
  const auto value = [&](const auto& z1, const auto& z2, const auto& fast) { return slow * z2 - quick * (z1 - fast); };
  return {value(state.z1.g1, state.z2.g1, state.fast.g1), value(state.z1.g2, state.z2.g2, state.fast.g2), state.z1.s,
          value(state.z1.c, state.z2.c, state.fast.c)};
}

OnsetRow OnsetRows::row(std::size_t k, std::size_t i) {
  check::that(k > s_ && k < end_, "instant", "one after the onset");
  const auto at = static_cast<Eigen::Index>(i), p = static_cast<Eigen::Index>(model_->p());
  const FaultSignals step = filtered(k);
  const FaultSignals& signals = drifts(fault_) ? drifting_[k - s_] : step;
  const double x = way(s_, k), decay = std::exp(-design_.beta * x);
  const SignatureErrors::Row& errors = errors_.row(k, i, x);
  OnsetRow out{{},
               signals.g1.row(at),
               signals.g2.row(at),
               errors.e1,
               errors.e2,
               signals.c[at],
               errors.ec,
               {gain_ * decay, design_.order == 2 ? gain_ * decay * x : 0.0,
                kernel_.apart() > 0.0 ? gain_ * std::exp(-kernel_.gamma() * x) : 0.0}};
  // An effort that reads too much says too little of what the robot may do between samples.
  out.e0 = Eigen::RowVectorXd::Zero(p);
  if (fault_.offset.size() > 0 && motion_->effort_dY.rows() > 0) {
    const auto row = static_cast<Eigen::Index>(k * model_->n() + i);
    out.e1 += fault_.offset.cwiseAbs().maxCoeff() * motion_->effort_dY.row(row);
    out.e0 = motion_->effort_doubt.row(row);
  }
  if (drifts(fault_)) {
    out.e1 += uncertain_ * step.g1.row(at).cwiseAbs();
    out.e2 += 2.0 * uncertain_ * step.g2.row(at).cwiseAbs();
    out.ec += uncertain_ * std::abs(step.c[at]);
  }
  return out;
}

// What is left of δ in the state is γ/(γ − β) (e^{−βx}(δz2 + x δz1) − (e^{−βx} δz1 − e^{−γx} δfast)/(γ − β)).
std::array<double, 3> OnsetRows::left_bounds(std::size_t i, double kappa, const Eigen::VectorXd& largest) const {
  const auto at = static_cast<Eigen::Index>(i);
  const auto size = [&](const FaultSignals& z) {
    return kTransition * (kappa * (z.g1.row(at).dot(largest) + z.c[at]) + kappa * kappa * z.g2.row(at).dot(largest));
  };
  if (design_.order == 1) {
    return {size(bound_.z1), 0.0, 0.0};
  }
  const double slow = kernel_.slow(), quick = slow * kernel_.apart();
  const double cut = motion_->cuts.empty() ? 0.0 : size(bound_.soft);  // of a cut behind s_
  const double z1 = size(bound_.z1) + cut;
  return {slow * size(bound_.z2) + quick * z1, slow * z1, quick * (size(bound_.fast) + cut)};
}

std::array<double, 3> OnsetRows::offset_left_bounds(std::size_t i, double size) const {
  const double effort = size * std::abs(fault_.offset[static_cast<Eigen::Index>(i)]);
  const double memory = 1.0 / design_.beta;
  if (design_.order == 1) {
    return {memory * effort, 0.0, 0.0};
  }
  const double slow = kernel_.slow(), quick = slow * kernel_.apart();
  const double short_memory = quick > 0.0 ? 1.0 / kernel_.gamma() : 0.0;
  return {(slow * memory * memory + quick * memory) * effort, slow * memory * effort, quick * short_memory * effort};
}

}  // namespace wheelwright::detector
