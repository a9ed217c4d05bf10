// SPDX-License-Identifier: Apache-2.0
/// \file
/// The limit at a stated risk: the smallest fault that any test could see as often as not, were everything known but
/// the drive and whether the fault is there.
///
/// Raw samples are those of raw_equations.hpp, with errors that are independent and Gaussian of given standard
/// deviations. With θ known the equations leave e = Tτ − Y(φ)θ, of covariance
///
///     C = σ_φ² D Dᵀ + σ_τ² T Tᵀ,      D = Σ_j θ_j D_j
///
/// and mean 0 where the robot is healthy, μ(κ) = κ((g1 − s)θ + c) + κ² g2 θ where it is not. Nothing is assumed of the
/// drive, so e is all that a test can stand on. Which sample the fault sets in with, its kind, sign and size are known,
/// too: the most powerful test is the likelihood ratio's (Neyman and Pearson 1933), and sees a fault with probability
/// 1/2 where √(μᵀC⁻¹μ) is the quantile z of its risk. A detector that raises r false alarms in a second raises one in
/// a window of T s with probability rT at most, hence sees no smaller fault than that test at the risk rT.
///
/// Among errors of the same deviation the Gaussian's are the hardest: their Fisher information of a shift is the
/// smallest. Those of another law may show smaller faults than this limit, to a test that knows the law.
#pragma once

#include <Eigen/Core>

#include "detector/faults/reference_motion.hpp"
#include "model/fault_type.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::bench {

/// What is asked of the most powerful test.
struct LikelihoodQuestion {
  double risk = 1e-8;   ///< probability of a false alarm in the window, in (0, 1/2)
  double window = 5.0;  ///< s after the onset
  double before = 5.0;  ///< s of healthy samples before it, as far as the segment has them
};

/// z with P(Z > z) = `risk` for a standard normal Z.
[[nodiscard]] double upper_quantile(double risk);

/// The smallest magnitude (absolute) of `fault` on one side that the test sees with probability 1/2, from the onset at
/// an instant of `motion` (without errors) on; infinite where none is in the fault's range. `deviations` are standard
/// deviations: of angles also where the log has mean speeds. Throws InvalidArgument as raw_equations() does.
[[nodiscard]] double likelihood_limit(const Model& model, const filter::Measurement& measurement,
                                      const filter::SensorErrors& deviations, const Eigen::VectorXd& theta,
                                      const detector::ReferenceMotion& motion, const model::FaultType& fault,
                                      double side, std::size_t onset, const LikelihoodQuestion& question = {});

}  // namespace wheelwright::bench
