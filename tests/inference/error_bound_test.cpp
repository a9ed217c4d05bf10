// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/noise_levels.hpp"

#include <algorithm>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::inference::error_bound_test {
namespace {

using testing_support::Random;

// Share of runs in which one of `horizon` samples leaves the bound made of the sd of 40 others.
double broken(NoiseLaw law, double risk, const std::function<double(Random&)>& draw) {
  constexpr int runs = 4000, learnt = 40, horizon = 200;
  int count = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(static_cast<std::uint64_t>(run) + 1);
    double squares = 0.0;
    for (int k = 0; k < learnt; ++k) {
      squares += std::pow(draw(random), 2.0);
    }
    const ErrorBound bound =
        bound_of_sd(std::sqrt(squares / learnt), std::sqrt(2.0 / learnt), {law, static_cast<double>(horizon), risk});
    bool outside = false;
    for (int k = 0; k < horizon; ++k) {
      outside = outside || std::abs(draw(random)) > bound.bound;
    }
    count += outside ? 1 : 0;
  }
  return static_cast<double>(count) / runs;
}

TEST(ErrorBound, KeepsItsPromise) {
  const auto normal = [](Random& r) { return r.normal(); };
  const auto uniform = [](Random& r) { return r.symmetric(); };
  const auto laplace = [](Random& r) { return r.laplace(); };
  // Four standard errors of a share of 0.1 in 4000 runs are 0.019.
  EXPECT_LE(broken(NoiseLaw::gaussian, 0.1, normal), 0.1 + 0.019);
  EXPECT_LE(broken(NoiseLaw::uniform, 0.1, uniform), 0.1 + 0.019);
  EXPECT_LE(broken(NoiseLaw::any_variance, 0.1, laplace), 0.1 + 0.019);
  // Laws matter: tails break the bound of the uniform distribution at once.
  EXPECT_GT(broken(NoiseLaw::uniform, 0.1, normal), 0.9);
  EXPECT_GT(broken(NoiseLaw::gaussian, 0.1, laplace), 0.2);
}

TEST(ErrorBound, OfAKnownSdIsTheClosedForm) {
  EXPECT_DOUBLE_EQ(bound_of_sd(0.5, 0.0, {NoiseLaw::uniform, 1e9, 1e-6}).bound, 0.5 * std::sqrt(3.0));
  EXPECT_DOUBLE_EQ(bound_of_sd(2.0, 0.0, {NoiseLaw::any_variance, 100.0, 0.02}).bound, 200.0);
  const ErrorBound b = bound_of_sd(1.0, 0.0, {NoiseLaw::gaussian, 10.0, 0.01});
  EXPECT_NEAR(10.0 * std::erfc(b.bound / std::sqrt(2.0)), 0.005, 1e-12);
}

TEST(ErrorBound, GrowsWithHorizonAndIgnorance) {
  EXPECT_LT(bound_of_sd(1.0, 0.0, {NoiseLaw::gaussian, 1e3}).bound,
            bound_of_sd(1.0, 0.0, {NoiseLaw::gaussian, 1e6}).bound);
  EXPECT_LT(bound_of_sd(1.0, 0.01).bound, bound_of_sd(1.0, 0.3).bound);
  EXPECT_EQ(bound_of_sd(0.0, 0.1).bound, 0.0);
}

TEST(ErrorBound, ChecksItsArguments) {
  EXPECT_THROW(static_cast<void>(bound_of_sd(-1.0, 0.0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(bound_of_sd(1.0, std::nan(""))), InvalidArgument);
  EXPECT_THROW(static_cast<void>(bound_of_sd(1.0, 0.0, {NoiseLaw::gaussian, 0.5})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(bound_of_sd(1.0, 0.0, {NoiseLaw::gaussian, 1.0, 1.0})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::inference::error_bound_test
