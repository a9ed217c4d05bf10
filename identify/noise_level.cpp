// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/noise_level.hpp>

#include <algorithm>
#include <cmath>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {

ExtrapolatedBound extrapolate(const OutputResidual& residual, std::size_t instants,
                              const ExtrapolationOptions& options) {
  check::that(options.risk > 0.0 && options.risk < 1.0, "extrapolation risk", "a number inside (0, 1)");
  check::positive(options.horizon, "extrapolation horizon");
  check::that(instants > 0, "extrapolation", "at least one instant");
  const double n = std::max(residual.effective_instants, 1.0);
  const double spread = std::sqrt(n / chi_squared_quantile(n, options.risk));
  const auto z = [&](double count) { return normal_upper_quantile(std::min(0.25, options.risk / (2.0 * count))); };
  const auto seen = static_cast<double>(instants);
  ExtrapolatedBound result;
  result.bound = residual.rms * spread * z(seen * std::max(options.horizon, 1.0));
  const double most_kurtosis = 3.0 + z(0.5) * std::sqrt(24.0 / n);
  result.heavy_tail = residual.largest > residual.rms * spread * z(seen) || residual.kurtosis > most_kurtosis;
  if (result.heavy_tail) {
    result.bound = std::max(result.bound,
                            residual.largest + residual.rms * std::log(std::max(options.horizon, 1.0) / options.risk));
  }
  result.over_largest = residual.largest > 0.0 ? result.bound / residual.largest : 0.0;
  result.over_rms = residual.rms > 0.0 ? result.bound / residual.rms : 0.0;
  return result;
}

Eigen::VectorXd largest_plausible_error(RegressionSource& rows, const Eigen::VectorXd& theta,
                                        const ResidualSummary& summary, double risk) {
  check::that(risk > 0.0 && risk < 1.0, "risk", "a number inside (0, 1)");
  const auto p = static_cast<double>(theta.size());
  const double f = fisher_upper_quantile(p, std::max(summary.freedom, 1.0), risk);
  const Eigen::MatrixXd scaled = p * f * summary.covariance;
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows.outputs()));
  RegressionBlock block;
  rows.rewind();
  while (rows.next(block)) {
    const auto n = static_cast<Eigen::Index>(block.outputs);
    for (Eigen::Index row = 0; row < block.rows(); ++row) {
      const double residual = std::abs(block.y[row] - block.Y.row(row).dot(theta));
      const double variance = block.Y.row(row) * scaled * block.Y.row(row).transpose();
      largest[row % n] = std::max(largest[row % n], residual + std::sqrt(std::max(variance, 0.0)));
    }
  }
  return largest;
}

}  // namespace wheelwright
