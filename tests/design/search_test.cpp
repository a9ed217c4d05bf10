// SPDX-License-Identifier: Apache-2.0
// Minima that are known, and that neither threads nor repetition change anything.
#include "commission/design/stages.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::design::search_test {
namespace {

// Many local minima (Rastrigin), the lowest, 0, at 0.3 in each coordinate.
double waves(std::span<const double> x) {
  double sum = 0.0;
  for (const double value : x) {
    const double z = 4.0 * (value - 0.3);
    sum += z * z + 0.5 * (1.0 - std::cos(2.0 * std::numbers::pi * z));
  }
  return sum;
}

// Not smooth: the largest of |x_j − 0.2(j + 1)|.
double roof(std::span<const double> x) {
  double largest = 0.0;
  for (std::size_t j = 0; j < x.size(); ++j) {
    largest = std::max(largest, std::abs(x[j] - 0.2 * static_cast<double>(j + 1)));
  }
  return largest;
}

TEST(Search, FindsTheLowestOfManyMinima) {
  const SearchResult found = minimise_over_cube(waves, 3, {}, {.samples = 200, .descents = 8, .tolerance = 1e-10});
  EXPECT_LT(found.value, 1e-4);
  for (const double x : found.x) {
    EXPECT_NEAR(x, 0.3, 0.01);
  }
}

TEST(Search, FollowsKinks) {
  const SearchResult found = minimise_over_cube(roof, 4, {{0.9, 0.1, 0.1, 0.1}}, {.samples = 0, .steps = 2000});
  EXPECT_LT(found.value, 0.01);
}

TEST(Search, NeitherThreadsNorRepetitionMatter) {
  const SearchOptions one{.samples = 50, .descents = 4, .steps = 100, .seed = 3, .threads = 1};
  SearchOptions three = one;
  three.threads = 3;
  const SearchResult a = minimise_over_cube(waves, 3, {}, one), b = minimise_over_cube(waves, 3, {}, three);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.value, b.value);
  EXPECT_EQ(a.evaluations, b.evaluations);
}

TEST(Search, PassesOverWhereTheFunctionIsNotDefined) {
  const auto half = [](std::span<const double> x) {
    if (x[0] < 0.5) {
      throw InvalidArgument("not here");
    }
    return x[0];
  };
  EXPECT_NEAR(minimise_over_cube(half, 1, {}, {.samples = 20}).value, 0.5, 1e-3);
  const auto nowhere = [](std::span<const double>) -> double { throw InvalidArgument("nowhere"); };
  EXPECT_THROW(static_cast<void>(minimise_over_cube(nowhere, 1, {}, {.samples = 5})), InvalidArgument);
  const auto broken = [](std::span<const double>) -> double { throw std::logic_error("a bug"); };
  EXPECT_THROW(static_cast<void>(minimise_over_cube(broken, 1, {}, {.samples = 5, .threads = 2})), std::logic_error);
}

TEST(Search, MisuseIsTold) {
  EXPECT_THROW(static_cast<void>(minimise_over_cube(waves, 0, {}, {})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(minimise_over_cube(waves, 2, {{0.5}}, {})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(minimise_over_cube(waves, 2, {}, {.samples = 0})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::design::search_test
