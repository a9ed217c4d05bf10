// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/pose_sums.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "detector/detector.hpp"
#include "detector/multiscale/sum_kernel.hpp"
#include "model/filter/kernel.hpp"
#include "model/filter/odometry_filter.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kSumRounding = 1e-10;  // of all that is added up, relative
constexpr double kCoordinateRounding =
    16.0 * std::numeric_limits<double>::epsilon();  // of a difference of two coordinates
constexpr double kShareOfUsual = 0.2;               // V0 is this share of a usual drive's V
constexpr double kLongestStep = 1.0;                // s, from pose to pose
constexpr double kShortestOf = 0.999;               // of the shortest step: a pose that comes earlier is left out
// V0 is never less than this share of that of weights of size 1 on an even drive.
constexpr double kLeastUsual = 1e-6;
const double kHalfTheRisk = std::log(2.0);  // what it costs that position and heading share a risk

const PoseRiskModel& at_risk_of(const KinematicModel& model) {
  check::that(model.at_risk.has_value(), "kinematic model", "one that was learnt at a stated risk");
  const PoseRiskModel& risk = *model.at_risk;
  check::that(model.measurement.heading, "kinematic model at a stated risk", "a heading");
  check::that(model.errors.estimated.size() == 0 || model.errors.estimated.isZero(0.0),
              "kinematic model at a stated risk", "declared errors");
  check::that(!risk.scales.empty() && risk.delay > 0.0 && risk.errors.shortest_step > 0.0,
              "kinematic model at a stated risk", "scales, a delay > 0, a shortest step > 0");
  for (const double scale : risk.scales) {
    check::positive(scale, "scale");
  }
  return risk;
}

// Of errors whose size is `times` as large: those of a vector's length.
filter::SampleClass class_of(const filter::ErrorClass& c, double shortest_step, double times) {
  filter::SampleClass sample = filter::sample_class(c, shortest_step);
  sample.bias = times * (sample.averages ? sample.bias : sample.bound);
  sample.bound *= times;
  sample.deviation *= times;
  return sample;
}

const double kHalves = 2.0 * std::log(2.0);  // what a mixture costs of which half, and half of that, counts

// Bound on the share of errors with the summed variance proxies V > 0 in a sum, but for e^{−L}, V0 > 0 fixed
// beforehand: √((V + V0)(2L + ln(1 + V/V0))) (method of mixtures: Robbins 1970; de la Peña, Klass, Lai 2004). Where the
// proxies hold for |λ| <= reach/√V0 only, half of the mixture is cut off there, the other half stands at that end.
double mixture_radius(double V, double V0, double L, double reach) {
  const double volume = std::log1p(V / V0);
  if (reach == core::kInfinity) {
    return std::sqrt((V + V0) * (2.0 * L + volume));
  }
  const double at_reach = std::sqrt(V0) / reach * (L + kHalves) + 0.5 * reach * V / std::sqrt(V0);
  const double squared = 2.0 * (L + kHalves) + volume;
  const bool inside = std::sqrt(squared) + 1.0 <= reach * std::sqrt(1.0 + V / V0);
  return inside ? std::min(at_reach, std::sqrt((V + V0) * squared)) : at_reach;
}

// Λ √V0 of sums whose risk is e^{−L}; infinite where Hoeffding's proxy serves.
double pose_reach(const filter::SampleClass& sample, double L) {
  if (!(sample.deviation < sample.bound)) {
    return core::kInfinity;
  }
  const double radius = std::sqrt(2.0 * (L + kHalves) + std::log1p(1.0 / kShareOfUsual));
  return 1.25 * std::sqrt(kShareOfUsual / (1.0 + kShareOfUsual)) * (radius + 1.0);
}

// Lengths and factors: neither so small nor so large that squares would leave the range of doubles.
double size_of(const std::array<double, 2>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1]); }
double dot(const std::array<double, 2>& a, const std::array<double, 2>& b) { return a[0] * b[0] + a[1] * b[1]; }
// aᵀJb: J turns by a right angle.
double cross(const std::array<double, 2>& a, const std::array<double, 2>& b) { return a[1] * b[0] - a[0] * b[1]; }

// An error whose factor in a sum is e^{−x} (α0 + α1 x).
template <typename Factor>
void add_variance(std::array<double, 3>& V, const filter::SampleClass& sample, double proxy, double reach, double size0,
                  double size1, const Factor& product) {
  if (sample.averages) {
    const double s = filter::variance_proxy(sample, reach * (size0 + SumKernel::kLargest * size1), proxy);
    V[0] += s * size0 * size0;
    V[1] += 2.0 * s * product;
    V[2] += s * size1 * size1;
  }
}

