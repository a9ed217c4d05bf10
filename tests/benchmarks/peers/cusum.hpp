// SPDX-License-Identifier: Apache-2.0
/// \file
/// Page's cumulative sum test (1954) on the residual, two-sided, for each output.
#pragma once

#include <algorithm>

#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// With z = (ε − mean)/sd of the fault-free residual: S⁺ = max(0, S⁺ + z − k), S⁻ = max(0, S⁻ − z − k); the value is
/// the larger of both. Best for a step of 2k standard deviations in white Gaussian noise (Lorden 1971).
class Cusum final : public Statistic {
 public:
  /// `mean` and `sd` (> 0) of the fault-free residual; `reference` is k.
  Cusum(std::array<double, kOutputs> mean, std::array<double, kOutputs> sd, double reference)
      : mean_(mean), sd_(sd), k_(reference) {}
  [[nodiscard]] std::size_t size() const override { return kOutputs; }
  void restart() override { up_ = down_ = {}; }
  void step(const Observation& now, std::span<double> values) override {
    for (std::size_t i = 0; i < kOutputs; ++i) {
      if (now.valid) {
        const double z = (now.residual[i] - mean_[i]) / sd_[i];
        up_[i] = std::max(0.0, up_[i] + z - k_);
        down_[i] = std::max(0.0, down_[i] - z - k_);
      }
      values[i] = std::max(up_[i], down_[i]);
    }
  }
  /// Tails of S are exponential where those of z are Gaussian.
  [[nodiscard]] double with_margin(double largest, double margin) const override { return margin * margin * largest; }

 private:
  std::array<double, kOutputs> mean_, sd_, up_{}, down_{};
  double k_;
};

}  // namespace wheelwright::peers
