// SPDX-License-Identifier: Apache-2.0
/// \file
/// The residual against its standard error: what least squares says about a prediction.
#pragma once

#include <cmath>
#include <utility>

#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// |ε_i| / √(y Cov yᵀ + σ_i²).
class ConfidenceThreshold final : public Statistic {
 public:
  /// `covariance` of θ̂ (p × p), `variance` σ_i² (> 0) of the residual when θ̂ is exact.
  ConfidenceThreshold(Eigen::MatrixXd covariance, std::array<double, kOutputs> variance)
      : covariance_(std::move(covariance)), variance_(variance) {}
  [[nodiscard]] std::size_t size() const override { return kOutputs; }
  void restart() override {}
  void step(const Observation& now, std::span<double> values) override {
    for (std::size_t i = 0; i < kOutputs; ++i) {
      values[i] = 0.0;
      if (now.valid) {
        const auto y = now.row->Y.row(static_cast<Eigen::Index>(i));
        double spread = variance_[i];
        for (Eigen::Index a = 0; a < y.size(); ++a) {
          for (Eigen::Index b = 0; b < y.size(); ++b) {
            spread += y[a] * covariance_(a, b) * y[b];
          }
        }
        values[i] = std::abs(now.residual[i]) / std::sqrt(spread);
      }
    }
  }

 private:
  Eigen::MatrixXd covariance_;
  std::array<double, kOutputs> variance_;
};

}  // namespace wheelwright::peers
