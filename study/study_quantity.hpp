// SPDX-License-Identifier: Apache-2.0
/// \file
/// Quantities that a study evaluates at each of its points.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "model/robot.hpp"
#include "study/study_case.hpp"

namespace wheelwright::study {

/// One number that a point gives.
struct StudyQuantity {
  /// What it is about.
  enum class Kind {
    lower,              ///< lower bound of the parameter
    upper,              ///< upper bound
    width,              ///< upper − lower
    estimate,           ///< θ̂
    standard_error,     ///< of θ̂
    threshold_mean,     ///< mean of ρ(t) over the drive, in an output
    threshold_peak,     ///< largest ρ(t) over the drive
    smallest_fault,     ///< size from which a fault is certainly seen within the window, at half of the onsets
    delay,              ///< time by which a fault of size `size` is certainly seen, at half of the onsets
    false_alarms,       ///< share of the held-out instants that are outside [l, u]
    commissioned,       ///< 1 where a model came out, else 0
    polytope_over_box,  ///< width of [l, u], feasible set over interval hull
    gap,                ///< 1 where the sim-to-real gap's verdict is `subject`, else 0
  };
  std::string name;  ///< as the study file has it, e.g. "width.r_mass"
  std::string unit;  ///< empty for pure numbers
  Kind kind = Kind::width;
  std::size_t index = 0;  ///< of the parameter or output
  std::string subject;    ///< name of the fault or verdict
  double size = 0.0;      ///< of the fault, in its unit
};

/// The quantities that `names` stand for, with the robot's model:
///
/// lower.θ, upper.θ, width.θ, estimate.θ, standard_error.θ (θ a parameter by its name in results or its physical name),
/// threshold.mean.OUTPUT, threshold.peak.OUTPUT, smallest_fault.FAULT, delay.FAULT=SIZE, false_alarms, commissioned,
/// polytope_over_box, gap.VERDICT (no_gap, explained, ambiguous, unexplained). Without the last name (width,
/// threshold.mean, …) all parameters or outputs are meant. Empty: width, threshold.mean, smallest_fault.wheel_radius,
/// false_alarms and commissioned.
///
/// Throws InvalidArgument, naming what was expected, for a name that stands for nothing.
[[nodiscard]] std::vector<StudyQuantity> study_quantities(const std::vector<std::string>& names, const Robot& robot);

/// Options of evaluate_case().
struct EvaluateOptions {
  double window = 1.0;           ///< s, of smallest_fault
  std::size_t most_onsets = 60;  ///< of smallest_fault and delay
};

/// Result of one point.
struct CaseResult {
  std::vector<double> values;  ///< one for each quantity; NaN where there is none; infinite where no size is certain
  std::string finding;         ///< why there is no model; empty where there is one
};

/// Commissions the case and reads the quantities off. What the data say (an empty feasible set, a parameter that does
/// not show) and what the inputs do to each other (a filter too fast for the rate) is a result, not an exception.
[[nodiscard]] CaseResult evaluate_case(const StudyCase& subject, const std::vector<StudyQuantity>& quantities,
                                       const EvaluateOptions& options = {});

}  // namespace wheelwright::study