void grow(std::array<double, 3>& V, double x, double decay) {
  V[0] = decay * (V[0] + x * (V[1] + x * V[2]));
  V[1] = decay * (V[1] + 2.0 * x * V[2]);
  V[2] *= decay;
}

}  // namespace

std::vector<PoseWeight> pose_weights(const filter::OdometryMeasurement& m) {
  using Shape = PoseWeight::Shape;
  std::vector<PoseWeight> all;
  if (m.position) {
    all = {{Shape::along, 0, "slip_along"},
           {Shape::across, 0, "slip_across"},
           {Shape::radius, 0, "radius_right"},
           {Shape::radius, 1, "radius_left"}};
  }
  if (m.heading) {
    all.push_back({Shape::turn, 0, "turn"});
    all.push_back({Shape::yaw_gain, 0, "yaw_gain_right"});
    all.push_back({Shape::yaw_gain, 1, "yaw_gain_left"});
  }
  return all;
}

PoseSumDetector::PoseSumDetector(const KinematicModel& model, PoseSumOptions options)
    : measurement_(model.measurement),
      errors_(model.errors),
      risk_(at_risk_of(model)),
      options_(options),
      rule_(Polytope(risk_.facets, risk_.box), model.estimate),
      weights_(pose_weights(model.measurement)) {
  check::positive(options_.false_alarms, "rate of false alarms");
  check::positive(options_.checks, "checks of a sum in its scale");
  const auto W = static_cast<Eigen::Index>(weights_.size()), S = static_cast<Eigen::Index>(risk_.scales.size());
  const auto p = static_cast<Eigen::Index>(measurement_.parameters().size());
  for (const Eigen::MatrixXd* usual : {&risk_.usual_position, &risk_.usual_heading}) {
    check::that(usual->rows() == W && usual->cols() == S, "usual variances", "one for each weight and scale");
  }
  check::that(model.estimate.size() == p && risk_.box.sides.size() == static_cast<std::size_t>(p), "feasible set",
              "as many parameters as the measurement has");
  const double shortest = risk_.errors.shortest_step;
  position_ = class_of(risk_.errors.position, shortest, std::numbers::sqrt2);
  heading_ = class_of(risk_.errors.heading, shortest, 1.0);
  position_proxy_ = filter::variance_proxy(position_);
  heading_proxy_ = filter::variance_proxy(heading_);
  correlation_ = std::max(risk_.errors.position.correlation, risk_.errors.heading.correlation);
  largest_ = risk_.box.magnitudes();
  half_ = Eigen::VectorXd(p);
  for (Eigen::Index q = 0; q < p; ++q) {
    const Interval& side = risk_.box.sides[static_cast<std::size_t>(q)];
    half_[q] = std::max({side.upper - model.estimate[q], model.estimate[q] - side.lower, 0.0});
  }
  gains_ = measurement_.position ? 2 : 0;
  for (Eigen::Index w = 0; w < 2; ++w) {
    radius_[static_cast<std::size_t>(w)] = measurement_.position ? largest_[w] : 0.0;
    yaw_gain_[static_cast<std::size_t>(w)] = largest_[gains_ + w];
  }
  beta_ = static_cast<double>(kOrder) / risk_.delay;
  lead_ = risk_.delay + 2.0 * shortest + correlation_;
  ring_.resize(static_cast<std::size_t>(std::ceil(2.0 * correlation_ / shortest)) + 4);
  factors_.resize(weights_.size());
  rows_ = Eigen::ArrayXXd::Zero(W, p);
  const double share = options_.false_alarms / static_cast<double>(weights_.size() * risk_.scales.size());
  for (Eigen::Index k = 0; k < S; ++k) {
    Scale s;
    s.T = risk_.scales[static_cast<std::size_t>(k)];
    s.risk = std::log(options_.checks / (share * s.T));
    s.sums.resize(weights_.size());
    s.Y0 = s.Y1 = rows_;
    for (Eigen::Index w = 0; w < W; ++w) {
      const double L = s.risk + (weights_[static_cast<std::size_t>(w)].of_position() ? kHalfTheRisk : 0.0);
      const auto reach = [&](const filter::SampleClass& sample, double usual) {
        return usual > 0.0 ? pose_reach(sample, L) / std::sqrt(usual) : core::kInfinity;
      };
      s.sums[static_cast<std::size_t>(w)].reach_position = reach(position_, risk_.usual_position(w, k));
      s.sums[static_cast<std::size_t>(w)].reach_heading = reach(heading_, risk_.usual_heading(w, k));
    }
    states_.push_back(std::move(s));
  }
  looks_.resize(weights_.size() * risk_.scales.size());
  direction_.resize(static_cast<std::size_t>(p));
}

