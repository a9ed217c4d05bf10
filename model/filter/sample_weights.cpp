// SPDX-License-Identifier: Apache-2.0
#include "model/filter/sample_weights.hpp"

#include <cmath>
#include <utility>

namespace wheelwright::filter {

SampleWeights::SampleWeights(const ElementFilter& elements, ParameterBox box, Eigen::Index sums)
    : box_(std::move(box)),
      joints_(elements.model().joints.size()),
      effort_lag_(elements.angles() ? 1 : 3),
      exact_(elements.effort_weights().exact) {
  const auto joints = static_cast<Eigen::Index>(joints_);
  const auto p = static_cast<Eigen::Index>(elements.model().p());
  for (std::size_t s = 0; s < kSlots; ++s) {
    slots_[s].motion.assign(joints_, Eigen::MatrixXd::Zero(p, sums));
    slots_[s].effort = Eigen::MatrixXd::Zero(joints, sums);
    moved_[s] = Eigen::VectorXd::Zero(joints);
  }
  middle_ = spread_ = zero_ = Eigen::VectorXd::Zero(sums);
}

void SampleWeights::add(const ElementFilter& elements, const core::RowMatrix& g) {
  const Model& model = elements.model();
  const WeakElement& e = elements.element();
  const std::size_t k = ++elements_taken_;
  const bool angles = elements.angles();
  const auto clear = [&](std::size_t sample) {
    Slot& slot = slots_[sample % kSlots];
    for (Eigen::MatrixXd& motion : slot.motion) {
      motion.setZero();
    }
    slot.effort.setZero();
  };
  if (k == 1) {
    for (std::size_t s = 0; s < kSlots; ++s) {
      clear(s);
      moved_[s].setZero();
    }
  }
  clear(k + 2);
  moved_[(angles ? k + 1 : k) % kSlots] = (elements.last_step().joint_speed * e.step).cwiseAbs();

  // Samples k − 1, k, k + 1 (angles), or k − 1 and k (speeds), in ∫ ω φ̈ and ∫ ω φ̇.
  const std::array<double, 3> slope =
      angles ? std::array{1.0 / e.before, -1.0 / e.before - 1.0 / e.step, 1.0 / e.step} : std::array{-1.0, 1.0, 0.0};
  const std::array<double, 3> motion =
      angles ? std::array{-0.5, 0.0, 0.5} : std::array{0.5 * e.step, 0.5 * e.step, 0.0};
  for (const Term& term : model.terms) {
    if (term.kind == Term::Kind::function) {
      continue;
    }
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto par = static_cast<Eigen::Index>(term.parameter);
    const auto& stencil = term.kind == Term::Kind::acceleration ? slope : motion;
    for (std::size_t j = 0; j < joints_; ++j) {
      const double by =
          -term.scale * model.motion(static_cast<Eigen::Index>(term.coordinate), static_cast<Eigen::Index>(j));
      if (by == 0.0) {
        continue;
      }
      for (std::size_t s = 0; s < 3; ++s) {
        if (stencil[s] != 0.0) {
          slots_[(k - 1 + s) % kSlots].motion[j].row(par) += (by * stencil[s]) * g.row(i);
        }
      }
    }
  }
  if (!exact_) {
    return;
  }
  const ElementFilter::EffortWeights effort = elements.effort_weights();
  const std::size_t first = angles ? k - 1 : k - 3;  // may wrap below 0, where its weight is 0
  for (std::size_t s = 0; s < 4; ++s) {
    if (effort.weight[s] != 0.0) {
      slots_[(first + s) % kSlots].effort.noalias() += effort.weight[s] * (model.input.transpose() * g);
    }
  }
}

void SampleWeights::whole_effort(const ElementFilter& elements, const core::RowMatrix& g, std::size_t joint) {
  const Eigen::MatrixXd& input = elements.model().input;
  spread_.setZero();
  for (Eigen::Index i = 0; i < g.rows(); ++i) {
    spread_ += (elements.element().length * std::abs(input(i, static_cast<Eigen::Index>(joint)))) *
               g.row(i).cwiseAbs().transpose();
  }
}

void SampleWeights::weigh_motion(const Slot& slot, std::size_t joint) {
  middle_.noalias() = slot.motion[joint].transpose() * box_.middle;
  spread_.noalias() = slot.motion[joint].cwiseAbs().transpose() * box_.radius;
}

WeakSums::WeakSums(Eigen::Index sums, Eigen::Index p)
    : Y(core::RowMatrix::Zero(sums, p)),
      y(Eigen::VectorXd::Zero(sums)),
      dY(core::RowMatrix::Zero(sums, p)),
      dy(Eigen::VectorXd::Zero(sums)) {}

WeakSummation::WeakSummation(const ElementFilter& elements, Eigen::Index sums)
    : sums_(sums, static_cast<Eigen::Index>(elements.model().p())) {
  before_ = change_ = core::RowMatrix::Zero(static_cast<Eigen::Index>(elements.model().n()), sums);
}

void WeakSummation::turn(const ElementFilter& elements, const core::RowMatrix& change, const Eigen::VectorXd& doubt,
                         double step) {
  for (const Term& term : elements.model().terms) {
    if (term.kind == Term::Kind::speed) {
      const double by = std::abs(term.scale) * doubt[static_cast<Eigen::Index>(term.coordinate)] / step;
      sums_.dY.col(static_cast<Eigen::Index>(term.parameter)) +=
          by * change.row(static_cast<Eigen::Index>(term.output)).cwiseAbs().transpose();
    }
  }
}

void WeakSummation::take(const ElementFilter& elements, const core::RowMatrix& g) {
  const Model& model = elements.model();
  const WeakElement& e = elements.element();
  if (elements.angles()) {
    if (any_) {
      change_ = g - before_;
      turn(elements, change_, e.motion_doubt_before, e.before);
    } else {
      turn(elements, g, e.motion_doubt_before, e.before);
    }
  }
  std::size_t function = 0;
  for (const Term& term : model.terms) {
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto par = static_cast<Eigen::Index>(term.parameter);
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    double value = 0.0, error = 0.0;
    switch (term.kind) {
      case Term::Kind::acceleration: value = term.scale * e.slope[c]; break;
      case Term::Kind::speed:
        value = term.scale * e.motion[c];
        error = elements.angles() ? 0.0 : std::abs(term.scale) * e.motion_doubt[c];
        break;
      case Term::Kind::function:
        value = e.functions[function].value;
        error = e.functions[function].error;
        ++function;
        break;
    }
    sums_.Y.col(par) += value * g.row(i).transpose();
    if (error != 0.0) {
      sums_.dY.col(par) += error * g.row(i).cwiseAbs().transpose();
    }
  }
  for (Eigen::Index i = 0; i < g.rows(); ++i) {
    sums_.y += e.torque[i] * g.row(i).transpose();
    if (e.torque_doubt[i] != 0.0) {
      sums_.dy += e.torque_doubt[i] * g.row(i).cwiseAbs().transpose();
    }
  }
  before_ = g;
  any_ = true;
}

void WeakSummation::end(const ElementFilter& elements) {
  if (any_ && elements.angles()) {
    turn(elements, before_, elements.element().motion_doubt, elements.element().step);
  }
  any_ = false;
}

void element_regressor(const ElementFilter& elements, const WeakElement& element, core::RowMatrix& Y) {
  Y.setZero();
  std::size_t function = 0;
  for (const Term& term : elements.model().terms) {
    const auto i = static_cast<Eigen::Index>(term.output);
    const auto par = static_cast<Eigen::Index>(term.parameter);
    const auto c = static_cast<Eigen::Index>(term.coordinate);
    Y(i, par) += term.kind == Term::Kind::acceleration ? term.scale * element.slope[c]
                 : term.kind == Term::Kind::speed      ? term.scale * element.motion[c]
                                                       : element.functions[function++].value;
  }
}

}  // namespace wheelwright::filter
