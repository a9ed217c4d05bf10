// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/risk_watch.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace wheelwright::commission {

bool RiskRecorder::add(const detector::ScaleDetector& detector, double t) {
  bool begins = false;
  for (const detector::SumState& state : detector.looks()) {
    const double ratio = state.threshold > 0.0 ? std::abs(state.value) / state.threshold : 0.0;
    ++watch_.looks;
    watch_.utilisation = std::max(watch_.utilisation, ratio);
    if (!(state.excess > 0.0)) {
      continue;
    }
    const double scale = detector.scales()[state.scale];
    if (watch_.events.empty() || t > watch_.events.back().end + pause_) {
      watch_.events.push_back({t, t, detector.weights()[state.weight], scale, 0.0, t});
      pause_ = merge_;
      begins = true;
    }
    RiskEvent& event = watch_.events.back();
    event.end = t;
    pause_ = std::max(pause_, 0.25 * scale);
    if (ratio > event.ratio) {
      event.ratio = ratio;
      event.peak_time = t;
    }
  }
  return begins;
}

RiskWatch watch_at_risk(LogSource& log, const OnlineModel& model, double merge) {
  if (!model.at_risk) {
    return {};
  }
  const detector::ScaleDetectorOptions options;
  detector::ScaleDetector detector(model, options);
  RiskRecorder recorder(merge);
  detector::walk_log(log, detector, [&](double t, bool, bool) { recorder.add(detector, t); });
  recorder.watch().watched = true;
  recorder.watch().false_alarms = options.false_alarms;
  return std::move(recorder.watch());
}

std::string sum_words(const detector::SumWeight& weight, const Model& model) {
  using Shape = detector::SumWeight::Shape;
  const auto of_joint = [&] {
    return model.joints.size() > 1 ? fmt::format(" ({})", model.joints[weight.which].torque) : std::string();
  };
  switch (weight.shape) {
    case Shape::constant: return "bias of the effort, or a jump" + of_joint();
    case Shape::effort: return "share of the effort" + of_joint();
    case Shape::parameter: return "torque of " + model.parameters[weight.which].physical;
  }
  return {};
}

std::string sentence(const RiskEvent& event, const Model& model) {
  return fmt::format("since {:.2f} s: {}, seen over {:g} s, up to {:.3g} times what a healthy robot's errors can do",
                     event.alarm, sum_words(event.weight, model), event.scale, event.ratio);
}

}  // namespace wheelwright::commission
