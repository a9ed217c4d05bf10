// SPDX-License-Identifier: Apache-2.0
#include "model/filter/element_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "model/filter/in_order.hpp"

namespace wheelwright::filter {
namespace {

constexpr double kInterpolated = 6.5;  // nominal steps: five rows are lost
constexpr double kAlike = 0.05;        // relative: steps alike enough for a parabola through past efforts

// result = |matrix| · x.
void multiply_sizes(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& x, Eigen::VectorXd& result) {
  multiply(matrix, x, result, [](double number) { return std::abs(number); });
}

double cube(double x) { return x * x * x; }

// The most that ∫ (s − middle)(φ̇ − mean) ds is in a step of angles.
double moment(const StepMotion& step, Eigen::Index c) { return step.departure[c] * step.length * step.length / 6.0; }

std::size_t steps_within(double time, double nominal) {
  return time > 0.0 ? static_cast<std::size_t>(std::ceil(time / nominal)) + 1 : 0;
}

}  // namespace

ElementFilter::ElementFilter(Model model, Measurement measurement, SignalErrors errors)
    : model_(std::move(model)), measurement_(std::move(measurement)), errors_(std::move(errors)) {
  model::validate(model_);
  const auto joints = static_cast<Eigen::Index>(model_.joints.size());
  const auto coordinates = static_cast<Eigen::Index>(model_.coordinates.size());
  const auto n = static_cast<Eigen::Index>(model_.n());
  check::that(measurement_.motion_columns.size() == model_.joints.size() &&
                  measurement_.effort_columns.size() == model_.joints.size(),
              "measurement", "one motion and one effort column for each joint");
  check::that(measurement_.delay.lower <= measurement_.delay.upper, "effort delay", "lower <= upper");
  ranged_ = measurement_.delay.lower != 0.0 || measurement_.delay.upper != 0.0;
  check::that(!ranged_ || measurement_.nominal_step > 0.0, "effort delay", "a measurement with a nominal step");
  check::that(!ranged_ || measurement_.correction.empty(), "effort delay",
              "efforts that no effect of the robot corrects (effects know a delay of their own)");
  check::that(measurement_.smoothing.lower >= 0.0 && measurement_.smoothing.lower <= measurement_.smoothing.upper,
              "effort smoothing", "0 <= lower <= upper");
  if (measurement_.smoothing.upper > 0.0) {
    check::that(measurement_.nominal_step > 0.0, "effort smoothing", "a measurement with a nominal step");
    check::that(measurement_.correction.empty() && !measurement_.effort_unsigned, "effort smoothing",
                "efforts with a sign, which no effect of the robot corrects");
    sharpening_ = measurement_.sharpening();
  }
  angles_ = measurement_.motion != MotionKind::speed;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  std::size_t back = 3;
  ahead_ = mean ? 1 : 0;
  if (ranged_) {
    ahead_ = steps_within(measurement_.delay.upper + (mean ? 0.5 : 0.0) * measurement_.nominal_step,
                          measurement_.nominal_step);
    back += steps_within(-measurement_.delay.lower, measurement_.nominal_step);
  }
  longest_ = measurement_.longest_step();
  if (errors_.interpolates && measurement_.motion != MotionKind::mean_speed) {
    longest_ = std::max(longest_, kInterpolated * measurement_.nominal_step);
  }
  if (errors_.acceleration.size() == 0) {
    errors_.acceleration = errors_.speed = errors_.speed_sample = Eigen::VectorXd::Zero(coordinates);
  }
  if (errors_.output.size() == 0) {
    errors_.output = Eigen::VectorXd::Zero(n);
  }
  if (errors_.motion.effort.size() == 0) {
    errors_.motion.effort = Eigen::VectorXd::Zero(n);
  }
  enclosure_ = StepEnclosure(model_, errors_.between_samples ? errors_.motion : MotionBound{});
  const Eigen::VectorXd joint_zero = Eigen::VectorXd::Zero(joints), output_zero = Eigen::VectorXd::Zero(n);
  ring_.assign(ahead_ + back, Sample{0.0, joint_zero, joint_zero, joint_zero, joint_zero, joint_zero, joint_zero});
  speed_ = speed_before_ = Eigen::VectorXd::Zero(coordinates);
  joint_speed_ = low_ = high_ = scratch_ = falling_in_ = rising_in_ = joint_zero;
  steps_.fill(StepMotion(model_));
  efforts_.fill(StepEffort{output_zero, output_zero, output_zero});
  curve_ = curve_doubt_ = effort_change_ = output_zero;
  for (std::size_t k = 0; k < model_.terms.size(); ++k) {
    if (model_.terms[k].kind == Term::Kind::function) {
      functions_.push_back(k);
    }
  }
  if (!measurement_.correction.empty()) {
    corrector_ =
        EffortCorrector(measurement_.correction, model_.joints.size(), measurement_.hold, measurement_.nominal_step);
    measurement_.changes = model::EffortChanges::at_samples;
  }
  const bool odometry = model_.heading_used && measurement_.heading_column.empty();
  const bool angle = measurement_.motion == MotionKind::angle;
  bridges_ = errors_.bridges && longest_ > 0.0 && (corrector_.empty() || !(corrector_.memory(0.5) > 0.0)) &&
             (angle || !odometry) && !(angle && measurement_.effort_unsigned);
  element_.motion = element_.slope = element_.motion_doubt = element_.motion_doubt_before = speed_;
  element_.torque = element_.torque_doubt = output_zero;
  element_.functions.resize(functions_.size());
}

void ElementFilter::restart() {
  samples_ = 0;
  instants_ = 0;
  after_loss_ = false;
  corrector_.restart();
}

void ElementFilter::read(double t, std::span<const double> sample) {
  newest_ = newest_ + 1 < ring_.size() ? newest_ + 1 : 0;
  ++samples_;
  Sample& now = ring_[newest_];
  now.t = t;
  for (Eigen::Index j = 0; j < now.joint.size(); ++j) {
    const double value = sample[static_cast<std::size_t>(j)];
    now.joint[j] = measurement_.count > 0.0 ? std::round(value / measurement_.count) * measurement_.count : value;
    now.joint[j] = uncut(now.joint[j], measurement_.cut);
  }
  now.heading = measurement_.heading_column.empty() ? 0.0 : sample.back();
  read_effort(now, sample);
}

void ElementFilter::read_effort(Sample& now, std::span<const double> sample) {
  const auto joints = static_cast<std::size_t>(now.joint.size());
  const Sample& before = ring_[(newest_ + ring_.size() - 1) % ring_.size()];
  for (std::size_t j = 0; j < joints; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const double value = sample[joints + j];
    if (measurement_.effort_unsigned) {
      const bool angle = measurement_.motion == MotionKind::angle;
      const double moved = !angle ? now.joint[i] : samples_ > 1 ? now.joint[i] - before.joint[i] : 0.0;
      now.effort[i] = std::abs(value) * core::sign(moved);
    } else {
      now.effort[i] = value;
    }
  }
  if (sharpening_.upper > 0.0) {
    sharpen(now, before);
  }
  if (corrector_.empty()) {
    now.over = before.effort;
    return;
  }
  corrector_.step(now.t, now.effort.data());
  for (std::size_t j = 0; j < joints; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    now.over[i] = corrector_.mean(j);  // what acted since the last sample is known now
    now.effort[i] = corrector_.now(j);
    now.doubt[i] = corrector_.doubt(j);
  }
}

// The effort of a row before it was smoothed: y + κ(y − that of the row before).
void ElementFilter::sharpen(Sample& now, const Sample& before) {
  now.logged = now.effort;
  now.sharp = samples_ > 1 && !(longest_ > 0.0 && now.t - before.t > longest_);
  const double middle = 0.5 * (sharpening_.lower + sharpening_.upper), half = sharpening_.upper - middle;
  const bool held = measurement_.hold == Hold::zero_order && measurement_.changes == model::EffortChanges::at_samples;
  each(now.effort.size(), [&](Eigen::Index j) {
    const double change = now.sharp ? now.logged[j] - before.logged[j] : 0.0;
    now.effort[j] = now.logged[j] + middle * change;
    now.own_doubt[j] = half * std::abs(change);
    now.doubt[j] = held ? before.own_doubt[j] : std::max(before.own_doubt[j], now.own_doubt[j]);
  });
}

void ElementFilter::measure_motion(const Sample& now, const Sample& before) {
  StepMotion& step = present();
  step.ends = measurement_.motion == MotionKind::speed;
  switch (measurement_.motion) {
    case MotionKind::angle:
      each(now.joint.size(),
           [&](Eigen::Index j) { step.joint_speed[j] = (now.joint[j] - before.joint[j]) / step.length; });
      break;
    case MotionKind::mean_speed: step.joint_speed = now.joint; break;
    case MotionKind::speed:
      each(now.joint.size(), [&](Eigen::Index j) {
        step.joint_speed[j] = 0.5 * (before.joint[j] + now.joint[j]);
        scratch_[j] = now.joint[j] - before.joint[j];
      });
      multiply(model_.motion, scratch_, step.gain);
      break;
  }
  multiply(model_.motion, step.joint_speed, step.speed);
  const double error = angles_ && errors_.joint_sample > 0.0 ? measurement_.nominal_step / step.length : 1.0;
  each(step.joint_error.size(), [&](Eigen::Index j) { step.joint_error[j] = error * errors_.joint_sample; });
  each(step.speed.size(), [&](Eigen::Index c) { step.speed_error[c] = error * errors_.speed_sample[c]; });
}

// Whether rows are lost between the sample of `age` and the one before it.
bool ElementFilter::lost_before(std::size_t age) const {
  return longest_ > 0.0 && sample(age).t - sample(age + 1).t > longest_;
}

// Whether the samples tell the effort in the step whose motion ends with the sample of `age`.
bool ElementFilter::effort_is_known(std::size_t age) const {
  if (!(longest_ > 0.0)) {
    return true;
  }
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  const bool held = measurement_.hold == Hold::zero_order && measurement_.changes == model::EffortChanges::at_samples;
  if (lost_before(age) || (mean && !held && lost_before(age - 1))) {
    return false;
  }
  if (ranged_) {
    const double shift = mean ? 0.5 * measurement_.nominal_step : 0.0;
    const double from = sample(age + 1).t + shift + measurement_.delay.lower,
                 to = sample(age).t + shift + measurement_.delay.upper;
    const std::size_t kept = std::min(samples_, ring_.size());
    for (std::size_t k = 0; k + 1 < kept; ++k) {
      const bool about = sample(k).t > from && sample(k + 1).t < to;
      if (about && (lost_before(k) || !sample(k).sharp || !sample(k + 1).sharp)) {
        return false;
      }
    }
    return true;
  }
  for (std::size_t k = mean ? age - 1 : held ? age + 1 : age; k <= age + 1; ++k) {
    if (!sample(k).sharp) {
      return false;
    }
  }
  return true;
}

// All values that may act between `begin` and `end` where logged efforts are late by anything in the declared range.
void ElementFilter::effort_of_range(double begin, double end) {
  const double from = begin + measurement_.delay.lower, to = end + measurement_.delay.upper;
  low_.setConstant(core::kInfinity);
  high_.setConstant(-core::kInfinity);
  // From the last stamp before the range to the first behind it: a value may change right after its stamp, or before
  // it.
  const std::size_t held = std::min(samples_, ring_.size());
  for (std::size_t k = 0; k < held; ++k) {
    const bool behind = sample(k).t > to && k + 1 < held && sample(k + 1).t >= to;
    const bool gone = k > 0 && sample(k - 1).t <= from;
    if (behind || gone) {
      continue;
    }
    for (Eigen::Index j = 0; j < low_.size(); ++j) {
      low_[j] = std::min(low_[j], sample(k).effort[j] - sample(k).own_doubt[j]);
      high_[j] = std::max(high_[j], sample(k).effort[j] + sample(k).own_doubt[j]);
    }
  }
}

bool ElementFilter::effort_is_covered(double end) const {
  return !ranged_ || sample(0).t >= end + measurement_.delay.upper;
}

// Effort in the step whose motion ends with the sample of `age`.
bool ElementFilter::measure_effort(std::size_t age) {
  const Sample& now = sample(age);
  const Sample& before = sample(age + 1);
  const bool held = measurement_.hold == Hold::zero_order;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  const bool between = measurement_.changes == model::EffortChanges::between;
  // Without bounds the nominal hold is taken: the middle of what is possible would be half a step late.
  const bool hull = ranged_ || (held && between && (errors_.between_samples || errors_.held_between));
  const Eigen::Index joints = low_.size();
  bool alike = true;  // what falls is the same as what rises
  if (hull) {
    if (ranged_) {
      const double shift = mean ? 0.5 * present().length : 0.0;
      effort_of_range(before.t + shift, now.t + shift);
    } else {
      low_ = before.effort.cwiseMin(now.effort);
      high_ = before.effort.cwiseMax(now.effort);
      if (mean) {
        low_ = low_.cwiseMin(sample(age - 1).effort);
        high_ = high_.cwiseMax(sample(age - 1).effort);
      }
    }
    each(joints, [&](Eigen::Index j) { falling_in_[j] = 0.25 * (low_[j] + high_[j]); });
  } else if (!mean && held) {
    // Held values on a line from the one at the beginning to the one at the end, of which the latter acts later.
    const double rows = std::round(present().length / measurement_.nominal_step);
    const bool lost = errors_.interpolates && present().length > measurement_.longest_step();
    const double share = lost ? 0.5 * (rows - 1.0) / rows : 0.0;
    each(joints, [&](Eigen::Index j) {
      const double held_there = now.over[j] + share * (now.effort[j] - now.over[j]);
      low_[j] = lost ? std::min(now.over[j], now.effort[j]) : held_there;
      high_[j] = lost ? std::max(now.over[j], now.effort[j]) : held_there;
      falling_in_[j] = 0.5 * held_there;
    });
  } else if (!mean || held) {  // of means, the stamp is in the middle of the step
    const Eigen::VectorXd& begin = mean ? now.over : before.effort;
    const Eigen::VectorXd& end = mean ? sample(age - 1).over : now.effort;
    const double near = mean ? 3.0 : 2.0, all = 2.0 * (near + 1.0);
    each(joints, [&](Eigen::Index j) {
      const double first = begin[j], last = end[j];
      low_[j] = std::min(first, last);
      high_[j] = std::max(first, last);
      falling_in_[j] = (near * first + last) / all;
      rising_in_[j] = (first + near * last) / all;
    });
    alike = false;
  } else {
    const Sample& next = sample(age - 1);
    each(joints, [&](Eigen::Index j) {
      const double first = before.effort[j], middle = now.effort[j], last = next.effort[j];
      low_[j] = std::min({first, middle, last});
      high_[j] = std::max({first, middle, last});
      falling_in_[j] = between ? 0.5 * middle : (5.0 * first + 18.0 * middle + last) / 48.0;
      rising_in_[j] = (first + 18.0 * middle + 5.0 * last) / 48.0;
    });
    alike = between;
  }
  StepEffort& e = present_effort();
  each(joints, [&](Eigen::Index j) {
    scratch_[j] = ranged_ ? 0.0 : mean ? std::max(now.doubt[j], sample(age - 1).doubt[j]) : now.doubt[j];
    low_[j] -= scratch_[j];
    high_[j] += scratch_[j];
  });
  multiply_sizes(model_.input, scratch_, e.doubt);
  multiply(model_.input, falling_in_, e.falling);
  if (alike) {
    each(e.rising.size(), [&](Eigen::Index i) { e.rising[i] = e.falling[i]; });
  } else {
    multiply(model_.input, rising_in_, e.rising);
  }
  each(joints, [&](Eigen::Index j) { scratch_[j] = 0.5 * (high_[j] - low_[j]); });
  multiply_sizes(model_.input, scratch_, effort_change_);
  StepMotion& step = present();
  step.held = held && !between && !ranged_ && !mean && corrector_.empty() && !measurement_.effort_unsigned;
  each(e.doubt.size(), [&](Eigen::Index i) {
    e.doubt[i] = hull ? effort_change_[i] : e.doubt[i];
    step.effort[i] = e.falling[i] + e.rising[i];
    step.effort_error[i] = effort_change_[i] + errors_.motion.effort[i];
  });
  return effort_is_covered(mean ? now.t + 0.5 * present().length : now.t);
}

bool ElementFilter::describe(std::size_t age) {
  const Sample& now = sample(age);
  const Sample& before = sample(age + 1);
  newest_step_ = 1 - newest_step_;
  length_before_ = length_;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  const bool interval = mean && measurement_.nominal_step > 0.0 && !lost_before(age);
  length_ = interval ? measurement_.nominal_step : now.t - before.t;
  present().length = length_;
  present().known = effort_is_known(age);
  measure_motion(now, before);
  if (measurement_.heading_column.empty()) {
    const bool first = instants_ == (angles_ ? 0U : 1U);
    const auto c = static_cast<Eigen::Index>(std::max(model_.heading_coordinate, 0));
    present().heading =
        first || model_.heading_coordinate < 0
            ? 0.0
            : previous().heading + 0.5 * (length_before_ * previous().speed[c] + length_ * present().speed[c]);
  } else {
    present().heading = 0.5 * (before.heading + now.heading);
  }
  present().heading_error = errors_.heading;
  if (!present().known) {
    present().departure.setZero();
    return true;
  }
  const bool follows = instants_ > 0 && previous().known;
  return measure_effort(age) && enclosure_.enclose(model_, present(), follows ? &previous() : nullptr);
}

// q − `corrected`, with `covered` in doubt, both times the curvature of a parabola through three efforts, `a` and `b`
// apart.
void ElementFilter::curve_effort(double a, double b, const Eigen::VectorXd& first, const Eigen::VectorXd& middle,
                                 const Eigen::VectorXd& last, double corrected, double covered) {
  for (Eigen::Index j = 0; j < scratch_.size(); ++j) {
    scratch_[j] = 2.0 * ((last[j] - middle[j]) / b - (middle[j] - first[j]) / a) / (a + b);
  }
  multiply(model_.input, scratch_, curve_);
  for (Eigen::Index i = 0; i < curve_.size(); ++i) {
    curve_[i] *= corrected;
  }
  scratch_ = scratch_.cwiseAbs();
  multiply_sizes(model_.input, scratch_, curve_doubt_);
  for (Eigen::Index i = 0; i < curve_doubt_.size(); ++i) {
    curve_doubt_[i] *= covered;
  }
}

void ElementFilter::begin() {
  began_ = true;
  at_rest_ = present().known && speed_.isZero(0.0) && (corrector_.empty() || present_effort().falling.isZero(0.0));
  first_length_ = length_;
  element_.number = 0;
}

// The node between the last two steps, and the way to the end of the last.
void ElementFilter::make_hat() {
  const double h = length_, before = length_before_;
  const bool linear = measurement_.hold == Hold::first_order && measurement_.changes == model::EffortChanges::between;
  curve_.setZero();
  curve_doubt_.setZero();
  if (linear && !ranged_) {
    const Sample &first = sample(ahead_ + 2), &middle = sample(ahead_ + 1), &last = sample(ahead_);
    if (measurement_.motion == MotionKind::angle) {
      const double least = 2.0 * cube(std::min(h, before)) / 24.0, most = (cube(h) + cube(before)) / 24.0;
      curve_effort(before, h, first.effort, middle.effort, last.effort, least, std::max(least, most - least));
    } else {
      const Sample& next = sample(ahead_ - 1);
      scratch_ = (first.effort - middle.effort - last.effort + next.effort).cwiseAbs() / 48.0;
      multiply_sizes(model_.input, scratch_, curve_doubt_);
      curve_doubt_ *= h;
    }
  }
  element_.known = true;
  element_.run_begins = element_.run_ends = false;
  element_.t = t_ - h;
  element_.length = 0.5 * (before + h);
  element_.before = before;
  element_.step = h;
  const StepMotion &first = previous(), &last = present();
  each(element_.motion.size(), [&](Eigen::Index c) {
    element_.motion[c] = 0.5 * (before * first.speed[c] + h * last.speed[c]);
    element_.slope[c] = last.speed[c] - first.speed[c];
    element_.motion_doubt[c] = moment(last, c);
    element_.motion_doubt_before[c] = moment(first, c);
  });
  const StepEffort &rising = previous_effort(), &falling = present_effort();
  each(element_.torque.size(), [&](Eigen::Index i) {
    element_.torque[i] = before * rising.rising[i] + h * falling.falling[i] - curve_[i];
    element_.torque_doubt[i] = 0.5 * (before * rising.doubt[i] + h * falling.doubt[i]) + curve_doubt_[i];
  });
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const model::TermValue &one = first.values[k], &two = last.values[k];
    element_.functions[k] = {0.5 * (before * one.value + h * two.value), 0.5 * (before * one.error + h * two.error)};
  }
}

