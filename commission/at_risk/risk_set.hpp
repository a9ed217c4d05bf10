// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible set at a stated risk: sharper than the guaranteed one, since errors that have no bias average out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "bounds/polytope.hpp"
#include "core/log.hpp"
#include "core/warrant.hpp"
#include "model/filter/error_class.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::commission {

/// Options of risk_set().
struct RiskSetOptions {
  double risk = 1e-9;                              ///< probability that the set lacks the true θ
  std::vector<double> delays{0.2, 0.4, 0.8, 1.6};  ///< s, by which the weights that are tried foresee
  double learning = 0.05;                          ///< share of the log on which the ellipsoid's scale is learnt
};

/// One of the ellipsoids that a set at a stated risk is made of: all sums of its weights stay in it, but for `risk`.
struct RiskEllipsoid {
  double delay = 0.0;                   ///< s, of the weights
  std::vector<std::size_t> parameters;  ///< ascending: a block of those that share an output
  double risk = 0.0;                    ///< its part of the set's
  double log_volume = 0.0;              ///< ln det(I + V0⁻¹V)
  double squared_radius = 0.0;          ///< >= 2 ln(1/risk) + log_volume
};

/// One facet: but for the set's risk, |y − Yθ| <= dy with Y known up to dY.
struct RiskFacet {
  Eigen::VectorXd Y, dY;  ///< p
  double y = 0.0, dy = 0.0;
  std::size_t ellipsoid = 0;  ///< number of that which it is tangent to
  Eigen::VectorXd weights;    ///< p: the sum's weights are the foreseen regressor times this
  filter::ErrorShare share;   ///< of the sensors' errors
  double radius = 0.0;        ///< what dy holds for errors that average out
  double rounding = 0.0;      ///< what dy holds for the rounding of all sums
};

/// Result of risk_set().
struct RiskSet {
  std::optional<bounds::Polytope> set;  ///< nothing where the log leaves none: it contradicts what is assumed
  std::vector<RiskFacet> facets;
  std::vector<RiskEllipsoid>
      ellipsoids;         ///< of every delay, block and scale: their risks add up to no more than `risk`
  Box box;                ///< that of the guaranteed set, over which the facets hold
  double learning = 0.0;  ///< RiskSetOptions::learning
  double risk = 0.0;      ///< probability that the set lacks the true θ
  core::Warrant warrant = core::Warrant::guaranteed;  ///< extrapolated where the errors were estimated from the log
  double log_volume = 0.0;                            ///< largest of the ellipsoids' ln det(I + V0⁻¹V)
  std::string reason;                                 ///< where there is no set
};

/// Learns the set of the parameters that explain `log` at the risk `options.risk`, as a part of `guaranteed`.
///
/// Sums of elements, weighted by the regressor as it was foreseen (instruments G), leave b − Mθ = Σ c_s e_s of all
/// samples' errors. For errors as `classes` says this is a vector martingale beside its bias; with V = Σ s² c_s c_sᵀ
/// and s² their variance proxies (error_class.hpp),
///
///     (b − Mθ)ᵀ (V + V0)⁻¹ (b − Mθ) <= 2 ln(1/δ) + ln det(V + V0)/det V0
///
/// but for the probability δ (Abbasi-Yadkori, Pál, Szepesvári 2011, theorem 1; for errors that are correlated over m
/// samples with m V, by Hölder's inequality). Every facet tangent to that ellipsoid holds at no more risk: those of the
/// parameters and of their pairs are taken. To each is added what bias, the motion between samples, and errors that do
/// not average may do at worst. V0 is learnt from the log's beginning, which the sums leave out, and taken at several
/// scales. Where a deviation below the bound is declared, proxies hold for λᵀV0λ <= reach² only: the mixture behind the
/// inequality is cut off there, at the price of 2 ln 2, and where that is not enough proxies for every λ stand in, with
/// a tenth of the risk. Weights fall to zero towards the ends of segments.
///
/// The log is walked three times. Throws InvalidArgument where options or classes make no sense.
[[nodiscard]] RiskSet risk_set(LogSource& log, const Model& model, const Measurement& measurement,
                               const filter::SignalErrors& errors, const filter::ErrorClasses& classes,
                               const bounds::Polytope& guaranteed, const RiskSetOptions& options = {});

/// What a half-space of RiskSet::set is.
struct RiskOrigin {
  /// Kinds.
  enum class Kind {
    guaranteed,  ///< a facet of the guaranteed set
    sum,         ///< a side of one of RiskSet::facets
    box,         ///< a side of RiskSet::box
  };
  Kind kind = Kind::guaranteed;
  std::size_t number = 0;  ///< of the facet, of the sum, or of the box's parameter
  bounds::Side side = bounds::Side::upper;
  friend bool operator==(const RiskOrigin&, const RiskOrigin&) = default;
};

/// That of a half-space of `set`, of which `origin` is the name.
[[nodiscard]] RiskOrigin risk_origin(const RiskSet& set, const bounds::RowOrigin& origin);

/// A direction in which a sum is taken.
struct RiskDirection {
  std::size_t ellipsoid = 0;
  Eigen::VectorXd weights;  ///< p, 0 outside of the ellipsoid's block
};

/// The statistics of a log that risk_set() stands on.
struct RiskSums {
  std::vector<RiskEllipsoid> ellipsoids;  ///< delay by delay, block by block, scale by scale
  std::vector<RiskFacet> facets;          ///< of each direction
};

/// The sums that risk_set() takes of `log`, in directions that are given, for θ in `box`: for those who doubt its set
/// and prove it again. Nothing is chosen and nothing is solved. Throws InvalidArgument as risk_set() does, and for a
/// direction that is none.
[[nodiscard]] RiskSums risk_sums(LogSource& log, const Model& model, const Measurement& measurement,
                                 const filter::SignalErrors& errors, const filter::ErrorClasses& classes,
                                 const Box& box, const RiskSetOptions& options,
                                 const std::vector<RiskDirection>& directions);

}  // namespace wheelwright::commission
