// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/detector/kinematic_detector.hpp>

#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

KinematicDetector::KinematicDetector(OdometryFilter filter, ThresholdRule threshold, DetectorOptions options)
    : filter_(std::move(filter)),
      rows_(static_cast<std::size_t>(filter_.row().y.size()), std::move(threshold), std::move(options)) {
  check::that(static_cast<Eigen::Index>(rows_.threshold().set().dimension()) == filter_.row().Y.cols(), "feasible set",
              "as many parameters as the filter's rows have");
}

void KinematicDetector::restart() {
  started_ = false;
  filter_.restart();
  rows_.restart();
}

const Decision& KinematicDetector::step(double t, std::span<const double> sample) {
  if (started_ && !follows(t_, t, filter_.measurement().nominal_step)) {
    restart();
  }
  started_ = true;
  t_ = t;
  return filter_.step(t, sample) ? rows_.decide(filter_.row()) : rows_.nothing();
}

}  // namespace wheelwright
