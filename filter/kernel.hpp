// SPDX-License-Identifier: Apache-2.0
/// \file
/// The weights of RegressorFilter and their recursion over steps of any length.
#pragma once

#include <algorithm>
#include <cmath>

#include <wheelwright/filter/design.hpp>
#include <wheelwright/filter/exact.hpp>
#include <wheelwright/filter/measurement.hpp>

namespace wheelwright {

/// One filtered signal: Σ q_k x_k^i e^{−βx_k} for i = 0 and 1, and Σ q_k e^{−γx_k}, over what went in at the times t − x_k.
struct KernelState {
  double z1 = 0.0;
  double z2 = 0.0;
  double fast = 0.0;
};

/// For speeds: f (24), or f₂ = f * f, as means over the steps. For angles and mean speeds: f₂ * γe^{−γt} at the samples,
/// γ = 2/(nominal step) and at least 4β. This smoothing by half a step spreads the newest angle over its neighbours, as
/// the mean over a step would, and needs no even steps; it has the area 1 and no sign, so that it raises neither the total
/// variation of f₂ nor that of its slope.
class FilterKernel {
 public:
  FilterKernel() = default;
  /// `nominal_step` (s) may be 0: then nothing is smoothed.
  FilterKernel(const FilterDesign& design, MotionKind motion, double nominal_step)
      : order_(design.order),
        beta_(design.beta),
        gain_(design.order == 1 ? design.alpha : design.alpha * design.alpha),
        nodes_(motion != MotionKind::speed),
        smooth_(nodes_ && design.order == 2 && nominal_step > 0.0) {
    if (smooth_) {
      gamma_ = std::max(2.0 / nominal_step, 4.0 * design.beta);
      const double apart = gamma_ - beta_;
      slow_ = gamma_ / apart;
      quick_ = gamma_ / (apart * apart);
    }
    prepare(0.0);
  }

  /// Whether signals enter at samples (angles) or over steps (speeds).
  [[nodiscard]] bool nodes() const { return nodes_; }
  /// α^order.
  [[nodiscard]] double gain() const { return gain_; }
  /// 1/s, 0 where nothing is smoothed.
  [[nodiscard]] double gamma() const { return gamma_; }
  /// e^{−βh} of the step that was prepared.
  [[nodiscard]] double decay() const { return weights_.decay(); }
  /// By how much the smoothing raises SlopeMajorant at most: γ/(γ − 2β), since P(x)e^{−x} falls no faster than e^{−2x}.
  [[nodiscard]] double majorant_gain() const { return smooth_ ? gamma_ / (gamma_ - 2.0 * beta_) : 1.0; }
  /// γ/(γ − β) and 1/(γ − β), s: weights of value() (1 and 0 where nothing is smoothed).
  [[nodiscard]] double slow() const { return slow_; }
  [[nodiscard]] double apart() const { return smooth_ ? 1.0 / (gamma_ - beta_) : 0.0; }

  /// The next steps have the length `h` (s).
  void prepare(double h) {
    if (h != step_) {
      step_ = h;
      weights_ = StepWeights(beta_, h);
      fast_ = smooth_ ? std::exp(-gamma_ * h) : 0.0;
    }
  }

  /// For nodes: an impulse `q` now, and then a step. For speeds: a step over which the integral of the signal is `q`.
  void take(KernelState& s, double q) const {
    if (nodes_) {
      s.z1 += q;
      s.z2 = weights_.decay() * (s.z2 + step_ * s.z1);
      s.z1 = weights_.decay() * s.z1;
      s.fast = fast_ * (s.fast + q);
    } else {
      s.z2 = weights_.decay() * (s.z2 + step_ * s.z1) + weights_.increment2() * q;
      s.z1 = weights_.decay() * s.z1 + weights_.increment1() * q;
    }
  }

  /// The filtered signal now.
  [[nodiscard]] double value(const KernelState& s) const {
    return order_ == 1 ? gain_ * s.z1 : smooth_ ? gain_ * (slow_ * s.z2 - quick_ * (s.z1 - s.fast)) : gain_ * s.z2;
  }

 private:
  int order_ = 2;
  double beta_ = 1.0;
  double gain_ = 1.0;
  bool nodes_ = false;
  bool smooth_ = false;
  double gamma_ = 0.0, slow_ = 1.0, quick_ = 0.0;
  double step_ = -1.0, fast_ = 0.0;
  StepWeights weights_;
};

}  // namespace wheelwright
