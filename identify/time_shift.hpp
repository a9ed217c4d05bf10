// SPDX-License-Identifier: Apache-2.0
/// \file
/// Delay and first-order lag between effort and motion, as separable models over filtered rows.
#pragma once

#include <cstddef>
#include <vector>

#include "core/regression.hpp"
#include "identify/variable_projection.hpp"

namespace wheelwright::identify {

/// Time effect between effort and motion. With y the effort as logged and Yθ the effort that the motion needs:
enum class TimeEffect {
  delay,         ///< y(t) = (Yθ)(t − T): for T > 0 the logged effort comes late, for T < 0 the motion does
  effort_lag,    ///< T ẏ + y = Yθ: the effort's sensor is slow
  actuator_lag,  ///< y = Yθ + T d(Yθ)/dt: what is logged is a command that the actuator follows slowly
};

/// y ≈ Φ(T)θ with the one shape parameter T, s. The effects are linear and do not change in time, so they commute with
/// the torque filter and are applied to filtered rows, sample by sample:
///
///   delay          Φ(T)_k = Y_f(t_k − T), between samples by cubic Hermite interpolation (Catmull and Rom's slopes)
///   effort_lag     Φ(T) = L_T Y_f with L_T the lag 1/(1 + Ts), exact for Y_f linear between samples
///   actuator_lag   L_a y_f = (1 − T/a) L_a Y_f + (T/a) Y_f, exactly the same equation after a further lag of fixed
///                  time constant a on both sides, which spares a derivative
///
/// Nothing is drawn across a segment: rows whose sample numbers do not follow on each other start a new one. Rows are
/// left out where the shift would need rows outside of their segment, or before six of the longest lag are over.
class TimeShiftedRows final : public SeparableModel {
 public:
  /// Bounds of T, s: lower < upper, and lower >= 0 for a lag. Throws InvalidArgument otherwise, or when no row is left.
  TimeShiftedRows(const RegressionBlock& rows, TimeEffect effect, double lower, double upper);

  [[nodiscard]] const Eigen::VectorXd& response() const override { return response_; }
  [[nodiscard]] std::size_t outputs() const override { return outputs_; }
  [[nodiscard]] Eigen::Index shapes() const override { return 1; }
  [[nodiscard]] Eigen::Index columns() const override { return Y_.cols(); }
  bool evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const override;
  /// Instants that are used, as numbers into the rows.
  [[nodiscard]] const std::vector<std::size_t>& instants() const { return kept_; }
  /// Bounds of T with which variable_projection() is to be called.
  [[nodiscard]] VariableProjectionOptions options() const;

 private:
  TimeEffect effect_;
  double lower_, upper_;
  std::size_t outputs_;
  std::vector<double> t_;
  std::vector<std::size_t> starts_;  // of segments, and the end
  std::vector<std::size_t> kept_;
  std::vector<bool> keep_;
  core::RowMatrix Y_;
  core::RowMatrix lagged_;  // actuator_lag: L_a Y_f
  Eigen::VectorXd response_;
};

}  // namespace wheelwright::identify
