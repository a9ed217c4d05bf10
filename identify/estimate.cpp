// SPDX-License-Identifier: Apache-2.0
#include "identify/estimate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <Eigen/Core>

#include "core/check.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/moments.hpp"

namespace wheelwright::identify {
namespace {

constexpr double kSingular = 1e-12;      // reciprocal condition, columns scaled
constexpr double kLeastShare = 0.1;      // of a direction's Σ YᵀY that must be signal
constexpr double kLeastContrast = 1e-9;  // of the estimates: a smaller difference is rounding

Eigen::VectorXd weights_of(const RegressionMoments& moments, const EstimatorOptions& options) {
  return options.weights.size() > 0 ? options.weights
                                    : Eigen::VectorXd::Ones(static_cast<Eigen::Index>(moments.outputs()));
}

std::vector<Eigen::Index> kept_columns(std::size_t p, const std::vector<bool>& excluded) {
  check::that(excluded.empty() || excluded.size() == p, "excluded parameters", "one flag for each");
  std::vector<Eigen::Index> kept;
  for (std::size_t j = 0; j < p; ++j) {
    if (excluded.empty() || !excluded[j]) {
      kept.push_back(static_cast<Eigen::Index>(j));
    }
  }
  return kept;
}

// A θ = b for the kept parameters, with A's columns and rows scaled. The inverse is kept for the influences.
class Equations {
 public:
  Equations(const Eigen::MatrixXd& A, const Eigen::VectorXd& row_scale, const Eigen::VectorXd& column_scale,
            const std::vector<Eigen::Index>& kept)
      : kept_(&kept) {
    const auto q = static_cast<Eigen::Index>(kept.size());
    rows_ = row_scale(kept);
    columns_ = column_scale(kept);
    for (Eigen::VectorXd* scale : {&rows_, &columns_}) {
      for (double& s : *scale) {
        s = s > 0.0 ? 1.0 / s : 1.0;
      }
    }
    const Eigen::MatrixXd scaled = rows_.asDiagonal() * A(kept, kept) * columns_.asDiagonal();
    lu_.emplace(q > 0 ? scaled : Eigen::MatrixXd(Eigen::MatrixXd::Identity(1, 1)));
    solvable_ = q > 0 && scaled.allFinite() && lu_->reciprocal_condition() > kSingular;
  }
  [[nodiscard]] bool solvable() const { return solvable_; }
  // Solution for the right-hand sides b (p × any), p × any with zeros for parameters that were left out.
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const {
    Eigen::MatrixXd x = Eigen::MatrixXd::Zero(b.rows(), b.cols());
    const Eigen::MatrixXd right = rows_.asDiagonal() * b(*kept_, Eigen::all);
    x(*kept_, Eigen::all) = columns_.asDiagonal() * lu_->solve(right);
    return x;
  }

