// SPDX-License-Identifier: Apache-2.0
/// \file
/// Premises of a model that the rows of a log test by statistics: parameters that stay what they are, efforts without
/// an offset, friction of the shape that the model has (docs/methods/assumptions.md).
#pragma once

#include <vector>

#include "commission/contradiction.hpp"
#include "core/log.hpp"

namespace wheelwright::commission {

struct Fit;
struct Setting;

/// Probability that a log which keeps to all premises is said to break one.
inline constexpr double kPremiseRisk = 1e-3;

/// Tests the premises by least squares on the filtered rows, and appends what they contradict to `out`. One walk.
///
/// Halves, from a minute on also thirds, are fitted by themselves and compared in pairs, parameter by parameter. Over
/// the whole log each joint's effort has an offset of its own beside the model, and both together a friction that
/// grows with the square of the speed (where the model has dry friction, with its root as well). Differences, offsets
/// and shapes count beyond
///   - Student's t at kPremiseRisk divided by the number of tests, with standard errors and degrees of freedom that
///     allow for autocorrelated residuals and for motion that is seen in one stretch only, and
///   - what taking the noise of the motion out of Σ YᵀY, or not, makes of them (errors in variables), and
///   - of differences, what an offset within its declared limit makes of them, and
///   - where errors do not average out (errors_average()), and of offsets where no bias is declared, the most that
///     errors within their declared bounds make of them (filter::ErrorInfluence). That walks the log again.
/// Instants at which noise leaves the sign of dry friction open are left out. A part in which less than half of the
/// motion in some direction is more than noise is not judged; nothing is where the noise of the motion is not known.
///
/// A violation would have shown nearly always from two standard errors beyond these limits on. `holds` is said where
/// that is no more than a tenth of each parameter or a fiftieth of the effort, no more than five times the declared
/// offset, and of shapes no more than a twentieth of the effort.
[[nodiscard]] Premises test_premises(LogSource& log, const Setting& setting, const Fit& fit,
                                     std::vector<LogContradiction>& out);

/// Whether errors of the log average out as far as it shows. Where nothing is declared of their mean, errors within
/// their bounds may do to any least-squares estimate what a broken premise does; what the model leaves, with all that
/// is tested in it and parameters of their own in each eighth of the log, is then like what it left when the filter had
/// forgotten that. True where a bias is declared (its own test says whether it holds), or no bound. Two walks.
[[nodiscard]] bool errors_average(LogSource& log, const Setting& setting, const Fit& fit);

}  // namespace wheelwright::commission
