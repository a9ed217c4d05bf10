// SPDX-License-Identifier: Apache-2.0
/// \file
/// Estimate θ̂ on a part of a log: the chosen estimator, its residuals, and the excitation of the parameters.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "commission/setting.hpp"
#include "commission/validation.hpp"
#include "identify/estimate.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::bounds {
class Polytope;
}  // namespace wheelwright::bounds

namespace wheelwright::commission {

/// A fit with everything that later stages ask of it.
struct Fit {
  Eigen::VectorXd weights;              ///< one for each output, 1/residual
  identify::LeastSquares factor{1};     ///< the rows, folded
  identify::LeastSquaresFit squares;    ///< weighted least squares, parameters that are not excited held at zero
  identify::EstimatorChoice choice;     ///< no candidates where no parameter is excited
  Eigen::VectorXd estimate;             ///< p, θ̂ of the chosen estimator
  identify::ResidualSummary residuals;  ///< at θ̂, with θ̂'s covariance
  std::vector<identify::ExcitationFinding> excitation;  ///< one for each parameter
  std::vector<bool> noise_alone;  ///< p: not excited, since what the column holds is no more than noise of the motion
  Eigen::VectorXd plausible;      ///< per output, largest_plausible_error; empty where noise is declared
  std::optional<identify::ResidualSummary> watched;  ///< at θ̂, of a detector's rows, where those of the fit
                                                     ///< interpolate lost ones (loses_often) and noise is learnt
};

/// Errors of the rows that are fitted: efforts and motion between samples as most likely, not in the middle of what is
/// possible; signs are left open where noise of the samples leaves them so.
[[nodiscard]] filter::SignalErrors errors_of_fit(const Setting& setting);

/// Fits `part` of `log`. `risk` is for Fit::plausible.
[[nodiscard]] Fit fit_log(LogSource& log, const Setting& setting, Part part, double risk);

/// `model` with zeros in the columns of these parameters (p, or empty: none).
[[nodiscard]] Model without_columns(Model model, const std::vector<bool>& parameters);

/// Moments of `part` of `log`: with the commanded motion as instruments where it is logged.
[[nodiscard]] identify::RegressionMoments log_moments(LogSource& log, const Setting& setting, Part part);

/// `estimate`, with the Chebyshev centre's value for each parameter that the log does not show.
[[nodiscard]] Eigen::VectorXd best_guess(Eigen::VectorXd estimate,
                                         const std::vector<identify::ExcitationFinding>& excitation,
                                         const bounds::Polytope& set);

}  // namespace wheelwright::commission
