// SPDX-License-Identifier: Apache-2.0
#include "detector/multiscale/scale_detector.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "commission/commission.hpp"
#include "tests/support/exact_axis.hpp"

namespace wheelwright::detector::scale_detector_test {
namespace {

// An axis that is known exactly, and whose efforts have no bias: what stands beside its sums are errors of angles and
// of efforts alone.
OnlineModel known_axis(const testing_support::ExactAxis& axis) {
  const LogTable log = drive(axis, 1);
  TableSource source(log);
  OnlineModel m = commission_robot(source, robot_of(axis)).model;
  m.at_risk->errors.effort.bias = 0.0;
  m.at_risk->facets.clear();
  for (std::size_t q = 0; q < m.at_risk->box.sides.size(); ++q) {
    const double theta = m.estimate[static_cast<Eigen::Index>(q)];
    m.at_risk->box.sides[q] = {theta, theta};
  }
  m.errors.between_samples = false;
  return m;
}

// The last look at every sum, by weight and scale.
using Looks = std::map<std::pair<std::size_t, std::size_t>, SumState>;
Looks last_looks(const LogTable& log, const OnlineModel& m) {
  ScaleDetector detector(m);
  Looks looks;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const double sample[2] = {log.columns[0][k], log.columns[1][k]};
    detector.step(log.t[k], sample);
    for (const SumState& look : detector.looks()) {
      looks[{look.weight, look.scale}] = look;
    }
  }
  return looks;
}

// By how much each sample of `column` moves every sum, per unit: no code of the bounds is in it. Sums are linear in
// efforts, and those with constant weights in angles.
std::map<std::pair<std::size_t, std::size_t>, std::vector<double>> sample_weights(LogTable log, const OnlineModel& m,
                                                                                  std::size_t column, double by) {
  const Looks before = last_looks(log, m);
  std::map<std::pair<std::size_t, std::size_t>, std::vector<double>> all;
  for (double& value : log.columns[column]) {
    const double read = value;
    value += by;
    for (const auto& [which, look] : last_looks(log, m)) {
      all[which].push_back((look.value - before.at(which).value) / by);
    }
    value = read;
  }
  return all;
}

TEST(ScaleDetector, AllowsForTheWorstErrorsOfAngles) {
  for (const double jitter : {0.0, 0.3}) {
    testing_support::ExactAxis axis{.seconds = 30.0, .count = 1e-3, .jitter = jitter};
    const OnlineModel m = known_axis(axis);
    axis.seconds = 7.0;
    const LogTable log = drive(axis, 2);
    const Looks looks = last_looks(log, m);
    std::size_t seen = 0;
    for (const auto& [which, weights] : sample_weights(log, m, 0, 1e-3)) {
      if (sum_weights(m.model)[which.first].shape != SumWeight::Shape::constant) {
        continue;
      }
      double worst = 0.0;
      for (const double weight : weights) {
        worst += std::abs(weight) * m.at_risk->errors.motion.bound;
      }
      const SumState& look = looks.at(which);
      EXPECT_GE(look.radius - look.averaged, worst * (1.0 - 1e-6)) << which.second;
      if (5.0 * m.at_risk->scales[which.second] <= axis.seconds) {  // sharp, once weights have risen and are old
        EXPECT_LE(look.radius - look.averaged, worst * 2.0) << which.second;
      }
      seen += worst > 0.0 ? 1 : 0;
    }
    EXPECT_GE(seen, 4U);
  }
}

// Independent errors of the law that has the largest generating function of all with their bound and deviation (two
// points) exceed x with a chance that Chernoff's inequality tells, and no bound for all such laws by exponential
// supermartingales can be below that.
TEST(ScaleDetector, AllowsForTheWorstLawOfEfforts) {
  for (const double deviation : {0.05, 0.3, 0.577, 1.0}) {
    testing_support::ExactAxis axis{.seconds = 30.0};
    axis.law = deviation < 1.0 ? testing_support::ErrorLaw::spikes : axis.law;
    axis.deviation = deviation * axis.bound;
    const OnlineModel m = known_axis(axis);
    axis.seconds = 5.0;
    const LogTable log = drive(axis, 2);
    const Looks looks = last_looks(log, m);
    const ScaleDetectorOptions usual;
    const double share =
        usual.false_alarms / static_cast<double>(sum_weights(m.model).size() * m.at_risk->scales.size());
    const double up = axis.bound, often = deviation * deviation / (1.0 + deviation * deviation);
    const double down = -up * often / (1.0 - often);
    std::size_t seen = 0;
    for (const auto& [which, weights] : sample_weights(log, m, 1, 1.0)) {
      const double L = std::log(usual.checks / (share * m.at_risk->scales[which.second]));
      double size = 0.0, least = 1e300;
      for (const double weight : weights) {
        size = std::max(size, std::abs(weight));
      }
      for (double lambda = 1e-4 / (size * up); lambda < 1e3 / (size * up); lambda *= 1.05) {
        double sum = L;
        for (const double weight : weights) {
          const double by = lambda * std::abs(weight), most = std::max(by * up, 0.0);
          sum += most + std::log(often * std::exp(by * up - most) + (1.0 - often) * std::exp(by * down - most));
        }
        least = std::min(least, sum / lambda);
      }
      EXPECT_GE(looks.at(which).averaged, least * (1.0 - 1e-9))
          << deviation << ' ' << which.first << ' ' << which.second;
      ++seen;
    }
    EXPECT_GE(seen, 12U);
  }
}

// A supermartingale of mean 1 exceeds e^L with probability e^−L at most: a sum at the radius makes this one exceed
// that, e^{λS − λ²V/2} of all λ, to both sides, at equal parts.
TEST(AveragedRadius, IsWhereTheMixtureReachesTheRisk) {
  for (const double L : {3.0, 10.0, 25.0, 40.0}) {
    for (const double ratio : {1e-5, 1e-3, 0.1, 1.0, 5.0, 50.0, 1e4}) {
      for (const double more : {1.0, 1.2, 9.0}) {
        const double V0 = 0.7, V = ratio * V0, all = more * V;
        const double cost = mixture_cost(L), usual = usual_multiple(V0, cost);
        const double S = averaged_radius(V, all, cost, usual);
        double most = 0.0;
        std::vector<double> logarithms;
        for (int k = 0; k < kMultiples; ++k) {
          const double lambda = usual * kFirstMultiple * std::exp2(k), proxy = k <= kUsualMultiple ? V : all;
          for (const double side : {1.0, -1.0}) {
            logarithms.push_back(side * lambda * S - 0.5 * lambda * lambda * proxy);
            most = std::max(most, logarithms.back());
          }
        }
        double sum = 0.0;
        for (const double logarithm : logarithms) {
          sum += std::exp(logarithm - most) / static_cast<double>(logarithms.size());
        }
        EXPECT_GE(most + std::log(sum), L - 1e-9) << L << ' ' << ratio << ' ' << more;
      }
    }
  }
}

// No worse than 15 % above what a normal law would make of it, from a thousandth of a usual variance to ten times it.
TEST(AveragedRadius, IsSharpWhateverTheVariance) {
  const double L = 27.0, V0 = 0.2, cost = mixture_cost(L), usual = usual_multiple(V0, cost);
  for (double V = 1e-3; V < 10.0; V *= 1.1) {
    EXPECT_LE(averaged_radius(V, V, cost, usual), 1.15 * std::sqrt(2.0 * L * V)) << V;
  }
}

}  // namespace
}  // namespace wheelwright::detector::scale_detector_test
