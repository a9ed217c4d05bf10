// SPDX-License-Identifier: Apache-2.0
// Published bounds against exact optima (QSopt_ex), p from 1 to 12: never inside, with zero tolerance, and no further
// out than 1e-9 of the exact width, or than rounding of the data where the set is a sliver. No problem is exempted;
// thousands of them: exact_lp_study.cpp.
#include <gtest/gtest.h>

#include "bounds/minimax.hpp"
#include "tests/bounds/exact_lp.hpp"

namespace wheelwright::bounds::exact_lp_test {
namespace {

using exact_lp::Family;
using exact_lp::Tally;

void expect_exact(const Tally& tally) {
  EXPECT_EQ(tally.inside, 0U) << summary(tally) << '\n' << tally.failures;
  EXPECT_EQ(tally.empty, 0U) << summary(tally) << '\n' << tally.failures;
  EXPECT_EQ(tally.loose, 0U) << summary(tally) << '\n' << tally.failures;
}

class ExactLp : public ::testing::TestWithParam<Family> {};

// The oracle itself: minimum and maximum of a box, a slab that cuts it, and one that misses it.
TEST(QsoptOracle, box_slab_and_empty_set) {
  qsopt::start();
  RegressionBlock rows = testing_rows::Rows(2).add({1.0, 1.0}, 0.5, 0.25).block(0, 1);
  const Box unit = testing_rows::cube(2, 1.0);
  EXPECT_EQ(qsopt::exact_set(rows, unit).maximise({1, 0}), mpq_class(1));
  EXPECT_EQ(qsopt::exact_set(rows, unit).maximise({1, 1}), mpq_class(3, 4));
  EXPECT_EQ(qsopt::exact_set(rows, unit).maximise({-1, -1}), mpq_class(-1, 4));
  rows.y[0] = 3.0;
  EXPECT_FALSE(qsopt::exact_set(rows, unit).maximise({1, 0}).has_value());
}

// The minimax fit of x² by lines on {−1, 0, 1} is 1/2, of x³ by quadratics on {±1, ±1/2} is 1/4.
TEST(QsoptOracle, minimax_of_powers) {
  qsopt::start();
  testing_rows::Rows square(2), cube(3);
  for (const double x : {-1.0, 0.0, 1.0}) {
    square.add({1.0, x}, x * x, 0.0);
  }
  for (const double x : {-1.0, -0.5, 0.5, 1.0}) {
    cube.add({1.0, x, x * x}, x * x * x, 0.0);
  }
  EXPECT_EQ(qsopt::exact_minimax(square.block(0, 3), testing_rows::cube(2, 9.0), 9.0), mpq_class(1, 2));
  EXPECT_EQ(qsopt::exact_minimax(cube.block(0, 4), testing_rows::cube(3, 9.0), 9.0), mpq_class(1, 4));
}

TEST_P(ExactLp, bounds_are_never_inside_and_tight) {
  qsopt::start();
  Tally tally;
  for (const std::size_t p : {1, 2, 3, 5, 7, 10}) {
    judge_one(tally, GetParam(), p, 0, 1);
  }
  expect_exact(tally);
}

TEST_P(ExactLp, minimax_bracket_encloses_the_exact_fit) {
  qsopt::start();
  for (const std::size_t p : {1, 2, 4, 8}) {
    exact_lp::Problem each = exact_lp::problem(GetParam(), p, 1);
    each.rows.dy.setZero();
    const mpq_class exact = qsopt::exact_minimax(each.rows, each.prior, each.rows.y.cwiseAbs().maxCoeff());
    core::RegressionTable table(each.rows);
    const MinimaxFit fit = minimax_fit(table, each.prior);
    EXPECT_TRUE(mpq_class(fit.lower) <= exact) << p << ": by " << mpq_class(fit.lower - exact).get_d();
    EXPECT_TRUE(exact <= mpq_class(fit.upper)) << p << ": by " << mpq_class(exact - fit.upper).get_d();
    EXPECT_TRUE(fit.converged) << p << ": " << fit.lower << ", " << fit.upper;
  }
}

class SlowExactLp : public ::testing::TestWithParam<Family> {};

TEST_P(SlowExactLp, bounds_are_never_inside_and_tight) {
  qsopt::start();
  Tally tally;
  for (std::size_t p = 1; p <= 12; ++p) {
    for (std::uint64_t seed = 1; seed <= (p <= 6 ? 8U : 1U); ++seed) {
      judge_one(tally, GetParam(), p, seed, 1);
    }
  }
  RecordProperty("summary", summary(tally));
  expect_exact(tally);
}

std::string test_name(const ::testing::TestParamInfo<Family>& info) {
  std::string name = exact_lp::name_of(info.param);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Families, ExactLp, ::testing::ValuesIn(exact_lp::families), test_name);
INSTANTIATE_TEST_SUITE_P(Families, SlowExactLp, ::testing::ValuesIn(exact_lp::families), test_name);

}  // namespace
}  // namespace wheelwright::bounds::exact_lp_test