void PoseSumDetector::restart() {
  started_ = false;
  step_ = {};
  oldest_ = count_ = 0;
  z_ = {};
  foreseen_ = {};
  std::ranges::fill(factors_, Factors{});
  for (Scale& s : states_) {
    s.since = 0.0;
    for (Sum& sum : s.sums) {
      sum =
          Sum{.position = {}, .heading = {}, .reach_position = sum.reach_position, .reach_heading = sum.reach_heading};
    }
    s.Y0.setZero();
    s.Y1.setZero();
  }
}

// Takes a sample; returns whether step_ is a step to a new pose now.
bool PoseSumDetector::read(double t, std::span<const double> sample) {
  const bool first = !started_;
  const double since = t - time_;
  for (std::size_t w = 0; w < 2; ++w) {
    if (measurement_.motion == MotionKind::angle) {
      moved_[w] = sample[w] - angle_[w];
    } else {
      moved_[w] = first ? 0.0 : moved_[w] + 0.5 * since * (speed_[w] + sample[w]);
    }
    speed_[w] = sample[w];
  }
  started_ = true;
  time_ = t;
  std::size_t next = 2;
  const double x = measurement_.position ? sample[next++] : 0.0;
  const double y = measurement_.position ? sample[next++] : 0.0;
  const double wrapped = sample[next];
  const double h = t - pose_time_;
  const bool same = x == x_ && y == y_ && wrapped == wrapped_;
  if (!first && ((measurement_.held_pose && same) || h < kShortestOf * risk_.errors.shortest_step)) {
    return false;
  }
  const double turn =
      wrapped - wrapped_ - 2.0 * std::numbers::pi * std::round((wrapped - wrapped_) / (2.0 * std::numbers::pi));
  step_ = {.number = first ? 0 : step_.number + 1,
           .begin = pose_time_,
           .h = h,
           .turn = turn,
           .by = {x - x_, y - y_},
           .mean = filter::mean_direction(wrapped_, wrapped_ + turn),
           .moved = moved_,
           .size = {std::abs(moved_[0]), std::abs(moved_[1])}};
  for (std::size_t w = 0; w < 2; ++w) {
    angle_[w] = sample[w];
    moved_[w] = 0.0;
  }
  heading_now_ = std::abs(wrapped) + std::abs(wrapped_);
  pose_time_ = t;
  x_ = x;
  y_ = y;
  wrapped_ = wrapped;
  return !first;
}

void PoseSumDetector::release(const Waiting& step) {
  const double forgotten = -std::expm1(-beta_ * step.h);
  for (std::size_t i = 0; i < kSignals; ++i) {
    z_[0][i] += forgotten * (step.signals[i] - z_[0][i]);
    for (std::size_t k = 1; k < kOrder; ++k) {
      z_[k][i] += forgotten * (z_[k - 1][i] - z_[k][i]);
    }
  }
}

// Of the steps that ended before the one from `begin` on, by the correlation time.
void PoseSumDetector::foresee(double begin) {
  while (count_ > 0 && ring_[oldest_].t < begin && ring_[oldest_].t <= begin - correlation_) {
    release(ring_[oldest_]);
    oldest_ = (oldest_ + 1) % ring_.size();
    --count_;
  }
  for (std::size_t i = 0; i < kSignals; ++i) {
    foreseen_[i] = z_[kOrder - 1][i] + lead_ * beta_ * (z_[kOrder - 2][i] - z_[kOrder - 1][i]);
  }
}

