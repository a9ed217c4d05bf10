// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regressor_filter.hpp>

#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

double sign(double x) { return static_cast<double>(x > 0.0) - static_cast<double>(x < 0.0); }

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
  joint_ = joint_before_ = joint_work_ = Eigen::VectorXd::Zero(joints);
  speed_ = speed_before_ = first_speed_ = Eigen::VectorXd::Zero(coordinates);
  effort_ = effort_before_ = Eigen::VectorXd::Zero(n);
  motion_.resize(model_.coordinates.size());
  slope_.resize(model_.coordinates.size());
  torque_.resize(model_.n());
  state_speed_.resize(model_.coordinates.size());
  for (std::size_t k = 0; k < model_.terms.size(); ++k) {
    if (model_.terms[k].kind == Term::Kind::function) {
      functions_.push_back(FunctionTerm{k, {}, {}});
    }
  }
  row_.Y = RowMatrix::Zero(n, p);
  row_.dY = RowMatrix::Zero(n, p);
  row_.y = Eigen::VectorXd::Zero(n);
  row_.dy = errors_.output;
}

void RegressorFilter::restart() { started_ = false; }

double RegressorFilter::filtered(const Cascade& c) const {
  return design_.order == 1 ? design_.alpha * c.z1 : design_.alpha * design_.alpha * c.z2;
}

void RegressorFilter::read_motion(std::span<const double> sample) {
  for (Eigen::Index j = 0; j < joint_.size(); ++j) {
    const double value = sample[static_cast<std::size_t>(j)];
    joint_[j] = measurement_.count > 0.0 ? std::round(value / measurement_.count) * measurement_.count : value;
  }
}

void RegressorFilter::read_efforts(std::span<const double> sample) {
  const auto joints = static_cast<std::size_t>(joint_.size());
  for (std::size_t j = 0; j < joints; ++j) {
    double value = sample[joints + j];
    if (measurement_.effort_unsigned) {
      const auto i = static_cast<Eigen::Index>(j);
      const double motion = measurement_.motion == MotionKind::angle ? joint_[i] - joint_before_[i] : joint_[i];
      value = std::abs(value) * sign(motion);
    }
    joint_work_[static_cast<Eigen::Index>(j)] = value;
  }
  effort_ = model_.input.lazyProduct(joint_work_);
}

void RegressorFilter::evaluate_functions(const Eigen::VectorXd& speed) {
  for (std::size_t c = 0; c < state_speed_.size(); ++c) {
    state_speed_[c] = speed[static_cast<Eigen::Index>(c)];
  }
  const std::span<const double> error(errors_.speed_sample.data(), state_speed_.size());
  const MotionState state{state_speed_, error, heading_now_, errors_.heading};
  for (FunctionTerm& f : functions_) {
    const Term& term = model_.terms[f.term];
    const TermValue value = term.function(state);
    f.last_value = term.scale * value.value;
    f.last_error = std::abs(term.scale) * value.error;
  }
}

void RegressorFilter::advance_functions_held(const StepWeights& w, const Eigen::VectorXd& speed) {
  if (functions_.empty()) {
    return;
  }
  evaluate_functions(speed);
  for (FunctionTerm& f : functions_) {
    f.value.held(w, f.last_value);
    f.error.held(w, f.last_error);
  }
}

void RegressorFilter::advance_piece(const StepWeights& w, const Eigen::VectorXd& speed) {
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    motion_[c].held(w, speed[static_cast<Eigen::Index>(c)]);
  }
  advance_functions_held(w, speed);
}

void RegressorFilter::advance_speeds(const StepWeights& w) {
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    motion_[c].linear(w, speed_before_[i], speed_[i]);
    slope_[c].increment(w, speed_[i] - speed_before_[i]);
  }
  if (functions_.empty()) {
    return;
  }
  evaluate_functions(speed_before_);
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
    if (measurement_.hold == Hold::zero_order) {
      torque_[i].held(w, effort_before_[k]);
    } else {
      torque_[i].linear(w, effort_before_[k], effort_[k]);
    }
  }
}

