// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/joint.hpp>

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/fisher_f.hpp>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/identify/block_sums.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/identify/residual_statistics.hpp>

namespace wheelwright {
namespace {

constexpr double kKnown = 1e-8;  // part of a column that the other columns must leave for a log to know its parameter

/// A log reduced to what the fit needs of it.
struct Reduced {
  Eigen::MatrixXd R;         // p × p
  Eigen::VectorXd c;         // Rθ ≈ c
  double rest = 0.0;         // sum of squares that no θ explains
  Eigen::VectorXd addition;  // p
  Eigen::VectorXd weights;   // n
  LeastSquaresFit own;
};

Reduced reduce(const JointLog& log, std::size_t p) {
  check::that(log.rows != nullptr, "joint fit, log '" + log.name + "'", "rows");
  check::that(log.rows->parameters() == p, "joint fit, log '" + log.name + "'", "a column for each parameter");
  check::that(
      log.addition.size() == 0 || (static_cast<std::size_t>(log.addition.size()) == p && log.addition.allFinite()),
      "addition of log '" + log.name + "'", "a finite value for each parameter");
  LeastSquares sums(p, log.weights);
  RegressionBlock block;
  log.rows->rewind();
  while (log.rows->next(block)) {
    sums.add(block);
  }
  check::that(sums.instants() > 0, "joint fit, log '" + log.name + "'", "at least one instant");
  const auto size = static_cast<Eigen::Index>(p);
  const Eigen::MatrixXd factor = sums.factor();
  Reduced reduced;
  reduced.R = factor.topLeftCorner(size, size);
  reduced.c = factor.col(size).head(size);
  reduced.rest = factor(size, size) * factor(size, size);
  reduced.addition = log.addition.size() == 0 ? Eigen::VectorXd(Eigen::VectorXd::Zero(size)) : log.addition;
  reduced.weights = log.weights.size() == 0
                        ? Eigen::VectorXd(Eigen::VectorXd::Ones(static_cast<Eigen::Index>(log.rows->outputs())))
                        : log.weights;
  reduced.own = sums.solve();
  return reduced;
}

/// Rows R_l E_l φ = c_l − R_l c of all logs.
LeastSquaresFit stacked(const std::vector<Reduced>& logs, const std::vector<Eigen::MatrixXd>& maps) {
  const Eigen::Index q = maps.front().cols();
  LeastSquares sums(static_cast<std::size_t>(q));
  for (std::size_t l = 0; l < logs.size(); ++l) {
    RegressionBlock rows;
    rows.resize(static_cast<std::size_t>(logs[l].R.rows()), 1, static_cast<std::size_t>(q));
    rows.Y = logs[l].R * maps[l];
    rows.y = logs[l].c - logs[l].R * logs[l].addition;
    sums.add(rows);
  }
  return sums.solve();
}

/// Long-run covariances of the scores at each θ.
std::vector<LongRunCovariance> score_covariances(const JointLog& log, const Reduced& reduced,
                                                 const std::vector<Eigen::VectorXd>& thetas) {
  std::vector<BlockSums> scores(thetas.size(), BlockSums(log.rows->parameters()));
  RegressionBlock block;
  const Eigen::VectorXd squared = reduced.weights.cwiseAbs2();
  log.rows->rewind();
  while (log.rows->next(block)) {
    const auto n = static_cast<Eigen::Index>(block.outputs);
    for (Eigen::Index first = 0; first < block.rows(); first += n) {
      const auto Y = block.Y.middleRows(first, n);
      for (std::size_t i = 0; i < thetas.size(); ++i) {
        const Eigen::VectorXd score = Y.transpose() * squared.cwiseProduct(block.y.segment(first, n) - Y * thetas[i]);
        scores[i].add(score);
      }
    }
  }
  std::vector<LongRunCovariance> covariances;
  for (const BlockSums& series : scores) {
    covariances.push_back(long_run_covariance(series));
  }
  return covariances;
}

/// Welch's F (1951) for equal means of estimates x with variances v that have `freedom` degrees of freedom each.
void welch(const Eigen::VectorXd& x, const Eigen::VectorXd& v, const Eigen::VectorXd& freedom, SharingTest& test) {
  const auto k = static_cast<double>(x.size());
  const Eigen::ArrayXd w = v.array().inverse();
  const double mean = (w * x.array()).sum() / w.sum();
  const double spread = ((1.0 - w / w.sum()).square() / freedom.array()).sum();
  const double between = (w * (x.array() - mean).square()).sum() / (k - 1.0);
  test.statistic = between / (1.0 + 2.0 * (k - 2.0) / (k * k - 1.0) * spread);
  test.freedom_between = k - 1.0;
  test.freedom_within = (k * k - 1.0) / (3.0 * spread);
  test.p_value = boost::math::cdf(
      boost::math::complement(boost::math::fisher_f(test.freedom_between, test.freedom_within), test.statistic));
  test.tested = true;
}

/// Holm's step-down adjustment over the tests that were made.
void adjust(std::vector<SharingTest>& tests) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < tests.size(); ++i) {
    if (tests[i].tested) {
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return tests[a].p_value < tests[b].p_value; });
  double least = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    least = std::max(least, std::min(1.0, static_cast<double>(order.size() - rank) * tests[order[rank]].p_value));
    tests[order[rank]].adjusted_p = least;
  }
}

