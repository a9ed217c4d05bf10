// SPDX-License-Identifier: Apache-2.0
#include "commission/at_risk/serial_correlation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <vector>

#include "commission/at_risk/element_walk.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/regression.hpp"
#include "model/filter/sample_weights.hpp"

namespace wheelwright::commission {
namespace {

using core::RowMatrix;
using filter::SampleWeight;

constexpr std::array<double, 5> kDelays = {1.0, 2.0, 4.0, 10.0, 30.0};         // in units of the shortest
constexpr double kShortestInCorrelations = 1.0 / 3.0, kShortestInSteps = 4.0;  // the larger of both
constexpr double kWindows = 20.0;              // of a delay that the log must hold for it to count
constexpr int kMultiples = 12;                 // λ, each twice the one before
constexpr double kLargestVariance = 16.0;      // for which the first of them is the best, in units of that of q = bound
constexpr double kEigenvalueRounding = 1e-10;  // relative, of eigenvalues
constexpr double kStamps = 1e-6;               // relative, by which a correlation time is taken to be longer

// Means of old elements [torque | Y], by filters of order kOrder that delay by several times each. Elements come in
// when all samples that they hold are older than all that the newest element holds, by the correlation time.
class OldElements {
 public:
  OldElements(const filter::ElementFilter& elements, std::vector<double> delays, double correlation)
      : delays_(std::move(delays)), correlation_((1.0 + kStamps) * correlation), angles_(elements.angles()) {
    zero_ = RowMatrix::Zero(static_cast<Eigen::Index>(elements.model().n()),
                            static_cast<Eigen::Index>(elements.model().p()) + 1);
    Y_ = zero_.rightCols(zero_.cols() - 1);
    begin();
  }

  void begin() {
    waiting_.clear();
    stages_.assign(delays_.size(), {});
    for (auto& stages : stages_) {
      stages.fill(zero_);
    }
  }

  // The newest element of `elements`, whose weights are made of mean().
  void take(const filter::ElementFilter& elements) {
    // Element k holds efforts of the samples k − 1 to k + 2 and angles of k − 1 to k + 1, or (speeds) k − 3 to k.
    while (waiting_.size() >= kLag) {
      const double latest = waiting_[angles_ ? 2 : 0].t;
      const double earliest = angles_ ? waiting_.back().t : waiting_[waiting_.size() - 3].t;
      if (latest > earliest - correlation_) {
        break;
      }
      release(waiting_.front());
      waiting_.pop_front();
    }
    const filter::WeakElement& e = elements.element();
    if (!e.known) {
      return;
    }
    waiting_.push_back({e.t, e.length, zero_});
    filter::element_regressor(elements, e, Y_);
    waiting_.back().signals.col(0) = e.torque;
    waiting_.back().signals.rightCols(Y_.cols()) = Y_;
  }

  [[nodiscard]] const RowMatrix& mean(std::size_t delay) const { return stages_[delay].back(); }

 private:
  static constexpr std::size_t kLag = 4, kOrder = 4;
  struct Waiting {
    double t = 0.0, length = 0.0;
    RowMatrix signals;
  };
  void release(const Waiting& element) {
    for (std::size_t d = 0; d < delays_.size(); ++d) {
      const double forgotten = -std::expm1(-static_cast<double>(kOrder) / delays_[d] * element.length);
      auto& z = stages_[d];
      z[0] += forgotten * (element.signals / element.length - z[0]);
      for (std::size_t i = 1; i < kOrder; ++i) {
        z[i] += forgotten * (z[i - 1] - z[i]);
      }
    }
  }

