// SPDX-License-Identifier: Apache-2.0
/// \file
/// Error bounds of the rows: declared by sensor bounds or estimated, and the bound of each output's residual.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "bounds/minimax.hpp"
#include "commission/output_noise.hpp"
#include "core/regression.hpp"
#include "core/warrant.hpp"
#include "identify/least_squares.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/error_class.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Use of rows: those of the log that bounds are learnt from, or those of later driving.
enum class RowUse { learning, driving };

/// The bound of an output that is estimated: `how` from what its residual was, never below `plausible`, the largest
/// error that the rows of the log can hold.
[[nodiscard]] OutputNoise estimated_noise(const identify::OutputResidual& residual, std::size_t instants,
                                          double plausible, const identify::ExtrapolationOptions& options);

/// An output in which only parameters move that the log does not excite tells no noise: what it leaves with these
/// parameters held at 0 lacks the noise of their columns times their true values. Its estimated bounds become what all
/// of `prior` explains, so that no bound on a parameter and no fault is made of it. No bound of such an output, nor of
/// one in which nothing moves at all (0 where both wheels are logged alike), is less than what the other outputs have
/// of the same joints, by `input` (outputs × joints). In any other output, driving to come may have what the columns of
/// `noise_alone` (p) are with the largest parameters of `prior`. Returns whether any bound was widened by the prior.
bool cover_untold_outputs(std::vector<OutputNoise>& noise, core::RegressionSource& rows, const Box& prior,
                          const std::vector<identify::ExcitationFinding>& excitation,
                          const std::vector<bool>& noise_alone, const Eigen::MatrixXd& input);

/// What bounds were estimated from: θ̂, its residuals, and the risk of the plausible error.
struct EstimateInPrior {
  const Eigen::VectorXd& estimate;
  const identify::ResidualSummary& residuals;
  double risk = 1e-3;
};

/// Raises estimated bounds that leave no set in `prior`, to just above the minimax fit of `rows` (which have none of
/// them), and returns the factor. Where that fit did not converge the factor is bisected between what it proved, by
/// `explained`: whether bounds leave a set. With so little noise the set is next to a point, and nothing says that the
/// true parameters are that point: bounds are raised further, to the largest plausible error
/// (identify::largest_plausible_error) about the point of `prior` that is nearest to θ̂.
double raise_until_explained(std::vector<OutputNoise>& noise, core::RegressionSource& rows, const Box& prior,
                             const EstimateInPrior& fit,
                             const std::function<bool(const std::vector<OutputNoise>&)>& explained);

/// The factor by which estimated bounds must grow for a set to be left, and a little more. `fit`, in units of the
/// bounds, tells it where it converged; else it is bisected between what `fit` proved, by `leaves_a_set`.
[[nodiscard]] double noise_that_leaves_a_set(const bounds::MinimaxFit& fit,
                                             const std::function<bool(double)>& leaves_a_set);

/// The declared part of the noise.
struct NoiseBudget {
  bool complete = false;         ///< motion and effort are both declared: the rows' bounds need no estimate
  filter::SensorErrors sensors;  ///< all zero unless complete
};

/// For complete declarations: half a count for count-differenced speeds and encoder angles, else the declared bound of
/// the motion column; the declared bound of the effort. What happens between samples is no noise: SignalErrors::motion.
/// Otherwise the equation error as a whole is estimated from the residuals: it then holds the noise of all sensors, and
/// adding propagated bounds to it would count them twice.
[[nodiscard]] NoiseBudget noise_budget(const Robot& robot, const Measurement& measurement);

/// What the robot file says of errors that average out; nothing where it declares no bias, or not all bounds. Rounding
/// of an encoder has no bias while its wheel moves by several counts a sample (error_class.hpp).
[[nodiscard]] std::optional<filter::ErrorClasses> error_classes(const Robot& robot, const Measurement& measurement);

/// The same with the efforts' errors as `effort` says, and the motion column's at most `motion`.
[[nodiscard]] filter::ErrorClasses classes_with(const Robot& robot, const Measurement& measurement, double motion,
                                                const filter::ErrorClass& effort);

/// The largest limit of a joint (acceleration_limit) as one of each coordinate of `model` (filter::MotionBound::limit).
[[nodiscard]] Eigen::VectorXd coordinate_limit(const Model& model, const std::vector<double>& joint_limit);

/// Bound on the error of the motion column alone, where the robot file or the encoder tells it: rad for angles and mean
/// speeds, rad/s for speeds.
[[nodiscard]] std::optional<double> motion_error(const Robot& robot, const Measurement& measurement);

}  // namespace wheelwright::commission
