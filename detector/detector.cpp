// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/detector.hpp>

#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

Detector::Detector(RegressorFilter filter, ThresholdRule threshold, DetectorOptions options)
    : filter_(std::move(filter)), rows_(filter_.model().n(), std::move(threshold), std::move(options)) {
  check::that(rows_.threshold().set().dimension() == filter_.model().p(), "feasible set",
              "as many parameters as the filter's model has");
}

void Detector::restart() {
  started_ = false;
  filter_.restart();
  rows_.restart();
}

const Decision& Detector::step(double t, std::span<const double> sample) {
  if (started_ && !follows(t_, t, filter_.measurement().nominal_step)) {
    restart();
  }
  started_ = true;
  t_ = t;
  return filter_.step(t, sample) ? rows_.decide(filter_.row()) : rows_.nothing();
}

}  // namespace wheelwright
