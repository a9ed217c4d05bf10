// SPDX-License-Identifier: Apache-2.0
/// \file
/// Fault isolation by the kinematic residual, and by both residuals together. As isolation.hpp, and **of faults that
/// are steps and stay**.
///
/// Rows of the kinematic residual are sums over a window [t_0, t] of what wheels rolled (odometry_filter.hpp). For a
/// fault that set in at T the displacement is Σ E_j (Δφ_j + κ s q_j) r/2 + κ Σ s (E_j a_1 + E_j⊥ d) h_j, the turn
/// alike, with q = K Δφ in joints (odometry_faults.hpp): the parts of the fault are sums from max(t_0, T) on. With T in
/// [t_a, t_b], t_b < t_s, they are those from max(t_0, t_s) on, and for the steps between max(t_0, t_a) and t_s no more
/// than the sum of their sizes. E_j are the measured headings', so that they are the faulty robot's own; K of a
/// measured way has the share of its errors that odometry_faults.hpp counts. A fault of an encoder is one of the motion
/// of what it shows (onset_rows.hpp).
///
/// A fault that leaves no trace here has the rows of a healthy robot. Where these do not explain the window, it is
/// excluded; where they do, nothing is said of its size and onset. So **what the kinematic residual does not show
/// speaks, too**: a fault of motion that would have left a trace for every θ of the set and all errors is excluded, or
/// its size is bounded.
///
/// It stands on the kinematic model's set and errors (OdometryErrors: wheels that spin faster up than it declares are
/// none of them).
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "detector/faults/isolation.hpp"
#include "detector/faults/odometry_faults.hpp"

namespace wheelwright::bounds {
class Polytope;
}  // namespace wheelwright::bounds

namespace wheelwright::detector {

/// True if a fault changes how the robot moves beside its wheels, or what encoders show of it.
[[nodiscard]] bool shows_in_odometry(const FaultType& fault);

/// Tells `faults` apart by the rows of the kinematic residual about an alarm, of whichever residual, at `alarm` whose
/// first instant outside is `outside` (s): onsets lie before that. `reference` is the log's own drive, or a piece of it
/// that begins `window` (the filter's, s) and more before the isolation's window; `set` bounds the parameters. A fault
/// whose rows are not known (a reading that stands still, a bump, a profile that ends) is not examined; of one that
/// leaves no trace a finding that is consistent has its whole range and any onset. Where no row lies in the window
/// nothing is examined. Throws InvalidArgument where options make no sense.
[[nodiscard]] Isolation isolate_by_odometry(const OdometryReference& reference, const Model& model,
                                            const filter::OdometryMeasurement& measurement,
                                            const filter::OdometryErrors& errors, double window,
                                            const bounds::Polytope& set, const std::vector<FaultType>& faults,
                                            double outside, double alarm, const IsolationOptions& options = {});

/// What a step of size κ = 1 (κ' of an encoder) from each of `times` (s) on adds to the rows at `instants` with the
/// parameters `theta`: instants × outputs, row by row, by times. Empty where the fault's rows are not known.
[[nodiscard]] Eigen::MatrixXd odometry_responses(const OdometryReference& reference, const Model& model,
                                                 const filter::OdometryMeasurement& measurement,
                                                 const filter::OdometryErrors& errors, const FaultType& fault,
                                                 const Eigen::VectorXd& theta, const std::vector<std::size_t>& instants,
                                                 const std::vector<double>& times);

/// Takes from `isolation` what `other`, of the other residual about the same alarm and of the same faults in the same
/// order, does not leave: a fault that either excludes is excluded, and size and onset are what both leave (onsets to
/// within `slack` s, by which the residuals' instants may be apart). A fault that only `other` examined, and that
/// leaves a trace there, takes its finding.
void narrow_by(Isolation& isolation, const Isolation& other, double slack);

}  // namespace wheelwright::detector
