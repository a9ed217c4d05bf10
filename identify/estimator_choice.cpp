// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/estimator_choice.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright::identify {
namespace {

constexpr int kSimulations = 2;  // the second at the parameters that the first gave

bool kept(const EstimatorOptions& options, Eigen::Index j) {
  return options.excluded.empty() || !options.excluded[static_cast<std::size_t>(j)];
}

bool strong(const EstimatorCandidate& c, const EstimatorChoiceOptions& options) {
  for (Eigen::Index j = 0; j < c.relevance.size(); ++j) {
    if (kept(options.estimator, j) && !(c.relevance[j] >= options.weak)) {
      return false;
    }
  }
  return true;
}

// Bias of least squares, −(ΣYᵀY − N)⁻¹Nθ̂ with N the noise in ΣYᵀY, in its standard errors.
Eigen::VectorXd bias_of_least_squares(const EstimatorEvidence& evidence, const Estimate& squares,
                                      const EstimatorOptions& options) {
  const Eigen::VectorXd w = options.weights.size() > 0
                                ? options.weights
                                : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(evidence.rows.outputs()));
  const Eigen::MatrixXd whole = evidence.rows.total(w).YY;
  Eigen::MatrixXd noise = Eigen::MatrixXd::Zero(whole.rows(), whole.cols());
  for (std::size_t i = 0; i < evidence.noise->YY.size(); ++i) {
    const double weight = w[static_cast<Eigen::Index>(i)];
    noise += static_cast<double>(evidence.rows.instants()) * weight * weight * evidence.noise->YY[i];
  }
  std::vector<Eigen::Index> in;
  for (Eigen::Index j = 0; j < whole.rows(); ++j) {
    if (kept(options, j)) {
      in.push_back(j);
    }
  }
  const Eigen::VectorXd scale = whole.diagonal()(in).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd signal = scale.asDiagonal() * (whole - noise)(in, in) * scale.asDiagonal();
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(whole.rows());
  const core::CholeskyFactors factor(signal);
  if (!factor.positive()) {
    bias(in).setConstant(std::numeric_limits<double>::infinity());
    return bias;
  }
  const Eigen::VectorXd pull = scale.asDiagonal() * (noise * squares.theta)(in);
  bias(in) = -(scale.asDiagonal() * factor.solve(pull)).cwiseQuotient(squares.standard_error(in));
  return bias;
}

EstimatorCandidate with_instruments(const RegressionMoments& moments, std::string origin,
                                    const EstimatorOptions& options) {
  return {instrumental_variables(moments, options), std::move(origin), instrument_strength(moments, options),
          instrument_relevance(moments, options)};
}

// What noise of measured efforts can do to simulated instruments, which hold it: at most θ_j times the residual's power
// over that of the parameter's own part of the effort.
void allow_for_noisy_efforts(Estimate& e, const RegressionMoments& moments, const EstimatorOptions& options) {
  const MomentSums total =
      moments.total(options.weights.size() > 0 ? options.weights
                                               : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs())));
  const double rss = std::max(0.0, total.yy - 2.0 * total.Yy.dot(e.theta) + e.theta.dot(total.YY * e.theta));
  std::vector<Eigen::Index> in;
  for (Eigen::Index j = 0; j < e.theta.size(); ++j) {
    if (kept(options, j)) {
      in.push_back(j);
    }
  }
  const Eigen::VectorXd scale = total.YY.diagonal()(in).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd inverse = core::inverse(scale.asDiagonal() * total.YY(in, in) * scale.asDiagonal());
  for (std::size_t k = 0; k < in.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double own = 1.0 / (inverse(at, at) * scale[at] * scale[at]);  // Σ of the column beyond the others
    const double theta = e.theta[in[k]];
    const double bias = theta != 0.0 ? rss / (own * std::abs(theta)) : 0.0;
    e.covariance(in[k], in[k]) += bias * bias;
  }
  e.standard_error = e.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
}

std::optional<EstimatorCandidate> simulated(const EstimatorEvidence& evidence, Eigen::VectorXd theta,
                                            const EstimatorOptions& options) {
  std::optional<EstimatorCandidate> best;
  for (int k = 0; evidence.simulate && k < kSimulations; ++k) {
    const auto moments = evidence.simulate(theta);
    if (!moments) {
      break;
    }
    EstimatorCandidate candidate = with_instruments(*moments, "a simulation of the fitted model", options);
    const bool usable = candidate.estimate.usable;
    const Eigen::VectorXd next = candidate.estimate.theta;
    if (usable && !evidence.effort_is_exact) {
      allow_for_noisy_efforts(candidate.estimate, *moments, options);
    }
    if (usable || !best) {
      best = std::move(candidate);
    }
    if (!usable) {
      break;
    }
    theta = next;
  }
  return best;
}

bool usable(const EstimatorCandidate& c, const EstimatorChoiceOptions& options) {
  return c.estimate.usable && strong(c, options);
}

