// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/scale_detector.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "detector/detector.hpp"
#include "detector/multiscale/sum_kernel.hpp"
#include "model/filter/kernel.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kRoundings = 1e-10;  // of all that is added up, relative
constexpr double kAlike = 1e-12;      // relative: steps whose decays need not be computed anew
constexpr double kRise = 1.0;         // s, in which constant weights rise at a segment's start
constexpr double kOfUsual = 0.2;      // V0 is this share of a usual drive's V

const RiskModel& demand(const OnlineModel& model) {
  check::that(model.at_risk.has_value(), "model", "one that was learnt at a stated risk");
  const RiskModel& risk = *model.at_risk;
  check::that(!risk.scales.empty() && risk.delay > 0.0, "model at a stated risk", "scales, and a delay > 0");
  for (const double scale : risk.scales) {
    check::positive(scale, "scale");
  }
  return risk;
}

// Sizes of a matrix whose square bounds MᵀM for all M within middle ± radius: (1 + η) mid'mid + (1 + 1/η) |radius|².
Eigen::MatrixXd largest_root(const Eigen::MatrixXd& middle, const Eigen::MatrixXd& radius) {
  const double size = middle.norm(), spread = radius.norm();
  const double eta = size > 0.0 ? std::max(spread / size, 1e-6) : 1.0;
  Eigen::MatrixXd square = (1.0 + eta) * middle.transpose() * middle;
  square.diagonal().array() += (1.0 + 1.0 / eta) * spread * spread + 1e-12 * (size * size + spread * spread) + 1e-300;
  const core::EigenPairs pairs = core::symmetric_eigen(square);
  return pairs.values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * pairs.vectors.transpose();
}

// a · b, from the first element to the last: the same digits in every language and build
// (detector/export/export_c_sums.hpp).
template <typename A, typename B>
double dot_in_order(const A& a, const B& b) {
  double sum = a[0] * b[0];
  for (Eigen::Index k = 1; k < a.size(); ++k) {
    sum += a[k] * b[k];
  }
  return sum;
}

// left · right, each sum in that order.
template <typename Right, typename Result>
void multiply_in_order(const Eigen::ArrayXXd& left, const Right& right, Result& result) {
  for (Eigen::Index j = 0; j < right.cols(); ++j) {
    result.col(j) = right(0, j) * left.col(0);
    for (Eigen::Index k = 1; k < left.cols(); ++k) {
      result.col(j) += right(k, j) * left.col(k);
    }
  }
}

}  // namespace

double mixture_cost(double L) { return L + std::log(2.0 * kMultiples); }

double usual_multiple(double V0, double cost) { return V0 > 0.0 ? std::sqrt(2.0 * kOfUsual * cost / V0) : 0.0; }

double averaged_radius(double V, double all, double cost, double usual) {
  double by_risk = cost / (usual * kFirstMultiple), by_variance = 0.5 * usual * kFirstMultiple;
  double least = HUGE_VAL;
  for (int k = 0; k < kMultiples; ++k) {
    least = std::min(least, by_risk + by_variance * (k <= kUsualMultiple ? V : all));
    by_risk *= 0.5;
    by_variance *= 2.0;
  }
  return least;
}

std::vector<SumWeight> sum_weights(const Model& model) {
  std::vector<SumWeight> result;
  const auto joint = [&](std::size_t j) {
    return model.joints.size() > 1 ? " " + model.joints[j].torque : std::string();
  };
  for (std::size_t j = 0; j < model.joints.size(); ++j) {
    result.push_back({SumWeight::Shape::constant, j, "constant" + joint(j)});
    result.push_back({SumWeight::Shape::effort, j, "effort" + joint(j)});
  }
  for (std::size_t q = 0; q < model.p(); ++q) {
    result.push_back({SumWeight::Shape::parameter, q, model.parameters[q].physical});
  }
  return result;
}

