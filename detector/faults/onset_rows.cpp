// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/onset_rows.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/check.hpp"

namespace wheelwright::detector {
namespace {

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
      entries_(model.n() * model.p()),
      width_(2 * entries_ + model.n()),
      gain_(std::pow(design.alpha, design.order)),
      bound_(parts * width_, 0.0) {
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
  find_jumps();
  states_.assign((end - first) * parts * width_, 0.0);
  for (const Part part : {z1, fast, soft}) {
    std::copy_n(jump(first), entries_, states_.begin() + static_cast<std::ptrdiff_t>(part * width_));
  }
  left_.resize(parts * width_);
  before_.resize(parts * width_);
  filtered_.resize(width_);
  take(step_);
}

void OnsetRows::take(const FaultType& fault) {
  FaultFilter filter(fault, *model_, design_, *motion_);
  filter.begin(first_);
  double* out = states_.data();
  const std::size_t n = model_->n();
  while (filter.instant() + 1 < end_ && filter.next_state()) {
    out = states_.data() + (filter.instant() - first_) * parts * width_;
    for (const double* from : {filter.bank().z1(), filter.bank().z2(), filter.bank().fast(), filter.bank().soft()}) {
      std::copy_n(from, 2 * entries_, out);
      std::copy_n(from + 3 * entries_, n, out + 2 * entries_);
      out += width_;
    }
  }
}

// The impulses that motion beyond v has where a step sets in, as far as rows hold it.
void OnsetRows::find_jumps() {
  jumps_.assign((end_ - first_) * entries_, 0.0);
  if (fault_.motion.size() == 0 && fault_.slip.size() == 0) {
    return;
  }
  Eigen::VectorXd moved(motion_->speed.rows());
  for (std::size_t k = first_; k < end_; ++k) {
    moved.setZero();
    if (fault_.motion.size() > 0) {
      moved.noalias() += fault_.motion * motion_->speed.col(static_cast<Eigen::Index>(k));
    }
    if (fault_.slip.size() > 0) {
      moved += fault_.slip;
    }
    double* out = jumps_.data() + (k - first_) * entries_;
    for (const Term& term : model_->terms) {
      if (term.kind == Term::Kind::acceleration) {
        out[term.output * model_->p() + term.parameter] +=
            motion_->held_jump(k) * term.scale * moved[static_cast<Eigen::Index>(term.coordinate)];
      }
    }
  }
}

// What is left at instant `to` of a state at instant `from`.
void OnsetRows::pass(std::vector<double>& state, std::size_t from, std::size_t to) const {
  double *slow1 = state.data() + z1 * width_, *slow2 = state.data() + z2 * width_,
         *quick = state.data() + fast * width_, *cut = state.data() + soft * width_;
  while (from < to) {
    if (motion_->cut_at(from)) {
      for (std::size_t e = 0; e < width_; ++e) {
        slow1[e] -= cut[e];
        quick[e] -= cut[e];
        cut[e] = 0.0;
      }
    }
    std::size_t end = motion_->cuts.empty() ? to : from + 1;
    while (end < to && !motion_->cut_at(end)) {
      ++end;
    }
    const double x = way(from, end), decay = std::exp(-design_.beta * x), shift = decay * x;
    const double fades = std::exp(-kernel_.gamma() * x), softens = std::exp(-kernel_.lambda() * x);
    for (std::size_t e = 0; e < width_; ++e) {
      slow2[e] = decay * slow2[e] + shift * slow1[e];
      slow1[e] *= decay;
      quick[e] *= fades;
      cut[e] *= softens;
    }
    from = end;
  }
}

// The state at instant `at` of a step that set in at `from`.
void OnsetRows::left(std::size_t from, std::size_t at, std::vector<double>& out) {
  const double *now = state(at), *impulse = jump(from);
  std::copy_n(state(from), before_.size(), before_.begin());
  double *slow1 = before_.data() + z1 * width_, *slow2 = before_.data() + z2 * width_,
         *quick = before_.data() + fast * width_, *cut = before_.data() + soft * width_;
  const bool cuts = !motion_->cuts.empty();
  for (std::size_t e = 0; e < entries_; ++e) {
    slow1[e] -= impulse[e];
    quick[e] -= impulse[e];
    cut[e] -= cuts ? impulse[e] : 0.0;
  }
  if (cuts) {
    pass(before_, from, at);
    for (std::size_t e = 0; e < out.size(); ++e) {
      out[e] = now[e] - before_[e];
    }
    return;
  }
  const double x = way(from, at), decay = std::exp(-design_.beta * x), shift = -decay * x;
  const double fades = std::exp(-kernel_.gamma() * x);
  for (std::size_t e = 0; e < width_; ++e) {
    out[z1 * width_ + e] = now[z1 * width_ + e] - decay * slow1[e];
    out[z2 * width_ + e] = (now[z2 * width_ + e] - decay * slow2[e]) + shift * slow1[e];
    out[fast * width_ + e] = now[fast * width_ + e] - fades * quick[e];
    out[soft * width_ + e] = now[soft * width_ + e];
  }
}

// The same of a fault that was there before first_: nothing jumps.
void OnsetRows::broken(std::size_t at, std::vector<double>& out) {
  std::ranges::fill(before_, 0.0);
  for (const Part part : {z1, fast, soft}) {
    if (part != soft || !motion_->cuts.empty()) {
      std::copy_n(jump(first_), entries_, before_.begin() + static_cast<std::ptrdiff_t>(part * width_));
    }
  }
  pass(before_, first_, at);
  const double* now = state(at);
  for (std::size_t e = 0; e < out.size(); ++e) {
    out[e] = now[e] - before_[e];
  }
}

void OnsetRows::between(std::size_t a, std::size_t b) {
  check::that(a >= first_ && a < b && b + 1 < end_, "onset", "instants of the motion");
  s_ = b + 1;
  filtered_at_ = 0;
  errors_.begin(s_);
  std::ranges::fill(bound_, 0.0);
  const std::size_t from = a > first_ ? a - 1 : a;
  const double* counted = jump(s_);
  const auto hold = [&] {
    for (const Part part : {z1, fast, soft}) {
      for (std::size_t e = 0; e < entries_; ++e) {
        left_[part * width_ + e] -= counted[e];
      }
    }
    for (std::size_t e = 0; e < bound_.size(); ++e) {
      bound_[e] = std::max(bound_[e], std::abs(left_[e]));
    }
  };
  for (std::size_t k = from; k <= s_; ++k) {
    left(k, s_, left_);
    hold();
  }
  if (a == first_) {
    broken(s_, left_);
    hold();
  }
  // The speed's own error in the impulse.
  Eigen::VectorXd error = Eigen::VectorXd::Zero(motion_->speed.rows());
  if (fault_.motion.size() > 0) {
    error = fault_.motion.cwiseAbs() * errors_.at_onset();
  }
  for (const Term& term : model_->terms) {
    if (term.kind == Term::Kind::acceleration) {
      const double by = std::abs(term.scale) * error[static_cast<Eigen::Index>(term.coordinate)];
      for (const Part part : {z1, fast, soft}) {
        bound_[part * width_ + term.output * model_->p() + term.parameter] += by;
      }
    }
  }
  if (drifts(fault_)) {
    uncertain_ = std::min(1.0, (motion_->instant[s_] - motion_->instant[from]) / fault_.profile.rise);
    for (double& bound : bound_) {
      bound *= uncertain_;
    }
    drifting_.assign((end_ - s_) * width_, 0.0);
    FaultFilter filter(fault_, *model_, design_, *motion_);
    filter.begin(s_);
    while (filter.instant() + 1 < end_ && filter.next_state()) {
      double* out = drifting_.data() + (filter.instant() - s_) * width_;
      const FaultSignals& signals = filter.filtered();
      std::copy_n(signals.g1.data(), entries_, out);
      std::copy_n(signals.g2.data(), entries_, out + entries_);
      std::copy_n(signals.c.data(), signals.c.size(), out + 2 * entries_);
    }
  }
}

// Filtered, of a step that sets in at s_.
void OnsetRows::filter_at(std::size_t k) {
  if (k == filtered_at_) {
    return;
  }
  filtered_at_ = k;
  left(s_, k, left_);
  const double *slow1 = left_.data() + z1 * width_, *slow2 = left_.data() + z2 * width_,
               *rapid = left_.data() + fast * width_;
  if (design_.order == 1) {
    for (std::size_t e = 0; e < width_; ++e) {
      filtered_[e] = gain_ * slow1[e];
    }
    return;
  }
  const double slow = gain_ * kernel_.slow(), quick = slow * kernel_.apart();
  for (std::size_t e = 0; e < width_; ++e) {
    filtered_[e] = slow * slow2[e] - quick * (slow1[e] - rapid[e]);
  }
}

void OnsetRows::row(std::size_t k, std::size_t i, OnsetRow& out) {
  check::that(k > s_ && k < end_, "instant", "one after the onset");
  using Entries = Eigen::Map<const Eigen::RowVectorXd>;
  const auto p = static_cast<Eigen::Index>(model_->p());
  filter_at(k);
  const auto g1 = [&](const double* of) { return Entries(of + i * model_->p(), p); };
  const auto g2 = [&](const double* of) { return Entries(of + entries_ + i * model_->p(), p); };
  const double *step = filtered_.data(),
               *signals = drifts(fault_) ? drifting_.data() + (k - s_) * width_ : filtered_.data();
  const double x = way(s_, k), decay = std::exp(-design_.beta * x);
  const SignatureErrors::Row& errors = errors_.row(k, i, x);
  out.g1 = g1(signals);
  out.g2 = g2(signals);
  out.e1 = errors.e1;
  out.e2 = errors.e2;
  out.c = signals[2 * entries_ + i];
  out.ec = errors.ec;
  out.left = {gain_ * decay, design_.order == 2 ? gain_ * decay * x : 0.0,
              kernel_.apart() > 0.0 ? gain_ * std::exp(-kernel_.gamma() * x) : 0.0};
  // An effort that reads too much says too little of what the robot may do between samples.
  out.e0.setZero(p);
  if (fault_.offset.size() > 0 && motion_->effort_dY.rows() > 0) {
    const auto row = static_cast<Eigen::Index>(k * model_->n() + i);
    out.e1 += fault_.offset.cwiseAbs().maxCoeff() * motion_->effort_dY.row(row);
    out.e0 = motion_->effort_doubt.row(row);
  }
  if (drifts(fault_)) {
    out.e1 += uncertain_ * g1(step).cwiseAbs();
    out.e2 += 2.0 * uncertain_ * g2(step).cwiseAbs();
    out.ec += uncertain_ * std::abs(step[2 * entries_ + i]);
  }
}

// What is left of δ in the state is γ/(γ − β) (e^{−βx}(δz2 + x δz1) − (e^{−βx} δz1 − e^{−γx} δfast)/(γ − β)).
std::array<double, 3> OnsetRows::left_bounds(std::size_t i, double kappa, const Eigen::VectorXd& largest) const {
  using Entries = Eigen::Map<const Eigen::RowVectorXd>;
  const auto p = static_cast<Eigen::Index>(model_->p());
  const auto size = [&](Part part) {
    const double* of = bound_.data() + part * width_;
    const Entries g1(of + i * model_->p(), p), g2(of + entries_ + i * model_->p(), p);
    return kTransition * (kappa * (g1.dot(largest) + of[2 * entries_ + i]) + kappa * kappa * g2.dot(largest));
  };
  if (design_.order == 1) {
    return {size(z1), 0.0, 0.0};
  }
  const double slow = kernel_.slow(), quick = slow * kernel_.apart();
  const double cut = motion_->cuts.empty() ? 0.0 : size(soft);  // of a cut behind s_
  const double near = size(z1) + cut;
  return {slow * size(z2) + quick * near, slow * near, quick * (size(fast) + cut)};
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
