// SPDX-License-Identifier: Apache-2.0
/// \file
/// |ε| against a constant for each output.
#pragma once

#include <cmath>

#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// |ε_i|.
class ConstantThreshold final : public Statistic {
 public:
  [[nodiscard]] std::size_t size() const override { return kOutputs; }
  void restart() override {}
  void step(const Observation& now, std::span<double> values) override {
    for (std::size_t i = 0; i < kOutputs; ++i) {
      values[i] = now.valid ? std::abs(now.residual[i]) : 0.0;
    }
  }
};

}  // namespace wheelwright::peers
