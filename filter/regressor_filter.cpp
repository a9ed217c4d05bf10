// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regressor_filter.hpp>

#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

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

}  // namespace

RegressorFilter::RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors)
    : model_(std::move(model)), design_(design), measurement_(std::move(measurement)), errors_(std::move(errors)) {
  validate(model_);
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
  if (errors_.acceleration.size() == 0) {
    errors_.acceleration = errors_.speed = errors_.speed_sample = Eigen::VectorXd::Zero(coordinates);
  }
  if (errors_.output.size() == 0) {
    errors_.output = Eigen::VectorXd::Zero(n);
  }
  joint_ = joint_before_ = joint_speed_ = joint_effort_ = Eigen::VectorXd::Zero(joints);
  speed_ = speed_before_ = Eigen::VectorXd::Zero(coordinates);
  effort_ = effort_before_ = effort_sample_ = effort_sample_before_ = Eigen::VectorXd::Zero(n);
  motion_.resize(model_.coordinates.size());
  slope_.resize(model_.coordinates.size());
  torque_.resize(model_.n());
  state_speed_.resize(model_.coordinates.size());
  state_joint_.resize(model_.joints.size());
  joint_error_.assign(model_.joints.size(), errors_.joint_sample);
  for (std::size_t k = 0; k < model_.terms.size(); ++k) {
    if (model_.terms[k].kind == Term::Kind::function) {
      functions_.push_back(FunctionTerm{k, {}, {}});
    }
  }
  if (!measurement_.correction.empty()) {
    corrector_ =
        EffortCorrector(measurement_.correction, model_.joints.size(), measurement_.hold, measurement_.nominal_step);
  }
  row_.Y = RowMatrix::Zero(n, p);
  row_.dY = RowMatrix::Zero(n, p);
  row_.y = Eigen::VectorXd::Zero(n);
  row_.dy = errors_.output;
}

void RegressorFilter::restart() {
  started_ = false;
  running_ = false;
  corrector_.restart();
}

double RegressorFilter::filtered(const Cascade& c) const {
  return design_.order == 1 ? design_.alpha * c.z1 : design_.alpha * design_.alpha * c.z2;
}

void RegressorFilter::read_motion(std::span<const double> sample) {
  for (Eigen::Index j = 0; j < joint_.size(); ++j) {
    const double value = sample[static_cast<std::size_t>(j)];
    joint_[j] = measurement_.count > 0.0 ? std::round(value / measurement_.count) * measurement_.count : value;
  }
}

void RegressorFilter::read_efforts(double t, std::span<const double> sample) {
  const auto joints = static_cast<std::size_t>(joint_.size());
  for (std::size_t j = 0; j < joints; ++j) {
    const auto i = static_cast<Eigen::Index>(j);
    const double value = sample[joints + j];
    if (measurement_.effort_unsigned) {
      const bool angle = measurement_.motion == MotionKind::angle;
      joint_effort_[i] = std::abs(value) * sign(angle ? joint_[i] - joint_before_[i] : joint_[i]);
    } else {
      joint_effort_[i] = value;
    }
  }
  effort_sample_.swap(effort_sample_before_);
  if (!corrector_.empty()) {
    corrector_.step(t, joint_effort_.data());
    if (measurement_.hold == Hold::zero_order) {  // what acted since the last sample is known now
      for (std::size_t j = 0; j < joints; ++j) {
        joint_effort_[static_cast<Eigen::Index>(j)] = corrector_.mean(j);
      }
      multiply(model_.input, joint_effort_, effort_sample_before_);
    }
    for (std::size_t j = 0; j < joints; ++j) {
      joint_effort_[static_cast<Eigen::Index>(j)] = corrector_.now(j);
    }
  }
  multiply(model_.input, joint_effort_, effort_sample_);
}

void RegressorFilter::evaluate_functions(const Eigen::VectorXd& speed) {
  if (functions_.empty()) {
    return;
  }
  for (std::size_t c = 0; c < state_speed_.size(); ++c) {
    state_speed_[c] = speed[static_cast<Eigen::Index>(c)];
  }
  const Eigen::VectorXd& joints = measurement_.motion == MotionKind::angle ? joint_speed_ : joint_;
  for (std::size_t j = 0; j < state_joint_.size(); ++j) {
    state_joint_[j] = joints[static_cast<Eigen::Index>(j)];
  }
  const std::span<const double> error(errors_.speed_sample.data(), state_speed_.size());
  const MotionState state{state_speed_, error, state_joint_, joint_error_, heading_, errors_.heading};
  for (FunctionTerm& f : functions_) {
    const Term& term = model_.terms[f.term];
    const TermValue value = term.function(state);
    f.last_value = term.scale * value.value;
    f.last_error = std::abs(term.scale) * value.error;
  }
}