// The step between the last two samples.
void ElementFilter::make_step() {
  const double h = length_;
  const bool linear = measurement_.hold == Hold::first_order && measurement_.changes == model::EffortChanges::between;
  curve_.setZero();
  curve_doubt_.setZero();
  if (linear && !ranged_) {
    if (instants_ > 2) {
      const bool even = std::abs(h - length_before_) <= kAlike * h;
      curve_effort(length_before_, h, sample(2).effort, sample(1).effort, sample(0).effort, even ? cube(h) / 12.0 : 0.0,
                   cube(h) / 12.0);
    } else {
      curve_doubt_ = h * effort_change_;
    }
  }
  const bool exact = measurement_.hold == Hold::zero_order && measurement_.changes == model::EffortChanges::at_samples;
  for (Eigen::Index i = 0; i < effort_change_.size(); ++i) {
    effort_change_[i] = exact && !ranged_ ? 0.0 : 2.0 * (effort_change_[i] + errors_.motion.effort[i]);
  }
  element_.known = true;
  element_.run_begins = element_.run_ends = false;
  element_.t = t_;
  element_.length = element_.before = element_.step = h;
  for (std::size_t c = 0; c < static_cast<std::size_t>(element_.motion.size()); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    element_.motion[i] = h * present().speed[i];
    element_.slope[i] = speed_[i] - speed_before_[i];
    double doubt = present().bow[i] * h;
    if (const double acceleration = present().acceleration[i]; acceleration < core::kInfinity) {
      const double change = enclosure_.change(c, model_, present(), effort_change_);
      doubt = std::min(doubt, std::min(0.25 * acceleration, 0.125 * change) * h * h);
    }
    element_.motion_doubt[i] = doubt;
  }
  for (Eigen::Index i = 0; i < element_.torque.size(); ++i) {
    element_.torque[i] = h * (present_effort().falling[i] + present_effort().rising[i]) - curve_[i];
    element_.torque_doubt[i] = h * present_effort().doubt[i] + curve_doubt_[i];
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    element_.functions[k] = {h * present().values[k].value, h * present().values[k].error};
  }
}