bool much_less_precise(const Estimate& a, const Estimate& b, const EstimatorChoiceOptions& options) {
  for (Eigen::Index j = 0; j < a.standard_error.size(); ++j) {
    if (kept(options.estimator, j) && a.standard_error[j] > options.imprecise * b.standard_error[j]) {
      return true;
    }
  }
  return false;
}

// Why none of the candidates beside least squares can be taken.
std::string why_not(const EstimatorChoice& choice, const EstimatorEvidence& evidence) {
  std::string text;
  for (std::size_t k = 1; k < choice.candidates.size(); ++k) {
    const EstimatorCandidate& c = choice.candidates[k];
    text += fmt::format(
        "; {} {}", c.relevance.size() > 0 ? "instruments from " + c.origin : "bias compensation",
        c.estimate.usable ? "move too little with the robot" : "cannot be used (" + c.estimate.reason + ")");
  }
  if (!evidence.rows.has_instruments()) {
    text += "; log the commanded speeds";
  }
  return text;
}

std::string words(const EstimatorCandidate& c) {
  return c.estimate.estimator == Estimator::bias_compensated ? "bias-compensated least squares"
                                                             : "instrumental variables from " + c.origin;
}

}  // namespace

EstimatorChoice choose_estimator(const EstimatorEvidence& evidence, const EstimatorChoiceOptions& options) {
  const EstimatorOptions& how = options.estimator;
  EstimatorChoice choice;
  choice.candidates.push_back({ordinary_least_squares(evidence.rows, how), "", {}, {}});
  if (!choice.candidates[0].estimate.usable) {
    choice.reason = "least squares cannot be solved: " + choice.candidates[0].estimate.reason;
    return choice;
  }
  if (evidence.noise) {
    choice.predicted_bias = bias_of_least_squares(evidence, choice.candidates[0].estimate, how);
  }
  const double bias = evidence.noise ? choice.predicted_bias.cwiseAbs().maxCoeff() : 0.0;
  const bool negligible = evidence.noise && bias <= options.negligible_bias;

  std::optional<std::size_t> best;
  const auto offer = [&](std::optional<EstimatorCandidate> candidate) -> std::optional<std::size_t> {
    if (!candidate) {
      return std::nullopt;
    }
    choice.candidates.push_back(std::move(*candidate));
    const std::size_t at = choice.candidates.size() - 1;
    return usable(choice.candidates[at], options) ? std::optional(at) : std::nullopt;
  };
  if (evidence.rows.has_instruments()) {
    best = offer(with_instruments(evidence.rows, "the commanded motion", how));
  }
  if (!negligible) {
    const bool known = evidence.noise && !evidence.noise_is_limit;
    const auto compensated =
        known ? offer(EstimatorCandidate{
                    bias_compensated(evidence.rows, *evidence.noise, how), evidence.noise_origin, {}, {}})
              : std::nullopt;
    if (known && evidence.noise->yy.size() > 0) {
      offer(EstimatorCandidate{total_least_squares(evidence.rows, *evidence.noise, how),
                               "shape of the noise: " + evidence.noise_origin + ", effort as declared",
                               {},
                               {}});
    }
    if (!best) {
      const auto at = offer(simulated(evidence, choice.candidates[compensated.value_or(0)].estimate.theta, how));
      const bool simulation_first =
          at && (evidence.effort_is_exact || !compensated ||
                 much_less_precise(choice.candidates[*compensated].estimate, choice.candidates[*at].estimate, options));
      best = simulation_first ? at : compensated;
    }
  }
  for (std::size_t k = 1; k < choice.candidates.size() && !choice.tested_against; ++k) {
    const EstimatorCandidate& c = choice.candidates[k];
    if (c.relevance.size() > 0 && usable(c, options) &&
        c.estimate.influence.cols() == choice.candidates[0].estimate.influence.cols()) {
      choice.tested_against = k;
      choice.test = contrast_test(choice.candidates[0].estimate, c.estimate, how);
    }
  }
  const std::string tested = choice.tested_against && choice.test.made
                                 ? fmt::format("; Durbin-Wu-Hausman p = {:.2g}", choice.test.p_value)
                                 : "";
  const std::string origin = evidence.noise_origin + (evidence.noise_is_limit ? " at most" : "");
  if (negligible) {
    choice.reason = fmt::format(
        "least squares: noise of the motion ({}) biases no parameter by more than {:.2g} of its standard "
        "error{}",
        origin, bias, tested);
  } else if (best) {
    choice.chosen = *best;
    const std::string why =
        !evidence.noise ? "the noise of the motion is not known"
        : std::isfinite(bias)
            ? fmt::format("noise of the motion ({}) could bias least squares by {:.2g} standard errors", origin, bias)
            : fmt::format("noise of the motion ({}) may be as large as the motion itself", origin);
    choice.reason = words(choice.candidates[*best]) + ": " + why + tested;
  } else {
    choice.in_doubt = true;
    choice.reason =
        "least squares, although noise of the motion may bias inertias towards zero" + why_not(choice, evidence);
  }
  return choice;
}

}  // namespace wheelwright::identify
