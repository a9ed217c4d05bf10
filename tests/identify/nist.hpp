// SPDX-License-Identifier: Apache-2.0
/// \file
/// Reads the Statistical Reference Datasets of NIST in tests/data/nist, as they were published.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/QR>

#include "core/limits.hpp"

namespace wheelwright::testing_support {

/// A regression problem with certified results.
struct NistProblem {
  std::string name;
  std::vector<Eigen::VectorXd> starts;  ///< official starts (nonlinear problems only: two)
  Eigen::VectorXd certified;            ///< certified parameters
  Eigen::VectorXd certified_sd;         ///< their certified standard deviations
  double residual_sd = 0.0;             ///< certified residual standard deviation
  double rss = 0.0;                     ///< certified residual sum of squares (nonlinear problems only)
  Eigen::VectorXd y;                    ///< response
  Eigen::MatrixXd x;                    ///< predictors, one a column
};

/// Number of decimal digits that `value` has right: the log relative error −log10(|value − truth|/|truth|), the log
/// absolute error where the truth is 0; 16 at most.
inline double digits(double value, double truth) {
  const double error = std::abs(value - truth) / (truth == 0.0 ? 1.0 : std::abs(truth));
  return error > 0.0 ? std::min(16.0, -std::log10(error)) : 16.0;
}

/// The digits of the worst entry.
inline double digits(const Eigen::VectorXd& value, const Eigen::VectorXd& truth) {
  double worst = 16.0;
  for (Eigen::Index j = 0; j < truth.size(); ++j) {
    worst = std::min(worst, std::isfinite(value[j]) ? digits(value[j], truth[j]) : -16.0);
  }
  return worst;
}

namespace nist_detail {

inline std::vector<double> numbers(const std::string& line) {
  std::istringstream in(line);
  std::vector<double> values;
  for (double v = 0.0; in >> v;) {
    values.push_back(v);
  }
  return values;
}

inline Eigen::VectorXd vector_of(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

}  // namespace nist_detail

/// Reads problem `name`; throws std::runtime_error where the file is not as expected.
inline NistProblem read_nist(const std::string& name) {
  std::ifstream file(std::string(WHEELWRIGHT_SOURCE_DIR) + "/tests/data/nist/" + name + ".dat");
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) {
    lines.push_back(line);
  }
  NistProblem p;
  p.name = name;
  int first = 0;
  int last = 0;
  std::vector<double> certified, sd, start1, start2;
  for (const std::string& line : lines) {
    int number = 0;
    int taken = 0;
    const std::size_t colon = line.find(':');
    if (first == 0 && line.find("Data ") != std::string::npos && line.find("(lines") != std::string::npos) {
      std::sscanf(line.c_str() + line.find("(lines"), "(lines %d to %d", &first, &last);
    } else if (std::sscanf(line.c_str(), " b%d =%n", &number, &taken) == 1 && taken > 0) {
      const auto v = nist_detail::numbers(line.substr(static_cast<std::size_t>(taken)));
      if (v.size() == 4) {
        start1.push_back(v[0]);
        start2.push_back(v[1]);
        certified.push_back(v[2]);
        sd.push_back(v[3]);
      }
    } else if (std::sscanf(line.c_str(), " B%d %n", &number, &taken) == 1 && taken > 0) {
      const auto v = nist_detail::numbers(line.substr(static_cast<std::size_t>(taken)));
      if (v.size() == 2) {
        certified.push_back(v[0]);
        sd.push_back(v[1]);
      }
    } else if (line.rfind("Residual Sum of Squares", 0) == 0) {
      p.rss = nist_detail::numbers(line.substr(colon + 1)).at(0);
    } else if (line.rfind("Residual Standard Deviation", 0) == 0) {
      p.residual_sd = nist_detail::numbers(line.substr(colon + 1)).at(0);
    } else if (line.rfind("     Standard Deviation ", 0) == 0) {
      p.residual_sd = nist_detail::numbers(line.substr(24)).at(0);
    }
  }
  std::vector<std::vector<double>> rows;
  for (int k = first; k <= last && k > 0 && k <= static_cast<int>(lines.size()); ++k) {
    rows.push_back(nist_detail::numbers(lines[static_cast<std::size_t>(k) - 1]));
  }
  if (rows.empty() || certified.empty() || rows.size() != static_cast<std::size_t>(last - first + 1)) {
    throw std::runtime_error("no NIST problem " + name);
  }
  p.certified = nist_detail::vector_of(certified);
  p.certified_sd = nist_detail::vector_of(sd);
  if (!start1.empty()) {
    p.starts = {nist_detail::vector_of(start1), nist_detail::vector_of(start2)};
  }
  p.y.resize(static_cast<Eigen::Index>(rows.size()));
  p.x.resize(p.y.size(), static_cast<Eigen::Index>(rows.front().size()) - 1);
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (rows[k].size() != rows.front().size()) {
      throw std::runtime_error("a ragged row in NIST problem " + name);
    }
    p.y[static_cast<Eigen::Index>(k)] = rows[k][0];
    for (std::size_t j = 1; j < rows[k].size(); ++j) {
      p.x(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j) - 1) = rows[k][j];
    }
  }
  return p;
}