ScaleDetector::ScaleDetector(const OnlineModel& model, ScaleDetectorOptions options)
    : elements_(model.model, model.measurement, model.errors),
      foreseen_(elements_, demand(model).delay,
                std::max(model.at_risk->errors.effort.correlation, model.at_risk->errors.motion.correlation)),
      risk_(*model.at_risk),
      options_(options),
      rule_(Polytope(risk_.facets, risk_.box), model.estimate, options.set),
      weights_(sum_weights(model.model)) {
  check::positive(options_.false_alarms, "rate of false alarms");
  check::positive(options_.checks, "checks of a sum in its scale");
  const Model& m = elements_.model();
  const auto n = static_cast<Eigen::Index>(m.n()), p = static_cast<Eigen::Index>(m.p());
  const auto joints = static_cast<Eigen::Index>(m.joints.size()), W = static_cast<Eigen::Index>(weights_.size());
  check::that(risk_.usual.rows() == W && risk_.usual.cols() == static_cast<Eigen::Index>(risk_.scales.size()),
              "usual variances", "one for each weight and scale");
  inverse_ = core::inverse(m.input * m.input.transpose());
  to_joints_ = m.input.transpose() * inverse_;
  largest_ = risk_.box.magnitudes();
  half_ = Eigen::VectorXd(p);
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(joints, n), radius = middle;
  speed_gain_ = Eigen::VectorXd::Zero(n);
  for (Eigen::Index q = 0; q < p; ++q) {
    const Interval& side = risk_.box.sides[static_cast<std::size_t>(q)];
    half_[q] = std::max(side.upper - model.estimate[q], model.estimate[q] - side.lower);
  }
  for (const Term& term : m.terms) {
    if (term.kind == Term::Kind::function) {
      continue;
    }
    const Interval& side = risk_.box.sides[term.parameter];
    const auto i = static_cast<Eigen::Index>(term.output);
    for (Eigen::Index j = 0; j < joints; ++j) {
      const double by = term.scale * m.motion(static_cast<Eigen::Index>(term.coordinate), j);
      if (term.kind == Term::Kind::acceleration) {
        middle(j, i) += 0.5 * (side.lower + side.upper) * by;
        radius(j, i) += 0.5 * (side.upper - side.lower) * std::abs(by);
      } else {
        speed_gain_[i] += largest_[static_cast<Eigen::Index>(term.parameter)] * std::abs(by);
      }
    }
  }
  slope_gain_ = largest_root(middle, radius);
  const Eigen::VectorXd none;
  effort_ = filter::sample_class(
      risk_.errors, {filter::SampleWeight::Sensor::effort, 0, elements_.effort_weights().exact, 0.0, none, none});
  averages_ = effort_.averages;
  varied_ = averages_ && effort_.deviation < effort_.bound;
  square_ = averages_ ? filter::variance_proxy(effort_) : 0.0;
  variance_ = varied_ ? effort_.multiplicity * effort_.deviation * effort_.deviation : square_;
  third_ = effort_.multiplicity * (effort_.bound + effort_.bias) / 3.0;
  g_ = g1_ = c_ = c1_ = c2_ = Eigen::ArrayXXd::Zero(W, n);
  joint_g_ = Eigen::ArrayXXd::Zero(W, joints);
  torque_ = Eigen::VectorXd::Zero(n);
  Y_ = core::RowMatrix::Zero(n, p);
  cut_ = turning_ = efforts_ = efforts1_ = spread_ = Eigen::ArrayXd::Zero(W);
  signals_ = Eigen::ArrayXXd::Zero(W, kParameters + p);
  squares_ = Eigen::ArrayXXd::Zero(W, varied_ ? 2 : 1);
  a0_ = a1_ = g_;
  direction_.resize(static_cast<std::size_t>(p));
  const double share = options_.false_alarms / static_cast<double>(weights_.size() * risk_.scales.size());
  for (const double T : risk_.scales) {
    Scale s;
    s.T = T;
    s.risk = std::log(options_.checks / (share * T));
    s.cost = mixture_cost(s.risk);
    s.usual = s.reach = Eigen::ArrayXd::Zero(W);
    for (Eigen::Index w = 0; w < W; ++w) {
      s.usual[w] = usual_multiple(risk_.usual(w, static_cast<Eigen::Index>(states_.size())), s.cost);
    }
    s.reach = SumKernel::kLargest * s.usual;
    s.linear0 = s.linear1 = signals_;
    s.v0 = s.v1 = s.v2 = squares_;
    s.u0 = s.u1 = s.u2 = Eigen::ArrayXd::Zero(W);
    states_.push_back(std::move(s));
  }
  looks_.resize(weights_.size() * states_.size());
}

void ScaleDetector::restart() { elements_.restart(); }

void ScaleDetector::begin() {
  foreseen_.begin();
  taken_ = 0;
  for (Eigen::ArrayXXd* weights : {&g_, &g1_, &c_, &c1_, &c2_}) {
    weights->setZero();
  }
  efforts_.setZero();
  efforts1_.setZero();
  steps_.fill(elements_.step_length());
  for (Scale& s : states_) {
    for (Eigen::ArrayXXd* state : {&s.linear0, &s.linear1, &s.v0, &s.v1, &s.v2}) {
      state->setZero();
    }
    for (Eigen::ArrayXd* state : {&s.u0, &s.u1, &s.u2}) {
      state->setZero();
    }
    s.samples = s.since = 0.0;
  }
}

