// SPDX-License-Identifier: Apache-2.0
/// \file
/// Model equations on raw samples: one sparse equation per sampling interval and output, without a filter.
///
/// Multiply u = Yθ (20) by a weight g_k(t) of area one and integrate. With φ the joint angles, t_k the samples,
/// h_k = t_k − t_k−1, w_k = (φ_k − φ_k−1)/h_k and H_k = (h_k + h_k+1)/2, take for **angles** the hat on [t_k−1, t_k+1]
/// with its peak 1/H_k at t_k. Then, for steps of any length and without error,
///
///     ∫ g_k v̇ dt = (v(w_k+1) − v(w_k))/H_k
///     ∫ g_k τ dt = (h_k τ_k−1 + h_k+1 τ_k)/(2H_k)                                       zero-order hold
///                = (h_k τ_k−1/2 + (h_k + h_k+1) τ_k + h_k+1 τ_k+1/2)/(3H_k)             linear: 1/6, 4/6, 1/6
///                = the same less a parabola's curvature                                 curved: 1/12, 10/12, 1/12
///
/// and ∫ g_k v dt = (v(w_k) + v(w_k+1))/2 up to terms of second order in the step, as for functions of the motion. For
/// **mean speeds** w_k and w_k+1 stand in the log, and efforts are taken as RegressorFilter takes them, as for
/// **speeds**, where g_k is the box on [t_k, t_k+1]: τ_k (zero order) or (τ_k + τ_k+1)/2. The filter's rows are
/// weighted sums of these equations.
///
/// The sensors' errors enter by the sample: φ_k by |n| <= n̄_φ (for mean speeds the angle at the ends of an interval,
/// for speeds the speed), τ_k by |n| <= n̄_τ, functions of the motion by their own error bound.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "detector/faults/fault_rows.hpp"
#include "detector/faults/reference_motion.hpp"
#include "model/fault_type.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::bench {

/// One error, of one sample, with its weights in the equations.
struct ErrorSource {
  /// Where the error enters: `weight` times it, times θ of `parameter` for motion, is added to Yθ of row `row`.
  struct Entry {
    std::size_t row = 0;
    std::size_t parameter = 0;
    double weight = 0.0;
  };
  double bound = 0.0;  ///< |error| <= bound, unit of its signal
  std::vector<Entry> entries{};
};

/// The equations Y(φ)θ = u + ζ of a stretch of a drive; row (k·n + i) is output i of equation k, between the instants
/// first + k and first + k + 1 of the motion.
struct RawEquations {
  std::size_t outputs = 0;            ///< n
  std::size_t parameters = 0;         ///< p
  std::size_t first = 0;              ///< instant at which the stretch begins
  std::vector<double> length{};       ///< N: H_k, s
  core::RowMatrix Y{};                ///< N·n × p
  std::vector<ErrorSource> joint{};   ///< of the joints' motion: the same error in all columns of Y
  std::vector<ErrorSource> column{};  ///< the same, relaxed: every term of Y has errors of its own; one parameter each
  std::vector<ErrorSource> function{};  ///< of functions of the motion; one parameter each
  std::vector<ErrorSource> effort{};    ///< of the efforts, for u

  /// Number of equations N.
  [[nodiscard]] std::size_t count() const { return length.size(); }
  /// Number of rows N·n.
  [[nodiscard]] std::size_t rows() const { return length.size() * outputs; }
};

/// The equations between instants `first` and `last` of `motion` (one segment), with the errors of `sensors` (for mean
/// speeds and angles: of the angle). Throws InvalidArgument unless first < last are instants of one segment, and for a
/// measurement with a correction of its efforts.
[[nodiscard]] RawEquations raw_equations(const Model& model, const filter::Measurement& measurement,
                                         const filter::SensorErrors& sensors, const detector::ReferenceMotion& motion,
                                         std::size_t first, std::size_t last);

/// u of these equations from efforts (joints × rows of the log, read_efforts).
[[nodiscard]] Eigen::VectorXd raw_efforts(const RawEquations& equations, const Model& model,
                                          const filter::Measurement& measurement,
                                          const detector::ReferenceMotion& motion, const Eigen::MatrixXd& effort);

/// The effort columns of a log, joints × rows. Throws InvalidArgument for a missing column, or efforts without sign.
[[nodiscard]] Eigen::MatrixXd read_efforts(LogSource& log, const filter::Measurement& measurement);

/// Terms that a fault with onset at instant `onset` of the motion adds to these equations: matrices N·n × p, zero
/// before. Means of FaultFilter's signature over the intervals; what jumps at the onset is in the equation that ends
/// there. Throws InvalidArgument for a fault that needs a filtered value (FaultType::held_effort), or an onset that is
/// not inside the stretch.
[[nodiscard]] detector::FaultSignals raw_signature(const RawEquations& equations, const FaultType& fault,
                                                   const Model& model, const detector::ReferenceMotion& motion,
                                                   std::size_t onset);

}  // namespace wheelwright::bench
