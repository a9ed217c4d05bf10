// SPDX-License-Identifier: Apache-2.0
/// \file
/// Identifiability of the parameters from a log: base parameters, unidentified directions, best-determined combinations
/// (in numbers and in words, with the driving that excites them), and information over time.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "identify/least_squares.hpp"
#include "identify/moments.hpp"

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

/// Input. p parameters.
struct IdentifiabilityInput {
  std::vector<ParameterWords> parameters;  ///< p
  Eigen::MatrixXd factor;                  ///< any R (rows × p) with RᵀR = Σ w²YᵀY
  std::size_t instants = 0;                ///< of the log
  Eigen::MatrixXd noise;                   ///< p × p, Σ w² E δYᵀδY over all instants; empty: unknown
  Eigen::MatrixXd covariance;              ///< p × p, of θ̂, zero for parameters that were left out; empty: unknown
  Eigen::VectorXd size;  ///< p, > 0: what counts as large, the half-width of the prior or |θ̂_j|; empty: unknown
};

/// R, with the parameters of `rows` seen through the triangular factor of least squares: condition enters once.
[[nodiscard]] IdentifiabilityInput identifiability_input(const identify::LeastSquares& rows,
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

/// Division of the log.
struct InformationOptions {
  Eigen::VectorXd weights;  ///< one for each output; empty: all one
  double seconds = 0.0;     ///< length of a window, s; 0: a sixtieth of the log
  double coverage = 0.8;    ///< share that the shortest set of windows is to carry, in (0, 1]
};

/// Information about one parameter.
struct ParameterInformation {
  double information = 0.0;           ///< 1/[(Σ w²YᵀY)⁻¹]_jj; 0 where the log does not tell θ_j from the others
  Eigen::VectorXd share;              ///< of each window, sum 1; all zero without information
  Eigen::VectorXd cumulative;         ///< share up to the end of each window
  std::vector<std::size_t> shortest;  ///< fewest windows that carry `coverage`, in the order of time
  std::vector<std::pair<double, double>>
      spans;             ///< the same as stretches [first, last] of the log, s, neighbours joined
  double seconds = 0.0;  ///< their length together
};

/// Information over time.
struct InformationOverTime {
  std::vector<identify::MomentBlock> windows;
  double seconds = 0.0;  ///< from the first instant to the last; where time goes back, of all instants together
  std::vector<ParameterInformation> parameters;  ///< p
};

/// Partial information about θ_j is what its column holds beyond the other columns over the whole log, I_j = min over d
/// with d_j = 1 of dᵀ(Σ w²YᵀY)d: the inverse of θ̂_j's variance under white errors. With its minimising d the share of
/// window k is dᵀ(Σ_{in k} w²YᵀY)d / I_j: at least zero, and all of them add up to one. Windows are made of whole
/// blocks of the moments, none across an instant at which time goes back; in such a log lengths are those of the
/// instants at the median step.
[[nodiscard]] InformationOverTime information_over_time(const identify::RegressionMoments& moments,
                                                        const InformationOptions& options = {});

}  // namespace wheelwright::inference
