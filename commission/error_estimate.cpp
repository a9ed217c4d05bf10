// SPDX-License-Identifier: Apache-2.0
#include "commission/error_estimate.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "commission/noise_budget.hpp"
#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kWindows = 20.0;  // of a scale that the log must hold for it to count
constexpr double kAbove = 1.1;     // deviation that is assumed, in units of the estimated one
constexpr double kBound = 3.0;     // bound, in deviations

}  // namespace

std::optional<double> effort_deviation(LogSource& log, const OnlineModel& model, double motion) {
  OnlineModel probe = model;
  detector::RiskModel risk;
  risk.errors.motion = {.bound = motion, .bias = motion};
  risk.errors.effort = {.bound = 1.0};
  risk.errors.shortest_step = model.measurement.nominal_step;
  risk.facets = model.facets;
  risk.box = model.box;
  risk.scales = {0.1, 0.3, 1.0, 3.0, 10.0};
  risk.delay = 0.4;
  risk.usual = Eigen::MatrixXd::Ones(static_cast<Eigen::Index>(detector::sum_weights(model.model).size()),
                                     static_cast<Eigen::Index>(risk.scales.size()));
  probe.at_risk = std::move(risk);
  detector::ScaleDetector detector(probe);
  const std::size_t scales = detector.scales().size();
  std::vector<double> ratio(scales, 0.0), count(scales, 0.0);
  double seconds = 0.0, last = 0.0;
  detector::walk_log(log, detector, [&](double t, bool starts, bool looked) {
    seconds += starts ? 0.0 : t - last;
    last = t;
    if (!looked) {
      return;
    }
    const Eigen::MatrixXd variances = detector.variances();
    for (const detector::SumState& look : detector.looks()) {
      const double V = variances(static_cast<Eigen::Index>(look.weight), static_cast<Eigen::Index>(look.scale));
      if (V > 0.0) {
        ratio[look.scale] += look.value * look.value / V;
        count[look.scale] += 1.0;
      }
    }
  });
  std::optional<double> least;
  for (std::size_t s = 0; s < scales; ++s) {
    if (count[s] > 0.0 && detector.scales()[s] * kWindows <= seconds) {
      const double deviation = std::sqrt(ratio[s] / count[s]);
      least = least ? std::min(*least, deviation) : deviation;
    }
  }
  return least && *least > 0.0 ? least : std::nullopt;
}

std::optional<filter::ErrorClasses> estimated_classes(LogSource& log, const OnlineModel& model) {
  const std::optional<double> motion = motion_error(model.robot, model.measurement);
  if (!motion) {
    return std::nullopt;
  }
  const std::optional<double> deviation = effort_deviation(log, model, *motion);
  if (!deviation) {
    return std::nullopt;
  }
  return classes_with(model.robot, model.measurement, *motion,
                      {.bound = kBound * kAbove * *deviation, .bias = 0.0, .deviation = kAbove * *deviation});
}

}  // namespace wheelwright::commission
