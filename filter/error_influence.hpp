// SPDX-License-Identifier: Apache-2.0
/// \file
/// How far bounded errors of the sensors can move a sum over filtered rows.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/filter/design.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>
#include <wheelwright/model/model.hpp>

namespace wheelwright {

/// sup |Σ_k g_kᵀ e_k| over all errors of the sensors within their bounds, where e_k = y_k − Y_k θ are the residuals of rows.
/// Each error is weighted with what all rows together make of it (the adjoint of the filter), so that what averages out in
/// the sum does so here; a sum of the rows' own bounds would be many times as large. To first order in the errors, of the
/// terms that are linear in the motion, and with each block of rows on its own (never smaller for it).
class ErrorInfluence {
 public:
  /// For `sums` functionals at once. Shapes as in propagate().
  ErrorInfluence(const Model& model, const FilterDesign& design, const Measurement& measurement,
                 const SensorErrors& sensors, const Eigen::VectorXd& parameters, Eigen::Index sums);

  /// Adds rows, in their order, with the weights `g` (rows × sums).
  void add(const RegressionBlock& rows, const RowMatrix& g);

  /// The suprema, per functional.
  [[nodiscard]] const Eigen::VectorXd& value() const { return value_; }

 private:
  void step_back(double h);
  void count(double h);

  FilterDesign design_;
  bool angles_;
  SensorErrors sensors_;
  double nominal_;
  Eigen::MatrixXd input_;                      // outputs × joints
  Eigen::MatrixXd motion_;                     // coordinates × joints
  Eigen::MatrixXd acceleration_, speed_;       // coordinates × outputs: what θ makes of a coordinate's derivatives
  RowMatrix z1_, z2_;                          // outputs × sums
  RowMatrix now_, later_, rate_, rate_later_;  // adjoint signals
  Eigen::VectorXd value_;
};

}  // namespace wheelwright
