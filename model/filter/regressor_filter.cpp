// SPDX-License-Identifier: Apache-2.0
#include "model/filter/regressor_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::filter {

RegressorFilter::RegressorFilter(Model model, FilterDesign design, Measurement measurement, SignalErrors errors)
    : elements_(std::move(model), std::move(measurement), std::move(errors)), design_(design) {
  validate(design_);
  check::that(design_.order == 2 || this->measurement().motion == MotionKind::speed, "filter order 1",
              "measured speeds (order 2 works on angles)");
  const Model& m = this->model();
  const auto n = static_cast<Eigen::Index>(m.n());
  kernel_ = FilterKernel(design_, this->measurement().motion, this->measurement().nominal_step);
  const std::size_t coordinates = m.coordinates.size(), functions = elements_.functions().size();
  torque_ = 2 * coordinates;
  area_ = torque_ + m.n();
  start_ = area_ + 1;
  functions_ = start_ + 1;
  torque_doubt_ = functions_ + functions;
  function_doubt_ = torque_doubt_ + m.n();
  motion_doubt_ = function_doubt_ + functions;
  bank_ = KernelBank(elements_.angles() ? motion_doubt_ : motion_doubt_ + coordinates);
  static_gain_ = design_.static_gain();
  error_.resize(2 * coordinates);
  slope_doubt_.resize(coordinates);
  first_doubt_.resize(coordinates);
  for (const Term& term : m.terms) {
    const std::size_t at = term.output * m.p() + term.parameter;
    if (term.kind == Term::Kind::function) {
      function_entries_.push_back({at, functions_ + function_entries_.size(), 1.0});
    } else {
      entries_.push_back(
          {at, term.kind == Term::Kind::speed ? term.coordinate : coordinates + term.coordinate, term.scale});
    }
  }
  row_.Y = core::RowMatrix::Zero(n, static_cast<Eigen::Index>(m.p()));
  row_.dY = row_.Y;
  row_.y = Eigen::VectorXd::Zero(n);
  row_.dy = this->errors().output;
}

void RegressorFilter::begin() {
  bank_.clear();
  std::fill(slope_doubt_.begin(), slope_doubt_.end(), SlopeMajorant{});
  const double length = elements_.first_length();
  for (std::size_t c = 0; c < first_doubt_.size(); ++c) {
    first_doubt_[c] = elements_.last_step().acceleration[static_cast<Eigen::Index>(c)] * length * length / 12.0;
  }
}

void RegressorFilter::follow() {
  const WeakElement& e = elements_.element();
  const std::size_t coordinates = slope_doubt_.size(), outputs = area_ - torque_;
  double* const in = bank_.in();
  if (e.number % kFade == 0) {
    bank_.fade();
    std::ranges::for_each(slope_doubt_, &SlopeMajorant::fade);
  }
  for (std::size_t c = 0; c < coordinates; ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    in[c] = e.motion[i];
    in[coordinates + c] = e.slope[i];
    if (elements_.angles()) {
      slope_doubt_[c].advance(kernel_.decay(), design_.beta * e.step, e.motion_doubt[i]);
    } else {
      in[motion_doubt_ + c] = e.motion_doubt[i];
    }
  }
  for (std::size_t k = 0; k < outputs; ++k) {
    in[torque_ + k] = e.torque[static_cast<Eigen::Index>(k)];
    in[torque_doubt_ + k] = e.torque_doubt[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k < e.functions.size(); ++k) {
    in[functions_ + k] = e.functions[k].value;
    in[function_doubt_ + k] = e.functions[k].error;
  }
  in[area_] = e.length;
  in[start_] = elements_.angles() && e.number == 1 ? 1.0 : 0.0;
  kernel_.take(bank_);
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
         bank_.out()[start_] / (kernel_.gain() * elements_.first_length()) <= 1.0 + std::exp(-2.0);
}

void RegressorFilter::write_row() {
  const SignalErrors& errors = elements_.errors();
  const bool angles = elements_.angles(), bounded = errors.between_samples;
  const std::size_t coordinates = slope_doubt_.size();
  const double* const out = bank_.out();
  // The kernel rises from 0 to the weight of the first node: the slope of that has errors of its own.
  const double start = angles ? out[start_] : 0.0;
  const double first =
      start > 0.0 && errors.joint_sample > 0.0 ? start * measurement().nominal_step / elements_.first_length() : 0.0;
  for (std::size_t c = 0; c < coordinates; ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    double error = errors.speed[i];
    if (bounded) {
      error += angles ? kernel_.gain() * kernel_.majorant_gain() * slope_doubt_[c].value() + start * first_doubt_[c]
                      : out[motion_doubt_ + c];
    }
    error_[c] = error;
    error_[coordinates + c] = errors.acceleration[i] + first * errors.speed_sample[i];
  }
  double *const Y = row_.Y.data(), *const dY = row_.dY.data();
  for (const auto* entries : {&entries_, &function_entries_}) {
    for (const Entry& entry : *entries) {
      Y[entry.at] = dY[entry.at] = 0.0;
    }
  }
  for (const Entry& entry : entries_) {
    Y[entry.at] += entry.scale * out[entry.signal];
    dY[entry.at] += std::abs(entry.scale) * error_[entry.signal];
  }
  for (const Entry& entry : function_entries_) {
    Y[entry.at] += out[entry.signal];
    dY[entry.at] += out[entry.signal - functions_ + function_doubt_];
  }
  // By a clock that is wrong by 1 + ε the equation holds with an inertia of m(1 + ε)² and a friction of b(1 + ε).
  if (const double drift = measurement().clock_drift; drift > 0.0) {
    for (Eigen::Index k = 0; k < row_.Y.size(); ++k) {
      dY[k] += drift * (2.0 + drift) * std::abs(Y[k]);
    }
  }
  const bool corrected = !elements_.corrector().empty();  // its doubt is no matter of what happens between samples
  const double area = bounded ? std::max(1.0, out[area_] / static_gain_) : 1.0;
  for (Eigen::Index i = 0; i < row_.y.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    row_.y[i] = out[torque_ + k];
    row_.dy[i] = area * errors.output[i] + (bounded || corrected ? out[torque_doubt_ + k] : 0.0);
  }
}

}  // namespace wheelwright::filter
