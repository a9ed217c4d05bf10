// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/estimator_choice.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/QR>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

constexpr int kSimulations = 2;  // the second at the parameters that the first gave

bool kept(const EstimatorOptions& options, Eigen::Index j) {
  return options.excluded.empty() || !options.excluded[static_cast<std::size_t>(j)];
}

bool strong(const EstimatorCandidate& c, const EstimatorChoiceOptions& options) {
  for (Eigen::Index j = 0; j < c.strength.size(); ++j) {
    if (kept(options.estimator, j) && !(c.strength[j] >= options.weak)) {
      return false;
    }
  }
  return true;
}

// First-order bias of least squares, N θ against Σ YᵀY, in its standard errors.
Eigen::VectorXd bias_of_least_squares(const EstimatorEvidence& evidence, const Estimate& squares,
                                      const EstimatorOptions& options) {
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(evidence.rows.outputs()));
  Eigen::MatrixXd gram = evidence.rows.total(w).YY;
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(gram.rows(), gram.cols());
  for (std::size_t i = 0; i < evidence.noise->YY.size(); ++i) {
    const double weight = w[static_cast<Eigen::Index>(i)];
    noise += static_cast<double>(evidence.rows.instants()) * weight * weight * evidence.noise->YY[i];
  }
  for (Eigen::Index j = 0; j < gram.rows(); ++j) {
    if (!kept(options, j)) {
      gram.row(j).setZero();
      gram.col(j).setZero();
      noise.row(j).setZero();
    }
  }
  const Eigen::VectorXd scale = gram.diagonal().cwiseSqrt().unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 0.0; });
  const Eigen::MatrixXd scaled = scale.asDiagonal() * gram * scale.asDiagonal();
  const Eigen::VectorXd bias = scale.asDiagonal() * scaled.completeOrthogonalDecomposition().solve(
                                                        Eigen::VectorXd(scale.asDiagonal() * (noise * squares.theta)));
  return bias.binaryExpr(squares.standard_error, [](double b, double se) { return se > 0.0 ? -b / se : 0.0; });
}

EstimatorCandidate with_instruments(const RegressionMoments& moments, std::string origin,
                                    const EstimatorOptions& options) {
  return {instrumental_variables(moments, options), std::move(origin), instrument_strength(moments, options)};
}

std::optional<EstimatorCandidate> simulated(const EstimatorEvidence& evidence, Eigen::VectorXd theta,
                                            const EstimatorOptions& options) {
  std::optional<EstimatorCandidate> candidate;
  for (int k = 0; evidence.simulate && k < kSimulations; ++k) {
    const auto moments = evidence.simulate(theta);
    if (!moments) {
      break;
    }
    candidate = with_instruments(*moments, "a simulation of the fitted model", options);
    if (!candidate->estimate.usable) {
      break;
    }
    theta = candidate->estimate.theta;
  }
  return candidate;
}

std::string words(const EstimatorCandidate& c) {
  return c.estimate.estimator == Estimator::bias_compensated
             ? "bias-compensated least squares (noise of the motion: " + c.origin + ")"
             : "instrumental variables from " + c.origin;
}

}  // namespace

EstimatorChoice choose_estimator(const EstimatorEvidence& evidence, const EstimatorChoiceOptions& options) {
  const EstimatorOptions& how = options.estimator;
  EstimatorChoice choice;
  choice.candidates.push_back({ordinary_least_squares(evidence.rows, how), "", {}});
  if (!choice.candidates[0].estimate.usable) {
    choice.reason = "least squares cannot be solved: " + choice.candidates[0].estimate.reason;
    return choice;
  }
  std::optional<std::size_t> best;
  const auto offer = [&](std::optional<EstimatorCandidate> candidate) {
    if (!candidate) {
      return;
    }
    const bool good = candidate->estimate.usable && strong(*candidate, options);
    choice.candidates.push_back(std::move(*candidate));
    if (good && !best) {
      best = choice.candidates.size() - 1;
    }
  };
  if (evidence.noise) {
    choice.predicted_bias = bias_of_least_squares(evidence, choice.candidates[0].estimate, how);
  }
  const double bias = evidence.noise ? choice.predicted_bias.cwiseAbs().maxCoeff() : 0.0;
  const bool negligible = evidence.noise && bias <= options.negligible_bias;
  if (evidence.rows.has_instruments()) {
    offer(with_instruments(evidence.rows, "the commanded motion", how));
  }
  if (!negligible) {
    const Eigen::VectorXd start = choice.candidates[best.value_or(0)].estimate.theta;
    const auto compensated = [&]() -> std::optional<EstimatorCandidate> {
      if (!evidence.noise) {
        return std::nullopt;
      }
      return EstimatorCandidate{bias_compensated(evidence.rows, *evidence.noise, how), evidence.noise_origin, {}};
    };
    if (evidence.effort_is_exact && !best) {
      offer(simulated(evidence, start, how));
      offer(compensated());
    } else {
      offer(compensated());
      if (!best) {
        offer(simulated(evidence, start, how));
      }
    }
  }
  if (best && choice.candidates[*best].estimate.influence.cols() == choice.candidates[0].estimate.influence.cols()) {
    choice.tested_against = best;
    choice.test = contrast_test(choice.candidates[0].estimate, choice.candidates[*best].estimate, how);
  }
  const std::string tested =
      choice.tested_against ? fmt::format("; Durbin-Wu-Hausman p = {:.2g}", choice.test.p_value) : "";
  if (negligible) {
    choice.reason = fmt::format(
        "least squares: the noise of the motion ({}) biases no parameter by more than {:.2g} of its standard error{}",
        evidence.noise_origin, bias, tested);
  } else if (best) {
    choice.chosen = *best;
    choice.reason = words(choice.candidates[*best]) +
                    (evidence.noise ? fmt::format(": noise of the motion would bias least squares by up to {:.2g} "
                                                  "standard errors{}",
                                                  bias, tested)
                                    : fmt::format(": the noise of the motion is not known{}", tested));
  } else {
    choice.in_doubt = true;
    choice.reason =
        "least squares, for want of instruments or a known noise of the motion: noise of the speeds may bias inertias "
        "towards zero; log the commanded speeds";
  }
  return choice;
}

}  // namespace wheelwright