// Weights of the newest element.
void ScaleDetector::weigh() {
  g1_.swap(g_);
  c2_.swap(c1_);
  c1_.swap(c_);
  const core::RowMatrix& foreseen = foreseen_.value();
  const Eigen::VectorXd& theta = rule_.estimate();
  for (Eigen::Index o = 0; o < torque_.size(); ++o) {
    torque_[o] = dot_in_order(foreseen.row(o), theta);
  }
  const double share = std::min((elements_.element().t - elements_.first_instant()) / kRise, 1.0);
  const double rise = share * share * (3.0 - 2.0 * share);
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    const auto i = static_cast<Eigen::Index>(w), which = static_cast<Eigen::Index>(weights_[w].which);
    switch (weights_[w].shape) {
      case SumWeight::Shape::constant: g_.row(i) = rise * to_joints_.row(which).array(); break;
      case SumWeight::Shape::effort:
        g_.row(i) = dot_in_order(to_joints_.row(which), torque_) * to_joints_.row(which).array();
        break;
      case SumWeight::Shape::parameter:
        for (Eigen::Index o = 0; o < g_.cols(); ++o) {
          g_(i, o) = theta[which] * dot_in_order(inverse_.row(o), foreseen.col(which));
        }
        break;
    }
  }
  multiply_in_order(g_, slope_gain_.transpose(), c_);
  cut_.setZero();
  const filter::WeakElement& e = elements_.element();
  if (!e.known) {
    // The sum goes on as if it had a weight, and this element is taken away again: with all that the errors of the
    // motion make of it.
    const double joints = static_cast<double>(elements_.model().joints.size());
    const double inverse = elements_.angles() ? 1.0 / e.before + 1.0 / e.step : 1.0;
    const double by = 2.0 * risk_.errors.motion.bound * std::sqrt(joints) * inverse;
    for (Eigen::Index w = 0; w < cut_.size(); ++w) {
      cut_[w] = by * std::sqrt(dot_in_order(c_.row(w), c_.row(w)));
    }
    g_.setZero();
  }
}