// Factors of the newest step.
void PoseSumDetector::weigh(const Step& step) {
  using Shape = PoseWeight::Shape;
  const Signals& f = foreseen_;
  const Eigen::VectorXd& theta = rule_.estimate();
  const bool position = measurement_.position, speeds = measurement_.motion == MotionKind::speed;
  const double n = errors_.motion, turning = risk_.errors.heading.bound, slack = speeds ? step.h * n : 2.0 * n;
  Vector way{}, rolled{};  // as foreseen, as measured
  double longest = 0.0, within = 0.0, unsure = 0.0;
  for (std::size_t w = 0; position && w < 2; ++w) {
    const double r = theta[static_cast<Eigen::Index>(w)];
    for (std::size_t i = 0; i < 2; ++i) {
      way[i] += 0.5 * step.h * r * f[2 * w + i];
      rolled[i] += 0.5 * r * step.moved[w] * step.mean[i];
    }
    longest += 0.5 * radius_[w] * (step.size[w] + slack);
    within += 0.5 * radius_[w] * filter::motion_within_step(step.h, step.size[w] + slack, step.turn, errors_);
    unsure += 0.5 * (step.size[w] * half_[static_cast<Eigen::Index>(w)] + slack * radius_[w]);
  }
  const double second =
      turning * (unsure + (1.5 + 1.0 / 3.0) * turning * longest + std::abs(step.turn) * longest / 6.0);
  const double rounding = kCoordinateRounding * (2.0 * (std::abs(x_) + std::abs(y_)) + size_of(step.by));
  rows_.setZero();
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    Factors& s = factors_[w];
    const auto row = static_cast<Eigen::Index>(w);
    const std::size_t wheel = weights_[w].wheel;
    s.g1 = s.g;
    s.turned1 = s.turned;
    s.wheel1 = s.wheel;
    switch (weights_[w].shape) {
      case Shape::along: s.g = {f[4], f[5]}; break;
      case Shape::across: s.g = {-f[5], f[4]}; break;
      case Shape::turn: s.g = {f[8], 0.0}; break;
      case Shape::radius: {
        const double r = 0.5 * theta[static_cast<Eigen::Index>(wheel)];
        s.g = {r * f[2 * wheel], r * f[2 * wheel + 1]};
        break;
      }
      case Shape::yaw_gain:
        s.g = {(wheel == 0 ? 1.0 : -1.0) * theta[gains_ + static_cast<Eigen::Index>(wheel)] * f[6 + wheel], 0.0};
        break;
    }
    if (weights_[w].of_position()) {
      const double along = dot(s.g, step.mean), size = size_of(s.g);
      s.observed = dot(s.g, step.by);
      s.turned = cross(s.g, way);
      for (std::size_t k = 0; k < 2; ++k) {
        rows_(row, static_cast<Eigen::Index>(k)) = 0.5 * along * step.moved[k];
        s.wheel[k] = 0.5 * radius_[k] * along;
      }
      s.straight = turning * std::abs(cross(s.g, rolled) - s.turned) + size * (second + within + rounding);
      s.response = weights_[w].shape == Shape::across ? step.h * std::abs(cross(s.g, step.mean)) : step.h * along;
    } else {
      s.observed = s.g[0] * step.turn;
      rows_(row, gains_) = s.g[0] * step.moved[0];
      rows_(row, gains_ + 1) = -s.g[0] * step.moved[1];
      s.wheel = {yaw_gain_[0] * s.g[0], yaw_gain_[1] * s.g[0]};
      s.straight = std::abs(s.g[0]) * kCoordinateRounding * (heading_now_ + 2.0 * std::numbers::pi);
      s.response = step.h * s.g[0];
    }
    if (weights_[w].shape == Shape::radius) {
      s.response = rows_(row, static_cast<Eigen::Index>(wheel)) * theta[static_cast<Eigen::Index>(wheel)];
    } else if (weights_[w].shape == Shape::yaw_gain) {
      const Eigen::Index j = gains_ + static_cast<Eigen::Index>(wheel);
      s.response = rows_(row, j) * theta[j];
    }
    double all = std::abs(s.observed);
    for (Eigen::Index q = 0; q < rows_.cols(); ++q) {
      all += largest_[q] * std::abs(rows_(row, q));
    }
    s.straight += kSumRounding * all + (speeds ? n * step.h * (std::abs(s.wheel[0]) + std::abs(s.wheel[1])) : 0.0);
  }
}

