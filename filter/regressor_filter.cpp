// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regressor_filter.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright::filter {
namespace {

constexpr double kAlike = 0.05;  // relative: steps alike enough for a parabola through past efforts

double sign(double x) { return static_cast<double>(x > 0.0) - static_cast<double>(x < 0.0); }

// result = matrix · x, each sum from the first column to the last: the same digits in every language and build.
void multiply(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& x, Eigen::VectorXd& result) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    double sum = matrix(i, 0) * x[0];
    for (Eigen::Index j = 1; j < matrix.cols(); ++j) {
      sum += matrix(i, j) * x[j];
    }
    result[i] = sum;
  }
}

// The same with |matrix|.
void multiply_sizes(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& x, Eigen::VectorXd& result) {
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    double sum = std::abs(matrix(i, 0)) * x[0];
    for (Eigen::Index j = 1; j < matrix.cols(); ++j) {
      sum += std::abs(matrix(i, j)) * x[j];
    }
    result[i] = sum;
  }
}

double cube(double x) { return x * x * x; }

std::size_t steps_within(double time, double nominal) {
  return time > 0.0 ? static_cast<std::size_t>(std::ceil(time / nominal)) + 1 : 0;
}

}  // namespace

RegressorFilter::RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors)
    : model_(std::move(model)), design_(design), measurement_(std::move(measurement)), errors_(std::move(errors)) {
  model::validate(model_);
  validate(design_);
  const auto joints = static_cast<Eigen::Index>(model_.joints.size());
  const auto coordinates = static_cast<Eigen::Index>(model_.coordinates.size());
  const auto n = static_cast<Eigen::Index>(model_.n());
  const auto p = static_cast<Eigen::Index>(model_.p());
  check::that(measurement_.motion_columns.size() == model_.joints.size() &&
                  measurement_.effort_columns.size() == model_.joints.size(),
              "measurement", "one motion and one effort column for each joint");
  check::that(design_.order == 2 || measurement_.motion == MotionKind::speed, "filter order 1",
              "measured speeds (order 2 works on angles)");
  check::that(measurement_.delay.lower <= measurement_.delay.upper, "effort delay", "lower <= upper");
  ranged_ = measurement_.delay.lower != 0.0 || measurement_.delay.upper != 0.0;
  check::that(!ranged_ || measurement_.nominal_step > 0.0, "effort delay", "a measurement with a nominal step");
  check::that(!ranged_ || measurement_.correction.empty(), "effort delay",
              "efforts that no effect of the robot corrects (effects know a delay of their own)");
  angles_ = measurement_.motion != MotionKind::speed;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  std::size_t back = 3;
  ahead_ = mean ? 1 : 0;
  if (ranged_) {
    ahead_ = steps_within(measurement_.delay.upper + (mean ? 0.5 : 0.0) * measurement_.nominal_step,
                          measurement_.nominal_step);
    back += steps_within(-measurement_.delay.lower, measurement_.nominal_step);
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
  kernel_ = FilterKernel(design_, measurement_.motion, measurement_.nominal_step);
  ring_.assign(ahead_ + back, Sample{0.0, joint_zero, joint_zero, joint_zero, 0.0});
  speed_ = speed_before_ = Eigen::VectorXd::Zero(coordinates);
  joint_speed_ = low_ = high_ = scratch_ = joint_zero;
  step_ = step_before_ = StepMotion(model_);
  effort_ = effort_before_ = {output_zero, output_zero, output_zero};
  curve_ = curve_doubt_ = effort_change_ = output_zero;
  motion_.resize(model_.coordinates.size());
  slope_.resize(model_.coordinates.size());
  motion_doubt_.resize(model_.coordinates.size());
  slope_doubt_.resize(model_.coordinates.size());
  first_doubt_.resize(model_.coordinates.size());
  torque_.resize(model_.n());
  torque_doubt_.resize(model_.n());
  for (std::size_t k = 0; k < model_.terms.size(); ++k) {
    if (model_.terms[k].kind == Term::Kind::function) {
      functions_.push_back(FunctionTerm{k, {}, {}});
    }
  }
  if (!measurement_.correction.empty()) {
    corrector_ =
        EffortCorrector(measurement_.correction, model_.joints.size(), measurement_.hold, measurement_.nominal_step);
    measurement_.changes = model::EffortChanges::at_samples;
  }
  row_.Y = core::RowMatrix::Zero(n, p);
  row_.dY = core::RowMatrix::Zero(n, p);
  row_.y = output_zero;
  row_.dy = errors_.output;
}

void RegressorFilter::restart() {
  samples_ = 0;
  instants_ = 0;
  after_loss_ = false;
  corrector_.restart();
}

void RegressorFilter::read(double t, std::span<const double> sample) {
  newest_ = newest_ + 1 < ring_.size() ? newest_ + 1 : 0;
  ++samples_;
  Sample& now = ring_[newest_];
  now.t = t;
  for (Eigen::Index j = 0; j < now.joint.size(); ++j) {
    const double value = sample[static_cast<std::size_t>(j)];
    now.joint[j] = measurement_.count > 0.0 ? std::round(value / measurement_.count) * measurement_.count : value;
  }
  now.heading = measurement_.heading_column.empty() ? 0.0 : sample.back();
  read_effort(now, sample);
}

void RegressorFilter::read_effort(Sample& now, std::span<const double> sample) {
  const auto joints = static_cast<std::size_t>(now.joint.size());
  const Sample& before = ring_[(newest_ + ring_.size() - 1) % ring_.size()];
  for (std::size_t j = 0; j < joints; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const double value = sample[joints + j];
    if (measurement_.effort_unsigned) {
      const bool angle = measurement_.motion == MotionKind::angle;
      const double moved = !angle ? now.joint[i] : samples_ > 1 ? now.joint[i] - before.joint[i] : 0.0;
      now.effort[i] = std::abs(value) * sign(moved);
    } else {
      now.effort[i] = value;
    }
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
  }
}

void RegressorFilter::measure_motion(const Sample& now, const Sample& before) {
  StepMotion& step = step_;
  switch (measurement_.motion) {
    case MotionKind::angle:
      for (Eigen::Index j = 0; j < now.joint.size(); ++j) {
        step.joint_speed[j] = (now.joint[j] - before.joint[j]) / step.length;
      }
      break;
    case MotionKind::mean_speed: step.joint_speed = now.joint; break;
    case MotionKind::speed:
      for (Eigen::Index j = 0; j < now.joint.size(); ++j) {
        step.joint_speed[j] = 0.5 * (before.joint[j] + now.joint[j]);
      }
      break;
  }
  multiply(model_.motion, step.joint_speed, step.speed);
  const double error = angles_ && errors_.joint_sample > 0.0 ? measurement_.nominal_step / step.length : 1.0;
  step.joint_error.setConstant(error * errors_.joint_sample);
  for (Eigen::Index c = 0; c < step.speed.size(); ++c) {
    step.speed_error[c] = error * errors_.speed_sample[c];
  }
}

// All values that may act between `begin` and `end` where logged efforts are late by anything in the declared range.
void RegressorFilter::effort_of_range(double begin, double end) {
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
      low_[j] = std::min(low_[j], sample(k).effort[j]);
      high_[j] = std::max(high_[j], sample(k).effort[j]);
    }
  }
}