void ScaleDetector::take() {
  const Model& m = elements_.model();
  const filter::WeakElement& e = elements_.element();
  const bool angles = elements_.angles();
  auto residual = signals_.col(kValue), response = signals_.col(kResponse), straight = signals_.col(kWorst);
  auto rows = signals_.rightCols(Y_.cols());
  filter::element_regressor(elements_, e, Y_);
  multiply_in_order(g_, Y_, rows);
  multiply_in_order(g_, e.torque, residual);
  multiply_in_order(g_, m.input, joint_g_);

  // At worst: what stands beside the sum for certain, in units of K.
  straight = kRoundings * residual.abs() + cut_;
  for (Eigen::Index q = 0; q < rows.cols(); ++q) {
    straight += (kRoundings * largest_[q]) * rows.col(q).abs();
  }
  const double effort = averages_ ? risk_.errors.effort.bias : risk_.errors.effort.bound;
  efforts_.setZero();
  for (Eigen::Index j = 0; j < joint_g_.cols(); ++j) {
    straight += (effort * e.length) * joint_g_.col(j).abs();
    efforts_ += joint_g_.col(j).square();
  }
  for (Eigen::Index i = 0; i < e.torque_doubt.size(); ++i) {
    double doubt = e.torque_doubt[i];
    if (!angles) {
      doubt += speed_gain_[i] * e.length * risk_.errors.motion.bound;
    }
    straight += doubt * g_.col(i).abs();
  }
  std::size_t function = 0;
  turning_.setZero();
  for (const Term& term : m.terms) {
    const auto i = static_cast<Eigen::Index>(term.output), c = static_cast<Eigen::Index>(term.coordinate);
    const double theta = largest_[static_cast<Eigen::Index>(term.parameter)];
    if (term.kind == Term::Kind::function) {
      straight += (theta * e.functions[function++].error) * g_.col(i).abs();
    } else if (term.kind == Term::Kind::speed && !angles) {
      straight += (theta * std::abs(term.scale) * e.motion_doubt[c]) * g_.col(i).abs();
    } else if (term.kind == Term::Kind::speed) {
      const double by = theta * std::abs(term.scale) * e.motion_doubt_before[c] / e.before;
      straight += by * (g_.col(i) - g1_.col(i)).abs();
      turning_ += by * g1_.col(i).abs();
    }
  }
  if (angles) {
    for (Eigen::Index i = 0; i < g_.cols(); ++i) {
      const double by = speed_gain_[i] * risk_.errors.motion.bound;
      straight += by * (g_.col(i) - g1_.col(i)).abs();
      turning_ += by * g1_.col(i).abs();
    }
  }

  for (std::size_t w = 0; w < weights_.size(); ++w) {
    const auto i = static_cast<Eigen::Index>(w), which = static_cast<Eigen::Index>(weights_[w].which);
    switch (weights_[w].shape) {
      case SumWeight::Shape::constant: response[i] = joint_g_(i, which) * e.length; break;
      case SumWeight::Shape::effort:
        response[i] = joint_g_(i, which) * dot_in_order(to_joints_.row(which), e.torque);
        break;
      case SumWeight::Shape::parameter: response[i] = rows(i, which) * rule_.estimate()[which]; break;
    }
  }

  steps_ = {steps_[1], steps_[2], steps_[3], e.step};
  const double longest = *std::max_element(steps_.begin(), steps_.end());
  const double h = angles ? e.before : e.step;  // from the element before
  const double length1 = angles ? 0.5 * (steps_[1] + steps_[2]) : steps_[2];
  const double length = length1 * longest;
  if (varied_) {
    spread_ = (third_ * longest) * efforts1_.sqrt();
  }
  squares_.col(0) = (length * square_) * efforts1_;
  for (Scale& s : states_) {
    const double x = h / s.T, d_before = s.decay;
    if (std::abs(x - s.delta) > kAlike * x) {
      s.delta = x;
      s.decay = std::exp(-x);
    }
    const double d = s.decay, dd = d * d;
    s.linear0 = d * (s.linear0 + x * s.linear1);
    s.linear1 = d * s.linear1 + signals_;
    s.linear0.col(kWorst) += x * turning_;
    s.linear1.col(kWorst) += x * turning_;
    // Efforts of the element before, which is as old as the step, with filter::variance_proxy(): a sample's weight is
    // an average of its elements' (the logarithm of a generating function is convex), none larger than 1/e of theirs.
    if (varied_) {
      squares_.col(1) = (length * variance_) * efforts1_ / (1.0 - s.reach * spread_).max(variance_ / square_);
    }
    s.v0 = dd * (s.v0 + x * s.v1 + (x * x) * (s.v2 + squares_));
    s.v1 = dd * (s.v1 + (2.0 * x) * (s.v2 + squares_));
    s.v2 = dd * (s.v2 + squares_);
    // The sample before the newest element's, which no later element holds: it stands in the sum with (a0 + a1 x)e^−x.
    s.u0 = d * (s.u0 + x * s.u1 + (x * x) * s.u2);
    s.u1 = d * (s.u1 + (2.0 * x) * s.u2);
    s.u2 = d * s.u2;
    const double d2 = d_before * d, x2 = angles ? (h + steps_[1]) / s.T : 0.0;
    const double before = angles ? 1.0 / steps_[1] : 0.0, after = angles ? 1.0 / h : -1.0;
    const double middle = angles ? -(before + after) : 1.0;
    a1_ = (before * d2) * c2_ + (middle * d) * c1_ + after * c_;
    a0_ = (before * d2 * x2) * c2_ + (middle * d * x) * c1_;
    for (Eigen::Index i = 0; i < c_.cols(); ++i) {
      s.u0 += a0_.col(i).square();
      s.u1 += 2.0 * a0_.col(i) * a1_.col(i);
      s.u2 += a1_.col(i).square();
    }
    s.samples = d * s.samples + 1.0;
    s.since += h;
  }
  efforts1_ = efforts_;
  if (++taken_ % filter::kFade == 0) {
    fade();
  }
}

void ScaleDetector::fade() {
  const auto fade = [](auto&... all) { ((all = all.unaryExpr(&filter::faded)), ...); };
  foreseen_.fade();
  fade(g_, g1_, c_, c1_, c2_, efforts1_);
  for (Scale& s : states_) {
    fade(s.linear0, s.linear1, s.v0, s.v1, s.v2, s.u0, s.u1, s.u2);
  }
}