 private:
  const std::vector<Eigen::Index>* kept_;
  Eigen::VectorXd rows_, columns_;
  std::optional<core::LuFactors> lu_;
  bool solvable_ = false;
};

Eigen::VectorXd column_sizes(const Eigen::MatrixXd& gram) { return gram.diagonal().cwiseMax(0.0).cwiseSqrt(); }

void finish(Estimate& e, const EstimatorOptions& options) {
  const LongRunCovariance covariance = long_run_covariance(e.influence, options.most_frequencies);
  e.covariance = covariance.matrix;
  e.freedom = covariance.freedom;
  e.standard_error = e.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  e.usable = e.theta.allFinite() && e.covariance.allFinite();
  if (!e.usable) {
    e.reason = "its equations have no finite solution";
  }
}

Estimate unusable(Estimator estimator, std::size_t p, std::string reason) {
  Estimate e;
  e.estimator = estimator;
  e.reason = std::move(reason);
  const auto size = static_cast<Eigen::Index>(p);
  e.theta = e.standard_error = Eigen::VectorXd::Zero(size);
  e.covariance = Eigen::MatrixXd::Zero(size, size);
  return e;
}

// Σ w² of what noise adds, at one instant.
struct NoiseSum {
  Eigen::MatrixXd YY;
  double yy = 0.0;
};

NoiseSum weighted(const RegressionMoments& moments, const RowNoise& noise, const Eigen::VectorXd& w) {
  const auto p = static_cast<Eigen::Index>(moments.parameters());
  check::that(noise.YY.size() == moments.outputs(), "row noise", "one matrix for each output");
  NoiseSum sum{Eigen::MatrixXd::Zero(p, p), 0.0};
  for (std::size_t i = 0; i < noise.YY.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    check::that(noise.YY[i].rows() == p && noise.YY[i].cols() == p, "row noise", "a p × p matrix for each output");
    sum.YY += w[at] * w[at] * noise.YY[i];
    sum.yy += noise.yy.size() > 0 ? w[at] * w[at] * noise.yy[at] : 0.0;
  }
  return sum;
}

}  // namespace

std::string_view to_string(Estimator estimator) {
  switch (estimator) {
    case Estimator::least_squares: return "least_squares";
    case Estimator::instrumental_variables: return "instrumental_variables";
    case Estimator::bias_compensated: return "bias_compensated";
    case Estimator::total_least_squares: return "total_least_squares";
  }
  return {};
}

Estimate ordinary_least_squares(const RegressionMoments& moments, const EstimatorOptions& options) {
  const Eigen::VectorXd w = weights_of(moments, options);
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const MomentSums total = moments.total(w);
  const Equations equations(total.YY, column_sizes(total.YY), column_sizes(total.YY), kept);
  if (!equations.solvable()) {
    return unusable(Estimator::least_squares, moments.parameters(), "the log does not tell the parameters apart");
  }
  Estimate e;
  e.estimator = Estimator::least_squares;
  e.theta = equations.solve(total.Yy);
  Eigen::MatrixXd scores(e.theta.size(), static_cast<Eigen::Index>(moments.blocks().size()));
  for (Eigen::Index b = 0; b < scores.cols(); ++b) {
    const MomentSums s = moments.block(static_cast<std::size_t>(b), w);
    scores.col(b) = s.Yy - s.YY * e.theta;
  }
  e.influence = equations.solve(scores);
  finish(e, options);
  return e;
}

Estimate instrumental_variables(const RegressionMoments& moments, const EstimatorOptions& options) {
  check::that(moments.has_instruments(), "instrumental variables", "moments with instruments");
  const Eigen::VectorXd w = weights_of(moments, options);
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const MomentSums total = moments.total(w);
  const Equations equations(total.ZY, column_sizes(total.ZZ), column_sizes(total.YY), kept);
  if (!equations.solvable()) {
    return unusable(Estimator::instrumental_variables, moments.parameters(),
                    "the instruments do not tell the parameters apart");
  }
  Estimate e;
  e.estimator = Estimator::instrumental_variables;
  e.theta = equations.solve(total.Zy);
  Eigen::MatrixXd scores(e.theta.size(), static_cast<Eigen::Index>(moments.blocks().size()));
  for (Eigen::Index b = 0; b < scores.cols(); ++b) {
    const MomentSums s = moments.block(static_cast<std::size_t>(b), w);
    scores.col(b) = s.Zy - s.ZY * e.theta;
  }
  e.influence = equations.solve(scores);
  finish(e, options);
  return e;
}

Estimate bias_compensated(const RegressionMoments& moments, const RowNoise& noise, const EstimatorOptions& options) {
  const Eigen::VectorXd w = weights_of(moments, options);
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const MomentSums total = moments.total(w);
  const NoiseSum per_instant = weighted(moments, noise, w);
  const auto instants = static_cast<double>(moments.instants());
  const Eigen::MatrixXd signal = total.YY - instants * per_instant.YY;
  const Eigen::VectorXd size = column_sizes(total.YY);
  const Equations equations(signal, size, size, kept);
  const auto q = static_cast<Eigen::Index>(kept.size());
  bool enough = equations.solvable();
  if (enough) {
    // Share of signal in every direction: eigenvalues of the signal relative to the whole.
    const Eigen::MatrixXd whole = total.YY(kept, kept);
    const std::optional<Eigen::VectorXd> shares = core::generalized_eigenvalues(signal(kept, kept), whole);
    enough = shares && shares->head(q).minCoeff() >= kLeastShare;
  }
  if (!enough) {
    return unusable(Estimator::bias_compensated, moments.parameters(),
                    "less than a tenth of the motion in some direction is signal, the rest noise");
  }
  Estimate e;
  e.estimator = Estimator::bias_compensated;
  e.theta = equations.solve(total.Yy);
  Eigen::MatrixXd scores(e.theta.size(), static_cast<Eigen::Index>(moments.blocks().size()));
  for (Eigen::Index b = 0; b < scores.cols(); ++b) {
    const MomentSums s = moments.block(static_cast<std::size_t>(b), w);
    const auto in_block = static_cast<double>(moments.blocks()[static_cast<std::size_t>(b)].instants);
    scores.col(b) = s.Yy - (s.YY - in_block * per_instant.YY) * e.theta;
  }
  e.influence = equations.solve(scores);
  finish(e, options);
  const Eigen::VectorXd by_noise = equations.solve(instants * noise.relative_sd * per_instant.YY * e.theta);
  e.covariance += by_noise * by_noise.transpose();
  e.standard_error = e.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  return e;
}

Estimate total_least_squares(const RegressionMoments& moments, const RowNoise& noise, const EstimatorOptions& options) {
  check::that(noise.yy.size() == static_cast<Eigen::Index>(moments.outputs()), "row noise",
              "the variance of y for each output");
  const Eigen::VectorXd w = weights_of(moments, options);
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const auto q = static_cast<Eigen::Index>(kept.size());
  const MomentSums total = moments.total(w);
  const NoiseSum per_instant = weighted(moments, noise, w);
  const auto instants = static_cast<double>(moments.instants());
  // Largest μ = 1/λ of C v = μ A v with A the moments of [Y y] and C those of its noise.
  Eigen::MatrixXd A(q + 1, q + 1), C = Eigen::MatrixXd::Zero(q + 1, q + 1);
  A.topLeftCorner(q, q) = total.YY(kept, kept);
  A.col(q).head(q) = total.Yy(kept);
  A.row(q).head(q) = total.Yy(kept).transpose();
  A(q, q) = total.yy;
  C.topLeftCorner(q, q) = instants * per_instant.YY(kept, kept);
  C(q, q) = instants * per_instant.yy;
  const Eigen::VectorXd scale = column_sizes(A).unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  const std::optional<Eigen::VectorXd> ratios = core::generalized_eigenvalues(
      scale.asDiagonal() * C * scale.asDiagonal(), scale.asDiagonal() * A * scale.asDiagonal());
  const bool solved = q > 0 && ratios && (*ratios)[q] > 0.0;
  const double lambda = solved ? 1.0 / (*ratios)[q] : 0.0;
  const Eigen::MatrixXd corrected = total.YY - lambda * instants * per_instant.YY;
  const Equations equations(corrected, column_sizes(total.YY), column_sizes(total.YY), kept);
  if (!solved || !equations.solvable()) {
    return unusable(Estimator::total_least_squares, moments.parameters(),
                    "the log does not tell the parameters from the noise");
  }
  Estimate e;
  e.estimator = Estimator::total_least_squares;
  e.theta = equations.solve(total.Yy);
  const double by_noise = instants * (e.theta.dot(per_instant.YY * e.theta) + per_instant.yy);
  const Eigen::VectorXd pull = instants * per_instant.YY * e.theta;
  Eigen::MatrixXd scores(e.theta.size(), static_cast<Eigen::Index>(moments.blocks().size()));
  for (Eigen::Index b = 0; b < scores.cols(); ++b) {
    const MomentSums s = moments.block(static_cast<std::size_t>(b), w);
    const double share = static_cast<double>(moments.blocks()[static_cast<std::size_t>(b)].instants) / instants;
    const double rss = s.yy - 2.0 * s.Yy.dot(e.theta) + e.theta.dot(s.YY * e.theta);
    const double of_lambda = by_noise > 0.0 ? (rss - lambda * share * by_noise) / by_noise : 0.0;
    scores.col(b) = s.Yy - s.YY * e.theta + lambda * share * pull + of_lambda * pull;
  }
  e.influence = equations.solve(scores);
  finish(e, options);
  return e;
}

Eigen::VectorXd instrument_strength(const RegressionMoments& moments, const EstimatorOptions& options) {
  check::that(moments.has_instruments(), "instrument strength", "moments with instruments");
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const MomentSums total = moments.total(weights_of(moments, options));
  Eigen::VectorXd strength = Eigen::VectorXd::Constant(total.Yy.size(), std::numeric_limits<double>::quiet_NaN());
  const auto unit = [](const Eigen::MatrixXd& gram) -> Eigen::VectorXd {
    return column_sizes(gram).unaryExpr([](double s) { return s > 0.0 ? 1.0 / s : 1.0; });
  };
  const Eigen::VectorXd of_Y = unit(total.YY)(kept), of_Z = unit(total.ZZ)(kept);
  const Eigen::MatrixXd YY = of_Y.asDiagonal() * total.YY(kept, kept) * of_Y.asDiagonal();
  const Eigen::MatrixXd ZY = of_Z.asDiagonal() * total.ZY(kept, kept) * of_Y.asDiagonal();
  const Eigen::MatrixXd ZZ = of_Z.asDiagonal() * total.ZZ(kept, kept) * of_Z.asDiagonal();
  if (kept.empty()) {
    return strength;
  }
  const core::LdltFactors of_YY(YY), of_ZZ(ZZ);
  if (of_YY.reciprocal_condition() < kSingular || of_ZZ.reciprocal_condition() < kSingular) {
    return strength;
  }
  const Eigen::MatrixXd explained = ZY.transpose() * of_ZZ.solve(ZY);
  const core::LdltFactors of_explained(explained);
  const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(YY.rows(), YY.cols());
  const Eigen::MatrixXd whole = of_YY.solve(identity);
  if (of_explained.reciprocal_condition() < kSingular) {
    for (const Eigen::Index j : kept) {
      strength[j] = 0.0;
    }
    return strength;
  }
  const Eigen::MatrixXd inverse = of_explained.solve(identity);
  for (std::size_t k = 0; k < kept.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    strength[kept[k]] = std::clamp(whole(at, at) / inverse(at, at), 0.0, 1.0);
  }
  return strength;
}

Eigen::VectorXd instrument_relevance(const RegressionMoments& moments, const EstimatorOptions& options) {
  check::that(moments.has_instruments(), "instrument relevance", "moments with instruments");
  const Eigen::VectorXd w = weights_of(moments, options);
  const auto kept = kept_columns(moments.parameters(), options.excluded);
  const MomentSums total = moments.total(w);
  const auto p = total.Yy.size();
  Eigen::VectorXd relevance = Eigen::VectorXd::Constant(p, std::numeric_limits<double>::quiet_NaN());
  const Equations transposed(total.ZY.transpose(), column_sizes(total.YY), column_sizes(total.ZZ), kept);
  if (!transposed.solvable()) {
    return relevance;
  }
  for (const Eigen::Index j : kept) {
    const Eigen::VectorXd h = transposed.solve(Eigen::VectorXd::Unit(p, j));  // hᵀ Σ ZᵀY = e_j
    const double squares = h.dot(total.ZZ * h);
    const double pi = squares > 0.0 ? 1.0 / squares : 0.0;
    Eigen::MatrixXd scores(1, static_cast<Eigen::Index>(moments.blocks().size()));
    for (Eigen::Index b = 0; b < scores.cols(); ++b) {
      const MomentSums s = moments.block(static_cast<std::size_t>(b), w);
      scores(0, b) = h.dot(s.ZY.col(j)) - pi * h.dot(s.ZZ * h);
    }
    const double variance = long_run_covariance(scores, options.most_frequencies).matrix(0, 0);
    relevance[j] = variance > 0.0 ? 1.0 / variance : std::numeric_limits<double>::infinity();
  }
  return relevance;
}

ContrastTest contrast_test(const Estimate& first, const Estimate& second, const EstimatorOptions& options) {
  check::that(first.usable && second.usable && first.influence.cols() == second.influence.cols(), "contrast test",
              "two usable estimates from the same moments");
  ContrastTest test;
  test.difference = second.theta - first.theta;
  test.t = Eigen::VectorXd::Zero(test.difference.size());
  const LongRunCovariance covariance =
      long_run_covariance(second.influence - first.influence, options.most_frequencies);
  std::vector<Eigen::Index> tested;
  for (Eigen::Index j = 0; j < test.difference.size(); ++j) {
    const double sd = std::sqrt(std::max(covariance.matrix(j, j), 0.0));
    const double size = std::max({std::abs(first.theta[j]), std::abs(second.theta[j]), first.standard_error[j]});
    if (sd > kLeastContrast * size && (options.excluded.empty() || !options.excluded[static_cast<std::size_t>(j)])) {
      test.t[j] = test.difference[j] / sd;
      tested.push_back(j);
    }
  }
  const auto q = static_cast<double>(tested.size());
  const double B = covariance.freedom;
  test.made = B >= q;
  if (tested.empty() || !test.made) {
    return test;
  }
  const Eigen::VectorXd scale = covariance.matrix.diagonal()(tested).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance.matrix(tested, tested) * scale.asDiagonal();
  const Eigen::VectorXd d = scale.asDiagonal() * test.difference(tested);
  const double t2 = d.dot(Eigen::VectorXd(core::minimum_norm_solution(correlation, d)));
  test.statistic = std::max(0.0, t2 * (B - q + 1.0) / (B * q));
  test.p_value = core::fisher_tail(q, B - q + 1.0, test.statistic);
  return test;
}

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
