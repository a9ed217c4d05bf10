// SPDX-License-Identifier: Apache-2.0
/// \file
/// Propagation of sensor noise through the filters: error bounds of the rows of the regression, and of sums over
/// filtered rows.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/model.hpp"

namespace wheelwright::filter {

/// Propagation that a bound rests on: worst case or statistical.
enum class NoiseMode {
  worst_case,   ///< for every noise |n(t)| <= n̄: L1 norm of the filter's kernel
  statistical,  ///< for independent zero-mean noise |n_k| <= n̄: Hoeffding's bound on the filtered sum, at a stated
                ///< confidence over all rows of a log together (union bound)
};

/// Bounds on the sensors' errors, units of the columns; 0 means exact (or "not declared": then the equation error that
/// is estimated from the data covers it).
struct SensorErrors {
  double motion = 0.0;   ///< n̄ of the motion column: rad for angles, rad/s for speeds; for mean speeds the *angle's*
                         ///< error at the interval's ends, rad (half a count)
  double effort = 0.0;   ///< n̄_τ
  double heading = 0.0;  ///< rad
};

/// Options of the worst case.
struct PropagationOptions {
  NoiseMode mode = NoiseMode::worst_case;
  double confidence = 0.999;  ///< statistical: probability that every row of the log obeys its bound
  double rows = 1e6;          ///< statistical: number of instants of a log that the confidence is about
  double largest_step = 0.0;  ///< statistical: largest sampling step, s (> 0)
};

/// Error bounds of filtered signals, ready to be written into rows.
struct SignalErrors {
  Eigen::VectorXd acceleration;  ///< per coordinate: of its filtered acceleration (empty: all zero)
  Eigen::VectorXd speed;         ///< per coordinate: of its filtered speed
  Eigen::VectorXd output;        ///< per output: of τ_f
  Eigen::VectorXd speed_sample;  ///< per coordinate: of its unfiltered speed, mean of a nominal step or sample
  double joint_sample = 0.0;     ///< of each joint's unfiltered speed, mean of a nominal step or sample
  double heading = 0.0;          ///< rad
  bool between_samples = false;  ///< dY and dy hold what motion and efforts may do between two samples as well
  bool held_between = false;     ///< dy holds what held efforts that change between samples may do there, in any case
  MotionBound motion{};          ///< how fast the motion can change between two samples
  bool interpolates = false;     ///< up to five rows that are lost are a step of angles or speeds like any other: held
      ///< efforts are the mean of those at its ends, in error by half their difference. For a fit,
      ///< where rows are lost so often that few are settled between
  bool bridges = false;  ///< where rows are lost a segment goes on (ElementFilter::bridges). Not for a fit, which takes
                         ///< the noise of all rows for alike
};

/// Norms of the kernels that turn a motion or effort error of size 1 into the error of a filtered signal.
struct KernelNorms {
  double acceleration = 0.0;
  double speed = 0.0;
  double effort = 0.0;
};

/// L1 norms (sup |f * n| over |n| <= 1), of the continuous kernels:
///   order 1, speeds:  f*n: α/β;  f*ṅ: 2α
///   order 2, angles:  f₂*n: α²/β²;  f₂*ṅ: 2α²/(eβ);  f₂*n̈: 2α²(1 + e⁻²)
///   order 2, speeds:  f₂*n: α²/β²;  f₂*ṅ: 2α²/(eβ)
/// For speeds f*n and f₂*n are exact, the others bound those of RegressorFilter's kernels for steps of any length:
/// these kernels interpolate f₂, or average it over steps, and neither raises the total variation of a function or of
/// its slope. The effort's norm is that of a long even log; where steps are uneven RegressorFilter follows the kernel's
/// area. What the beginning of a segment adds to f₂*n̈ is added by RegressorFilter, too.
[[nodiscard]] KernelNorms worst_case_norms(const FilterDesign& design, MotionKind motion);

/// L2 norms (root of the summed squares of the weights of all samples) for a constant step `step` (s), found by sending
/// a unit sample through the filter's recursion. For small βh: f*n: α√(h/(2β)), f*ṅ: about α, f₂*n: α²√(h/(4β³)),
/// f₂*ṅ: α²√(h/(4β)), f₂*n̈: about 0.68 α² (the three newest angles enter with 0.57, 0.37 and 0.05 of α²).
[[nodiscard]] KernelNorms statistical_norms(const FilterDesign& design, MotionKind motion, double step);

/// Second moments that independent sensor noise adds to the rows, for noise of variance 1.
struct NoiseGram {
  std::vector<Eigen::MatrixXd>
      motion;              ///< per output p × p: E δYᵀδY at one instant, noise of each joint's motion column
                           ///< (rad² for angles and the angles behind mean speeds, else (rad/s)²)
  Eigen::VectorXd effort;  ///< per output: variance of τ_f, noise of each joint's effort
};

/// Second moments that independent noise (from sample to sample and from joint to joint) adds to the rows of a settled
/// filter at a constant step `step` (s): what bias-compensated and total least squares take away. Terms that are
/// functions of the motion (dry friction) are taken as exact. Throws InvalidArgument unless `step` > 0.
[[nodiscard]] NoiseGram noise_gram(const Model& model, const FilterDesign& design, const Measurement& measurement,
                                   double step);

/// Bounds on the filtered signals for sensors with the errors `sensors`. Throws InvalidArgument on negative bounds, a
/// confidence outside (0, 1), or a missing largest step where it is needed.
[[nodiscard]] SignalErrors propagate(const Model& model, const FilterDesign& design, const Measurement& measurement,
                                     const SensorErrors& sensors, const PropagationOptions& options = {});

/// sup |Σ_k g_kᵀ e_k| over all errors of the sensors within their bounds, where e_k = y_k − Y_k θ are the residuals of
/// rows. Each error is weighted with what all rows together make of it (the adjoint of the filter), so that what
/// averages out in the sum does so here; a sum of the rows' own bounds would be many times as large. To first order in
/// the errors, of the terms that are linear in the motion, and with each block of rows on its own (never smaller for
/// it).
class ErrorInfluence {
 public:
  /// For `sums` functionals at once. Shapes as in propagate().
  ErrorInfluence(const Model& model, const FilterDesign& design, const Measurement& measurement,
                 const SensorErrors& sensors, const Eigen::VectorXd& parameters, Eigen::Index sums);

  /// Adds rows, in their order, with the weights `g` (rows × sums).
  void add(const RegressionBlock& rows, const core::RowMatrix& g);

  /// The suprema, per functional.
  [[nodiscard]] const Eigen::VectorXd& value() const { return value_; }

 private:
  void step_back(double h);
  void count(double h);

  FilterDesign design_;
  bool angles_;
  SensorErrors sensors_;
  double nominal_;
  Eigen::MatrixXd input_;                 // outputs × joints
  Eigen::MatrixXd motion_;                // coordinates × joints
  Eigen::MatrixXd acceleration_, speed_;  // coordinates × outputs: what θ makes of a coordinate's derivatives
  core::RowMatrix z1_, z2_;               // outputs × sums
  core::RowMatrix now_, later_, rate_, rate_later_;  // adjoint signals
  Eigen::VectorXd value_;
};

}  // namespace wheelwright::filter