void ScaleDetector::look(Scale& s, std::size_t which) {
  const std::size_t p = direction_.size();
  const double joints = static_cast<double>(elements_.model().joints.size());
  const double last = elements_.angles() ? s.delta * s.decay / elements_.element().before : 0.0;
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    const auto i = static_cast<Eigen::Index>(w);
    double predicted = 0.0;
    for (std::size_t q = 0; q < p; ++q) {
      direction_[q] = s.linear0(i, kParameters + static_cast<Eigen::Index>(q));
      predicted += direction_[q] * rule_.estimate()[static_cast<Eigen::Index>(q)];
    }
    // Inequality of Cauchy and Schwarz for samples that no later element holds; the newest but one stands apart from
    // them: it alone sees the kernel's kink.
    const double newest = last * std::sqrt(dot_in_order(c1_.row(i), c1_.row(i)));
    const double angles = risk_.errors.motion.bound * std::sqrt(joints) *
                          (std::sqrt((s.samples + 2.0) * std::max(s.u0[i], 0.0)) + newest);
    const double all = std::max(s.v0(i, 0), 0.0), V = varied_ ? std::max(s.v0(i, 1), 0.0) : all;
    const double averaged = all > 0.0 ? averaged_radius(V, all, s.cost, s.usual[i]) : 0.0;
    const double radius = (s.linear0(i, kWorst) + angles + averaged) * (1.0 + kRoundings);
    const double value = s.linear0(i, kValue) - predicted;
    SumState& state = looks_[looked_++];
    if (!options_.exact_thresholds && std::abs(value) <= radius) {  // inside, whatever the set: its box will do
      double box = 0.0;
      for (std::size_t q = 0; q < p; ++q) {
        box += std::abs(direction_[q]) * half_[static_cast<Eigen::Index>(q)];
      }
      state = {w,
               which,
               value,
               radius + box,
               std::abs(value) - radius - box,
               s.linear0(i, kResponse),
               s.linear1(i, kResponse),
               radius,
               averaged};
      continue;
    }
    const Interval range = rule_.prediction(direction_, w);
    const double up = range.upper - predicted + radius, down = predicted - range.lower + radius;
    state = {w,
             which,
             value,
             value >= 0.0 ? up : down,
             std::max(value - up, -value - down),
             s.linear0(i, kResponse),
             s.linear1(i, kResponse),
             radius,
             averaged};
    alarm_ = alarm_ || state.excess > 0.0;
  }
}

bool ScaleDetector::step(double t, std::span<const double> sample) {
  looked_ = 0;
  alarm_ = false;
  if (!is_whole(t, sample)) {
    return false;
  }
  const bool element = elements_.step(t, sample);
  if (elements_.began()) {
    begin();
  }
  if (!element) {
    return false;
  }
  foreseen_.take(elements_);
  weigh();
  take();
  for (std::size_t k = 0; k < states_.size(); ++k) {
    Scale& s = states_[k];
    if (s.since * options_.checks >= s.T) {
      s.since = 0.0;
      look(s, k);
    }
  }
  return looked_ > 0;
}

SumConstants ScaleDetector::constants() const {
  SumConstants c{largest_, half_, inverse_, to_joints_, slope_gain_, speed_gain_, effort_, averages_, square_};
  c.usual.resize(static_cast<Eigen::Index>(weights_.size()), static_cast<Eigen::Index>(states_.size()));
  for (std::size_t k = 0; k < states_.size(); ++k) {
    c.cost.push_back(states_[k].cost);
    c.usual.col(static_cast<Eigen::Index>(k)) = states_[k].usual.matrix();
  }
  return c;
}

Eigen::MatrixXd ScaleDetector::variances() const {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(weights_.size()), static_cast<Eigen::Index>(states_.size()));
  for (std::size_t k = 0; k < states_.size(); ++k) {
    result.col(static_cast<Eigen::Index>(k)) = states_[k].v0.col(0).matrix();
  }
  return result;
}

Eigen::MatrixXd usual_variances(LogSource& log, const OnlineModel& model) {
  OnlineModel any = model;
  const auto W = static_cast<Eigen::Index>(sum_weights(model.model).size());
  any.at_risk->usual = Eigen::MatrixXd::Ones(W, static_cast<Eigen::Index>(any.at_risk->scales.size()));
  filter::ErrorClass& effort = any.at_risk->errors.effort;
  if (effort.bias < effort.bound && effort.deviation < effort.bound) {
    effort = {
        .bound = effort.deviation, .bias = 0.0, .correlation = effort.correlation};  // what reach adds depends on V0
  }
  ScaleDetector detector(any);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(any.at_risk->usual.rows(), any.at_risk->usual.cols());
  double count = 0.0;
  walk_log(log, detector, [&](double, bool, bool looked) {
    if (looked) {
      sum += detector.variances();
      count += 1.0;
    }
  });
  return count > 0.0 ? Eigen::MatrixXd(kOfUsual / count * sum) : sum;
}

}  // namespace wheelwright::detector