bool RegressorFilter::effort_is_covered(double end) const {
  return !ranged_ || sample(0).t >= end + measurement_.delay.upper;
}

// Effort in the step whose motion ends with the sample of `age`.
bool RegressorFilter::measure_effort(std::size_t age) {
  const Sample& now = sample(age);
  const Sample& before = sample(age + 1);
  const bool held = measurement_.hold == Hold::zero_order;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  const bool between = measurement_.changes == model::EffortChanges::between;
  // Without bounds the nominal hold is taken: the middle of what is possible would be half a step late.
  const bool hull = ranged_ || (held && between && errors_.between_samples);
  StepEffort& e = effort_;
  e.doubt.setZero();
  if (hull) {
    if (ranged_) {
      const double shift = mean ? 0.5 * step_.length : 0.0;
      effort_of_range(before.t + shift, now.t + shift);
    } else {
      low_ = before.effort.cwiseMin(now.effort);
      high_ = before.effort.cwiseMax(now.effort);
      if (mean) {
        low_ = low_.cwiseMin(sample(age - 1).effort);
        high_ = high_.cwiseMax(sample(age - 1).effort);
      }
    }
    for (Eigen::Index j = 0; j < low_.size(); ++j) {
      scratch_[j] = 0.25 * (low_[j] + high_[j]);
    }
    multiply(model_.input, scratch_, e.falling);
    e.rising = e.falling;
  } else if (!mean) {
    if (held) {
      low_ = high_ = now.over;
      scratch_ = 0.5 * now.over;
      multiply(model_.input, scratch_, e.falling);
      e.rising = e.falling;
    } else {
      low_ = before.effort.cwiseMin(now.effort);
      high_ = before.effort.cwiseMax(now.effort);
      scratch_ = (2.0 * before.effort + now.effort) / 6.0;
      multiply(model_.input, scratch_, e.falling);
      scratch_ = (before.effort + 2.0 * now.effort) / 6.0;
      multiply(model_.input, scratch_, e.rising);
    }
  } else {  // the stamp is in the middle of the step
    const Sample& next = sample(age - 1);
    if (held) {
      low_ = now.over.cwiseMin(next.over);
      high_ = now.over.cwiseMax(next.over);
      scratch_ = (3.0 * now.over + next.over) / 8.0;
      multiply(model_.input, scratch_, e.falling);
      scratch_ = (now.over + 3.0 * next.over) / 8.0;
      multiply(model_.input, scratch_, e.rising);
    } else {
      low_ = before.effort.cwiseMin(now.effort).cwiseMin(next.effort);
      high_ = before.effort.cwiseMax(now.effort).cwiseMax(next.effort);
      if (between) {
        scratch_ = 0.5 * now.effort;
        multiply(model_.input, scratch_, e.falling);
        e.rising = e.falling;
      } else {
        scratch_ = (5.0 * before.effort + 18.0 * now.effort + next.effort) / 48.0;
        multiply(model_.input, scratch_, e.falling);
        scratch_ = (before.effort + 18.0 * now.effort + 5.0 * next.effort) / 48.0;
        multiply(model_.input, scratch_, e.rising);
      }
    }
  }
  scratch_ = 0.5 * (high_ - low_);
  multiply_sizes(model_.input, scratch_, effort_change_);
  if (hull) {
    e.doubt = effort_change_;
  }
  for (Eigen::Index i = 0; i < e.doubt.size(); ++i) {
    step_.effort[i] = std::abs(e.falling[i] + e.rising[i]) + effort_change_[i] + errors_.motion.effort[i];
  }
  return effort_is_covered(mean ? now.t + 0.5 * step_.length : now.t);
}

