// SPDX-License-Identifier: Apache-2.0
#include "commission/pose_timing.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "commission/contradiction_search.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::commission {

bool PoseTiming::told(double step) const {
  return std::abs(delay) > std::max(kLeastShift * step, errors_at(kRiskOfDoubt, freedom) * standard_error);
}

std::optional<PoseTiming> pose_timing(const core::RegressionBlock& rows, const Eigen::VectorXd& theta,
                                      const Eigen::VectorXd& weights, double step, std::size_t positions) {
  constexpr double kReach = 0.1;  // s, to either side: over less the slope is that of the encoders' counts
  constexpr double kHole = 0.75;  // steps more than there should be
  const auto reach = static_cast<std::size_t>(std::max(1.0, std::round(kReach / step)));
  const auto n = static_cast<Eigen::Index>(rows.outputs), p = static_cast<Eigen::Index>(rows.parameters);
  const Eigen::VectorXd modelled = rows.Y * theta;
  core::RegressionBlock shifted;
  shifted.resize(rows.instants(), rows.outputs, rows.parameters + 1);
  std::size_t used = 0;
  const auto beside = static_cast<Eigen::Index>(reach) * n;
  for (std::size_t k = reach; k + reach < rows.instants(); ++k) {
    const double seconds = rows.t[k + reach] - rows.t[k - reach];
    if (seconds > (2.0 * static_cast<double>(reach) + kHole) * step) {
      continue;
    }
    const Eigen::Index from = static_cast<Eigen::Index>(k) * n, to = static_cast<Eigen::Index>(used) * n;
    shifted.Y.block(to, 0, n, p) = rows.Y.middleRows(from, n);
    shifted.Y.col(p).segment(to, n) =
        (modelled.segment(from - beside, n) - modelled.segment(from + beside, n)) / seconds;
    shifted.Y.col(p).segment(to, static_cast<Eigen::Index>(positions)).setZero();
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
