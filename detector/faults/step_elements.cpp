// SPDX-License-Identifier: Apache-2.0
#include "detector/faults/step_elements.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "detector/faults/fault_rows.hpp"

namespace wheelwright::detector {
namespace {

constexpr double kForgottenAfter = 20.0;  // 1/β

}  // namespace

std::vector<std::size_t> settled_within(const ReferenceMotion& motion, const Interval& window, std::size_t most) {
  std::vector<std::size_t> all, out;
  for (std::size_t k = 0; k < motion.instants(); ++k) {
    if (motion.settled[k] && window.contains(motion.t[k])) {
      all.push_back(k);
    }
  }
  const std::size_t count = std::min(most, all.size());
  for (std::size_t k = 0; k < count; ++k) {
    out.push_back(all[count > 1 ? k * (all.size() - 1) / (count - 1) : 0]);
  }
  return out;
}

RowWeights::RowWeights(const ReferenceMotion& motion, const FilterDesign& design)
    : motion_(motion), design_(design), kernel_(design, motion.kind, motion.nominal_step) {
  if (!motion.cuts.empty()) {
    kernel_.soften();
  }
}

void RowWeights::of(std::size_t row) {
  const auto next = std::upper_bound(motion_.segment_starts.begin(), motion_.segment_starts.end(), row);
  const std::size_t segment = next == motion_.segment_starts.begin() ? 0 : *(next - 1);
  first_ = row;
  while (first_ > segment && motion_.instant[row] - motion_.instant[first_] < kForgottenAfter / design_.beta) {
    --first_;
  }
  weights_.assign(row - first_, 0.0);
  std::optional<std::size_t> cut;
  for (std::size_t k = row; k-- > first_;) {
    double weight = of_age(k, row, k);
    if (cut) {
      weight -= std::exp(-kernel_.lambda() * (motion_.instant[*cut] - motion_.instant[k])) * of_age(k, row, *cut);
    }
    weights_[k - first_] = motion_.held(k) * weight;
    if (motion_.cut_at(k)) {
      cut = k;
    }
  }
}

double RowWeights::of_age(std::size_t k, std::size_t row, std::size_t since) const {
  const double beta = design_.beta, gain = kernel_.gain();
  if (kernel_.nodes()) {
    const double x = motion_.instant[row] - motion_.instant[since], decay = std::exp(-beta * x);
    if (design_.order == 1) {
      return gain * decay;
    }
    const double fast = kernel_.apart() > 0.0 ? std::exp(-kernel_.gamma() * x) : decay;
    return gain * kernel_.slow() * (x * decay - kernel_.apart() * (decay - fast));
  }
  const filter::StepWeights step(beta, motion_.step[k + 1]);
  const double x = motion_.instant[row] - motion_.instant[k + 1], decay = std::exp(-beta * x);
  return gain * decay * (design_.order == 1 ? step.increment1() : step.increment2() + x * step.increment1());
}

StepElements step_elements(const FaultType& fault, const Model& model, double static_gain,
                           const ReferenceMotion& motion) {
  const auto n = static_cast<Eigen::Index>(model.n());
  StepElements out;
  out.outputs = model.n();
  out.columns = model.p();
  const std::size_t size = out.outputs * out.columns;
  for (std::vector<double>* part : {&out.g1, &out.g2, &out.once, &out.twice}) {
    part->assign(motion.instants() * size, 0.0);
  }
  out.c.assign(motion.instants() * out.outputs, 0.0);
  FaultElements elements(fault, model, static_gain, motion);
  for (const std::size_t start : motion.segment_starts) {
    elements.begin_broken(start);
    while (elements.next()) {
      const std::array<double, 2>& share = elements.shares();
      const FaultSignals &a = elements.at_begin(), &b = elements.at_end();
      const std::size_t k = elements.instant() - 1;
      for (std::size_t e = 0; e < size; ++e) {
        out.g1[k * size + e] = share[0] * a.g1.data()[e] + share[1] * b.g1.data()[e];
        out.g2[k * size + e] = share[0] * a.g2.data()[e] + share[1] * b.g2.data()[e];
      }
      for (std::size_t i = 0; i < out.outputs; ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        out.c[k * out.outputs + i] = share[0] * a.c[at] + share[1] * b.c[at];
      }
    }
  }
  if (fault.motion.size() == 0 && fault.slip.size() == 0) {
    return out;
  }
  Eigen::MatrixXd gain = Eigen::MatrixXd::Zero(n, n);
  for (const Eigen::MatrixXd* part : {&fault.effort, &fault.ground}) {
    if (part->size() > 0) {
      gain += *part;
    }
  }
  for (std::size_t k = 0; k < motion.instants(); ++k) {
    Eigen::VectorXd moved = Eigen::VectorXd::Zero(motion.speed.rows());
    if (fault.motion.size() > 0) {
      moved += fault.motion * motion.speed.col(static_cast<Eigen::Index>(k));
    }
    if (fault.slip.size() > 0) {
      moved += fault.slip;
    }
    for (const Term& term : model.terms) {
      if (term.kind == Term::Kind::acceleration) {
        const double impulse = term.scale * moved[static_cast<Eigen::Index>(term.coordinate)];
        out.once[k * size + term.output * out.columns + term.parameter] += impulse;
        for (std::size_t i = 0; i < out.outputs; ++i) {
          // κ d(κu)/dt = d(κ²u)/dt − (κ²)˙u/2
          out.twice[k * size + i * out.columns + term.parameter] +=
              0.5 * gain(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(term.output)) * impulse;
        }
      }
    }
  }
  return out;
}

}  // namespace wheelwright::detector
