// SPDX-License-Identifier: Apache-2.0
/// \file
/// The limit that no residual can beat: is there any θ in P and any admissible noise that explains the raw samples?
///
/// Raw samples φ = φ° + n, |n| <= n̄_φ, and τ = τ° + n_τ, |n_τ| <= n̄_τ, obey the sparse equations of
/// raw_equations.hpp. Since φ enters linearly (dry friction apart), with D_j the column of θ_j
///
///     Y(φ° )θ = Y(φ)θ − Σ_j θ_j D_j(n).
///
/// **Relaxation.** z^j = θ_j n has |z^j_k| <= θ_j n̄. To let every column have a z^j of its own makes the set of
/// explanations larger and a linear program of the question. What the program denies is therefore denied. What is lost
/// is that all columns share one n: little where one of them (the acceleration's, of weight 1/h²) dominates; the
/// bracket below measures it.
///
/// **Test.** A healthy robot explains u over a window unless some weights λ of its equations show
///
///     λᵀu > h(y + Δ) + n̄   or   λᵀu < −h(−y + Δ) − n̄,      y = λᵀY,  Δ_j = n̄_φ Σ_k |(D_jᵀλ)_k|,  n̄ = n̄_τ Σ_k
///     |(Tᵀλ)_k|,
///
/// T the weights of the efforts: the two-sided threshold of detector/threshold.hpp for the best residual that is linear
/// in the samples. The program finds λ; that λ proves what is claimed is then evaluated with outward rounding, so that
/// the solver's tolerance can make the test miss something, never accuse a healthy robot.
///
/// **Limit.** For a motion φ° as the encoders of a healthy robot would show it, a fault of size κ is seen for certain,
/// by any test whatever, if and only if no healthy robot could have given the same samples: there are no θ°, θ in P
/// with
///
///     Y(φ° + κ seen + d)θ = (Y + κ g1 + κ² g2)(φ°)θ° + κ c + e,       |d| <= 2n̄_φ,  |e| <= 2n̄_τ
///
/// (fault_rows.hpp's signature, unfiltered). If there are, that healthy robot and this faulty one can give one and the
/// same log, with half of d and e in each. If there are none, consistent() sees it. With d relaxed and κ fixed this is
/// a linear program again, whose λ gives a row as fault_margin.hpp judges it: (λᵀY, λᵀg1, …, Δ, n̄), with supports of P
/// from linear programs that are certified. **For one λ the certain
/// sizes up to a largest one form one interval** (fault_margin.hpp: quadratics that are convex, or concave and not
/// positive at 0), so a descent closes in from above: λ from the program at κ, then the smallest κ that λ proves, and
/// so on. Each step proves all sizes between its two ends, hence every size from the last one up to the first: a chain
/// replaces the bisection, and rounding stays on the safe side. The sizes that can be proved need not be all above one,
/// so the limit is that of the sizes connected to the largest one, as everywhere in margins.hpp.
///
/// **Bracket.** `upper` is proved. Fix θ at a member of P (the one that the last program came up with): d is then
/// shared by all columns, linearly, and the program is exact. Where it finds an explanation at κ, sizes of κ are not
/// certain: `lower`. Functions of the motion are then taken at their measured values.
///
/// A stretch before the onset, healthy, is part of the window: it helps to pin θ down, and errors to taper off.
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include <Eigen/Core>

#include "bounds/polytope.hpp"
#include "detector/faults/reference_motion.hpp"
#include "model/fault_type.hpp"
#include "tests/benchmarks/limit/raw_equations.hpp"
#include "tests/benchmarks/limit/separation.hpp"

namespace wheelwright::bench {

/// Verdict on a window of samples: explained by a healthy robot or not.
struct Consistency {
  bool refuted = false;      ///< proved: no θ in P and no admissible noise explains the samples
  double unexplained = 0.0;  ///< share of the deviation from the centre of P that no explanation of the relaxed program
                             ///< covers, to the solver's tolerance; <= 0 where there is one
  Eigen::VectorXd theta;     ///< the θ that comes closest
  Eigen::VectorXd weights;   ///< λ, one for each row of the equations
};

/// The limit of a fault on one side from one onset on. Sizes are magnitudes of FaultType, absolute.
struct DetectableSize {
  double upper =
      std::numeric_limits<double>::infinity();  ///< proved: every size from here up to the end of the fault's
                                                ///< range is seen for certain; infinite where none is
  double lower = 0.0;        ///< at this size a healthy explanation was found (to the solver's tolerance)
  Eigen::VectorXd weights;   ///< λ of the proof of `upper`, one for each row of the equations
  std::size_t programs = 0;  ///< linear programs that it took
};

/// Effort limits of the search.
struct ConsistencyOptions {
  double before = 0.5;          ///< s of healthy samples before the onset, as far as the segment has them
  double tolerance = 1e-3;      ///< the descent ends where it gains less than this share
  std::size_t most_steps = 30;  ///< of the descent
};

/// The consistency test. One object serves one thread; off-line.
class ConsistencyTest {
 public:
  /// `sensors` bounds the errors of raw samples: of angles also where the log has mean speeds. `set` is P.
  ConsistencyTest(Model model, filter::Measurement measurement, filter::SensorErrors sensors, Polytope set,
                  ConsistencyOptions options = {});

  /// Asks for the samples between the instants `first` and `last` of `motion`; `effort` (joints × rows of the log) as
  /// read_efforts() gives it.
  [[nodiscard]] Consistency consistent(const detector::ReferenceMotion& motion, const Eigen::MatrixXd& effort,
                                       std::size_t first, std::size_t last);

  /// The smallest size of `fault` (`side` 1: positive, −1: negative magnitudes) that any test could see for certain
  /// within `window` s of its onset at an instant of `motion`. A fault that is there or not is asked for at its one
  /// size.
  [[nodiscard]] DetectableSize smallest_detectable(const detector::ReferenceMotion& motion, const FaultType& fault,
                                                   double side, std::size_t onset, double window);

  [[nodiscard]] const Polytope& set() const { return set_; }

 private:
  [[nodiscard]] std::vector<Disturbance> relaxed(const RawEquations& equations, double times) const;
  [[nodiscard]] std::vector<Disturbance> exact(const RawEquations& equations, const Eigen::VectorXd& theta,
                                               double times) const;

  Model model_;
  filter::Measurement measurement_;
  filter::SensorErrors sensors_;
  ConsistencyOptions options_;
  Polytope set_;
  Eigen::VectorXd largest_;  // |θ_j| over P
};

}  // namespace wheelwright::bench
