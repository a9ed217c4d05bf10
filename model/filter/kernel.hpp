// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exact discretisation of the filters f(t) = α e^{−βt} (24) and f₂(t) = α² t e^{−βt} (f twice) for steps of any
/// length.
///
/// Both are cascades of z' = −βz + u. Over a step h on which u is a polynomial of degree <= 1 the update is a linear
/// combination of the state and the ends of u, with weights made of I_n(x) = ∫₀¹ wⁿ e^{−xw} dw, x = βh. There is no
/// discretisation error beyond how u is taken to behave inside the step.
/// The weights of RegressorFilter and their recursion over steps of any length.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "model/filter/measurement.hpp"

namespace wheelwright::filter {

/// I_0, I_1 and I_2 at x >= 0, each to a few units in the last place: a series for I_2 below 1 and the downward
/// recurrence I_{n−1} = (x I_n + e^{−x})/n, closed forms above.
struct ExponentialMoments {
  double decay = 1.0;  ///< e^{−x}
  double i0 = 1.0;
  double i1 = 0.5;
  double i2 = 1.0 / 3.0;
};

/// The moments at x = βh >= 0.
inline ExponentialMoments exponential_moments(double x) {
  ExponentialMoments m;
  m.decay = std::exp(-x);
  if (x < 1.0) {
    double term = 1.0;
    double sum = 1.0 / 3.0;
    for (int k = 1; k <= 18; ++k) {
      term *= -x / k;
      sum += term / (k + 3);
    }
    m.i2 = sum;
    m.i1 = 0.5 * (x * m.i2 + m.decay);
    m.i0 = x * m.i1 + m.decay;
  } else {
    m.i0 = (1.0 - m.decay) / x;
    m.i1 = (m.i0 - m.decay) / x;
    m.i2 = (2.0 * m.i1 - m.decay) / x;
  }
  return m;
}

/// The weights of one step of length h. Recomputed only when h changes.
class StepWeights {
 public:
  StepWeights() = default;
  /// Weights of the step `h` >= 0 (s) for β > 0 (1/s).
  StepWeights(double beta, double h) : h_(h), m_(exponential_moments(beta * h)) {}

  [[nodiscard]] double step() const { return h_; }
  [[nodiscard]] double decay() const { return m_.decay; }
  /// z1 += over a step with constant u: weight of u.
  [[nodiscard]] double held1() const { return h_ * m_.i0; }
  /// z2 += over a step with constant u: weight of u.
  [[nodiscard]] double held2() const { return h_ * h_ * m_.i1; }
  /// z1 += over a step with linear u: weights of its beginning and end.
  [[nodiscard]] double begin1() const { return h_ * m_.i1; }
  [[nodiscard]] double end1() const { return h_ * (m_.i0 - m_.i1); }
  /// z2 += over a step with linear u: weights of its beginning and end.
  [[nodiscard]] double begin2() const { return h_ * h_ * m_.i2; }
  [[nodiscard]] double end2() const { return h_ * h_ * (m_.i1 - m_.i2); }
  /// z1 += and z2 += over a step on which u' is constant, per unit of the increment of u: the filters of u'.
  [[nodiscard]] double increment1() const { return m_.i0; }
  [[nodiscard]] double increment2() const { return h_ * m_.i1; }

 private:
  double h_ = 0.0;
  ExponentialMoments m_;
};

/// The state of the cascade z1' = −βz1 + u, z2' = −βz2 + z1, both zero at the start of a segment.
struct Cascade {
  double z1 = 0.0;
  double z2 = 0.0;

  /// One step on which u adds `add1` to z1 and `add2` to z2.
  void advance(const StepWeights& w, double add1, double add2) {
    z2 = w.decay() * (z2 + w.step() * z1) + add2;
    z1 = w.decay() * z1 + add1;
  }
  /// One step with constant u.
  void held(const StepWeights& w, double u) { advance(w, w.held1() * u, w.held2() * u); }
  /// One step with linear u from `begin` to `end`.
  void linear(const StepWeights& w, double begin, double end) {
    advance(w, w.begin1() * begin + w.end1() * end, w.begin2() * begin + w.end2() * end);
  }
  /// One step of the cascade driven by u' where u grows linearly by `by`.
  void increment(const StepWeights& w, double by) { advance(w, w.increment1() * by, w.increment2() * by); }
};

/// A number that only fades ends as a denormal one, for ever, which takes a processor many times as long: every kFade
/// samples a filter takes what is smaller than kTrace for 0. That is far below the rounding of anything measured.
inline constexpr double kTrace = 0x1p-800;
inline constexpr std::size_t kFade = 64;

/// `x`, or 0 for a trace.
inline double faded(double x) { return std::abs(x) < kTrace ? 0.0 : x; }

/// Σ q_k P(x_k) e^{−x_k} with P(x) = 1 − x + x²/2, x_k = β(t − t_k), over impulses q_k >= 0 at the times t_k: at least
/// Σ q_k sup |1 − x| e^{−x} over x >= x_k, since |1 − x| <= P(x) and P(x)e^{−x} falls. α² times it bounds what the
/// slope of f₂ makes of the impulses.
struct SlopeMajorant {
  double s0 = 0.0;
  double s1 = 0.0;
  double s2 = 0.0;