void RegressorFilter::advance_motion(const StepWeights& w) {
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    motion_[c].linear(w, speed_before_[i], speed_[i]);
    slope_[c].increment(w, speed_[i] - speed_before_[i]);
  }
  for (FunctionTerm& f : functions_) {
    f.value.advance(w, w.begin1() * f.last_value, w.begin2() * f.last_value);
    f.error.advance(w, w.begin1() * f.last_error, w.begin2() * f.last_error);
  }
  evaluate_functions(speed_);
  for (FunctionTerm& f : functions_) {
    f.value.z1 += w.end1() * f.last_value;
    f.value.z2 += w.end2() * f.last_value;
    f.error.z1 += w.end1() * f.last_error;
    f.error.z2 += w.end2() * f.last_error;
  }
}

void RegressorFilter::advance_efforts(const StepWeights& w) {
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (measurement_.hold == Hold::zero_order && measurement_.motion != MotionKind::angle) {
      torque_[i].held(w, effort_before_[k]);
    } else {
      torque_[i].linear(w, effort_before_[k], effort_[k]);
    }
  }
}

bool RegressorFilter::step(double t, std::span<const double> sample) {
  const bool first = !started_;
  const double before = sample_time_;
  started_ = true;
  sample_time_ = t;
  joint_.swap(joint_before_);
  read_motion(sample);
  if (first) {
    joint_before_ = joint_;
  }
  read_efforts(t, sample);
  const bool measured_heading = !measurement_.heading_column.empty();
  const double heading_before = heading_sample_;
  heading_sample_ = measured_heading ? sample.back() : 0.0;

  speed_.swap(speed_before_);
  effort_.swap(effort_before_);
  if (measurement_.motion == MotionKind::angle) {
    if (first) {
      return false;
    }
    joint_speed_ = (joint_ - joint_before_) / (t - before);
    multiply(model_.motion, joint_speed_, speed_);
    if (measurement_.hold == Hold::zero_order) {  // a conditional expression would allocate
      effort_ = effort_sample_before_;
    } else {
      effort_ = 0.5 * (effort_sample_before_ + effort_sample_);
    }
    heading_ = measured_heading ? 0.5 * (heading_before + heading_sample_) : heading_;
    return advance(0.5 * (before + t));
  }
  multiply(model_.motion, joint_, speed_);
  if (!corrector_.empty() && measurement_.hold == Hold::zero_order) {
    effort_before_ = effort_sample_before_;
  }
  effort_ = effort_sample_;
  heading_ = measured_heading ? heading_sample_ : heading_;
  return advance(t);
}

void RegressorFilter::begin(double t) {
  running_ = true;
  t0_ = t_ = t;
  at_rest_ = speed_.isZero(0.0) && (corrector_.empty() || effort_.isZero(0.0));
  heading_ = measurement_.heading_column.empty() ? 0.0 : heading_;
  for (Cascade& c : motion_) c = {};
  for (Cascade& c : slope_) c = {};
  for (Cascade& c : torque_) c = {};
  evaluate_functions(speed_);
  for (FunctionTerm& f : functions_) {
    f.value = {};
    f.error = {};
  }
}

bool RegressorFilter::advance(double t) {
  if (!running_) {
    begin(t);
    return false;
  }
  const double h = t - t_;
  t_ = t;
  if (h != weights_.step()) {
    weights_ = StepWeights(design_.beta, h);
  }
  if (measurement_.heading_column.empty() && model_.heading_coordinate >= 0) {
    heading_ += 0.5 * h * (speed_before_[model_.heading_coordinate] + speed_[model_.heading_coordinate]);
  }
  advance_motion(weights_);
  advance_efforts(weights_);
  write_row();
  return settled();
}

bool RegressorFilter::settled() const {
  const double since = t_ - t0_;
  if (!corrector_.empty() && !at_rest_ && since < corrector_.memory(std::exp(-design_.settle))) {
    return false;
  }
  return measurement_.motion == MotionKind::speed || at_rest_ || since * design_.beta >= design_.settle;
}

void RegressorFilter::write_row() {
  row_.Y.setZero();
  row_.dY.setZero();
  // Weight with which the error of the first mean speed, a difference of two angles over one step, enters f₂ * v̇.
  double start = 0.0;
  if (measurement_.motion != MotionKind::speed) {
    const double x = design_.beta * (t_ - t0_);
    start = x < 700.0 ? design_.alpha * design_.alpha * (t_ - t0_) * std::exp(-x) : 0.0;
  }
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
      value = filtered(motion_[term.coordinate]);
      error = errors_.speed[c];
    } else {
      value = filtered(slope_[term.coordinate]);
      error = errors_.acceleration[c] + start * errors_.speed_sample[c];
    }
    row_.Y(i, j) += term.scale * value;
    row_.dY(i, j) += std::abs(term.scale) * error;
  }
  for (const FunctionTerm& f : functions_) {
    const Term& term = model_.terms[f.term];
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto j = static_cast<Eigen::Index>(term.parameter);
    row_.Y(i, j) += filtered(f.value);
    row_.dY(i, j) += filtered(f.error);
  }
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    row_.y[static_cast<Eigen::Index>(i)] = filtered(torque_[i]);
  }
}

}  // namespace wheelwright