// The same where a step of it is not known.
void ElementFilter::make_unknown() {
  const double h = length_;
  const StepMotion &first = previous(), &last = present();
  element_.known = false;
  element_.t = angles_ ? t_ - h : t_;
  element_.before = angles_ ? length_before_ : h;
  element_.step = h;
  element_.length = 0.0;
  element_.motion.setZero();
  element_.slope.setZero();
  element_.torque.setZero();
  element_.torque_doubt.setZero();
  element_.motion_doubt.setZero();
  element_.motion_doubt_before.setZero();
  for (model::TermValue& function : element_.functions) {
    function = {};
  }
  if (!angles_) {
    element_.run_begins = instants_ == 2 || first.known;
    element_.run_ends = false;
    return;
  }
  element_.run_begins = first.known;
  element_.run_ends = last.known;
  each(element_.motion.size(), [&](Eigen::Index c) {  // departures in steps that are not known are 0
    element_.motion_doubt[c] = moment(last, c);
    element_.motion_doubt_before[c] = moment(first, c);
  });
}

// Held, linear, stamps at samples or in the middle of the steps: as measure_effort() and curve_effort() have them.
ElementFilter::EffortWeights ElementFilter::effort_weights() const {
  const bool held = measurement_.hold == Hold::zero_order;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  const bool between = measurement_.changes == model::EffortChanges::between;
  if (ranged_ || errors_.interpolates || sharpening_.upper > 0.0 || !corrector_.empty() ||
      measurement_.effort_unsigned || (held && between)) {
    return {};
  }
  const double a = element_.before, b = element_.step;
  if (!angles_) {
    if (held) {
      return {true, {0.0, 0.0, b, 0.0}};
    }
    EffortWeights w{true, {0.0, 0.0, 0.5 * b, 0.5 * b}};
    if (between && instants_ > 2 && std::abs(b - length_before_) <= kAlike * b) {
      const double first = 2.0 * cube(b) / 12.0 / (length_before_ + b);
      w.weight[1] -= first / length_before_;
      w.weight[2] += first / length_before_ + first / b;
      w.weight[3] -= first / b;
    }
    return w;
  }
  if (mean) {
    return held ? EffortWeights{true, {a / 8.0, 3.0 * (a + b) / 8.0, b / 8.0, 0.0}}
           : between
               ? EffortWeights{true, {0.0, 0.5 * a, 0.5 * b, 0.0}}
               : EffortWeights{true, {a / 48.0, (18.0 * a + 5.0 * b) / 48.0, (5.0 * a + 18.0 * b) / 48.0, b / 48.0}};
  }
  if (held) {
    return {true, {0.5 * a, 0.5 * b, 0.0, 0.0}};
  }
  EffortWeights w{true, {a / 6.0, (a + b) / 3.0, b / 6.0, 0.0}};
  if (between) {
    const double by = 2.0 * (2.0 * cube(std::min(a, b)) / 24.0) / (a + b);
    w.weight[0] -= by / a;
    w.weight[1] += by / a + by / b;
    w.weight[2] -= by / b;
  }
  return w;
}

