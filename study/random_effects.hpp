// SPDX-License-Identifier: Apache-2.0
/// \file
/// Centre and spread of a population whose members are each known with an error of their own.
#pragma once

#include <cstddef>
#include <span>

namespace wheelwright {

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
/// (`paule1982`), fitted so that a few strange members do not move it: with z_i = (x_i − μ)/√(s_i² + τ²) and Huber's
/// ψ(z) = max(−c, min(c, z)), c = 1.5, μ and τ solve (`huber2009`, section 6.4, "Proposal 2")
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

}  // namespace wheelwright
