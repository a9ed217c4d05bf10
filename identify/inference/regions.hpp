// SPDX-License-Identifier: Apache-2.0
/// \file
/// Confidence regions of θ: sign-perturbed sums, and all methods side by side.
///
/// Sign-perturbed sums: a confidence region for θ whose probability is exact for any finite log and any symmetric
/// noise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "identify/estimate.hpp"
#include "identify/inference/block_bootstrap.hpp"
#include "identify/moments.hpp"

namespace wheelwright::inference {

/// Options of the region.
struct SignPerturbedOptions {
  identify::EstimatorOptions
      estimator;             ///< weights and parameters that are zero; weights made of the log's own residuals keep the
                             ///< probability nearly, given ones exactly
  bool instruments = true;   ///< use the instruments where the moments have them (Volpe, Csáji and Weyer 2015)
  double confidence = 0.95;  ///< asked for; `probability()` is the next one of the form 1 − q/m
  std::size_t sums = 400;    ///< m, the sum as it is and m − 1 perturbed ones
  double seconds = 0.0;      ///< length of a group with one sign, s; 0: chosen from the autocorrelation of the scores,
                             ///< so that neighbours' correlation is a tenth of the sum's variance at most
  std::size_t groups = 24;   ///< at least so many where the length is chosen
  std::uint64_t seed = 1;    ///< of the signs and of the order among ties
};

/// Outer bounds of the region.
struct SignPerturbedBounds {
  Eigen::VectorXd lower;  ///< p; −∞ where the region is not bounded; zero for parameters that were left out
  Eigen::VectorXd upper;  ///< p
  Eigen::MatrixXd H;      ///< p × p: the region lies in (θ − θ̂)ᵀ H (θ − θ̂) <= radius
  double radius = 0.0;    ///< ∞ where the ellipsoid is not bounded
};

/// Region of all θ for which ‖S_0(θ)‖² is not among the q largest of m sums
///
///     S_i(θ) = P^{−1/2} Σ_g α_{i,g} s_g(θ),   s_g(θ) = Σ of w²Zᵀ(y − Yθ) over group g of blocks of time
///
/// with α_{0,g} = 1, other α random signs, Z = Y for least squares and P = Σ w²ZᵀZ (Csáji, Campi and Weyer 2015).
///
/// Promise: P(θ° in region) = 1 − q/m exactly, for any number of groups, if at the true θ° the joint distribution of
/// the scores (s_1, …, s_G) given Z is unchanged when any of them change sign: for example when Z is independent of the
/// error, and errors of different groups are independent and jointly symmetric within each group. Within a group errors
/// may be correlated in any way. No moment of them need exist. A length of groups, or weights, found from the same log
/// make this an approximation.
class SignPerturbedSums {
 public:
  /// Draws the signs. Throws InvalidArgument for options out of range or too few `sums` for the confidence.
  explicit SignPerturbedSums(const identify::RegressionMoments& moments, const SignPerturbedOptions& options = {});

  /// True if the sums could be formed; if not, nothing is excluded: the region is everything.
  [[nodiscard]] bool usable() const { return usable_; }
  /// Why not; empty where usable.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// 1 − q/m.
  [[nodiscard]] double probability() const;
  /// Number of groups G with a sign each.
  [[nodiscard]] std::size_t groups() const { return groups_; }
  /// Length of a group, s.
  [[nodiscard]] double group_seconds() const { return group_seconds_; }
  /// Estimated share of the sum's variance that groups do not see because their neighbours are correlated
  /// (block_bootstrap.hpp): 0 where the assumption holds; above 0.05 the log is short for its errors' memory, and the
  /// region is too small.
  [[nodiscard]] double edge_share() const { return edge_share_; }
  /// θ̂ (p), where S_0 = 0: always in the region, up to ties.
  [[nodiscard]] const Eigen::VectorXd& centre() const { return centre_; }
  /// True if θ (p) is in the region. Entries of parameters that were left out are not looked at.
  [[nodiscard]] bool contains(const Eigen::VectorXd& theta) const;
  /// Bounds that hold the region. A member satisfies ‖S_0‖ <= ‖S_i‖ for at least q of the i, each an ellipsoid: its
  /// largest ‖S_0‖² by the S-lemma, min over ξ of one scalar (any ξ bounds it), and its extent in θ_j in closed form;
  /// the q-th largest of these bound the member. The box is never wider than the ellipsoid's.
  [[nodiscard]] SignPerturbedBounds bounds() const;

 private:
  bool usable_ = false;
  std::string reason_;
  std::size_t m_, q_, parameters_;
  std::size_t groups_ = 0;
  double group_seconds_ = 0.0;
  double edge_share_ = 0.0;
  std::vector<Eigen::Index> kept_;
  Eigen::VectorXd centre_;
  Eigen::VectorXd scale_, psi_;       // of the kept parameters
  Eigen::MatrixXd A_, c_;             // q² × m, q × m: P^{-1/2} applied; column 0 is unperturbed
  std::vector<std::uint64_t> order_;  // m, decides ties
};

/// Method of a row of the comparison.
enum class RegionMethod { student_t, block_bootstrap, sign_perturbed_sums, interval_hull };

/// Name for people and files: "student_t", …
[[nodiscard]] std::string_view to_string(RegionMethod method);

/// Intervals by one method.
struct RegionRow {
  RegionMethod method = RegionMethod::student_t;
  bool available = false;    ///< if not, `remark` says why
  bool all_at_once = false;  ///< the promise is for all parameters together, not for each of them
  double confidence = 0.0;   ///< of the promise; 1 for the interval hull
  Eigen::VectorXd lower;     ///< p; ±∞ where there is no bound
  Eigen::VectorXd upper;     ///< p
  std::string promise;       ///< one line: how often, and under which assumption
  std::string remark;        ///< why it is not available, or a doubt; may be empty
};

/// The interval hull, by the caller (bounds/).
struct IntervalBounds {
  Eigen::VectorXd lower;  ///< p
  Eigen::VectorXd upper;  ///< p
  Eigen::VectorXd error;  ///< ē of each output
  std::string unit;       ///< of ē, may be empty
};

/// Options of the comparison.
struct RegionOptions {
  double confidence = 0.95;
  BlockBootstrapOptions bootstrap;      ///< `confidence` and `instruments` are set by the comparison
  SignPerturbedOptions sign_perturbed;  ///< the same
};

/// One row for each method.
struct RegionComparison {
  Eigen::VectorXd theta;           ///< p, of the estimate
  std::vector<RegionRow> rows;     ///< Student's t, bootstrap, sign-perturbed sums, and the hull where it was given
  double bootstrap_seconds = 0.0;  ///< length of a stretch
  double sign_seconds = 0.0;       ///< length of a group with one sign
  std::size_t sign_groups = 0;
};

/// Compares on the moments of one log. Bootstrap and sign-perturbed sums take instruments when `estimate` is one of
/// instrumental variables; they have no form for the two estimators that take noise out of Σ YᵀY, are made for least
/// squares there, and the remark says so.
[[nodiscard]] RegionComparison compare_regions(const identify::RegressionMoments& moments,
                                               const identify::Estimate& estimate, const RegionOptions& options = {},
                                               const std::optional<IntervalBounds>& hull = std::nullopt);

}  // namespace wheelwright::inference
