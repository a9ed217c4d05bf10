// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a log can tell about the parameters together: base parameters, directions it does not see, combinations it
/// knows best, in numbers and in words.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/identify/moments.hpp>
#include <wheelwright/inference/direction_words.hpp>

namespace wheelwright {

/// What is judged. p parameters.
struct IdentifiabilityInput {
  std::vector<ParameterWords> parameters;  ///< p
  Eigen::MatrixXd factor;                  ///< any R (rows × p) with RᵀR = Σ w²YᵀY
  bool from_gram = false;      ///< R was made of Σ w²YᵀY: only half the digits of small directions are left
  std::size_t instants = 0;    ///< of the log
  Eigen::MatrixXd noise;       ///< p × p, Σ w² E δYᵀδY over all instants; empty: unknown
  Eigen::MatrixXd covariance;  ///< p × p, of θ̂, zero for parameters that were left out; empty: unknown
  Eigen::VectorXd size;  ///< p, > 0: what counts as large, the half-width of the prior or |θ̂_j|; empty: unknown
};

/// R, with the parameters of `rows` seen through the triangular factor of least squares: condition enters once.
[[nodiscard]] IdentifiabilityInput identifiability_input(const LeastSquares& rows,
                                                         std::vector<ParameterWords> parameters);
/// R from second moments, weighted: the condition enters squared.
[[nodiscard]] IdentifiabilityInput identifiability_input(const RegressionMoments& moments,
                                                         const Eigen::VectorXd& weights,
                                                         std::vector<ParameterWords> parameters);

/// Why a direction is not seen.
enum class Unseen {
  not_moved,      ///< a parameter's column is zero throughout
  not_separated,  ///< columns are linearly dependent
  noise,          ///< the signal along it is less than three times what sensor noise would put there
  imprecise,      ///< its standard error is larger than the parameters' sizes
};

/// A direction in which θ may change with no, or little, effect on the log.
struct UnseenDirection {
  Unseen why = Unseen::not_separated;
  Eigen::VectorXd direction;            ///< p, θ may move along it; scale without meaning
  std::vector<Eigen::Index> members;    ///< parameters that take part
  double standard_error = 0.0;          ///< imprecise: of the combination that is named
  std::string words;                    ///< one sentence
  std::vector<std::string> manoeuvres;  ///< what would show it
};

/// A combination c·θ.
struct KnownCombination {
  Eigen::VectorXd coefficients;  ///< p
  double relative_error = 0.0;   ///< standard error in units of the parameters' sizes; 0 where unknown
  std::string words;             ///< e.g. "mass + 4.2·armature (mass in kg, armature in kg·m²)"
};

/// The judgement.
struct Identifiability {
  Eigen::VectorXd singular_values;      ///< p, of R with columns of length one (zero columns stay zero)
  double condition = 0.0;               ///< largest over smallest of them; ∞ for a zero one
  double tolerance = 0.0;               ///< singular values up to tolerance·largest count as zero
  int rank = 0;                         ///< number of those above
  int noise_rank = 0;                   ///< rank less directions made of noise; equal to rank where noise is unknown
  std::vector<Eigen::Index> base;       ///< `rank` parameters whose columns span all others
  std::vector<KnownCombination> seen;   ///< base parameters: one for each of `base`, what is estimated in its place
  std::vector<UnseenDirection> unseen;  ///< directions not seen, the surest first
  std::vector<KnownCombination> known;  ///< uncorrelated combinations, best known first; empty without covariance
};

/// Judges R with columns scaled to length one.
///
/// Numerical rank: singular values above 64·p·ε·√N of the largest, ε = 2⁻⁵³: N rows with rounding errors of a few ε, in
/// random directions, move a singular value by about ε√N relative to unit columns, 64 leaves room for the filter's own
/// rounding. From a Gram matrix √(64·p·ε·√N), since errors enter Σ YᵀY.
///
/// Base parameters (Gautier 1991): QR with column pivoting, where the first column is taken whose rest is at least half
/// the longest rest: the order of the parameters decides between equals. With R_2 = R_1β for the columns left over, the
/// log sees θ_1 + βθ_2 only.
///
/// Noise: directions z in the seen space with zᵀ(RᵀR − 9N)z <= 0, counted by the signs of eigenvalues, which no scaling
/// changes (Sylvester).
///
/// Precision: eigenvectors of the covariance in units of `size`; an eigenvalue above one is a direction of which the
/// log says less than was known before.
[[nodiscard]] Identifiability identifiability(const IdentifiabilityInput& input);

}  // namespace wheelwright
