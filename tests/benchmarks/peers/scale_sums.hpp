// SPDX-License-Identifier: Apache-2.0
/// \file
/// The detector at a stated risk, as the study compares it.
#pragma once

#include "detector/multiscale/scale_detector.hpp"
#include "tests/benchmarks/peers/statistic.hpp"

namespace wheelwright::peers {

/// 1 where a sum of ScaleDetector is outside, else 0. It has no limit to tune: its risk is that of its options. Alarms
/// before the first filtered row count with that row.
class ScaleSums final : public Statistic {
 public:
  explicit ScaleSums(const OnlineModel& model) : detector_(model) {}
  [[nodiscard]] std::size_t size() const override { return 1; }
  void restart() override {
    detector_.restart();
    outside_ = false;
  }
  void step(const Observation& now, std::span<double> values) override {
    detector_.step(now.t, now.sample);
    outside_ = outside_ || detector_.alarm();
    values[0] = outside_ ? 1.0 : 0.0;
    outside_ = outside_ && !now.valid;
  }

 private:
  detector::ScaleDetector detector_;
  bool outside_ = false;
};

}  // namespace wheelwright::peers
