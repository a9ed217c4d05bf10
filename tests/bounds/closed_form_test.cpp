// SPDX-License-Identifier: Apache-2.0
// Sets and fits that are known in closed form.
#include <cmath>

#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "bounds/minimax.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::closed_form_test {
namespace {

using testing_rows::Rows;

TEST(ClosedForm, unit_rows_give_the_box) {
  Rows rows(3);
  rows.add({1, 0, 0}, 1.0, 0.5).add({0, 1, 0}, -2.0, 0.25).add({0, 0, 1}, 0.0, 1.0);
  core::RegressionTable table = rows.table();
  const FeasibleSet set = feasible_set(table, testing_rows::cube(3, 100.0));
  ASSERT_EQ(set.status, FeasibleSet::Status::nonempty);
  const std::vector<Interval> expected{{0.5, 1.5}, {-2.25, -1.75}, {-1.0, 1.0}};
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_LE(set.hull.sides[j].lower, expected[j].lower);
    EXPECT_GE(set.hull.sides[j].upper, expected[j].upper);
    EXPECT_NEAR(set.hull.sides[j].lower, expected[j].lower, 1e-12);
    EXPECT_NEAR(set.hull.sides[j].upper, expected[j].upper, 1e-12);
  }
  EXPECT_EQ(set.polytope->blocks().size(), 3U);
  EXPECT_EQ(set.polytope->facets().size(), 6U);
}

// All rows ±1 with |Yθ| <= 1 bound Σ|θ_j| <= 1: the support function is the largest |a_j|.
TEST(ClosedForm, all_sign_rows_give_the_l1_ball) {
  for (std::size_t p = 1; p <= 6; ++p) {
    Rows rows(p);
    for (std::size_t pattern = 0; pattern < std::size_t{1} << (p - 1); ++pattern) {
      std::vector<double> signs(p, 1.0);
      for (std::size_t j = 0; j + 1 < p; ++j) {
        signs[j] = (pattern >> j & 1) != 0 ? -1.0 : 1.0;
      }
      rows.add(signs, 0.0, 1.0);
    }
    core::RegressionTable table = rows.table();
    const FeasibleSet set = feasible_set(table, testing_rows::cube(p, 1000.0));
    ASSERT_EQ(set.status, FeasibleSet::Status::nonempty) << p;
    EXPECT_EQ(set.polytope->facets().size(), std::size_t{1} << p);
    testing_rows::Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p);
      double largest = 0.0;
      for (const double x : a) {
        largest = std::max(largest, std::abs(x));
      }
      EXPECT_GE(set.polytope->support(a), largest) << p;
      // The ball's inner radius is 1/√p: facets that are shifted by s scale it by 1 + s√p at most (p to spare a
      // rotation).
      EXPECT_LE(set.polytope->support(a), largest * (1.0 + set.polytope->looseness() * static_cast<double>(p)) + 1e-9);
    }
  }
}

// Chebyshev: x² by lines on {−1, 0, 1} errs by 1/2, x³ by quadratics on {±1, ±1/2} by 1/4.
TEST(ClosedForm, minimax_fit_of_powers) {
  const auto fit = [](int degree, int power, const std::vector<double>& nodes) {
    Rows rows(static_cast<std::size_t>(degree) + 1);
    for (const double x : nodes) {
      std::vector<double> Y;
      for (int k = 0; k <= degree; ++k) {
        Y.push_back(std::pow(x, k));
      }
      rows.add(Y, std::pow(x, power), 0.0);
    }
    core::RegressionTable table = rows.table();
    return minimax_fit(table, testing_rows::cube(static_cast<std::size_t>(degree) + 1, 10.0));
  };
  const MinimaxFit square = fit(1, 2, {-1.0, 0.0, 1.0});
  EXPECT_LE(square.lower, 0.5);
  EXPECT_GE(square.upper, 0.5);
  EXPECT_NEAR(square.upper - square.lower, 0.0, 1e-9);
  EXPECT_TRUE(square.converged);
  const MinimaxFit cube = fit(2, 3, {-1.0, -0.5, 0.5, 1.0});
  EXPECT_LE(cube.lower, 0.25);
  EXPECT_GE(cube.upper, 0.25);
  EXPECT_NEAR(cube.upper - cube.lower, 0.0, 1e-9);
}

// Klee and Minty's cube: x_1 <= 5, 4x_1 + x_2 <= 25, 8x_1 + 4x_2 + x_3 <= 125, x >= 0; max 4x_1 + 2x_2 + x_3 = 125.
TEST(ClosedForm, klee_minty_cube) {
  const std::size_t p = 8;
  std::vector<HalfSpace> rows;
  double right = 1.0;
  std::vector<double> a(p);
  for (std::size_t i = 0; i < p; ++i) {
    right *= 5.0;
    HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p)), right, {}};
    row.a[static_cast<Eigen::Index>(i)] = 1.0;
    for (std::size_t j = 0; j < i; ++j) {
      row.a[static_cast<Eigen::Index>(j)] = std::pow(2.0, static_cast<double>(i - j + 1));
    }
    rows.push_back(row);
    a[i] = std::pow(2.0, static_cast<double>(p - 1 - i));
  }
  Box box;
  box.sides.assign(p, {0.0, right});
  const Polytope polytope(rows, box);
  EXPECT_EQ(polytope.facets().size(), 2 * p);
  EXPECT_EQ(polytope.vertex_count(), std::size_t{1} << p);
  EXPECT_GE(polytope.support(a), right);
  EXPECT_NEAR(polytope.support(a) / right, 1.0, 1e-6);
}

}  // namespace
}  // namespace wheelwright::bounds::closed_form_test
