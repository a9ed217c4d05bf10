// SPDX-License-Identifier: Apache-2.0
/// \file
/// Size of a fault over time, for faults that need not be steps: bounds that hold for every course of the size.
///
/// isolation.hpp gives sizes and onsets of faults that are steps and stay. Here the size is a function κ(τ) of time,
/// and each bound names the class of functions that it holds for:
///
/// **Any bounded one**: κ(τ) in the fault's range, changing as it likes, from before the log or not. Where what a row
/// has of the fault is ∫ w(t, τ) κ(τ) dτ, with weights w that are known, the *mean of the size* with the weights |w|
/// over the memory of the row lies in an interval (MeanSize). With E the interval of what parameters of the set and
/// admissible noise leave of the row (E = [y − u, y − l], threshold.hpp, θ̂ = 0):
///
///     ∫ w κ ∈ E,   Φ = ∫ w,   P = ∫ |w| = Φ + 2B,   B the part of the weights with the other sign:
///     κ̄ = ∫ |w| κ / P = (1 − λ) (∫ w κ)/Φ + λ κ_B,   λ = 2B/P,   κ_B a mean of sizes, in the range:
///
/// so κ̄ lies in the hull of E/Φ and of its mixture with the range at the largest B. The weights are
/// - a share of an effort that is lost: the effort as it was logged, filtered: the rest of it, u(1 − m), is what
///   drives, so that the residual is ∫ f u m, and errors of u count as a healthy robot's, since 1 − m is in [0, 1];
/// - an effort's bias: the filter's own kernel;
/// - radius, slip in per cent, encoder, by the kinematic residual: the ways that the wheel rolled from sample to sample
///   in the row's window (the class: in a step in which it turns back the size stays as it is); a slip in m/s or rad/s:
///   time. Rows whose weights turn with the robot (E_j of odometry_filter.hpp) have weights w =
///   c|w| + d, and ∫ d κ is bounded by the range.
///
/// **Growing**: the size has one sign and its amount never falls (a step, a ramp, stairs, from before the log or not).
/// It is then a mixture of steps, κ(t) = σλ(t), dλ >= 0. With S(T) what a step of size 1 at T has in a row at t, and
/// any T0 before t,
///
///     σE ∋ ∫ S(T) dλ(T)  ⇒  σE.lower <= q λ(T0) + M (λ(t) − λ(T0)),    q = max S up to T0,  M = max S
///                           σE.upper >= m λ(T0) − N (λ(t) − λ(T0)),    m = min S up to T0,  N = −min(S, 0)
///
/// so that λ(t) is bounded from below by what is known of λ(T0), and λ(T0) from above by what is known of λ(t) (Link):
/// bounds are carried from row to row, one below ever after, one above ever before. For a radius, whose part in κ² is
/// about half of that in κ, λ is |κ + κ²/2|: with Q of κ², S dκ + 2κQ dκ = (S + 2κQ)/(1 + κ) d(κ + κ²/2). A mean over
/// [t0, t1] bounds λ(t1) from below and λ(t0) from above. In a torque residual a change of radius or slip shows by how
/// fast it comes as well as by its size (the inertia of what it adds to the motion), so that S is not of one sign in
/// general and no mean is known: for these the class is needed. A bias counts here up to ReferenceMotion::most_effort.
///
/// **Bounds are outer bounds**: of the class the true size is never outside where model, sensors' bounds and catalogue
/// hold. Where no course of the class is left the fault is excluded for that class.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "detector/faults/isolation.hpp"
#include "model/fault_type.hpp"

namespace wheelwright::filter {
struct OdometryMeasurement;
struct OdometryErrors;
}  // namespace wheelwright::filter

namespace wheelwright::detector {

struct OdometryReference;

/// What rows say of one fault's size.
struct SizeEvidence {
  /// A bound on λ at one instant by that at another: λ(at) >= constant + share λ(from), from <= at, or λ(at) <=
  /// constant + share λ(from), from >= at.
  struct Link {
    double at = 0.0, from = 0.0;  ///< s
    double constant = 0.0, share = 0.0;
    bool below = true;  ///< λ(at) is bounded from below
  };
  /// Of a fault of one sign that grows.
  struct Side {
    std::vector<Link> links{};
    bool excluded = false;  ///< no growing fault of this sign explains the rows
  };
  std::vector<MeanSize> means{};  ///< for any bounded course, ascending in `to`; empty where no weights are known
  bool excluded = false;          ///< no bounded course explains the rows
  std::array<Side, 2> sides{};    ///< sizes >= 0, sizes <= 0
};

/// λ of a fault's size, >= 0 and growing with |size|: the amount in which a row is nearly linear. Of one sign the size
/// is size_of() again.
[[nodiscard]] double amount_of(const FaultType& fault, double size);
/// The size whose amount is `amount`, of the sign of `sigma`; infinite where there is none.
[[nodiscard]] double size_of(const FaultType& fault, double sigma, double amount);

/// Options of the evidence.
struct SizeOptions {
  std::size_t most_rows = 240;  ///< whose rows are used, evenly spread over the window
  std::vector<double> also{};   ///< s: rows next to these times are used, too
  std::size_t threads = 1;      ///< the result does not depend on it
};

/// Evidence of the torque residual within `window` (s) on each of `faults`. `motion` is the log's own (read_reference()
/// with `filter`), from before the window's memory on; `efforts` are the logged ones (joints × instants, at
/// ReferenceMotion::sample); `set` is P. Faults that are there or not, that stand still at an unknown value, that end
/// by themselves or whose signature is no polynomial of their size get none. Throws InvalidArgument where shapes
/// disagree.
[[nodiscard]] std::vector<SizeEvidence> size_evidence(const ReferenceMotion& motion,
                                                      const filter::RegressorFilter& filter,
                                                      const Eigen::MatrixXd& efforts, const bounds::Polytope& set,
                                                      const std::vector<FaultType>& faults, const Interval& window,
                                                      const SizeOptions& options = {});

/// The same of the kinematic residual, as for isolate_by_odometry(). A fault that leaves no trace there is excluded
/// where rows are not those of a healthy robot.
[[nodiscard]] std::vector<SizeEvidence> size_evidence_by_odometry(
    const OdometryReference& reference, const Model& model, const filter::OdometryMeasurement& measurement,
    const filter::OdometryErrors& errors, const bounds::Polytope& set, const std::vector<FaultType>& faults,
    const Interval& window, const SizeOptions& options = {});

/// Puts evidence of both residuals on `fault` together.
[[nodiscard]] SizeOverTime size_over_time(const FaultType& fault, std::span<const SizeEvidence> evidence);

}  // namespace wheelwright::detector
