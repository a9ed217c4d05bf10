// SPDX-License-Identifier: Apache-2.0
#include "detector/online_model.hpp"

#include <utility>

namespace wheelwright::detector {
namespace {

template <typename Channel>
auto detector_of(const Channel& channel, DetectorOptions options) {
  options.persistence = options.persistence.value_or(channel.persistence);
  return Detector(make_filter(channel),
                  ThresholdRule(Polytope(channel.facets, channel.box), channel.estimate, options.set), options);
}

}  // namespace

RegressorFilter make_filter(const OnlineModel& model) {
  return {model.model, model.filter, model.measurement, model.errors};
}

filter::OdometryFilter make_filter(const KinematicModel& model) {
  return {model.measurement, model.window, model.errors};
}

TorqueDetector make_detector(const OnlineModel& model, DetectorOptions options) {
  return detector_of(model, std::move(options));
}

KinematicDetector make_detector(const KinematicModel& model, DetectorOptions options) {
  return detector_of(model, std::move(options));
}

double torque_share(const OnlineModel& model) { return model.kinematic && model.kinematic->at_risk ? 0.5 : 1.0; }

Model kinematic_outputs(const KinematicModel& model) {
  Model names;
  names.outputs = model.measurement.outputs();
  names.output_units = model.measurement.output_units();
  return names;
}

}  // namespace wheelwright::detector
