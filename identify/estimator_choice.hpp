// SPDX-License-Identifier: Apache-2.0
/// \file
/// Choice of an estimator for a log, with its reason.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/estimate.hpp>

namespace wheelwright::identify {

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
