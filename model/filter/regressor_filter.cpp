// SPDX-License-Identifier: Apache-2.0
#include "model/filter/regressor_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::filter {
namespace {

// L2 norms: of the errors of the samples at an edge, per unit of the edge, over that of a whole row
// (statistical_norms() for short steps). Of speeds an edge is (1, −1) times half of it; that of angles, which is soft,
// is below 0.48 whatever the steps.
double roughness_per_edge(const FilterDesign& design, const Measurement& measurement) {
  constexpr double kOfSoftEdge = 0.5, kOfEdge = 0.71, kNewest = 0.68;
  const double gain = std::pow(design.alpha, design.order), step = measurement.nominal_step;
  if (measurement.motion != MotionKind::speed) {
    return kOfSoftEdge / (kNewest * gain);
  }
  return kOfEdge / (design.order == 1 || !(step > 0.0) ? gain : gain * std::sqrt(step / (4.0 * design.beta)));
}

}  // namespace

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
  edge_ = elements_.angles() ? motion_doubt_ : motion_doubt_ + coordinates;
  whole_ = edge_ + 1;
  edge_doubt_ = whole_ + 1;
  bank_ = KernelBank(elements_.angles() ? edge_doubt_ + coordinates : whole_);
  doubt_before_.assign(coordinates, 0.0);
  if (elements_.bridges()) {
    kernel_.soften();
  }
  per_edge_ = roughness_per_edge(design_, this->measurement());
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
  turn_ = {};
  left_ = rate_ = cross_ = 0.0;
  std::fill(doubt_before_.begin(), doubt_before_.end(), 0.0);
  slope_before_ = (1.0 - std::exp(-kernel_.lambda() * elements_.first_length())) / elements_.first_length();
  const double length = elements_.first_length();
  for (std::size_t c = 0; c < first_doubt_.size(); ++c) {
    first_doubt_[c] = elements_.last_step().departure[static_cast<Eigen::Index>(c)] * length / 6.0;
  }
}

void RegressorFilter::follow() {
  const WeakElement& e = elements_.element();
  const std::size_t coordinates = slope_doubt_.size(), outputs = area_ - torque_;
  double* const in = bank_.in();
  if (e.number % kFade == 0) {
    bank_.fade();
    std::ranges::for_each(slope_doubt_, &SlopeMajorant::fade);
    turn_.fade();
    left_ = faded(left_);
    rate_ = faded(rate_);
    cross_ = faded(cross_);
    std::ranges::transform(doubt_before_, doubt_before_.begin(), &faded);
  }
  share_ = e.known ? 1.0 : 0.0;
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
  if (!elements_.angles()) {
    in[edge_] = e.run_begins ? 2.0 : 0.0;
  } else if (elements_.bridges()) {
    cut_out(e);
  }
  kernel_.take(bank_);
}

// Weights of a row end before a run of elements that are not known and begin after it. Ended at once, the errors of the
// samples there would count with 2/h; so what was the weight w becomes w(t − t_k) − e^{−λx} w(t − t_0) before the run's
// first node t_0, x = t_0 − t_k (KernelBank::cut), and w(t − t_k)(1 − e^{−λx}) behind its last. With these, u = w − w_0
// ε and ρ = 1 − ε', slopes s and r over a step: the slope of ρu changes at a node by ρ (change of s_u) + u (change of
// r) + what both slopes make of each other in the steps beside it, h r s_u. Summed up, in absolute values,
//
//     |change of s_w|                                 no more than of the whole kernel, but for its slope at the run
//     2 w_0 (slope of ε at t_0 + Σ h r |slope of ε|)   as 0 <= u <= w, and ε is convex
//     Σ w |change of r| + 2 Σ h r |s_w|
void RegressorFilter::cut_out(const WeakElement& e) {
  double* const in = bank_.in();
  double edge = 0.0, whole = 0.0, turn = 0.0;
  const double decay = kernel_.soft_decay(), gone = 1.0 - decay, slope = gone / e.step;
  const bool goes_on = e.known || e.run_ends;
  if (e.run_begins) {
    edge = 2.0 * (slope_before_ + cross_);
    whole = turn = 1.0;
    bank_.cut(edge_);
  }
  double left = 1.0;
  if (e.known) {
    left = decay_before_ * left_;
    turn += 2.0 * (left_ - left);
    whole += left_ - left;
  }
  const double rate = goes_on ? left * slope : 0.0;
  if (goes_on) {
    edge += std::abs(rate - rate_);
  }
  for (std::size_t c = 0; c < doubt_before_.size(); ++c) {
    const double doubt = e.motion_doubt[static_cast<Eigen::Index>(c)];
    in[edge_doubt_ + c] = (e.run_begins ? doubt_before_[c] : 0.0) + rate * doubt;
    doubt_before_[c] = goes_on ? decay * doubt_before_[c] + slope * doubt : 0.0;
  }
  cross_ = goes_on ? decay * cross_ + left * gone * slope : 0.0;
  in[edge_] = edge;
  in[whole_] = whole;
  turn_.advance(kernel_.decay(), design_.beta * e.step, turn);
  if (e.known && left > 0.0) {
    share_ = 1.0 - left;
    std::transform(in, in + edge_, in, [&](double x) { return share_ * x; });
  }
  left_ = left;
  rate_ = rate;
  decay_before_ = decay;
  slope_before_ = slope;
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
  // What is cut out, in units of the error of a sample of the speed.
  const double half = 0.5 * measurement().nominal_step, slope = kernel_.gain() * kernel_.majorant_gain();
  const double edge = angles ? half * (out[edge_] + slope * turn_.value()) : out[edge_];
  const double whole = angles ? half * out[whole_] : 0.0;
  for (std::size_t c = 0; c < coordinates; ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    double error = errors.speed[i] + whole * errors.speed_sample[i];
    if (bounded) {
      error += angles ? slope * slope_doubt_[c].value() + start * first_doubt_[c] + out[edge_doubt_ + c]
                      : out[motion_doubt_ + c];
    }
    error_[c] = error;
    error_[coordinates + c] = errors.acceleration[i] + (first + edge) * errors.speed_sample[i];
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
  // Doubt of a correction, a filter or a delay is no matter of what happens between samples.
  const bool doubted = errors.held_between || !elements_.corrector().empty() || measurement().smoothing.upper > 0.0 ||
                       measurement().delay.lower < measurement().delay.upper;
  // Where the motion's errors are not known the output's bound stands for them.
  const double rougher = errors.joint_sample > 0.0 ? 1.0 : 1.0 + rough();
  const double area = (bounded ? std::max(1.0, out[area_] / static_gain_) : 1.0) * rougher;
  for (Eigen::Index i = 0; i < row_.y.size(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    row_.y[i] = out[torque_ + k];
    row_.dy[i] = area * errors.output[i] + (bounded || doubted ? out[torque_doubt_ + k] : 0.0);
  }
}

}  // namespace wheelwright::filter
