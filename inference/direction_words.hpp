// SPDX-License-Identifier: Apache-2.0
/// \file
/// Physical descriptions of directions in the parameter space, and the driving that excites them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::inference {

/// Kind of motion that excites a parameter.
enum class TermKind {
  inertia,  ///< acceleration
  viscous,  ///< speed
  coulomb,  ///< direction of motion
  offset,   ///< nothing: it is always there
  other,
};

/// A parameter as people know it.
struct ParameterWords {
  std::string name;    ///< e.g. "mass"
  std::string unit;    ///< e.g. "kg"
  std::string excite;  ///< what to do when a log does not show it, e.g. "drive in curves"; may be empty
  TermKind kind = TermKind::other;
};

/// The kind that a name tells: "mass", "inertia", "armature", "payload"; "viscous"; "coulomb"; "offset"; else `other`.
[[nodiscard]] TermKind kind_of(std::string_view name);

/// The combination Σ_j c_j θ_j with units: "mass + 4.2·armature (mass in kg, armature in kg·m²)", "a − b (N)". `size`
/// (p, > 0): what a usual value of each θ_j is; parts |c_j|·size_j below `least` of the largest are not named.
/// Coefficients have two digits.
[[nodiscard]] std::string combination_in_words(const Eigen::VectorXd& c, const std::vector<ParameterWords>& parameters,
                                               const Eigen::VectorXd& size, double least = 0.1);

/// c scaled so that its largest part |c_j|·size_j has the coefficient ±1, and the first that is named the sign plus.
[[nodiscard]] Eigen::VectorXd largest_part_one(const Eigen::VectorXd& c, const Eigen::VectorXd& size,
                                               double least = 0.1);

/// The driving that would tell the parameters `members` (indices) apart, or show it where it is only one. Follows from
/// their kinds (two friction laws: both directions and many speeds; inertia and friction: changes of speed and constant
/// speeds; two inertias on one motion: none, a known load), else from what each says itself.
[[nodiscard]] std::vector<std::string> missing_manoeuvres(const std::vector<Eigen::Index>& members,
                                                          const std::vector<ParameterWords>& parameters);

}  // namespace wheelwright::inference
