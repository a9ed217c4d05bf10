// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/error_influence.hpp>

#include <algorithm>
#include <cmath>

namespace wheelwright {
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
      input_(model.input),
      motion_(model.motion) {
  for (Eigen::Index j = 0; j < input_.cols(); ++j) {
    input_.col(j) *= measurement.correction.gain_of(static_cast<std::size_t>(j));
  }
  const auto n = static_cast<Eigen::Index>(model.n()), c = model.motion.rows();
  acceleration_ = speed_ = Eigen::MatrixXd::Zero(c, n);
  for (const Term& term : model.terms) {
    if (term.kind != Term::Kind::function) {
      Eigen::MatrixXd& to = term.kind == Term::Kind::acceleration ? acceleration_ : speed_;
      to(static_cast<Eigen::Index>(term.coordinate), static_cast<Eigen::Index>(term.output)) +=
          term.scale * parameters[static_cast<Eigen::Index>(term.parameter)];
    }
  }
  z1_ = z2_ = now_ = later_ = RowMatrix::Zero(n, sums);
  rate_ = rate_later_ = RowMatrix::Zero(c, sums);
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
  const RowMatrix effort = input_.transpose() * now_;
  const RowMatrix motion = motion_.transpose() * (angles_ ? RowMatrix(rate_later_ - rate_) : RowMatrix(h * rate_));
  value_ +=
      (sensors_.effort * h * effort.cwiseAbs().colwise().sum() + sensors_.motion * motion.cwiseAbs().colwise().sum())
          .transpose();
}

void ErrorInfluence::add(const RegressionBlock& rows, const RowMatrix& g) {
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

}  // namespace wheelwright