bool RegressorFilter::describe(std::size_t age) {
  const Sample& now = sample(age);
  const Sample& before = sample(age + 1);
  std::swap(step_, step_before_);
  std::swap(effort_, effort_before_);
  length_before_ = length_;
  const bool mean = measurement_.motion == MotionKind::mean_speed;
  length_ = mean && measurement_.nominal_step > 0.0 ? measurement_.nominal_step : now.t - before.t;
  step_.length = length_;
  measure_motion(now, before);
  if (measurement_.heading_column.empty()) {
    const bool first = instants_ == (angles_ ? 0U : 1U);
    const auto c = static_cast<Eigen::Index>(std::max(model_.heading_coordinate, 0));
    step_.heading =
        first || model_.heading_coordinate < 0
            ? 0.0
            : step_before_.heading + 0.5 * (length_before_ * step_before_.speed[c] + length_ * step_.speed[c]);
  } else {
    step_.heading = 0.5 * (before.heading + now.heading);
  }
  step_.heading_error = errors_.heading;
  return measure_effort(age) && enclosure_.enclose(model_, step_);
}

void RegressorFilter::begin() {
  at_rest_ = speed_.isZero(0.0) && (corrector_.empty() || effort_.falling.isZero(0.0));
  for (auto* cascades : {&motion_, &slope_, &torque_, &torque_doubt_, &motion_doubt_}) {
    std::fill(cascades->begin(), cascades->end(), KernelState{});
  }
  std::fill(slope_doubt_.begin(), slope_doubt_.end(), SlopeMajorant{});
  area_ = start_ = {};
  for (FunctionTerm& f : functions_) {
    f.value = {};
    f.error = {};
  }
  first_length_ = length_;
  for (std::size_t c = 0; c < first_doubt_.size(); ++c) {
    first_doubt_[c] = step_.acceleration[static_cast<Eigen::Index>(c)] * length_ * length_ / 12.0;
  }
}

// q − `corrected`, with `covered` in doubt, both times the curvature of a parabola through three efforts, `a` and `b`
// apart.
void RegressorFilter::curve_effort(double a, double b, const Eigen::VectorXd& first, const Eigen::VectorXd& middle,
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

// The node between the last two steps, and the way to the end of the last.
void RegressorFilter::follow_angles() {
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
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    kernel_.take(motion_[c], 0.5 * (before * step_before_.speed[i] + h * step_.speed[i]));
    kernel_.take(slope_[c], step_.speed[i] - step_before_.speed[i]);
  }
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    kernel_.take(torque_[i], before * effort_before_.rising[k] + h * effort_.falling[k] - curve_[k]);
    kernel_.take(torque_doubt_[i], 0.5 * (before * effort_before_.doubt[k] + h * effort_.doubt[k]) + curve_doubt_[k]);
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const model::TermValue &first = step_before_.values[k], &second = step_.values[k];
    kernel_.take(functions_[k].value, 0.5 * (before * first.value + h * second.value));
    kernel_.take(functions_[k].error, 0.5 * (before * first.error + h * second.error));
  }
  for (std::size_t c = 0; c < slope_doubt_.size(); ++c) {
    slope_doubt_[c].advance(kernel_.decay(), design_.beta * h,
                            step_.acceleration[static_cast<Eigen::Index>(c)] * cube(h) / 12.0);
  }
  kernel_.take(area_, 0.5 * (before + h));
  kernel_.take(start_, instants_ == 2 ? 1.0 : 0.0);
}

