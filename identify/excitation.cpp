// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/excitation.hpp>

#include <cmath>

namespace wheelwright {
namespace {

constexpr double kCollinear = 1e-7;  // of the column's own size
constexpr double kSignalOverNoise = 3.0;

}  // namespace

std::vector<ExcitationFinding> judge_excitation(const LeastSquaresFit& fit, const Eigen::VectorXd& standard_error,
                                                double t_quantile, const Eigen::VectorXd& noise_rms) {
  std::vector<ExcitationFinding> findings;
  for (Eigen::Index j = 0; j < fit.estimate.size(); ++j) {
    ExcitationFinding f;
    f.signal_rms = fit.partial_rms[j];
    f.noise_rms = noise_rms.size() > 0 ? noise_rms[j] : 0.0;
    if (!(fit.column_rms[j] > 0.0)) {
      f.state = Excitation::not_excited;
      f.reason = "its motion never occurs in the log";
    } else if (fit.partial_rms[j] <= kCollinear * fit.column_rms[j]) {
      f.state = Excitation::not_excited;
      f.reason = "its motion always comes together with that of another parameter";
    } else if (fit.partial_rms[j] < kSignalOverNoise * f.noise_rms) {
      f.state = Excitation::not_excited;
      f.reason = "its motion is no larger than what sensor noise alone would show";
    } else if (std::abs(fit.estimate[j]) < t_quantile * standard_error[j]) {
      f.state = Excitation::indistinct;
      f.reason = "it cannot be told from zero on this log";
    }
    findings.push_back(f);
  }
  return findings;
}

}  // namespace wheelwright