  /// A step with x = βh and e^{−x} = `decay`, and then an impulse of area `q`.
  void advance(double decay, double x, double q) {
    s2 = decay * (s2 + x * (2.0 * s1 + x * s0));
    s1 = decay * (s1 + x * s0);
    s0 = decay * s0 + q;
  }
  [[nodiscard]] double value() const { return s0 - s1 + 0.5 * s2; }
  /// Forgets traces.
  void fade() {
    s0 = faded(s0);
    s1 = faded(s1);
    s2 = faded(s2);
  }
};

/// One filtered signal: Σ q_k x_k^i e^{−βx_k} for i = 0 and 1, and Σ q_k e^{−γx_k}, over what went in at the times t −
/// x_k.
struct KernelState {
  double z1 = 0.0;
  double z2 = 0.0;
  double fast = 0.0;
};

/// Many KernelStates, part by part, that take what is in `in` together and give what is in `out`: the digits that each
/// of them would have by itself, several at a time.
class KernelBank {
 public:
  KernelBank() = default;
  /// `signals` of them, in a segment that has not begun.
  explicit KernelBank(std::size_t signals) : rows_((signals + kLane - 1) / kLane * kLane), numbers_(6 * rows_, 0.0) {}

  /// `signals` each; what was written to in() stays there.
  [[nodiscard]] double* in() { return numbers_.data(); }
  [[nodiscard]] double* out() { return numbers_.data() + rows_; }
  [[nodiscard]] const double* out() const { return numbers_.data() + rows_; }
  [[nodiscard]] double* z1() { return numbers_.data() + 2 * rows_; }
  [[nodiscard]] double* z2() { return numbers_.data() + 3 * rows_; }
  [[nodiscard]] double* fast() { return numbers_.data() + 4 * rows_; }
  [[nodiscard]] const double* z1() const { return numbers_.data() + 2 * rows_; }
  [[nodiscard]] const double* z2() const { return numbers_.data() + 3 * rows_; }
  [[nodiscard]] const double* fast() const { return numbers_.data() + 4 * rows_; }
  /// Σ q_k e^{−λx_k} since the last cut(), of a FilterKernel that is soft.
  [[nodiscard]] double* soft() { return numbers_.data() + 5 * rows_; }
  [[nodiscard]] const double* soft() const { return numbers_.data() + 5 * rows_; }
  /// Lets the weight of what went into the first `signals` since the last cut end here, now and for ever: what it was
  /// to be, w(t − t_k), becomes w(t − t_k) − e^{−λx_k} w(t − now), x_k = now − t_k.
  void cut(std::size_t signals) {
    for (std::size_t k = 0; k < signals; ++k) {
      z1()[k] -= soft()[k];
      fast()[k] -= soft()[k];
      soft()[k] = 0.0;
    }
  }

  /// Forgets everything, in() too.
  void clear() { std::fill(numbers_.begin(), numbers_.end(), 0.0); }
  /// Forgets traces.
  void fade() { std::transform(z1(), numbers_.data() + numbers_.size(), z1(), faded); }

 private:
  friend class FilterKernel;
  static constexpr std::size_t kLane = 4;  // that are worked on without looking whether there are as many

  std::size_t rows_ = 0;
  std::vector<double> numbers_;
};

/// For speeds: f (24), or f₂ = f * f, as means over the steps. For angles and mean speeds: f₂ * γe^{−γt} at the
/// samples, γ = 2/(nominal step) and at least 4β. This smoothing by half a step spreads the newest angle over its
/// neighbours, as the mean over a step would, and needs no even steps; it has the area 1 and no sign, so that it raises
/// neither the total variation of f₂ nor that of its slope.
class FilterKernel {
 public:
  static constexpr double kSoft = 4.0;

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

  /// True if signals enter at samples (angles) or over steps (speeds).
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

  /// Keeps KernelBank::soft() of what goes in: λ is kSoft β. To be called before prepare().
  void soften() { lambda_ = smooth_ ? kSoft * beta_ : 0.0; }
  /// λ, 1/s; 0 where nothing is soft. A cut costs about 2λ of the weight there in the slope of the weights, and the
  /// signals of 1/λ.
  [[nodiscard]] double lambda() const { return lambda_; }
  /// e^{−λh} of the step that was prepared.
  [[nodiscard]] double soft_decay() const { return soft_; }

  /// The next steps have the length `h` (s).
  void prepare(double h) {
    if (h != step_) {
      step_ = h;
      weights_ = StepWeights(beta_, h);
      fast_ = smooth_ ? std::exp(-gamma_ * h) : 0.0;
      soft_ = lambda_ > 0.0 ? std::exp(-lambda_ * h) : 0.0;
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

  /// take() and value() of every signal of `bank`.
  void take(KernelBank& bank) const {
    using Lane = Eigen::Array<double, KernelBank::kLane, 1>;
    const double decay = weights_.decay(), step = step_, fast = fast_;
    for (std::size_t first = 0; first < bank.rows_; first += KernelBank::kLane) {
      const Lane in = Eigen::Map<const Lane>(bank.in() + first);
      Eigen::Map<Lane> z1(bank.z1() + first), z2(bank.z2() + first), rest(bank.fast() + first), out(bank.out() + first);
      if (nodes_) {
        const Lane sum = z1 + in;
        z2 = decay * (z2 + step * sum);
        z1 = decay * sum;
        rest = fast * (rest + in);
        if (lambda_ > 0.0) {
          Eigen::Map<Lane> soft(bank.soft() + first);
          soft = soft_ * (soft + in);
        }
      } else {
        z2 = decay * (z2 + step * z1) + weights_.increment2() * in;
        z1 = decay * z1 + weights_.increment1() * in;
      }
      if (order_ == 1) {
        out = gain_ * z1;
      } else if (smooth_) {
        out = gain_ * (slow_ * z2 - quick_ * (z1 - rest));
      } else {
        out = gain_ * z2;
      }
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
  double lambda_ = 0.0, soft_ = 0.0;
  double step_ = -1.0, fast_ = 0.0;
  StepWeights weights_;
};

}  // namespace wheelwright::filter