// The step between the last two samples.
void RegressorFilter::follow_speeds() {
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
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    kernel_.take(motion_[c], h * step_.speed[i]);
    kernel_.take(slope_[c], speed_[i] - speed_before_[i]);
    double error = 0.0;
    if (step_.acceleration[i] > 0.0) {
      const double change = enclosure_.change(c, model_, step_, effort_change_);
      error = std::min(0.25 * step_.acceleration[i], 0.125 * change) * h * h;
    }
    kernel_.take(motion_doubt_[c], error);
  }
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    kernel_.take(torque_[i], h * (effort_.falling[k] + effort_.rising[k]) - curve_[k]);
    kernel_.take(torque_doubt_[i], h * effort_.doubt[k] + curve_doubt_[k]);
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    kernel_.take(functions_[k].value, h * step_.values[k].value);
    kernel_.take(functions_[k].error, h * step_.values[k].error);
  }
  kernel_.take(area_, h);
}

bool RegressorFilter::take() {
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
  t_ = measurement_.motion == MotionKind::mean_speed ? now.t + 0.5 * h : now.t;
  kernel_.prepare(h);
  if (angles_) {
    joint_speed_ = step_.joint_speed;
    speed_ = step_.speed;
    heading_ = step_.heading;
  } else {
    joint_speed_ = now.joint;
    multiply(model_.motion, joint_speed_, speed_);
    heading_ = measurement_.heading_column.empty()
                   ? (model_.heading_coordinate >= 0
                          ? heading_ + h * step_.speed[static_cast<Eigen::Index>(model_.heading_coordinate)]
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
  if (angles_) {
    follow_angles();
  } else {
    follow_speeds();
  }
  write_row();
  return settled();
}

bool RegressorFilter::step(double t, std::span<const double> sample) {
  const double longest = measurement_.longest_step();
  if (samples_ > 0 && longest > 0.0 && t - ring_[newest_].t > longest) {
    restart();
    after_loss_ = true;
  }
  read(t, sample);
  return take();
}

bool RegressorFilter::settled() const {
  const double since = t_ - t0_;
  if (!corrector_.empty() && !at_rest_ && since < corrector_.memory(std::exp(-design_.settle))) {
    return false;
  }
  if (!angles_ || at_rest_ || since * design_.beta >= design_.settle) {
    return true;
  }
  // 2n̄/h of the first step, times the weight of its end, against sup |f₂ * n̈|.
  return after_loss_ && since * design_.beta >= 1.0 &&
         kernel_.value(start_) / (kernel_.gain() * first_length_) <= 1.0 + std::exp(-2.0);
}

void RegressorFilter::write_row() {
  row_.Y.setZero();
  row_.dY.setZero();
  const bool bounded = errors_.between_samples;
  // The kernel rises from 0 to the weight of the first node: the slope of that has errors of its own.
  const double start = angles_ ? kernel_.value(start_) : 0.0;
  const double first =
      start > 0.0 && errors_.joint_sample > 0.0 ? start * measurement_.nominal_step / first_length_ : 0.0;
  for (const Term& term : model_.terms) {
    if (term.kind == Term::Kind::function) {
      continue;
    }
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto j = static_cast<Eigen::Index>(term.parameter);
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    double value = 0.0;
    double error = 0.0;
    if (term.kind == Term::Kind::speed) {
      value = kernel_.value(motion_[term.coordinate]);
      error = errors_.speed[c];
      if (bounded) {
        error += angles_ ? kernel_.gain() * kernel_.majorant_gain() * slope_doubt_[term.coordinate].value() +
                               start * first_doubt_[term.coordinate]
                         : kernel_.value(motion_doubt_[term.coordinate]);
      }
    } else {
      value = kernel_.value(slope_[term.coordinate]);
      error = errors_.acceleration[c] + first * errors_.speed_sample[c];
    }
    row_.Y(i, j) += term.scale * value;
    row_.dY(i, j) += std::abs(term.scale) * error;
  }
  for (const FunctionTerm& f : functions_) {
    const Term& term = model_.terms[f.term];
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto j = static_cast<Eigen::Index>(term.parameter);
    row_.Y(i, j) += kernel_.value(f.value);
    row_.dY(i, j) += kernel_.value(f.error);
  }
  const double area = bounded ? std::max(1.0, kernel_.value(area_) / design_.static_gain()) : 1.0;
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    row_.y[k] = kernel_.value(torque_[i]);
    row_.dy[k] = area * errors_.output[k] + (bounded ? kernel_.value(torque_doubt_[i]) : 0.0);
  }
}

}  // namespace wheelwright::filter