bool RegressorFilter::step(double t, std::span<const double> sample) {
  joint_.swap(joint_before_);
  effort_.swap(effort_before_);
  speed_.swap(speed_before_);
  const double heading_before = heading_;
  const bool measured_heading = !measurement_.heading_column.empty();
  if (!started_) {
    read_motion(sample);
    joint_before_ = joint_;
    read_efforts(sample);
    speed_ = model_.motion.lazyProduct(joint_);
    heading_ = measured_heading ? sample.back() : 0.0;
    t0_ = t_ = t;
    for (Cascade& c : motion_) c = {};
    for (Cascade& c : slope_) c = {};
    for (Cascade& c : torque_) c = {};
    for (FunctionTerm& f : functions_) {
      f.value = {};
      f.error = {};
    }
    first_speed_.setZero();
    if (measurement_.motion == MotionKind::mean_speed) {
      first_speed_ = speed_;
    }
    started_ = true;
    return false;
  }

  const double h = t - t_;
  const bool first_step = t_ == t0_;
  t_ = t;
  if (h != whole_.step()) {
    whole_ = StepWeights(design_.beta, h);
    if (measurement_.motion == MotionKind::mean_speed) {
      half_ = StepWeights(design_.beta, 0.5 * h);
    }
  }
  read_motion(sample);
  read_efforts(sample);
  const auto heading_at = [&](double share, double turned) {
    heading_now_ = measured_heading ? heading_before + share * (sample.back() - heading_before) : heading_before + turned;
  };
  const auto yaw = [&](const Eigen::VectorXd& speed) {
    return model_.heading_coordinate < 0 ? 0.0 : speed[model_.heading_coordinate];
  };
  switch (measurement_.motion) {
    case MotionKind::angle:
      joint_work_ = (joint_ - joint_before_) / h;
      speed_ = model_.motion.lazyProduct(joint_work_);
      if (first_step) {
        first_speed_ = speed_;
      }
      heading_at(0.5, 0.5 * h * yaw(speed_));
      advance_piece(whole_, speed_);
      heading_at(1.0, h * yaw(speed_));
      break;
    case MotionKind::mean_speed:
      speed_ = model_.motion.lazyProduct(joint_);
      heading_at(0.25, 0.25 * h * yaw(speed_before_));
      advance_piece(half_, speed_before_);
      heading_at(0.75, 0.5 * h * yaw(speed_before_) + 0.25 * h * yaw(speed_));
      advance_piece(half_, speed_);
      heading_at(1.0, 0.5 * h * (yaw(speed_before_) + yaw(speed_)));
      break;
    case MotionKind::speed:
      speed_ = model_.motion.lazyProduct(joint_);
      heading_at(0.5, 0.25 * h * (yaw(speed_before_) + yaw(speed_)));
      advance_speeds(whole_);
      heading_at(1.0, 0.5 * h * (yaw(speed_before_) + yaw(speed_)));
      break;
  }
  heading_ = heading_now_;
  advance_efforts(whole_);
  write_row();

  const bool from_angles = measurement_.motion != MotionKind::speed;
  return !from_angles || first_speed_.isZero(0.0) || (t_ - t0_) * design_.beta >= design_.settle;
}

void RegressorFilter::write_row() {
  row_.Y.setZero();
  row_.dY.setZero();
  const double gain = design_.alpha * design_.alpha;
  // Weight of the unmeasured initial speed, f₂(t) of f₂ * s̈ = f₂' * ṡ − f₂(t) ṡ(0).
  double start = 0.0;
  if (measurement_.motion != MotionKind::speed) {
    const double age = t_ - t0_;
    const double x = design_.beta * age;
    start = x < 700.0 ? gain * age * std::exp(-x) : 0.0;
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
    } else if (measurement_.motion == MotionKind::speed) {
      value = filtered(slope_[term.coordinate]);
      error = errors_.acceleration[c];
    } else {
      const Cascade& x = motion_[term.coordinate];
      value = gain * (x.z1 - design_.beta * x.z2) - start * first_speed_[c];
      error = errors_.acceleration[c];
      if (error > 0.0) {
        error += start * (std::abs(first_speed_[c]) + errors_.speed_sample[c]);
      }
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
