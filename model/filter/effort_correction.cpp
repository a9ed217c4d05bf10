// SPDX-License-Identifier: Apache-2.0
#include "model/filter/effort_correction.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::filter {
namespace {

using model::SpeedFilterKind;

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
  if (c.smoothing) {
    check::that(c.smoothing->time.lower > 0.0 && c.smoothing->time.upper >= c.smoothing->time.lower &&
                    std::isfinite(c.smoothing->time.upper),
                "speed_filter time", "a number > 0, or two [lo, hi] with 0 < lo <= hi");
    check::that(c.smoothing->order == 1 ||
                    (c.smoothing->order == 2 && c.smoothing->kind == model::SpeedFilterKind::exponential),
                "speed_filter order", "1, or 2 of an exponential filter");
    check::that(c.delay == 0.0 && c.lag == 0.0, "speed_filter", "no effect beside it that delays efforts");
  }
}

EffortCorrection effort_correction(const Robot& robot, bool from_speeds) {
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
  if (from_speeds) {
    c.smoothing = robot.speed_filter;
  }
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
  std::size_t window = 0;
  if (correction_.smoothing) {
    nominal_ = check::positive(nominal_step, "measurement nominal_step");
    if (correction_.smoothing->kind == SpeedFilterKind::mean) {
      const double rows = std::ceil(correction_.smoothing->time.upper / nominal_) + 1.0;
      check::that(rows <= kMostHistory, "speed_filter time", "a mean of at most 10⁶ rows");
      window = static_cast<std::size_t>(rows);
    }
  }
  for (Joint& joint : joints_) {
    joint.history.resize(kept);
    joint.window.resize(window);
  }
}

double EffortCorrector::memory(double share) const {
  if (correction_.smoothing) {
    const model::SpeedFilter& filter = *correction_.smoothing;
    // Of two in a row (1 + x) e^{−x} is left, at most 2 e^{−0.7 x}.
    constexpr double kTwo = 0.7;
    return filter.kind == SpeedFilterKind::mean ? filter.time.upper
           : filter.order == 1                  ? -filter.time.upper * std::log(share)
                                                : -filter.time.upper * std::log(0.5 * share) / kTwo;
  }
  return correction_.delay - correction_.lag * std::log(share);
}

// y += (1 − p)(u − y), p = e^{−h/T}. For p′ instead the difference z follows z = p′ z + (p′ − p)(y − u) + (1 − p′)(what
// u would be off by).
double EffortCorrector::exponential(Joint& joint, double u, double rows) const {
  const model::SpeedFilter& filter = *correction_.smoothing;
  const auto kept = [&](double time) { return std::exp(-rows * nominal_ / time); };
  const double p = kept(filter.middle()), most = kept(filter.time.upper), least = kept(filter.time.lower);
  double off = 0.0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(filter.order); ++i) {
    double &y = joint.smooth[i], &z = joint.off[i];
    z = most * z + std::max(most - p, p - least) * std::abs(y - u) + (1.0 - least) * off;
    y += (1.0 - p) * (u - y);
    u = y;
    off = z;
  }
  joint.now = off;
  return u;
}

// Mean of n = T/h samples, n no whole number: the oldest counts in part. For n′ instead the difference is at most
// |n′ − n|/n′ times the largest distance of a sample in which they differ from the mean.
double EffortCorrector::window_mean(Joint& joint, double u) const {
  const model::SpeedFilter& filter = *correction_.smoothing;
  joint.window[in_window_] = u;
  const double least = std::max(filter.time.lower / nominal_, 1.0),
               most = std::max(filter.time.upper / nominal_, least);
  const double n = std::clamp(filter.middle() / nominal_, least, most);
  const auto sample = [&](std::size_t age) {
    return joint.window[(in_window_ + joint.window.size() - age) % joint.window.size()];
  };
  double sum = 0.0;
  for (std::size_t age = 0; static_cast<double>(age) < n; ++age) {
    sum += std::min(1.0, n - static_cast<double>(age)) * sample(age);
  }
  const double mean = sum / n;
  double apart = 0.0;
  for (auto age = static_cast<std::size_t>(least); static_cast<double>(age) < most; ++age) {
    apart = std::max(apart, std::abs(sample(age) - mean));
  }
  joint.now = std::max(most - n, n - least) / least * apart;
  return mean;
}

