// SPDX-License-Identifier: Apache-2.0
/// \file
/// The threshold of this project, as the study compares it.
#pragma once

#include <cmath>
#include <utility>

#include "detector/threshold.hpp"
#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// 1 where ε is outside [l, u] (or |ε| > ρ), else 0: a limit of 1/2 makes the detector, there is nothing to tune.
class TightThreshold final : public Statistic {
 public:
  enum class Kind {
    two_sided,   ///< l <= ε <= u
    symmetric,   ///< |ε| <= ρ
    statistical  ///< two-sided, with bounds on the noise that hold with a stated probability only
  };
  TightThreshold(detector::ThresholdRule rule, Kind kind) : rule_(std::move(rule)), kind_(kind) {}
  [[nodiscard]] std::size_t size() const override { return kOutputs; }
  void restart() override {}
  void step(const Observation& now, std::span<double> values) override {
    for (std::size_t i = 0; i < kOutputs; ++i) {
      values[i] = 0.0;
      if (now.valid) {
        const filter::FilteredRow& in = kind_ == Kind::statistical ? *now.statistical : *now.row;
        const auto row = static_cast<Eigen::Index>(i);
        const auto p = static_cast<std::size_t>(in.Y.cols());
        const detector::Threshold limit =
            rule_.at({in.Y.row(row).data(), p}, {in.dY.row(row).data(), p}, in.dy[row], i);
        const double e = now.residual[i];
        const bool outside = kind_ == Kind::symmetric ? std::abs(e) > limit.rho() : e < limit.lower || e > limit.upper;
        values[i] = outside ? 1.0 : 0.0;
      }
    }
  }

 private:
  detector::ThresholdRule rule_;
  Kind kind_;
};

}  // namespace wheelwright::peers
