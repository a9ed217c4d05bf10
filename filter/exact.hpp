// SPDX-License-Identifier: Apache-2.0
/// \file
/// Exact discretisation of the filters f(t) = α e^{−βt} (24) and f₂(t) = α² t e^{−βt} (f twice) for steps of any length.
///
/// Both are cascades of z' = −βz + u. Over a step h on which u is a polynomial of degree <= 1 the update is a linear
/// combination of the state and the ends of u, with weights made of I_n(x) = ∫₀¹ wⁿ e^{−xw} dw, x = βh. There is no
/// discretisation error beyond how u is taken to behave inside the step.
#pragma once

#include <cmath>

namespace wheelwright {

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

/// Σ q_k P(x_k) e^{−x_k} with P(x) = 1 − x + x²/2, x_k = β(t − t_k), over impulses q_k >= 0 at the times t_k: at least
/// Σ q_k sup |1 − x| e^{−x} over x >= x_k, since |1 − x| <= P(x) and P(x)e^{−x} falls. α² times it bounds what the slope of f₂
/// makes of the impulses.
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
};

}  // namespace wheelwright
