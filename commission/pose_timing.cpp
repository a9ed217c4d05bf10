// SPDX-License-Identifier: Apache-2.0
#include "commission/pose_timing.hpp"

#include <cmath>

#include "commission/contradiction_search.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::commission {

bool PoseTiming::told(double step) const {
  return std::abs(delay) > std::max(kLeastShift * step, errors_at(kRiskOfDoubt, freedom) * standard_error);
}

std::optional<PoseTiming> pose_timing(const core::RegressionBlock& rows, const Eigen::VectorXd& theta,
                                      const Eigen::VectorXd& weights, double step) {
  constexpr double kHole = 1.75;  // steps
  const auto n = static_cast<Eigen::Index>(rows.outputs), p = static_cast<Eigen::Index>(rows.parameters);
  const Eigen::VectorXd modelled = rows.Y * theta;
  core::RegressionBlock shifted;
  shifted.resize(rows.instants(), rows.outputs, rows.parameters + 1);
  std::size_t used = 0;
  for (std::size_t k = 1; k + 1 < rows.instants(); ++k) {
    if (rows.t[k] - rows.t[k - 1] > kHole * step || rows.t[k + 1] - rows.t[k] > kHole * step) {
      continue;
    }
    const Eigen::Index from = static_cast<Eigen::Index>(k) * n, to = static_cast<Eigen::Index>(used) * n;
    shifted.Y.block(to, 0, n, p) = rows.Y.middleRows(from, n);
    shifted.Y.col(p).segment(to, n) =
        (modelled.segment(from - n, n) - modelled.segment(from + n, n)) / (rows.t[k + 1] - rows.t[k - 1]);
    shifted.y.segment(to, n) = rows.y.segment(from, n);
    shifted.t[used] = rows.t[k];
    shifted.sample[used++] = rows.sample[k];
  }
  if (used < kFewestInstants) {
    return std::nullopt;
  }
  shifted.shorten(used);
  identify::LeastSquares squares(rows.parameters + 1, weights);
  squares.add(shifted);
  const identify::LeastSquaresFit fit = squares.solve({});
  identify::ResidualStatistics statistics(fit.estimate, weights);
  statistics.add(shifted);
  const identify::ResidualSummary residuals = statistics.summary(fit.inverse_gram);
  const double error = residuals.standard_error[p];
  if (!(error > 0.0) || !std::isfinite(error)) {
    return std::nullopt;
  }
  return PoseTiming{fit.estimate[p], error, residuals.freedom};
}

}  // namespace wheelwright::commission
