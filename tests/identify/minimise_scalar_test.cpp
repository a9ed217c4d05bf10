// SPDX-License-Identifier: Apache-2.0
#include "identify/minimise_scalar.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::identify::minimise_scalar_test {
namespace {

TEST(MinimiseScalar, FindsTheMinimumOfAConvexFunctionFromAnywhere) {
  for (const double start : {0.0, 0.4, 1.7, 3.0}) {
    const ScalarMinimum m = minimise_scalar([](double x) { return std::cosh(x - 1.2345); }, 0.0, 3.0, start,
                                            {.most_evaluations = 200, .tolerance = 1e-5});
    EXPECT_EQ(m.status, ScalarSearchStatus::converged);
    EXPECT_NEAR(m.x, 1.2345, 1e-4);
  }
}

TEST(MinimiseScalar, StopsAtABoundWhereTheFunctionFallsThroughout) {
  const ScalarMinimum m = minimise_scalar([](double x) { return std::exp(-x); }, -1.0, 2.0, 0.0,
                                          {.most_evaluations = 100, .tolerance = 1e-4});
  EXPECT_DOUBLE_EQ(m.x, 2.0);
}

TEST(MinimiseScalar, KeepsItsBudgetAndTheBestPointMet) {
  for (std::size_t most = 1; most < 12; ++most) {
    std::size_t calls = 0;
    double least = std::numeric_limits<double>::infinity();
    const ScalarMinimum m = minimise_scalar(
        [&](double x) {
          ++calls;
          const double value = std::abs(x - 0.3) + 0.2 * std::sin(40.0 * x);
          least = std::min(least, value);
          return value;
        },
        0.0, 1.0, 0.9, {.most_evaluations = most, .tolerance = 1e-9});
    EXPECT_EQ(calls, most);
    EXPECT_EQ(m.evaluations, calls);
    EXPECT_EQ(m.value, least);
    EXPECT_EQ(m.status, ScalarSearchStatus::out_of_budget);
  }
}

TEST(MinimiseScalar, TurnsAwayFromValuesThatAreNotFinite) {
  const auto f = [](double x) { return x < 0.5 ? std::numeric_limits<double>::quiet_NaN() : x; };
  const ScalarMinimum m = minimise_scalar(f, 0.0, 1.0, 0.9, {.most_evaluations = 100, .tolerance = 1e-4});
  EXPECT_NEAR(m.x, 0.5, 1e-3);
  const ScalarMinimum none =
      minimise_scalar([](double) { return std::numeric_limits<double>::infinity(); }, 0.0, 1.0, 0.5);
  EXPECT_EQ(none.status, ScalarSearchStatus::stalled);
  EXPECT_EQ(none.value, std::numeric_limits<double>::infinity());
}

TEST(MinimiseScalar, PassesExceptionsOnAndChecksItsArguments) {
  const auto square = [](double x) { return x * x; };
  EXPECT_THROW(
      static_cast<void>(minimise_scalar([](double) -> double { throw std::runtime_error("no"); }, 0.0, 1.0, 0.5)),
      std::runtime_error);
  EXPECT_THROW(static_cast<void>(minimise_scalar(square, 1.0, 1.0, 1.0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(minimise_scalar(square, 0.0, 1.0, 2.0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(minimise_scalar(square, 0.0, 1.0, std::nan(""))), InvalidArgument);
  EXPECT_THROW(static_cast<void>(minimise_scalar(square, 0.0, 1.0, 0.5, {.most_evaluations = 0})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::identify::minimise_scalar_test