void PoseSumDetector::take(const Step& step) {
  const double n = measurement_.motion == MotionKind::speed ? 0.0 : errors_.motion;
  for (Scale& s : states_) {
    const double x = step.h / s.T, d = std::exp(-x), dd = d * d;
    s.Y0 = d * (s.Y0 + x * s.Y1);
    s.Y1 = d * s.Y1 + rows_;
    s.since += step.h;
    for (std::size_t w = 0; w < weights_.size(); ++w) {
      const Factors& f = factors_[w];
      Sum& sum = s.sums[w];
      sum.y0 = d * (sum.y0 + x * sum.y1);
      sum.y1 = d * sum.y1 + f.observed;
      sum.r0 = d * (sum.r0 + x * sum.r1);
      sum.r1 = d * sum.r1 + f.response;
      sum.l0 = d * (sum.l0 + x * sum.l1);
      sum.l1 = d * sum.l1 + f.straight;
      grow(sum.position, x, dd);
      grow(sum.heading, x, dd);
      // The pose between the two newest steps: K_k g_k − K_k+1 g_k+1 = e^{−x} (α0 + α1 x), x the newest step's age.
      const Vector a0{x * d * f.g1[0], x * d * f.g1[1]}, a1{d * f.g1[0] - f.g[0], d * f.g1[1] - f.g[1]};
      const double size0 = size_of(a0), size1 = size_of(a1);
      const bool of_position = weights_[w].of_position();
      const filter::SampleClass& telescoping = of_position ? position_ : heading_;
      sum.l0 += telescoping.bias * size0;
      sum.l1 += telescoping.bias * size1;
      add_variance(of_position ? sum.position : sum.heading, telescoping,
                   of_position ? position_proxy_ : heading_proxy_, of_position ? sum.reach_position : sum.reach_heading,
                   size0, size1, dot(a0, a1));
      if (of_position) {
        const double b0 = 0.5 * x * d * f.turned1, b1 = 0.5 * (d * f.turned1 + f.turned);
        sum.l0 += heading_.bias * std::abs(b0);
        sum.l1 += heading_.bias * std::abs(b1);
        add_variance(sum.heading, heading_, heading_proxy_, sum.reach_heading, std::abs(b0), std::abs(b1), b0 * b1);
      }
      for (std::size_t k = 0; k < 2; ++k) {
        sum.l0 += n * std::abs(x * d * f.wheel1[k]);
        sum.l1 += n * std::abs(d * f.wheel1[k] - f.wheel[k]);
      }
    }
  }
  if (step.number % filter::kFade == 0) {
    fade();
  }
}

void PoseSumDetector::fade() {
  const auto fade = [](auto& numbers) {
    for (double& x : numbers) {
      x = filter::faded(x);
    }
  };
  std::ranges::for_each(z_, fade);
  for (Scale& s : states_) {
    s.Y0 = s.Y0.unaryExpr(&filter::faded);
    s.Y1 = s.Y1.unaryExpr(&filter::faded);
    for (Sum& sum : s.sums) {
      for (double* x : {&sum.y0, &sum.y1, &sum.r0, &sum.r1, &sum.l0, &sum.l1}) {
        *x = filter::faded(*x);
      }
      fade(sum.position);
      fade(sum.heading);
    }
  }
}

double PoseSumDetector::averaged(double V, double usual, double L, const filter::SampleClass& sample) const {
  if (!(V > 0.0)) {
    return 0.0;
  }
  return usual > 0.0 ? mixture_radius(V, usual, L, pose_reach(sample, L)) : HUGE_VAL;
}

void PoseSumDetector::look(Scale& s, std::size_t which) {
  const auto k = static_cast<Eigen::Index>(which);
  for (std::size_t w = 0; w < weights_.size(); ++w) {
    const auto i = static_cast<Eigen::Index>(w);
    const Sum& sum = s.sums[w];
    double predicted = 0.0, box = 0.0;
    for (std::size_t q = 0; q < direction_.size(); ++q) {
      const auto j = static_cast<Eigen::Index>(q);
      direction_[q] = s.Y0(i, j);
      predicted += direction_[q] * rule_.estimate()[j];
      box += std::abs(direction_[q]) * half_[j];
    }
    const double L = s.risk + (weights_[w].of_position() ? kHalfTheRisk : 0.0);
    const double averages = averaged(sum.position[0], risk_.usual_position(i, k), L, position_) +
                            averaged(sum.heading[0], risk_.usual_heading(i, k), L, heading_);
    const double radius = (sum.l0 + averages) * (1.0 + kSumRounding), value = sum.y0 - predicted;
    SumState& state = looks_[looked_++];
    state = {w, which, value, radius + box, std::abs(value) - radius - box, sum.r0, sum.r1, radius, averages};
    if (std::abs(value) > radius) {
      const Interval range = rule_.prediction(direction_, w);
      const double up = range.upper - predicted + radius, down = predicted - range.lower + radius;
      state.threshold = value >= 0.0 ? up : down;
      state.excess = std::max(value - up, -value - down);
      alarm_ = alarm_ || state.excess > 0.0;
    }
  }
}

