// SPDX-License-Identifier: Apache-2.0
#include "model/filter/noise.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/check.hpp"
#include "model/filter/kernel.hpp"

namespace wheelwright::filter {
namespace {

// Squared weights with which one sample of the motion, and one of the effort, enter the filtered signals at all later
// instants. A unit sample among zeros is sent through the cascades.
struct Energies {
  double acceleration = 0.0;
  double speed = 0.0;
  double effort = 0.0;
  double cross = 0.0;  // of acceleration and speed
};

Energies impulse_energies(const FilterDesign& d, MotionKind motion, Hold hold, double h,
                          model::EffortChanges changes = model::EffortChanges::at_samples) {
  FilterKernel kernel(d, motion, h);
  kernel.prepare(h);
  const bool angles = motion != MotionKind::speed;
  KernelState effort, speed, slope;
  Energies e;
  const auto steps = static_cast<long>(std::ceil(60.0 / (d.beta * h))) + 3;
  std::array<double, 3> sample{};  // newest first
  for (long k = 0; k < steps; ++k) {
    sample = {k == 0 ? 1.0 : 0.0, sample[0], sample[1]};
    const double change = sample[0] - sample[1], before = sample[1] - sample[2];
    kernel.take(slope, angles ? (change - before) / h : change);
    kernel.take(speed, angles ? 0.5 * (change + before) : 0.5 * h * (sample[0] + sample[1]));
    if (hold == Hold::zero_order) {
      kernel.take(effort, angles ? 0.5 * h * (sample[1] + sample[2]) : h * sample[1]);
    } else {
      const double linear =
          0.5 * h * (angles ? (sample[0] + 4.0 * sample[1] + sample[2]) / 3.0 : sample[0] + sample[1]);
      const double curved =
          changes == model::EffortChanges::between ? h * (sample[0] - 2.0 * sample[1] + sample[2]) / 12.0 : 0.0;
      kernel.take(effort, linear - curved);
    }
    const double a = kernel.value(slope), v = kernel.value(speed), u = kernel.value(effort);
    e.acceleration += a * a;
    e.speed += v * v;
    e.effort += u * u;
    e.cross += a * v;
  }
  return e;
}

// The input matrix from the errors of logged efforts to those of the outputs.
Eigen::MatrixXd corrected_input(const Model& model, const Measurement& measurement) {
  Eigen::MatrixXd input = model.input;
  for (Eigen::Index j = 0; j < input.cols(); ++j) {
    input.col(j) *= measurement.effort_gain(static_cast<std::size_t>(j));
  }
  return input;
}

KernelNorms roots(const Energies& e) { return {std::sqrt(e.acceleration), std::sqrt(e.speed), std::sqrt(e.effort)}; }

}  // namespace

KernelNorms worst_case_norms(const FilterDesign& d, MotionKind motion) {
  validate(d);
  const double a2 = d.alpha * d.alpha;
  if (d.order == 1) {
    return {2.0 * d.alpha, d.alpha / d.beta, d.alpha / d.beta};
  }
  const double rate = 2.0 * a2 / (std::numbers::e * d.beta);
  const double level = a2 / (d.beta * d.beta);
  if (motion == MotionKind::speed) {
    return {rate, level, level};
  }
  return {2.0 * a2 * (1.0 + std::exp(-2.0)), rate, level};
}

KernelNorms statistical_norms(const FilterDesign& design, MotionKind motion, double step) {
  validate(design);
  check::positive(step, "statistical_norms step");
  const Energies linear = impulse_energies(design, motion, Hold::first_order, step);
  const Energies held = impulse_energies(design, motion, Hold::zero_order, step);
  return roots({linear.acceleration, linear.speed, std::max(linear.effort, held.effort)});
}

NoiseGram noise_gram(const Model& model, const FilterDesign& design, const Measurement& measurement, double step) {
  validate(design);
  check::positive(step, "noise_gram step");
  const Energies e = impulse_energies(design, measurement.motion, measurement.hold, step, measurement.changes);
  const Eigen::MatrixXd joints = model.motion * model.motion.transpose();
  const auto p = static_cast<Eigen::Index>(model.p());
  NoiseGram gram;
  gram.motion.assign(model.n(), Eigen::MatrixXd::Zero(p, p));
  const auto energy = [&](Term::Kind a, Term::Kind b) {
    if (a != b) {
      return e.cross;
    }
    return a == Term::Kind::acceleration ? e.acceleration : e.speed;
  };
  for (const Term& a : model.terms) {
    for (const Term& b : model.terms) {
      if (a.output == b.output && a.kind != Term::Kind::function && b.kind != Term::Kind::function) {
        gram.motion[a.output](static_cast<Eigen::Index>(a.parameter), static_cast<Eigen::Index>(b.parameter)) +=
            a.scale * b.scale * energy(a.kind, b.kind) *
            joints(static_cast<Eigen::Index>(a.coordinate), static_cast<Eigen::Index>(b.coordinate));
      }
    }
  }
  gram.effort = e.effort * corrected_input(model, measurement).rowwise().squaredNorm();
  return gram;
}

SignalErrors propagate(const Model& model, const FilterDesign& design, const Measurement& measurement,
                       const SensorErrors& sensors, const PropagationOptions& options) {
  check::non_negative(sensors.motion, "motion error bound");
  check::non_negative(sensors.effort, "effort error bound");
  check::non_negative(sensors.heading, "heading error bound");
  const KernelNorms norms = worst_case_norms(design, measurement.motion);
  std::optional<KernelNorms> statistical;
  if (options.mode == NoiseMode::statistical) {
    check::that(options.confidence > 0.0 && options.confidence < 1.0, "confidence", "a number inside (0, 1)");
    check::that(options.rows >= 1.0, "rows", "at least 1");
    const KernelNorms energy = statistical_norms(design, measurement.motion, options.largest_step);
    // Hoeffding (1963): P(|Σ w_k n_k| > s) <= 2 exp(−s²/(2 n̄² Σ w_k²)), and as many events as rows have entries.
    const double entries = options.rows * static_cast<double>(2 * model.coordinates.size() + model.n());
    const double factor = std::sqrt(2.0 * std::log(2.0 * entries / (1.0 - options.confidence)));
    statistical = KernelNorms{factor * energy.acceleration, factor * energy.speed, factor * energy.effort};
  }
  // Independent noise of several joints adds up in squares, the worst case in absolute values: each bound holds as a
  // whole, so the smaller one is taken last.
  const auto across = [&](const Eigen::MatrixXd& map, double worst, double likely) -> Eigen::VectorXd {
    const Eigen::VectorXd sum = worst * map.cwiseAbs().rowwise().sum();
    return statistical ? sum.cwiseMin(likely * map.rowwise().norm()) : sum;
  };
  const KernelNorms likely = statistical.value_or(norms);
  SignalErrors errors;
  errors.acceleration = sensors.motion * across(model.motion, norms.acceleration, likely.acceleration);
  errors.speed = sensors.motion * across(model.motion, norms.speed, likely.speed);
  // Clipped noise has a mean: only its bound is left.
  const Eigen::MatrixXd input = corrected_input(model, measurement);
  errors.output = measurement.correction.linear()
                      ? (sensors.effort * across(input, norms.effort, likely.effort)).eval()
                      : (sensors.effort * norms.effort * input.cwiseAbs().rowwise().sum()).eval();
  errors.heading = sensors.heading;
  errors.between_samples = errors.bridges = true;
  errors.motion.effort = sensors.effort * input.cwiseAbs().rowwise().sum();
  errors.joint_sample = sensors.motion;
  if (measurement.motion != MotionKind::speed && sensors.motion > 0.0) {
    errors.joint_sample *= 2.0 / check::positive(measurement.nominal_step, "measurement nominal_step");
  }
  errors.speed_sample = model.motion.cwiseAbs().rowwise().sum() * errors.joint_sample;
  return errors;
}

namespace {

constexpr int kMostStepsBehind = 4096;
constexpr double kForgotten = 20.0;  // times 1/β

}  // namespace

ErrorInfluence::ErrorInfluence(const Model& model, const FilterDesign& design, const Measurement& measurement,
                               const SensorErrors& sensors, const Eigen::VectorXd& parameters, Eigen::Index sums)
    : design_(design),
      angles_(measurement.motion != MotionKind::speed),
      sensors_(sensors),
      nominal_(measurement.nominal_step),
      input_(corrected_input(model, measurement)),
      motion_(model.motion) {
  const auto n = static_cast<Eigen::Index>(model.n()), c = model.motion.rows();
  acceleration_ = speed_ = Eigen::MatrixXd::Zero(c, n);
  for (const Term& term : model.terms) {
    if (term.kind != Term::Kind::function) {
      Eigen::MatrixXd& to = term.kind == Term::Kind::acceleration ? acceleration_ : speed_;
      to(static_cast<Eigen::Index>(term.coordinate), static_cast<Eigen::Index>(term.output)) +=
          term.scale * parameters[static_cast<Eigen::Index>(term.parameter)];
    }
  }
  z1_ = z2_ = now_ = later_ = core::RowMatrix::Zero(n, sums);
  rate_ = rate_later_ = core::RowMatrix::Zero(c, sums);
  value_ = Eigen::VectorXd::Zero(sums);
}

void ErrorInfluence::step_back(double h) {
  const double decay = std::exp(-design_.beta * h);
  z2_ = decay * (z2_ + h * z1_);
  z1_ *= decay;
}

// A sample `h` before the last one counted.
void ErrorInfluence::count(double h) {
  const double gain = design_.order == 1 ? design_.alpha : design_.alpha * design_.alpha;
  later_.swap(now_);
  rate_later_.swap(rate_);
  now_ = gain * (design_.order == 1 ? z1_ : z2_);
  // ∫ A (θ_a v̇ + θ_v v) dt = ∫ B v dt with B = θ_v A − θ_a Ȧ.
  rate_ = speed_ * now_ - acceleration_ * (later_ - now_) / h;
  const core::RowMatrix effort = input_.transpose() * now_;
  const core::RowMatrix motion =
      motion_.transpose() * (angles_ ? core::RowMatrix(rate_later_ - rate_) : core::RowMatrix(h * rate_));
  value_ +=
      (sensors_.effort * h * effort.cwiseAbs().colwise().sum() + sensors_.motion * motion.cwiseAbs().colwise().sum())
          .transpose();
}

void ErrorInfluence::add(const RegressionBlock& rows, const core::RowMatrix& g) {
  if (rows.instants() == 0) {
    return;
  }
  const auto n = static_cast<Eigen::Index>(rows.outputs);
  z1_.setZero();
  z2_.setZero();
  now_.setZero();
  rate_.setZero();
  double h = nominal_;
  for (std::size_t k = rows.instants(); k-- > 0;) {
    z1_ += g.middleRows(static_cast<Eigen::Index>(k) * n, n);
    count(h);
    const double before = k > 0 ? rows.t[k] - rows.t[k - 1] : nominal_;
    h = before > 0.0 ? before : nominal_;
    step_back(h);
  }
  const int behind = static_cast<int>(
      std::min(static_cast<double>(kMostStepsBehind), std::ceil(kForgotten / (design_.beta * nominal_))));
  for (int k = 0; k < behind; ++k) {
    count(nominal_);
    step_back(nominal_);
  }
}

}  // namespace wheelwright::filter
