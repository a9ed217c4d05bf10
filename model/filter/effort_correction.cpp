// SPDX-License-Identifier: Apache-2.0
#include "model/filter/effort_correction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::filter {
namespace {

constexpr double kPerStep = 8.0;      // kept samples per nominal step, at most
constexpr double kMostHistory = 1e6;  // samples

}  // namespace

void validate(const EffortCorrection& c, std::size_t joints) {
  check::that(c.limit > 0.0, "EffortCorrection::limit", "a number > 0");
  check::non_negative(c.deadzone, "EffortCorrection::deadzone");
  check::that(c.gain.empty() || c.gain.size() == joints, "EffortCorrection::gain",
              "one number for each joint, or none");
  for (const double gain : c.gain) {
    check::positive(gain, "EffortCorrection::gain");
  }
  check::non_negative(c.delay, "EffortCorrection::delay");
  check::non_negative(c.lag, "EffortCorrection::lag");
}

EffortCorrection effort_correction(const Robot& robot) {
  model::validate_effects(robot);
  EffortCorrection c;
  const double unit = model::effort_per_torque(robot).value_or(1.0);
  if (model::has_effect(robot, "saturation")) {
    c.limit = unit * model::effect_value(robot, "saturation", "tau_max");
  }
  c.deadzone = unit * model::effect_value(robot, "torque_deadzone", "b");
  if (model::has_effect(robot, "torque_gain_asymmetric")) {
    const double g = model::effect_value(robot, "torque_gain_asymmetric", "g");
    c.gain = {1.0 + g, 1.0 - g};
  }
  c.delay = model::effect_value(robot, "delay", "T_d") + model::effect_value(robot, "sensor_time_offset", "dt");
  c.lag = model::effect_value(robot, "actuator_lag", "T");
  return c;
}

EffortCorrector::EffortCorrector(EffortCorrection correction, std::size_t joints, Hold hold, double nominal_step)
    : correction_(std::move(correction)), hold_(hold) {
  validate(correction_, joints);
  std::size_t kept = 2;
  if (correction_.delay > 0.0) {
    closest_ = check::positive(nominal_step, "measurement nominal_step") / kPerStep;
    const double needed = correction_.delay / closest_ + 4.0;
    check::that(needed <= kMostHistory, "EffortCorrection::delay", "a delay of at most 10⁵ sampling steps");
    kept = static_cast<std::size_t>(std::ceil(needed));
  }
  times_.resize(kept);
  joints_.resize(joints);
  for (Joint& joint : joints_) {
    joint.history.resize(kept);
  }
}

double EffortCorrector::memory(double share) const { return correction_.delay - correction_.lag * std::log(share); }

double EffortCorrector::instantaneous(double u, std::size_t joint) const {
  const double clipped = std::clamp(u, -correction_.limit, correction_.limit);
  const double past = std::max(std::abs(clipped) - correction_.deadzone, 0.0);
  return correction_.gain_of(joint) * std::copysign(past, clipped);
}

std::size_t EffortCorrector::slot(std::size_t age) const {
  return newest_ >= age ? newest_ - age : newest_ + times_.size() - age;
}

void EffortCorrector::push(double t, const double* effort) {
  const bool replace = count_ >= 2 && t - times_[slot(1)] < closest_;
  if (!replace) {
    newest_ = count_ == 0 || newest_ + 1 == times_.size() ? 0 : newest_ + 1;
    count_ = std::min(count_ + 1, times_.size());
  }
  times_[newest_] = t;
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    joints_[j].history[newest_] = instantaneous(effort[j], j);
  }
}

double EffortCorrector::at(const Joint& joint, double t) const {
  std::size_t age = 0;
  while (age + 1 < count_ && times_[slot(age)] > t) {
    ++age;
  }
  const std::size_t left = slot(age);
  if (times_[left] >= t || age == 0 || hold_ == Hold::zero_order) {
    return joint.history[left];
  }
  const std::size_t right = slot(age - 1);
  const double part = (t - times_[left]) / (times_[right] - times_[left]);
  return joint.history[left] + part * (joint.history[right] - joint.history[left]);
}

// T ẏ + y = u over `length`, with u going linearly from `begin` to `end`; adds ∫y to the mean.
void EffortCorrector::piece(Joint& joint, double begin, double end, double length) const {
  const double lag = correction_.lag;
  if (lag <= 0.0) {
    joint.y = end;
    joint.mean += 0.5 * (begin + end) * length;
    return;
  }
  const double x = length / lag, behind = (end - begin) / x;  // y follows a ramp by slope·T
  const double gone = -std::expm1(-x), away = joint.y - begin;
  joint.y = end - behind * gone + away * (1.0 - gone);
  joint.mean += (0.5 * (begin + end) - behind) * length + (away + behind) * lag * gone;
}

// The delayed signal between the times `from` and `to` of the input, piece by piece.
void EffortCorrector::advance(Joint& joint, double from, double to) const {
  joint.mean = 0.0;
  double t = from;
  std::size_t age = count_;  // of the first sample after t
  while (age > 0 && times_[slot(age - 1)] <= t) {
    --age;
  }
  while (t < to) {
    const double next = age > 0 ? std::min(times_[slot(age - 1)], to) : to;
    const double begin = at(joint, t);
    const double end = hold_ == Hold::zero_order ? begin : at(joint, next);
    piece(joint, begin, end, next - t);
    t = next;
    while (age > 0 && times_[slot(age - 1)] <= t) {
      --age;
    }
  }
  joint.mean /= to - from;
}

void EffortCorrector::step(double t, const double* effort) {
  if (count_ == 0) {
    push(t, effort);
    for (Joint& joint : joints_) {
      joint.y = joint.mean = joint.history[newest_];
    }
    return;
  }
  const double before = times_[newest_];
  push(t, effort);
  for (Joint& joint : joints_) {
    advance(joint, before - correction_.delay, t - correction_.delay);
  }
}

}  // namespace wheelwright::filter
