// SPDX-License-Identifier: Apache-2.0
#include "model/filter/error_class.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::filter::error_class_test {
namespace {

// Errors of two points have the largest generating function of all with their largest value, mean and variance
// (Hoeffding 1963, Bennett 1962): `up` with the probability that makes the deviation what it is.
double log_generating_function(double lambda, double up, double deviation) {
  const double often = deviation * deviation / (up * up + deviation * deviation);
  const double down = -up * often / (1.0 - often);
  return std::log(often * std::exp(lambda * up) + (1.0 - often) * std::exp(lambda * down));
}

TEST(VarianceProxy, BoundsTheGeneratingFunctionWithinItsReach) {
  for (const double deviation : {0.02, 0.1, 0.3, 0.7, 1.0}) {
    const SampleClass sample{.averages = true, .bound = 1.0, .bias = 0.0, .deviation = deviation};
    for (const double reach : {0.01, 0.1, 0.5, 1.0, 2.0, 2.9, 3.1, 10.0}) {
      const double proxy = variance_proxy(sample, reach);
      EXPECT_LE(proxy, 1.0);
      for (int k = -20; k <= 20; ++k) {
        const double lambda = reach * k / 20.0;
        EXPECT_LE(log_generating_function(lambda, 1.0, deviation), 0.5 * lambda * lambda * proxy * (1.0 + 1e-12))
            << deviation << ' ' << reach << ' ' << lambda;
      }
    }
  }
}

// That for every λ, with whatever bias: the mean may stand at one side, the two points as far from it as that allows.
TEST(VarianceProxy, BoundsTheGeneratingFunctionForEveryMultiple) {
  for (const double bias : {0.0, 0.1, 0.5}) {
    for (const double deviation : {0.001, 0.02, 0.1, 0.3, 0.577, 0.7, 0.999, 1.0}) {
      const SampleClass sample{.averages = true, .bound = 1.0, .bias = bias, .deviation = deviation};
      const double proxy = variance_proxy(sample, core::kInfinity), up = 1.0 + bias;
      const double spread = std::min(deviation, std::sqrt(1.0 - bias * bias));  // of what is left within the bound
      for (double lambda = 1e-3; lambda < 400.0; lambda *= 1.1) {
        for (const double side : {1.0, -1.0}) {
          if (spread * spread / up <= 1.0 - bias) {  // the other point is within the bound
            EXPECT_LE(log_generating_function(side * lambda, up, spread), 0.5 * lambda * lambda * proxy * (1.0 + 1e-9))
                << bias << ' ' << deviation << ' ' << side * lambda;
          }
        }
      }
    }
  }
}

TEST(VarianceProxy, IsNearlyTheVarianceForSmallWeights) {
  const SampleClass sample{.averages = true, .bound = 2.0, .bias = 0.1, .deviation = 0.5, .multiplicity = 3.0};
  EXPECT_NEAR(variance_proxy(sample, 1e-3), 3.0 * 0.25, 3.0 * 0.25 * 3.0 * 1e-3 * 2.1 / 3.0 * 1.01);
  EXPECT_EQ(variance_proxy(sample, 1e3), variance_proxy(sample));
  EXPECT_LT(variance_proxy(sample), 3.0 * 4.0);
}

TEST(ErrorClass, ADeviationIsPositive) {
  ErrorClasses classes;
  classes.effort = {.bound = 1.0, .bias = 0.1, .correlation = 0.0, .deviation = 0.3};
  EXPECT_NO_THROW(validate(classes));
  classes.effort.deviation = 0.0;
  EXPECT_THROW(validate(classes), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::filter::error_class_test
