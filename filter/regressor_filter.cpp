// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regressor_filter.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright::filter {

RegressorFilter::RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors)
    : elements_(std::move(model), std::move(measurement), std::move(errors)), design_(design) {
  validate(design_);
  check::that(design_.order == 2 || this->measurement().motion == MotionKind::speed, "filter order 1",
              "measured speeds (order 2 works on angles)");
  const Model& m = this->model();
  const auto n = static_cast<Eigen::Index>(m.n());
  kernel_ = FilterKernel(design_, this->measurement().motion, this->measurement().nominal_step);
  for (auto* per_coordinate : {&motion_, &slope_, &motion_doubt_}) {
    per_coordinate->resize(m.coordinates.size());
  }
  slope_doubt_.resize(m.coordinates.size());
  first_doubt_.resize(m.coordinates.size());
  torque_.resize(m.n());
  torque_doubt_.resize(m.n());
  functions_.resize(elements_.functions().size());
  function_doubt_.resize(elements_.functions().size());
  row_.Y = core::RowMatrix::Zero(n, static_cast<Eigen::Index>(m.p()));
  row_.dY = row_.Y;
  row_.y = Eigen::VectorXd::Zero(n);
  row_.dy = this->errors().output;
}

void RegressorFilter::begin() {
  for (auto* states : {&motion_, &slope_, &torque_, &torque_doubt_, &motion_doubt_, &functions_, &function_doubt_}) {
    std::fill(states->begin(), states->end(), KernelState{});
  }
  std::fill(slope_doubt_.begin(), slope_doubt_.end(), SlopeMajorant{});
  area_ = start_ = {};
  const double length = elements_.first_length();
  for (std::size_t c = 0; c < first_doubt_.size(); ++c) {
    first_doubt_[c] = elements_.last_step().acceleration[static_cast<Eigen::Index>(c)] * length * length / 12.0;
  }
}

void RegressorFilter::follow() {
  const WeakElement& e = elements_.element();
  for (std::size_t c = 0; c < motion_.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    kernel_.take(motion_[c], e.motion[i]);
    kernel_.take(slope_[c], e.slope[i]);
    if (elements_.angles()) {
      slope_doubt_[c].advance(kernel_.decay(), design_.beta * e.step, e.motion_doubt[i]);
    } else {
      kernel_.take(motion_doubt_[c], e.motion_doubt[i]);
    }
  }
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    kernel_.take(torque_[i], e.torque[static_cast<Eigen::Index>(i)]);
    kernel_.take(torque_doubt_[i], e.torque_doubt[static_cast<Eigen::Index>(i)]);
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    kernel_.take(functions_[k], e.functions[k].value);
    kernel_.take(function_doubt_[k], e.functions[k].error);
  }
  kernel_.take(area_, e.length);
  if (elements_.angles()) {
    kernel_.take(start_, e.number == 1 ? 1.0 : 0.0);
  }
}

bool RegressorFilter::step(double t, std::span<const double> sample) {
  const bool element = elements_.step(t, sample);
  if (elements_.began()) {
    begin();
  }
  if (!element) {
    return false;
  }
  kernel_.prepare(elements_.step_length());
  follow();
  write_row();
  return settled();
}

bool RegressorFilter::settled() const {
  const double since = elements_.instant() - elements_.first_instant();
  const EffortCorrector& corrector = elements_.corrector();
  if (!corrector.empty() && !elements_.at_rest() && since < corrector.memory(std::exp(-design_.settle))) {
    return false;
  }
  if (!elements_.angles() || elements_.at_rest() || since * design_.beta >= design_.settle) {
    return true;
  }
  // 2n̄/h of the first step, times the weight of its end, against sup |f₂ * n̈|.
  return elements_.after_loss() && since * design_.beta >= 1.0 &&
         kernel_.value(start_) / (kernel_.gain() * elements_.first_length()) <= 1.0 + std::exp(-2.0);
}

void RegressorFilter::write_row() {
  const Model& model = elements_.model();
  const SignalErrors& errors = elements_.errors();
  const bool angles = elements_.angles();
  row_.Y.setZero();
  row_.dY.setZero();
  const bool bounded = errors.between_samples;
  // The kernel rises from 0 to the weight of the first node: the slope of that has errors of its own.
  const double start = angles ? kernel_.value(start_) : 0.0;
  const double first =
      start > 0.0 && errors.joint_sample > 0.0 ? start * measurement().nominal_step / elements_.first_length() : 0.0;
  for (const Term& term : model.terms) {
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
      error = errors.speed[c];
      if (bounded) {
        error += angles ? kernel_.gain() * kernel_.majorant_gain() * slope_doubt_[term.coordinate].value() +
                              start * first_doubt_[term.coordinate]
                        : kernel_.value(motion_doubt_[term.coordinate]);
      }
    } else {
      value = kernel_.value(slope_[term.coordinate]);
      error = errors.acceleration[c] + first * errors.speed_sample[c];
    }
    row_.Y(i, j) += term.scale * value;
    row_.dY(i, j) += std::abs(term.scale) * error;
  }
  for (std::size_t k = 0; k < functions_.size(); ++k) {
    const Term& term = model.terms[elements_.functions()[k]];
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto j = static_cast<Eigen::Index>(term.parameter);
    row_.Y(i, j) += kernel_.value(functions_[k]);
    row_.dY(i, j) += kernel_.value(function_doubt_[k]);
  }
  const double area = bounded ? std::max(1.0, kernel_.value(area_) / design_.static_gain()) : 1.0;
  for (std::size_t i = 0; i < torque_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    row_.y[k] = kernel_.value(torque_[i]);
    row_.dy[k] = area * errors.output[k] + (bounded ? kernel_.value(torque_doubt_[i]) : 0.0);
  }
}

}  // namespace wheelwright::filter
