// SPDX-License-Identifier: Apache-2.0
#include "detector/online_model.hpp"

#include <algorithm>
#include <utility>

namespace wheelwright::detector {
namespace {

template <typename Channel>
auto detector_of(const Channel& channel, DetectorOptions options) {
  options.persistence = options.persistence.value_or(channel.persistence);
  if (options.residual == Residual::d2) {
    check::that(channel.constant.has_value(), "model", "constant thresholds of the residual, which D2 needs");
    options.mu = channel.constant->mu();
  }
  return Detector(make_filter(channel),
                  ThresholdRule(Polytope(channel.facets, channel.box), channel.estimate, options.set), options);
}

}  // namespace

OnlineModel decided_by(OnlineModel model, Residual residual) {
  if (residual == Residual::d2) {
    check::that(model.constant.has_value(), "model",
                "constant thresholds, which D2 needs: commission a log of ten blocks as long as the filter's memory at "
                "least, or state them as `thresholds` in the robot file");
    model.at_risk.reset();
    if (model.kinematic) {
      model.kinematic->at_risk.reset();
    }
  }
  return model;
}

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

Eigen::VectorXd ConstantThresholds::mu() const {
  Eigen::VectorXd values(static_cast<Eigen::Index>(outputs.size()));
  std::ranges::transform(outputs, values.begin(), &ConstantThreshold::value);
  return values;
}

std::optional<double> ConstantThresholds::false_alarms() const {
  if (outputs.empty() || std::ranges::any_of(outputs, &ConstantThreshold::stated)) {
    return std::nullopt;
  }
  return std::min(1.0, static_cast<double>(outputs.size()) / static_cast<double>(blocks + 1));
}

bool ConstantThresholds::refuted() const {
  constexpr double kSure = 0.01;
  return std::ranges::any_of(outputs, [&](const ConstantThreshold& output) {
    return output.chance * static_cast<double>(outputs.size()) < kSure;
  });
}

double torque_share(const OnlineModel& model) { return model.kinematic && model.kinematic->at_risk ? 0.5 : 1.0; }

Model kinematic_outputs(const KinematicModel& model) {
  Model names;
  names.outputs = model.measurement.outputs();
  names.output_units = model.measurement.output_units();
  return names;
}

}  // namespace wheelwright::detector
