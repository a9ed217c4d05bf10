// SPDX-License-Identifier: Apache-2.0
/// \file
/// Criteria for a filter on a log: expected error of θ̂, or width of the thresholds.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/model.hpp"

namespace wheelwright::commission {

/// Criterion by which the filter is chosen. α cancels in each of them, since it scales both sides of (25) alike: α = β
/// throughout, for a static gain of 1.
enum class FilterCriterion {
  residual_over_torque,  ///< residual rms/torque rms: the largest β whose value is near the best one
  predicted_error,       ///< √(se_j² + bias_j²) of each parameter, geometric mean: the least
  threshold_width,       ///< width of the threshold over torque rms of each output, geometric mean: the least
};

/// Inputs of the criteria beside the log.
struct FilterCriterionOptions {
  std::optional<double> motion_noise;  ///< standard deviation of the motion column (rad for angles and the angles
                                       ///< behind mean speeds, else rad/s or m/s); nothing: no bias is predicted
  double bias_left = 1.0;  ///< share of the noise's bias that the estimator leaves: 1 for least squares, 0 for unbiased
                           ///< ones
  double step = 0.0;       ///< sampling step, s, for the noise
  double risk = 1e-3;      ///< of the extrapolated ē, over as many instants as the log has
};

/// The value of a criterion for one filter.
struct FilterValue {
  double criterion = 0.0;  ///< +∞ where the filter cannot be used
  Eigen::VectorXd parts;   ///< predicted_error: p, each parameter's, its unit, 0 where it is left out; threshold_width:
                           ///< n
};

/// Evaluates filters on a log, several in one walk. predicted_error takes one walk, threshold_width two.
///
/// predicted_error: least squares with weights of one over each output's residual rms; se_j is its standard error,
/// which holds the residual's level and autocorrelation and the information on θ_j beyond the other columns
/// (estimate.hpp); the bias by noise of the motion is −(G − N)⁻¹N θ̂ with G = Σ w²YᵀY and N what noise_gram says is
/// noise in it, without bound where more than nine tenths of a direction of G are noise. Columns that are zero or a
/// combination of the columns before them under any filter of the first evaluation are left out. Standard errors from a
/// short log are too small: in simulation by up to 30 % for friction at 20 s and β = 10, by less than 25 % at 80 s.
///
/// threshold_width, per output: 2(ē + t·√mean(YΣYᵀ))/torque rms, with ē extrapolated from the residual
/// (noise_level.hpp), Σ the covariance of θ̂, and t Student's quantile at 1 − risk: the share of the torque that a
/// fault must take to be certain, where the set of θ is as wide as the confidence in θ̂. Outputs are left out of the
/// mean of which no filter of the first evaluation explains half the torque, unless that is all.
class FilterEvaluation {
 public:
  /// Throws InvalidArgument for residual_over_torque (filter_choice.hpp), a negative noise or share, or a step that is
  /// not positive. The log must outlive it.
  FilterEvaluation(LogSource& log, const Model& model, const Measurement& measurement, FilterCriterion criterion,
                   const FilterCriterionOptions& options);
  /// One value for each of `designs`.
  [[nodiscard]] std::vector<FilterValue> operator()(const std::vector<FilterDesign>& designs);
  /// Walks over the log so far.
  [[nodiscard]] std::size_t walks() const { return walks_; }

 private:
  struct Fit;
  [[nodiscard]] std::vector<Fit> fit(const std::vector<FilterDesign>& designs);
  void leave_out(const std::vector<Fit>& fits);
  [[nodiscard]] FilterValue predicted_error(const Fit& fit) const;
  [[nodiscard]] std::vector<FilterValue> threshold_widths(const std::vector<Fit>& fits);

  LogSource* log_;
  Model model_;
  Measurement measurement_;
  FilterCriterion criterion_;
  FilterCriterionOptions options_;
  std::vector<bool> excluded_;   // parameters
  std::vector<bool> explained_;  // outputs
  std::size_t walks_ = 0;
};

}  // namespace wheelwright::commission