/// Tolerance of a fit against the certified values, absolute.
struct NistLimits {
  Eigen::VectorXd estimate, sd;
  double residual_sd = 0.0;
};

/// Attainable accuracy of backward stable least squares with the columns (or, of a nonlinear model, the Jacobian) `Y`.
/// The factorisation, and data that are decimals and their powers rounded to doubles, amount to other data: each column
/// a_j and the response, of size `response`, off by γ of their norm (Higham 2002, theorems 19.4 and 20.3), γ = (p +
/// 4√(mp))·ε for m rows of p columns, where roundings partly cancel (Higham and Mary 2019, "A new approach to
/// probabilistic rounding error analysis", SIAM J. Sci. Comput. 41; the worst case is of order mp). With s_j =
/// √(AᵀA)⁻¹_jj, the length of row j of A⁺, and r the residuals, to first order (Björck 1996, "Numerical methods for
/// least squares problems", section 1.4)
///
///     |δx_j| <= γ(s_j t + Σ_k |(AᵀA)⁻¹_jk| ‖a_k‖ ‖r‖),    t = ‖y‖ + Σ_k ‖a_k‖ |x_k|,
///     |δσ| <= γ(t + Σ_k s_k ‖a_k‖ ‖r‖) / √(m − p),           |δs_j| <= 2γ s_j Σ_k s_k ‖a_k‖,
///
/// Σ_k s_k ‖a_k‖ being a condition number (p where columns are orthogonal). Certified values are rounded by
/// `published`.
inline NistLimits nist_limits(const Eigen::MatrixXd& Y, const NistProblem& problem, double response, double published) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::Index p = Y.cols();
  const double gamma = (static_cast<double>(p) + 4.0 * std::sqrt(static_cast<double>(Y.rows() * p))) * core::kEpsilon;
  const double root = std::sqrt(static_cast<double>(Y.rows() - p)), residual = problem.residual_sd * root;
  const Eigen::VectorXd norm = Y.colwise().norm(), x = problem.certified.cwiseAbs();
  const Long scaled = Y.cast<long double>() * norm.cast<long double>().cwiseInverse().asDiagonal();
  const Long R = Long(scaled.householderQr().matrixQR().topRows(p)).triangularView<Eigen::Upper>();
  const Long inverse = R.triangularView<Eigen::Upper>().solve(Long::Identity(p, p));
  const Eigen::MatrixXd gram = (inverse * inverse.transpose()).cast<double>();  // of columns of norm 1
  const Eigen::VectorXd length = gram.diagonal().cwiseSqrt();
  const double t = response + norm.dot(x);
  NistLimits limits;
  limits.estimate =
      (gamma * (length * t + gram.cwiseAbs().rowwise().sum() * residual)).cwiseQuotient(norm) + published * x;
  limits.residual_sd = gamma * (t + length.sum() * residual) / root + published * problem.residual_sd;
  limits.sd =
      limits.residual_sd * length.cwiseQuotient(norm) + (2.0 * gamma * length.sum() + published) * problem.certified_sd;
  return limits;
}

}  // namespace wheelwright::testing_support
