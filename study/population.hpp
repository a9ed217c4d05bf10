// SPDX-License-Identifier: Apache-2.0
/// \file
/// Population of a fleet: random effects, robots outside at a family-wise level (Holm).
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/study/robot_record.hpp>

namespace wheelwright::study {

/// Result of fit_random_effects().
struct RandomEffects {
  std::size_t members = 0;
  double centre = 0.0;        ///< μ, unit of the values
  double centre_error = 0.0;  ///< standard error of μ
  double spread = 0.0;   ///< τ, standard deviation between members, their own errors apart; 0 where those explain it
  double freedom = 0.0;  ///< degrees of freedom of √(s² + τ²) for Student's t
};

/// Takes no member out.
inline constexpr std::size_t kNoMember = static_cast<std::size_t>(-1);

/// The random-effects model x_i = μ + b_i + e_i, b_i of standard deviation τ, e_i of standard deviation s_i known
/// (`paule1982`), fitted robustly against a few outliers: with z_i = (x_i − μ)/√(s_i² + τ²) and Huber's ψ(z) = max(−c,
/// min(c, z)), c = 1.5, μ and τ solve (`huber2009`, section 6.4, "Proposal 2")
///
///     Σ ψ(z_i)/√(s_i² + τ²) = 0,     Σ ψ(z_i)² = (n − 1) E ψ(Z)²,     Z standard normal,
///
/// and τ = 0 where even that makes the second sum too small. With c → ∞ they are Paule and Mandel's equations. About a
/// quarter of the members may be arbitrarily far off. freedom = 0.72 (n − 1): Proposal 2's scale has 0.72 of the
/// efficiency of the standard deviation at the normal distribution.
///
/// Member number `without` is left out. Throws InvalidArgument for fewer than two members left, lengths that differ,
/// values that are not finite and errors that are not finite and >= 0.
[[nodiscard]] RandomEffects fit_random_effects(std::span<const double> values, std::span<const double> errors,
                                               std::size_t without = kNoMember);

/// Options of describe_population().
struct PopulationOptions {
  double level = 0.05;     ///< probability that any robot of a homogeneous fleet is called outside
  std::size_t fewest = 5;  ///< robots that a parameter needs for its population to be looked at
  double central = 0.9;    ///< share of the others that the certain statement is about
};

/// One parameter over the fleet.
struct ParameterPopulation {
  std::size_t column = 0;      ///< of the table
  std::size_t shown = 0;       ///< robots whose log shows the parameter, with a standard error
  bool described = false;      ///< there are enough of them
  RandomEffects fit{};         ///< μ and τ, where described
  double typical_error = 0.0;  ///< median of the robots' own standard errors
  Interval central{};  ///< the middle `central` share of the robots' true values lies in it, if noise kept to its
                       ///< bounds: quantiles of the lower and of the upper bounds
};

/// A robot outside.
struct RobotOutside {
  std::size_t robot = 0;
  std::size_t column = 0;
  double value = 0.0;       ///< estimate
  double deviations = 0.0;  ///< t: distance from the others' centre in standard deviations, with its sign
  double p = 1.0;           ///< two-sided
  double adjusted_p = 1.0;  ///< Holm over robots and parameters
  double certainly_beyond =
      0.0;               ///< share of the other robots whose whole interval of bounds lies on one side of its own
  bool certain = false;  ///< its interval of bounds does not meet where the central share of the others certainly is
};

/// The result of describe_population().
struct Population {
  std::vector<ParameterPopulation> parameters{};  ///< one for each column of the table
  std::vector<RobotOutside> outside{};            ///< smallest adjusted p first
  std::size_t tests = 0;                          ///< pairs of robot and parameter
};

/// Of each parameter, centre and spread of the robots that show it (population.hpp), and the robots outside. A robot
/// is compared with the others: with their μ and τ (fitted without it where there are at most 200 robots; beyond, its
/// own pull on them is bounded and below a hundredth of a deviation),
///
///     t = (x − μ)/√(s² + τ² + s_μ²),
///
/// which for a robot like the others follows about Student's t (normal θ and errors) of ν degrees of freedom, those of
/// the estimated variances in it: 1/ν = 1/(freedom of the others' random effects) + q²/(those of s), q = s²/(s² + τ² +
/// s_μ²). It is outside where its p, adjusted by Holm's method over all robots and parameters, is at most `level`. The
/// certain statement needs no distribution, only the noise bounds. Throws InvalidArgument for a level or share outside
/// (0, 1) or fewest < 4.
[[nodiscard]] Population describe_population(const FleetTable& table, const PopulationOptions& options = {});

}  // namespace wheelwright::study
