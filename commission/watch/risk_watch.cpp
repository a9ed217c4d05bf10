// SPDX-License-Identifier: Apache-2.0
#include "commission/watch/risk_watch.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/two_walks.hpp"
#include "core/log.hpp"
#include "detector/multiscale/pose_sums.hpp"
#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::commission {

RiskEvent* RiskRecorder::take(const detector::SumState& state, double scale, double t) {
  const double ratio = state.threshold > 0.0 ? std::abs(state.value) / state.threshold : 0.0;
  ++watch_.looks;
  watch_.utilisation = std::max(watch_.utilisation, ratio);
  if (!(state.excess > 0.0)) {
    return nullptr;
  }
  const bool begins = watch_.events.empty() || t > watch_.events.back().end + pause_;
  if (begins) {
    watch_.events.push_back({.alarm = t, .end = t, .scale = scale, .peak_time = t, .pose = {}});
    pause_ = merge_;
  }
  RiskEvent& event = watch_.events.back();
  event.end = t;
  pause_ = std::max(pause_, 0.25 * scale);
  if (ratio > event.ratio) {
    event.ratio = ratio;
    event.peak_time = t;
  }
  return begins ? &event : nullptr;
}

bool RiskRecorder::add(const detector::ScaleDetector& detector, double t) {
  bool begins = false;
  for (const detector::SumState& state : detector.looks()) {
    if (RiskEvent* event = take(state, detector.scales()[state.scale], t)) {
      event->weight = detector.weights()[state.weight];
      begins = true;
    }
  }
  return begins;
}

bool RiskRecorder::add(const detector::PoseSumDetector& detector, double t) {
  bool begins = false;
  for (const detector::SumState& state : detector.looks()) {
    if (RiskEvent* event = take(state, detector.scales()[state.scale], t)) {
      event->pose = detector.weights()[state.weight];
      begins = true;
    }
  }
  return begins;
}

double torque_false_alarms(const OnlineModel& model) {
  return detector::torque_share(model) * detector::ScaleDetectorOptions{}.false_alarms;
}

double pose_false_alarms(const OnlineModel& model) {
  return (model.at_risk ? 0.5 : 1.0) * detector::PoseSumOptions{}.false_alarms;
}

namespace {

// Walks `log` through a detector; `recorder` takes what it says.
template <typename AnyDetector>
void record(LogSource& log, const std::vector<std::string>& columns, AnyDetector detector, RiskRecorder& recorder) {
  core::for_each_sample(log, columns, [&](const core::LogSample& sample) {
    if (sample.starts) {
      detector.restart();
    }
    detector.step(sample.t, sample.values);
    recorder.add(detector, sample.t);
  });
}

}  // namespace

bool watches_pose(const LogSource& log, const OnlineModel& model) {
  return model.kinematic && model.kinematic->at_risk &&
         std::ranges::all_of(model.kinematic->measurement.columns(),
                             [&](const std::string& name) { return log.find(name).has_value(); });
}

RiskWatch watch_at_risk(LogSource& log, const OnlineModel& model, std::size_t threads, double merge) {
  RiskRecorder of_torque(merge), of_pose(merge);  // an event of one residual is not to hide one of the other
  RiskWatch& watch = of_torque.watch();
  watch.pose = watches_pose(log, model);
  watch.watched = model.at_risk || watch.pose;
  if (!watch.watched) {
    return {};
  }
  two_walks(
      log, model.at_risk && watch.pose ? threads : 1,
      [&](LogSource& walk) {
        if (model.at_risk) {
          watch.false_alarms += torque_false_alarms(model);
          record(walk, model.measurement.columns(),
                 detector::ScaleDetector(model, {.false_alarms = torque_false_alarms(model)}), of_torque);
        }
      },
      [&](LogSource& walk) {
        if (watch.pose) {
          record(walk, model.kinematic->measurement.columns(),
                 detector::PoseSumDetector(*model.kinematic, {.false_alarms = pose_false_alarms(model)}), of_pose);
        }
      });
  watch.false_alarms += watch.pose ? pose_false_alarms(model) : 0.0;
  const RiskWatch& other = of_pose.watch();
  watch.looks += other.looks;
  watch.utilisation = std::max(watch.utilisation, other.utilisation);
  watch.events.insert(watch.events.end(), other.events.begin(), other.events.end());
  std::ranges::stable_sort(watch.events, {}, &RiskEvent::alarm);
  return std::move(watch);
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

std::string sum_words(const detector::PoseWeight& weight) {
  using Shape = detector::PoseWeight::Shape;
  const char* side = weight.wheel == 0 ? "right" : "left";
  switch (weight.shape) {
    case Shape::along: return "slip along the heading";
    case Shape::across: return "slip across the heading";
    case Shape::turn: return "turning beside the wheels";
    case Shape::radius: return fmt::format("way of the {} wheel", side);
    case Shape::yaw_gain: return fmt::format("turn by the {} wheel", side);
  }
  return {};
}

std::string sum_words(const RiskEvent& event, const Model& model) {
  return event.pose ? sum_words(*event.pose) + " (pose against wheels)" : sum_words(event.weight, model);
}

std::string sentence(const RiskEvent& event, const Model& model) {
  return fmt::format("since {:.2f} s: {}, seen over {:g} s, up to {:.3g} times what a healthy robot's errors can do",
                     event.alarm, sum_words(event, model), event.scale, event.ratio);
}

}  // namespace wheelwright::commission
