// SPDX-License-Identifier: Apache-2.0
/// \file
/// Estimators of θ_L on the moments of a log, each with the influence function of every block of time. From the
/// influences follow covariances that are valid under autocorrelation, tests of one estimator against another, and the
/// choice of one for a log, with its reason.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "identify/moments.hpp"

namespace wheelwright::identify {

/// Estimator of θ̂_L.
enum class Estimator {
  least_squares,           ///< min Σ w²(y − Yθ)²: biased towards zero where Y is noisy
  instrumental_variables,  ///< Σ w² Zᵀ(y − Yθ) = 0 with instruments Z that share nothing with the noise of Y and y
  bias_compensated,        ///< least squares with the noise's share taken out of Σ YᵀY
  total_least_squares,     ///< the same with the size of the noise found from the residuals, its shape known
};

/// Name for people and files: "least_squares", …
[[nodiscard]] std::string_view to_string(Estimator estimator);

/// θ̂_L and what is known about its error. Parameters that were left out are zero, in covariance and influence too.
struct Estimate {
  Estimator estimator = Estimator::least_squares;
  bool usable = false;             ///< whether the equations could be solved; if not, `reason` says why
  std::string reason;              ///< empty where usable
  Eigen::VectorXd theta;           ///< p
  Eigen::MatrixXd covariance;      ///< p × p, allows for autocorrelation (moments.hpp)
  Eigen::VectorXd standard_error;  ///< p
  double freedom = 0.0;            ///< of Student's t for intervals
  Eigen::MatrixXd influence;  ///< p × blocks: θ̂ − θ is nearly the sum of its columns, each from one block of time
};

/// Options that the estimators share.
struct EstimatorOptions {
  Eigen::VectorXd weights;            ///< one for each output (moments.hpp, efficient_weights); empty: all one
  std::vector<bool> excluded;         ///< parameters held at zero; empty: none
  std::size_t most_frequencies = 24;  ///< of the long-run covariance
};

/// Second moments that noise adds to Σ YᵀY and Σ y² at one instant.
struct RowNoise {
  std::vector<Eigen::MatrixXd> YY;  ///< per output p × p: E δYᵀδY
  Eigen::VectorXd yy;               ///< per output: E δy² (total least squares)
  double relative_sd = 0.0;         ///< standard error of the noise's variance, relative to it, where it was estimated
};

/// Ordinary (weighted) least squares.
[[nodiscard]] Estimate ordinary_least_squares(const RegressionMoments& moments, const EstimatorOptions& options = {});

/// Instrumental variables, as many as parameters (Söderström and Stoica 1983): θ̂ = (Σ w²ZᵀY)⁻¹ Σ w²Zᵀy. Throws
/// InvalidArgument for moments without instruments.
[[nodiscard]] Estimate instrumental_variables(const RegressionMoments& moments, const EstimatorOptions& options = {});

/// Bias-compensated least squares (Stoica and Söderström 1982): θ̂ = (Σ w²YᵀY − N)⁻¹ Σ w²Yᵀy with N the sum of
/// `noise.YY`. Not usable where less than a tenth of a direction's Σ YᵀY would be left: what remains would be noise.
[[nodiscard]] Estimate bias_compensated(const RegressionMoments& moments, const RowNoise& noise,
                                        const EstimatorOptions& options = {});

/// Total least squares for noise of known shape and unknown size (Golub and Van Loan 1980; Van Huffel and Vandewalle
/// 1991): λ = min over θ of Σ w²(y − Yθ)² / (θᵀNθ + Σ w² E δy²), at which θ̂ = (Σ w²YᵀY − λN)⁻¹ Σ w²Yᵀy.
[[nodiscard]] Estimate total_least_squares(const RegressionMoments& moments, const RowNoise& noise,
                                           const EstimatorOptions& options = {});

/// Share of the variation of each column of Y that the instruments explain beyond what they explain of the other
/// columns (Shea 1997): 1 for instruments as good as Y, 0 for useless ones. NaN where it cannot be computed.
[[nodiscard]] Eigen::VectorXd instrument_strength(const RegressionMoments& moments,
                                                  const EstimatorOptions& options = {});

/// Relevance of the instruments for each parameter's column: F of the first stage, robust to autocorrelation. With z =
/// Zh the combination of instruments that is orthogonal to all other columns of Y (the one that estimates θ_j) and π =
/// Σ zY_j / Σ z², F_j = (Σ zY_j)² over the long-run variance of Σ z(Y_j − πz). Below about 10 instruments are weak, and
/// intervals are not to be trusted (Staiger and Stock 1997); noise in Y alone does not make them weak. NaN where it
/// cannot be computed, infinite for instruments that are the columns themselves.
[[nodiscard]] Eigen::VectorXd instrument_relevance(const RegressionMoments& moments,
                                                   const EstimatorOptions& options = {});

/// A test whether two estimators of the same θ differ by more than chance.
struct ContrastTest {
  bool made = false;           ///< false: the log is too short for it, p_value is 1 and means nothing
  double statistic = 0.0;      ///< F
  double p_value = 1.0;        ///< probability of a contrast as large by chance
  Eigen::VectorXd difference;  ///< p, second minus first
  Eigen::VectorXd t;           ///< p, difference over its standard error; 0 where both agree exactly
};

/// Durbin, Wu and Hausman's test with a covariance that allows for autocorrelation: the difference of two estimates is
/// judged by the long-run covariance of the difference of their influences, which needs neither to be efficient
/// (Hausman 1978). Hotelling's T² against F(q, B − q + 1) for q parameters and B frequencies.
[[nodiscard]] ContrastTest contrast_test(const Estimate& first, const Estimate& second,
                                         const EstimatorOptions& options = {});

/// Evidence of a log for the choice.
struct EstimatorEvidence {
  RegressionMoments rows;  ///< of the log; with instruments where the commanded motion is logged
  /// Moments with instruments from a simulation of the model at θ; nothing where it cannot be simulated or runs away.
  /// May be empty.
  std::function<std::optional<RegressionMoments>(const Eigen::VectorXd& theta)> simulate;
  std::optional<RowNoise> noise;  ///< what the noise of the motion adds to the rows, where that is known
  bool noise_is_limit = false;   ///< `noise` is an upper limit: good for saying that it does not matter, not for taking
                                 ///< it away
  std::string noise_origin;      ///< in words, e.g. "0.002 rad/s by differences"
  bool effort_is_exact = false;  ///< the efforts are commands: simulated instruments hold no noise at all
};

/// One estimate and where it comes from.
struct EstimatorCandidate {
  Estimate estimate;
  std::string origin;         ///< of instruments or noise, in words; empty for least squares
  Eigen::VectorXd strength;   ///< of instruments (instrument_strength); empty without
  Eigen::VectorXd relevance;  ///< of instruments (instrument_relevance); empty without
};

/// The choice with everything behind it.
struct EstimatorChoice {
  std::vector<EstimatorCandidate> candidates;  ///< least squares first
  std::size_t chosen = 0;                      ///< index of the one to believe
  std::string reason;                          ///< one sentence
  std::optional<std::size_t> tested_against;   ///< candidate with instruments to which least squares was compared
  ContrastTest test;                           ///< Durbin-Wu-Hausman, where tested_against
  Eigen::VectorXd predicted_bias;  ///< p, of least squares in its standard errors (infinite where the noise is as large
                                   ///< as the motion), where the noise or its limit is known; else empty
  bool in_doubt = false;           ///< noise of the motion may bias the estimate, and nothing could be done about it

