// SPDX-License-Identifier: Apache-2.0
/// \file
/// The result of commissioning in plain sentences, and its parameters as people read them.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commission/commission.hpp"

namespace wheelwright::words {

/// Result of commissioning for one quantity. All numbers are in `unit`.
struct ParameterView {
  std::string name;  ///< identifier, e.g. "mass" or "r_mass"
  std::string unit;
  std::optional<double> estimate;
  std::optional<double> spread;  ///< half of the 95 % interval, t·standard error
  double lower = 0.0;            ///< bounds, in the sense of `warrant`
  double upper = 0.0;
  double centre = 0.0;            ///< Chebyshev centre
  std::optional<double> nominal;  ///< of the robot file
  bool lower_is_prior = false;
  bool upper_is_prior = false;
  bool has_set = true;                                  ///< false: the feasible set is empty, and nothing is bounded
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of lower and upper
  std::optional<Interval> at_risk{};                    ///< bounds at a stated risk (RiskSet)
};

/// A parameter as θ_L,j, and as a physical quantity where the robot file tells the scale and the two differ.
struct ParameterViews {
  ParameterView theta;
  std::optional<ParameterView> physical;

  /// The physical quantity where there is one.
  [[nodiscard]] const ParameterView& best() const { return physical ? *physical : theta; }
};

/// The estimate with the digits that its uncertainty leaves it; "–" where there is none.
[[nodiscard]] std::string estimate_text(const ParameterView& view);
/// The Chebyshev centre, in the same way; "–" where the log says nothing of the parameter.
[[nodiscard]] std::string centre_text(const ParameterView& view);

/// In the place of the warrant's meaning where little was learned.
inline constexpr std::string_view little_meaning =
    "Little was learned: the bounds hold while the assumptions listed hold, but are too wide to be of use.";

/// Views of all parameters, in their order.
[[nodiscard]] std::vector<ParameterViews> parameter_views(const Commissioning& result);

/// What the bounds at a stated risk mean, in one sentence.
[[nodiscard]] std::string risk_remark(const commission::RiskSet& set);

/// True if the effort is not torque and the robot file lacks the motor's constants.
[[nodiscard]] bool physical_values_unknown(const Commissioning& result);

/// Name of output `i`; "output 2" where the model has none.
[[nodiscard]] std::string output_name(const Model& model, std::size_t i);
/// Unit of output `i` with the effort that was used; empty where the model has none.
[[nodiscard]] std::string output_unit_of(const Robot& robot, const Model& model, std::size_t i);

/// |δ1|/r = √(1 + κ) − 1: the growth of both wheel radii that ζ = κ·Yθ means.
[[nodiscard]] double radius_change(double kappa);

/// Overall standing of a result.
enum class Standing { good, caution, bad };

/// good: a model whose thresholds held and can fire. caution: a model with something to be read first (parameters that
/// the log does not show, false alarms on held-out driving, thresholds that can hardly fire, or see
/// coarse faults only). bad: no model.
[[nodiscard]] Standing standing(const Commissioning& result);

/// One short sentence, and what to drive instead where the model sees nothing. Text, not HTML.
[[nodiscard]] std::string verdict(const Commissioning& result);

/// Three to six sentences: what was found, what it stands on, how it fared on held-out driving, what it can see, and
/// what to do next where the result is not what was hoped for. Text, not HTML.
[[nodiscard]] std::vector<std::string> commission_words(const Commissioning& result);

}  // namespace wheelwright::words
