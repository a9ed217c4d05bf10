// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether a log says anything about each parameter, and what to do where it does not.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/least_squares.hpp>

namespace wheelwright {

/// What a log says about one parameter.
enum class Excitation {
  identified,   ///< the estimate can be used
  indistinct,   ///< excited, but not told from zero at 95 %: the estimate is small, its interval holds zero
  not_excited,  ///< the log says nothing about it: no number is given
};

/// The finding for one parameter.
struct ExcitationFinding {
  Excitation state = Excitation::identified;
  double signal_rms = 0.0;  ///< what the parameter's column holds beyond the other columns (weighted units)
  double noise_rms = 0.0;   ///< what sensor noise alone would put there (0: unknown)
  std::string reason;       ///< one sentence for people, empty when identified
};

/// Judges each parameter. `noise_rms` (p, or empty): root mean square of sensor noise in each weighted column;
/// `standard_error` (p) and its t quantile for 95 %.
///
/// not_excited: the column is nothing beyond the other columns (numerical rank), or holds less than three times what
/// noise alone would put there. Least squares would still give a number with a small standard error: that number would
/// be made of noise.
[[nodiscard]] std::vector<ExcitationFinding> judge_excitation(const LeastSquaresFit& fit,
                                                              const Eigen::VectorXd& standard_error, double t_quantile,
                                                              const Eigen::VectorXd& noise_rms = {});

}  // namespace wheelwright