  std::vector<double> delays_;
  double correlation_ = 0.0;
  bool angles_ = false;
  RowMatrix zero_, Y_;
  std::deque<Waiting> waiting_;
  std::vector<std::array<RowMatrix, kOrder>> stages_;
};

// The most by which uᵀMu may be below 0 while no entry of u is larger than 1.
double most_below(const Eigen::MatrixXd& M) {
  const Eigen::MatrixXd half = 0.5 * (M + M.transpose());
  const double size = half.cwiseAbs().sum();
  const double least = core::symmetric_eigen(half).values.minCoeff();
  return std::min(size, static_cast<double>(M.rows()) * std::max(-least, 0.0) + kEigenvalueRounding * size);
}

// The most that errors which average out may add to S, but for the probability e^{−cost}.
double averaged(double V, double largest, double cost) {
  double least = core::kInfinity;
  for (int i = 0; i < kMultiples; ++i) {
    const double lambda = std::sqrt(2.0 * cost / largest) * std::exp2(i);
    least = std::min(least, cost / lambda + 0.5 * lambda * V);
  }
  return least;
}

}  // namespace

SerialCorrelation serial_correlation(LogSource& log, filter::ElementFilter elements,
                                     const filter::ErrorClasses& classes, const bounds::Polytope& set, double seconds,
                                     double risk) {
  const Model& model = elements.model();
  const filter::SampleClass effort = filter::sample_class(classes.effort, classes.shortest_step);
  const double shortest = std::max(kShortestInCorrelations * classes.effort.correlation,
                                   kShortestInSteps * elements.measurement().nominal_step);
  std::vector<double> delays;
  for (const double multiple : kDelays) {
    if (kWindows * multiple * shortest <= seconds) {
      delays.push_back(multiple * shortest);
    }
  }
  SerialCorrelation result;
  if (!effort.averages || delays.empty()) {
    return result;
  }
  const auto joints = static_cast<Eigen::Index>(model.joints.size()), p = static_cast<Eigen::Index>(model.p());
  const Eigen::MatrixXd to_joints = model.input.transpose() * core::inverse(model.input * model.input.transpose());
  const filter::ParameterBox box = middle_and_radius(set.hull());
  const Eigen::VectorXd largest = box.middle.cwiseAbs() + box.radius;

  // A group of sums for each delay and joint: with the weights q of the box's middle, and with what θ_a subtracts from
  // these, for each parameter a.
  const Eigen::Index width = 1 + p, groups = static_cast<Eigen::Index>(delays.size()) * joints;
  OldElements old(elements, delays, classes.effort.correlation);
  filter::SampleWeights weights(elements, box, groups * width);
  filter::WeakSummation summation(elements, groups * width);
  Eigen::VectorXd straight = Eigen::VectorXd::Zero(groups), V = straight;
  double squares = 0.0;  // Σ length²
  const auto sink = [&](const SampleWeight& s) {
    const bool averages = s.sensor == SampleWeight::Sensor::effort && s.exact;
    const double bound = s.sensor == SampleWeight::Sensor::motion ? classes.motion.bound : effort.bound;
    for (Eigen::Index k = 0; k < groups; ++k) {
      const auto size = s.middle.segment(k * width, width).cwiseAbs() + s.spread.segment(k * width, width);
      const double weight = size[0] + box.radius.dot(size.tail(p));
      straight[k] += weight * (averages ? effort.bias : bound);
      V[k] += averages ? filter::variance_proxy(effort) * weight * weight : 0.0;
    }
  };
  RowMatrix g(static_cast<Eigen::Index>(model.n()), groups * width);
  walk_elements(
      log, elements,
      [&] {
        old.begin();
        weights.begin();
        summation.begin();
      },
      [&] {
        old.take(elements);
        for (Eigen::Index k = 0; k < groups; ++k) {
          const auto joint = to_joints.row(k % joints);
          const Eigen::RowVectorXd mean = joint * old.mean(static_cast<std::size_t>(k / joints));
          g.col(k * width) = (mean[0] - mean.tail(p).dot(box.middle)) * joint.transpose();
          g.middleCols(k * width + 1, p) = joint.transpose() * mean.tail(p);
        }
        if (!elements.element().known) {
          g.setZero();
        }
        weights.take(elements, g, sink);
        summation.take(elements, g);
        squares += std::pow(elements.element().length, 2);
      },
      [&] {
        weights.end(sink);
        summation.end(elements);
      });

  const filter::WeakSums& sums = summation.sums();
  const double cost = std::log(static_cast<double>(groups * kMultiples) / risk);
  const double variance = kLargestVariance * filter::variance_proxy(effort) * effort.bound * effort.bound * squares;
  for (Eigen::Index k = 0; k < groups; ++k) {
    const Eigen::Index first = k * width;
    const Eigen::VectorXd left = sums.y.segment(first, width) - sums.Y.middleRows(first, width) * box.middle;
    const Eigen::VectorXd doubt = sums.dy.segment(first, width) + sums.dY.middleRows(first, width) * largest;
    // S(middle + Δ) = left_0 − slope·Δ + Δᵀ curvature Δ.
    const Eigen::VectorXd slope = sums.Y.row(first).transpose() + left.tail(p);
    const double by_slope = set.support({slope.data(), static_cast<std::size_t>(p)}) - slope.dot(box.middle);
    const double by_curvature =
        most_below(box.radius.asDiagonal() * sums.Y.middleRows(first + 1, p) * box.radius.asDiagonal());
    const double least = left[0] - by_slope - by_curvature - doubt[0] - box.radius.dot(doubt.tail(p)) - straight[k];
    const double excess = least / averaged(V[k], variance, cost);
    if (excess > result.excess) {
      result = {excess, classes.effort.correlation + delays[static_cast<std::size_t>(k / joints)],
                static_cast<std::size_t>(k % joints)};
    }
  }
  return result;
}

}  // namespace wheelwright::commission