  [[nodiscard]] const Estimate& best() const { return candidates[chosen].estimate; }
};

/// Options of the choice.
struct EstimatorChoiceOptions {
  EstimatorOptions estimator;
  double negligible_bias = 0.1;  ///< of a standard error
  double weak = 10.0;            ///< instruments of less relevance for a parameter are not used
  double imprecise = 3.0;  ///< bias compensation with so many times the standard error of simulated instruments, in
                           ///< any parameter, gives way to them
};

/// Least squares where the noise of the motion, or its limit, biases no parameter by more than `negligible_bias`.
/// Otherwise the first of these that can be had: instruments from the commanded motion; simulated ones where efforts
/// are exact; bias compensation where the noise itself is known, unless it is `imprecise`; simulated instruments. Where
/// efforts are measured, the standard errors of simulated instruments hold what noise of the efforts can have done at
/// most: θ_j times the residual's power over that of the parameter's own part of the effort. Total least squares is
/// shown where both noises are known, and never taken. The rule does not look at the test's outcome, since an estimate
/// chosen by a test no longer has the intervals it claims (Guggenberger 2010); the test is reported beside it, against
/// instruments only: bias compensation differs from least squares by what is assumed of the noise. Where nothing can be
/// had, least squares stays, and `in_doubt` says so.
[[nodiscard]] EstimatorChoice choose_estimator(const EstimatorEvidence& evidence,
                                               const EstimatorChoiceOptions& options = {});

}  // namespace wheelwright::identify