double EffortCorrector::instantaneous(double u, std::size_t joint) const {
  const double clipped = std::clamp(u, -correction_.limit, correction_.limit);
  const double past = std::max(std::abs(clipped) - correction_.deadzone, 0.0);
  return correction_.gain_of(joint) * std::copysign(past, clipped);
}

std::size_t EffortCorrector::slot(std::size_t age) const {
  return newest_ >= age ? newest_ - age : newest_ + times_.size() - age;
}

// The sample `u` behind the filters of samples, `rows` rows after the last.
double EffortCorrector::filtered(Joint& joint, double u, double rows, bool first) const {
  if (!correction_.smoothing || correction_.smoothing->kind == SpeedFilterKind::lag) {
    return u;
  }
  if (first) {
    joint.smooth.fill(u);
    joint.off.fill(0.0);
    std::ranges::fill(joint.window, u);
    joint.now = 0.0;
    return u;
  }
  return correction_.smoothing->kind == SpeedFilterKind::mean ? window_mean(joint, u) : exponential(joint, u, rows);
}

void EffortCorrector::push(double t, const double* effort) {
  const double before = count_ > 0 ? times_[newest_] : t;
  const bool replace = count_ >= 2 && t - times_[slot(1)] < closest_;
  if (!replace) {
    newest_ = count_ == 0 || newest_ + 1 == times_.size() ? 0 : newest_ + 1;
    count_ = std::min(count_ + 1, times_.size());
  }
  times_[newest_] = t;
  in_window_ = in_window_ + 1 < joints_.front().window.size() ? in_window_ + 1 : 0;
  const bool first = count_ == 1 && !replace;
  const double rows = first || nominal_ == 0.0 ? 1.0 : std::max(1.0, std::round((t - before) / nominal_));
  for (std::size_t j = 0; j < joints_.size(); ++j) {
    joints_[j].history[newest_] = filtered(joints_[j], instantaneous(effort[j], j), rows, first);
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

// T ẏ + y = u over `length`, with u going linearly from `begin` to `end`; adds ∫y to the mean. For T′ instead of T the
// difference z follows T′ ż + z = (1 − T′/T)(u − y), and u − y is between its values at both ends.
void EffortCorrector::piece(Joint& joint, double begin, double end, double length) const {
  const bool smoothed = correction_.smoothing && correction_.smoothing->kind == SpeedFilterKind::lag;
  const double lag = smoothed ? correction_.smoothing->middle() : correction_.lag;
  if (lag <= 0.0) {
    joint.y = end;
    joint.mean += 0.5 * (begin + end) * length;
    return;
  }
  const double x = length / lag, behind = (end - begin) / x;  // y follows a ramp by slope·T
  const double gone = -std::expm1(-x), away = joint.y - begin;
  joint.y = end - behind * gone + away * (1.0 - gone);
  if (smoothed) {
    const Interval time = correction_.smoothing->time;
    const double share = std::max(time.upper - lag, lag - time.lower) / lag;
    const double apart = share * std::max(std::abs(away), std::abs(end - joint.y));
    const double added = -std::expm1(-length / time.lower) * apart;
    joint.doubt = std::max(joint.doubt, joint.now + added);
    joint.now = std::exp(-length / time.upper) * joint.now + added;
  }
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
      joint.now = joint.doubt = 0.0;
    }
    return;
  }
  const double before = times_[newest_];
  for (Joint& joint : joints_) {
    joint.doubt = joint.now;
  }
  push(t, effort);
  for (Joint& joint : joints_) {
    joint.doubt = std::max(joint.doubt, joint.now);
    advance(joint, before - correction_.delay, t - correction_.delay);
  }
}

}  // namespace wheelwright::filter