std::string sharing_sentence(const SharingTest& test, const std::vector<JointLog>& logs) {
  if (!test.tested) {
    return test.parameter + ": fewer than two logs know it by themselves, so that sharing cannot be tested";
  }
  if (test.adjusted_p >= 0.05) {
    return fmt::format("{}: the logs agree as far as they can tell (p = {:.2g})", test.parameter, test.adjusted_p);
  }
  std::string words = fmt::format("{}: the logs disagree (p = {:.2g}):", test.parameter, test.adjusted_p);
  std::string separator = " ";
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const auto at = static_cast<Eigen::Index>(l);
    if (test.standard_error[at] > 0.0) {
      words +=
          fmt::format("{}{:.4g} ± {:.2g} in {}", separator, test.estimate[at], test.standard_error[at], logs[l].name);
      separator = ", ";
    }
  }
  return words + "; make it a parameter of each log, or look for what changed between them";
}

}  // namespace

Eigen::MatrixXd joint_map(const std::vector<JointParameter>& parameters, std::size_t logs, std::size_t log) {
  check::that(log < logs, "joint_map log", "a log of the list");
  std::size_t q = 0;
  for (const JointParameter& parameter : parameters) {
    q += parameter.shared ? 1 : logs;
  }
  Eigen::MatrixXd map =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(parameters.size()), static_cast<Eigen::Index>(q));
  std::size_t at = 0;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const std::size_t mine = parameters[j].shared ? at : at + log;
    map(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(mine)) = 1.0;
    at += parameters[j].shared ? 1 : logs;
  }
  return map;
}

JointFit joint_fit(const std::vector<JointLog>& logs, const std::vector<JointParameter>& parameters) {
  check::that(!logs.empty(), "joint fit", "at least one log");
  check::that(!parameters.empty(), "joint fit", "at least one parameter");
  const std::size_t p = parameters.size();
  std::vector<Reduced> reduced;
  std::vector<Eigen::MatrixXd> maps;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    reduced.push_back(reduce(logs[l], p));
    maps.push_back(joint_map(parameters, logs.size(), l));
  }

  JointFit fit;
  for (const JointParameter& parameter : parameters) {
    if (parameter.shared) {
      fit.unknowns.push_back(parameter.name);
      continue;
    }
    for (const JointLog& log : logs) {
      fit.unknowns.push_back(parameter.name + " (" + log.name + ")");
    }
  }
  const LeastSquaresFit solution = stacked(reduced, maps);
  const Eigen::Index q = maps.front().cols();
  fit.unknown = solution.estimate;
  fit.rank = solution.rank;
  fit.weighted_rss = solution.weighted_rss;
  fit.theta.resize(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(logs.size()));
  fit.covariance = Eigen::MatrixXd::Zero(q, q);
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(q);
  std::vector<LongRunCovariance> own;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const Eigen::VectorXd theta = maps[l] * fit.unknown + reduced[l].addition;
    fit.theta.col(static_cast<Eigen::Index>(l)) = theta;
    fit.weighted_rss += reduced[l].rest;
    fit.instants += reduced[l].own.instants;
    const Eigen::MatrixXd side = solution.inverse_gram * maps[l].transpose();
    const auto both = score_covariances(logs[l], reduced[l], {theta, reduced[l].own.estimate});
    const LongRunCovariance& scores = both[0];
    const Eigen::MatrixXd part = side * scores.matrix * side.transpose();
    fit.covariance += part;
    squares += part.diagonal().cwiseAbs2() / std::max(scores.freedom, 1.0);
    own.push_back(both[1]);
    own.back().matrix = reduced[l].own.inverse_gram * own.back().matrix * reduced[l].own.inverse_gram;
  }
  fit.standard_error = fit.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  fit.freedom = Eigen::VectorXd::Zero(q);
  for (Eigen::Index j = 0; j < q; ++j) {
    fit.freedom[j] = squares[j] > 0.0 ? fit.covariance(j, j) * fit.covariance(j, j) / squares[j] : 0.0;
  }

  for (std::size_t j = 0; j < p; ++j) {
    if (!parameters[j].shared) {
      continue;
    }
    const auto at = static_cast<Eigen::Index>(j);
    const auto count = static_cast<Eigen::Index>(logs.size());
    SharingTest test;
    test.parameter = parameters[j].name;
    test.estimate = Eigen::VectorXd::Zero(count);
    test.standard_error = Eigen::VectorXd::Zero(count);
    std::vector<Eigen::Index> knowing;
    Eigen::VectorXd freedom(count);
    for (Eigen::Index l = 0; l < count; ++l) {
      const Reduced& log = reduced[static_cast<std::size_t>(l)];
      const LongRunCovariance& covariance = own[static_cast<std::size_t>(l)];
      test.estimate[l] = log.own.estimate[at] - log.addition[at];
      freedom[l] = covariance.freedom;
      if (log.own.partial_rms[at] > kKnown * log.own.column_rms[at] && covariance.matrix(at, at) > 0.0) {
        test.standard_error[l] = std::sqrt(covariance.matrix(at, at));
        knowing.push_back(l);
      }
    }
    if (knowing.size() >= 2) {
      const Eigen::VectorXd x = test.estimate(knowing), variance = test.standard_error(knowing).cwiseAbs2();
      welch(x, variance, freedom(knowing), test);
    }
    fit.sharing.push_back(test);
  }
  adjust(fit.sharing);
  for (SharingTest& test : fit.sharing) {
    test.words = sharing_sentence(test, logs);
    fit.compatible = fit.compatible && !(test.adjusted_p < 0.05);
  }
  return fit;
}

}  // namespace wheelwright
