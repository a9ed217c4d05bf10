// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible set at a stated risk: sharper than the guaranteed one, since errors that have no bias average out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/polytope.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/filter/error_class.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>
#include <wheelwright/model/model.hpp>

namespace wheelwright::commission {

/// Options of risk_set().
struct RiskSetOptions {
  double risk = 1e-9;                              ///< probability that the set lacks the true θ
  std::vector<double> delays{0.2, 0.4, 0.8, 1.6};  ///< s, by which the weights that are tried foresee
  double learning = 0.05;                          ///< share of the log on which the ellipsoid's scale is learnt
};

/// One facet: but for the set's risk, |y − Yθ| <= dy with Y known up to dY.
struct RiskFacet {
  Eigen::VectorXd Y, dY;  ///< p
  double y = 0.0, dy = 0.0;
  double delay = 0.0;        ///< s, of the weights
  Eigen::VectorXd weights;   ///< p: the sum's weights are the foreseen regressor times this
  filter::ErrorShare share;  ///< of the sensors' errors
  double radius = 0.0;       ///< what dy holds for errors that average out
};

/// Result of risk_set().
struct RiskSet {
  std::optional<bounds::Polytope> set;  ///< nothing where the log leaves none: it contradicts what is assumed
  std::vector<RiskFacet> facets;
  double risk = 0.0;        ///< probability that the set lacks the true θ
  core::Warrant warrant = core::Warrant::guaranteed;  ///< extrapolated where the errors were estimated from the log
  double log_volume = 0.0;  ///< largest of the ellipsoids' ln det(I + V0⁻¹V)
  std::string reason;       ///< where there is no set
};

/// Learns the set of the parameters that explain `log` at the risk `options.risk`, as a part of `guaranteed`.
///
/// Sums of elements, weighted by the regressor as it was foreseen (instruments G), leave b − Mθ = Σ c_s e_s of all
/// samples' errors. For errors as `classes` says this is a vector martingale beside its bias; V = Σ n̄² c_s c_sᵀ, and
///
///     (b − Mθ)ᵀ (V + V0)⁻¹ (b − Mθ) <= 2 ln(1/δ) + ln det(V + V0)/det V0
///
/// but for the probability δ (Abbasi-Yadkori, Pál, Szepesvári 2011, theorem 1; for errors that are correlated over m
/// samples with m V, by Hölder's inequality). Every facet tangent to that ellipsoid holds at no more risk: those of the
/// parameters and of their pairs are taken. To each is added what bias, the motion between samples, and errors that do
/// not average may do at worst. V0 is learnt from the log's beginning, which the sums leave out. Weights fall to zero
/// towards the ends of segments.
///
/// The log is walked three times. Throws InvalidArgument where options or classes make no sense.
[[nodiscard]] RiskSet risk_set(LogSource& log, const Model& model, const Measurement& measurement,
                               const filter::SignalErrors& errors, const filter::ErrorClasses& classes,
                               const bounds::Polytope& guaranteed, const RiskSetOptions& options = {});

}  // namespace wheelwright::commission