bool PoseSumDetector::step(double t, std::span<const double> sample) {
  looked_ = 0;
  alarm_ = false;
  if (!is_whole(t, sample)) {
    return false;
  }
  if (started_ && (!follows(time_, t, measurement_.nominal_step) || t - pose_time_ > kLongestStep)) {
    restart();
  }
  if (!read(t, sample)) {
    return false;
  }
  foresee(step_.begin);
  weigh(step_);
  take(step_);
  ++steps_;
  if (count_ < ring_.size()) {
    Waiting& next = ring_[(oldest_ + count_++) % ring_.size()];
    next.t = t;
    next.h = step_.h;
    const Vector rate{step_.moved[0] / step_.h, step_.moved[1] / step_.h};
    next.signals = {step_.mean[0] * rate[0],
                    step_.mean[1] * rate[0],
                    step_.mean[0] * rate[1],
                    step_.mean[1] * rate[1],
                    step_.mean[0],
                    step_.mean[1],
                    rate[0],
                    rate[1],
                    1.0};
  }
  for (std::size_t k = 0; k < states_.size(); ++k) {
    Scale& s = states_[k];
    if (s.since * options_.checks >= s.T) {
      s.since = 0.0;
      look(s, k);
    }
  }
  return looked_ > 0;
}

Eigen::VectorXd PoseSumDetector::regressor(const SumState& look) const {
  return states_[look.scale].Y0.row(static_cast<Eigen::Index>(look.weight)).transpose();
}

Eigen::MatrixXd PoseSumDetector::variances(std::array<double, 3> Sum::*part) const {
  Eigen::MatrixXd result(rows_.rows(), static_cast<Eigen::Index>(states_.size()));
  for (Eigen::Index k = 0; k < result.cols(); ++k) {
    for (Eigen::Index w = 0; w < result.rows(); ++w) {
      result(w, k) = (states_[static_cast<std::size_t>(k)].sums[static_cast<std::size_t>(w)].*part)[0];
    }
  }
  return result;
}

Eigen::MatrixXd PoseSumDetector::position_variances() const { return variances(&Sum::position); }

Eigen::MatrixXd PoseSumDetector::heading_variances() const { return variances(&Sum::heading); }

UsualPoseVariances usual_pose_variances(LogSource& log, const KinematicModel& model, double from, double until) {
  KinematicModel any = model;
  PoseRiskModel& risk = *any.at_risk;
  const auto W = static_cast<Eigen::Index>(pose_weights(model.measurement).size());
  const auto S = static_cast<Eigen::Index>(risk.scales.size());
  risk.usual_position = risk.usual_heading = Eigen::MatrixXd::Ones(W, S);
  for (filter::ErrorClass* c : {&risk.errors.position, &risk.errors.heading}) {
    if (c->bias < c->bound && c->deviation < c->bound) {  // what reach adds depends on V0
      *c = {.bound = c->deviation, .bias = 0.0, .correlation = c->correlation};
    }
  }
  PoseSumDetector detector(any);
  UsualPoseVariances sum{Eigen::MatrixXd::Zero(W, S), Eigen::MatrixXd::Zero(W, S)};
  double count = 0.0;
  walk_poses(log, detector, from, until, [&] {
    sum.position += detector.position_variances();
    sum.heading += detector.heading_variances();
    count += 1.0;
  });
  const double h = risk.errors.shortest_step, share = count > 0.0 ? kShareOfUsual / count : 0.0;
  const double p = 2.0 * risk.errors.position.bound * risk.errors.position.bound;
  const double a = risk.errors.heading.bound * risk.errors.heading.bound;
  for (Eigen::Index k = 0; k < S; ++k) {
    const double T = risk.scales[static_cast<std::size_t>(k)], even = 0.25 * kLeastUsual;
    sum.position.col(k) = (share * sum.position.col(k)).cwiseMax(even * p * h / T);
    sum.heading.col(k) = (share * sum.heading.col(k)).cwiseMax(even * a * std::min(h / T, h * T));
  }
  return sum;
}

}  // namespace wheelwright::detector
