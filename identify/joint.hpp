// SPDX-License-Identifier: Apache-2.0
/// \file
/// One fit to several logs of a robot: parameters that are shared, and parameters of each log.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Whether one entry of θ_L is the same in all logs.
struct JointParameter {
  std::string name;
  bool shared = true;
};

/// A log of a joint fit.
struct JointLog {
  std::string name;
  RegressionSource* rows = nullptr;  ///< walked twice; must outlive the call
  Eigen::VectorXd addition;  ///< p, what is known to stand in θ_L of this log beyond the common part: r·Δm at the mass
                             ///< for a payload of the mass Δm; empty: nothing
  Eigen::VectorXd weights;  ///< w_i > 0 for each output (LeastSquares); empty: all one
};

/// Whether the logs agree on a shared parameter.
struct SharingTest {
  std::string parameter;
  bool tested = false;     ///< false: fewer than two logs know the parameter by themselves
  double statistic = 0.0;  ///< Welch's F
  double freedom_between = 0.0;
  double freedom_within = 0.0;
  double p_value = 1.0;            ///< probability of so large a statistic if the parameter is the same in all logs
  double adjusted_p = 1.0;         ///< the same, allowed for the number of parameters that were tested (Holm 1979)
  Eigen::VectorXd estimate;        ///< of each log by itself, its addition taken away
  Eigen::VectorXd standard_error;  ///< of each log by itself; 0 where it does not know the parameter
  std::string words;               ///< a sentence for people
};

/// Solution of min Σ_l Σ w² (y − Y(E_l φ + c_l))².
struct JointFit {
  std::vector<std::string> unknowns;  ///< names of φ: a shared parameter's own, else "parameter (log)"
  Eigen::VectorXd unknown;            ///< q, φ̂
  Eigen::MatrixXd covariance;  ///< q × q, of φ̂: logs are independent, residuals within a log may be autocorrelated
  Eigen::VectorXd standard_error;    ///< q, roots of its diagonal
  Eigen::VectorXd freedom;           ///< q, degrees of freedom of each one's Student's t (Satterthwaite 1946)
  int rank = 0;                      ///< numerical rank; directions without information are 0 in φ̂ in scaled columns
  Eigen::MatrixXd theta;             ///< p × logs, θ_l = E_l φ̂ + c_l
  double weighted_rss = 0.0;         ///< Σ over all logs
  std::vector<SharingTest> sharing;  ///< one for each shared parameter
  bool compatible = true;            ///< no adjusted p-value is below 0.05
  std::size_t instants = 0;
};

/// E_l (p × q): which unknown stands behind each parameter of log l.
[[nodiscard]] Eigen::MatrixXd joint_map(const std::vector<JointParameter>& parameters, std::size_t logs,
                                        std::size_t log);

/// The joint fit. Each log is reduced to its triangular factor in one pass (LeastSquares), so that nothing grows with
/// the logs' lengths; a second pass takes the residuals for the covariance Σ_l E_lᵀ Ω_l E_l between two inverses of
/// Σ_l E_lᵀ G_l E_l, with Ω_l the long-run covariance of the scores of log l (block_sums.hpp).
///
/// Sharing is judged one parameter at a time by Welch's test (1951) on the estimates of each log by itself, whose
/// variances differ and have few degrees of freedom; for two logs it is the square of the t test of their difference.
///
/// Throws InvalidArgument for no logs, a log without rows or instants, and shapes that disagree.
[[nodiscard]] JointFit joint_fit(const std::vector<JointLog>& logs, const std::vector<JointParameter>& parameters);

}  // namespace wheelwright
