// SPDX-License-Identifier: Apache-2.0
/// \file
/// An identification in sentences, the same ones for terminal, file and page: what was found, and what to do next.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "commission/identification.hpp"
#include "commission/physical.hpp"

namespace wheelwright::words {

/// A parameter as people read it: the physical quantity where physical_scales() has it, else θ_L,j.
struct ShownParameter {
  std::string name;                 ///< e.g. "mass" or "r_mass"
  std::string unit;                 ///< of the values
  commission::PhysicalScale scale;  ///< 1 and 0 for θ_L,j itself

  /// The value of θ_L,j in `unit`.
  [[nodiscard]] double value(double theta) const { return scale.scale * theta - scale.offset; }
};

/// All parameters, in their order.
[[nodiscard]] std::vector<ShownParameter> shown_parameters(const commission::Identification& result);

/// Overall standing of the result.
enum class IdentificationStanding {
  good,     ///< every parameter is identified, and nothing that was looked for is missing in the model
  caution,  ///< something is missing: a parameter, or something in the model
  bad,      ///< the log shows no parameter
};

/// The standing of `result`.
[[nodiscard]] IdentificationStanding standing(const commission::Identification& result);

/// The constraints that hold `fit` back; a parameter that is left out touches zero and is not among them.
[[nodiscard]] std::vector<inference::ActiveConstraint> binding(const inference::ConstrainedFit& fit);

/// A shape matters where it is identified and the residual with it is below this share of that without.
inline constexpr double kShapeMatters = 0.95;

/// True if `shape` is identified by the log and relevant: it lowers the residual below kShapeMatters and is either told
/// from zero or, for the Stribeck speed, not at an end of what was searched.
[[nodiscard]] bool matters(const commission::ShapeFinding& shape);

/// Estimate of a shape in one sentence: its value with its 95 % interval and what it explains, or that the log does not
/// show it.
[[nodiscard]] std::string in_words(const commission::ShapeFinding& shape);

/// The whole in one sentence.
[[nodiscard]] std::string verdict(const commission::Identification& result);

/// Findings, most important first, one sentence each.
[[nodiscard]] std::vector<std::string> findings(const commission::Identification& result);

/// Missing information and the next steps, most important first, one or two sentences each; never empty.
[[nodiscard]] std::vector<std::string> next_steps(const commission::Identification& result);

}  // namespace wheelwright::words
