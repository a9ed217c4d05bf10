// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <wheelwright/commission/noise_budget.hpp>

namespace wheelwright::commission {
namespace {

TEST(OutputNoise, AConvergedFitTellsTheFactor) {
  bounds::MinimaxFit fit;
  fit.converged = true;
  fit.lower = 1.4999, fit.upper = 1.5;
  EXPECT_DOUBLE_EQ(noise_that_leaves_a_set(fit,
                                           [](double) {
                                             ADD_FAILURE() << "asked although the fit knows";
                                             return true;
                                           }),
                   1.05 * 1.5);
}

// Whatever a fit that stopped early had proved, the factor is the same up to the steps of the search.
TEST(OutputNoise, AFitThatStoppedEarlyIsFinished) {
  constexpr double kTruth = 1.51;
  const auto leaves = [](double factor) { return factor >= kTruth; };
  for (const double lower : {0.2, 1.0, 1.3}) {
    for (const double upper : {1.6, 9.02, 1e6}) {
      bounds::MinimaxFit fit;
      fit.converged = false;
      fit.lower = lower, fit.upper = upper;
      const double factor = noise_that_leaves_a_set(fit, leaves);
      EXPECT_GE(factor, 1.05 * kTruth) << lower << ' ' << upper;
      EXPECT_LE(factor, 1.05 * 1.05 * kTruth) << lower << ' ' << upper;
    }
  }
}

}  // namespace
}  // namespace wheelwright::commission
