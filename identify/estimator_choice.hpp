// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which estimator to believe on a log, and why.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/estimate.hpp>

namespace wheelwright {

/// What a log offers for the choice.
struct EstimatorEvidence {
  RegressionMoments rows;  ///< of the log; with instruments where the commanded motion is logged
  /// Moments with instruments from a simulation of the model at θ; nothing where it cannot be simulated or runs away. May
  /// be empty.
  std::function<std::optional<RegressionMoments>(const Eigen::VectorXd& theta)> simulate;
  std::optional<RowNoise> noise;  ///< what the noise of the motion adds to the rows, where that is known
  std::string noise_origin;       ///< in words, e.g. "0.002 rad/s by differences"
  bool effort_is_exact = false;   ///< the efforts are commands: simulated instruments hold no noise at all
};

/// One estimate and where it comes from.
struct EstimatorCandidate {
  Estimate estimate;
  std::string origin;        ///< of instruments or noise, in words; empty for least squares
  Eigen::VectorXd strength;  ///< of instruments (instrument_strength); empty without
};

/// The choice with everything behind it.
struct EstimatorChoice {
  std::vector<EstimatorCandidate> candidates;  ///< least squares first
  std::size_t chosen = 0;                      ///< index of the one to believe
  std::string reason;                          ///< one sentence
  std::optional<std::size_t> tested_against;   ///< candidate to which least squares was compared
  ContrastTest test;                           ///< Durbin-Wu-Hausman, where tested_against
  Eigen::VectorXd predicted_bias;  ///< p, of least squares in its standard errors, where the noise is known; else empty
  bool in_doubt = false;           ///< noise of the motion may bias the estimate, and nothing could be done about it

  [[nodiscard]] const Estimate& best() const { return candidates[chosen].estimate; }
};

/// What the choice goes by.
struct EstimatorChoiceOptions {
  EstimatorOptions estimator;
  double negligible_bias = 0.1;  ///< of a standard error
  double weak = 0.1;             ///< instruments of less strength for a parameter are not used
};

/// Least squares where the known noise of the motion biases no parameter by more than `negligible_bias`. Otherwise the
/// first of these that can be had: instruments from the commanded motion; simulated ones where efforts are exact; bias
/// compensation; simulated instruments. The rule does not look at the test's outcome, since an estimate chosen by a test
/// no longer has the intervals it claims (Guggenberger 2010); the test is reported beside it. Where nothing can be had, least
/// squares stays, and `in_doubt` says so.
[[nodiscard]] EstimatorChoice choose_estimator(const EstimatorEvidence& evidence,
                                               const EstimatorChoiceOptions& options = {});

}  // namespace wheelwright