bool ElementFilter::take() {
  const std::size_t age = ahead_;
  const std::size_t needed = angles_ ? ring_.size() - 1 : 1 + (ring_.size() - 3);
  if (samples_ < std::min(needed, ring_.size())) {
    return false;
  }
  speed_.swap(speed_before_);
  if (!angles_ && instants_ == 0) {
    const Sample& now = sample(age);
    joint_speed_ = now.joint;
    multiply(model_.motion, joint_speed_, speed_);
    instants_ = 1;
    t0_ = t_ = now.t;
    heading_ = now.heading;
    return false;
  }
  if (!describe(age)) {
    const bool lost = after_loss_;
    restart();
    after_loss_ = lost;
    return false;
  }
  const Sample& now = sample(age);
  const double h = length_;
  const double half = 0.5 * (lost_before(age) ? measurement_.nominal_step : h);
  t_ = measurement_.motion == MotionKind::mean_speed ? now.t + half : now.t;
  if (angles_) {
    joint_speed_ = present().joint_speed;
    speed_ = present().speed;
    heading_ = present().heading;
  } else {
    joint_speed_ = now.joint;
    multiply(model_.motion, joint_speed_, speed_);
    heading_ = measurement_.heading_column.empty()
                   ? (model_.heading_coordinate >= 0
                          ? heading_ + h * present().speed[static_cast<Eigen::Index>(model_.heading_coordinate)]
                          : 0.0)
                   : now.heading;
  }
  ++instants_;
  if (angles_ ? instants_ == 1 : instants_ == 2) {
    begin();
    if (angles_) {
      t0_ = t_;
      return false;
    }
  }
  if (!present().known || (angles_ && !previous().known)) {
    make_unknown();
  } else if (angles_) {
    make_hat();
  } else {
    make_step();
  }
  ++element_.number;
  return true;
}

bool ElementFilter::step(double t, std::span<const double> sample) {
  if (!bridges_ && samples_ > 0 && longest_ > 0.0 && t - ring_[newest_].t > longest_) {
    restart();
    after_loss_ = true;
  }
  read(t, sample);
  began_ = false;
  return take();
}

}  // namespace wheelwright::filter
