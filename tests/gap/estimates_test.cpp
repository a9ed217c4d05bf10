// SPDX-License-Identifier: Apache-2.0
// Oracle: the simulator's own numbers, and the axioms of Shapley's value.
#include "gap/causes/estimates.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::estimates_test {
namespace {

using gap_example::noisy_scenario;
using gap_example::only;
using gap_example::prepared_log;
using gap_example::Problem;
using gap_example::robot_with;

FittedCauses fitted_single(const PreparedGap& prepared, BaseModel base = BaseModel::refitted) {
  const Problem problem(prepared);
  CauseSearchOptions search;
  search.largest = 1;
  return fit_causes(prepared, problem.problem, search_causes(problem.problem.table, search)[1].front(), base, {});
}

struct Coverage {
  std::string effect, parameter;
  double truth;
  double clock = 0.0;  // half of what the interval has in any case: a tenth of the log's step
};

class Intervals : public testing::TestWithParam<Coverage> {};

// 54 of 60, and the intervals are no barn doors.
TEST_P(Intervals, HoldTheTruth) {
  const Coverage& c = GetParam();
  DiagnoseOptions options;
  options.catalogue = only({c.effect});
  int covered = 0;
  double widths = 0.0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Scenario s = noisy_scenario(robot_with(c.effect, {{c.parameter, c.truth}}), seed);
    s.duration = 27.0;
    const FittedCauses fitted = fitted_single(prepared_log(s, false, options));
    const GapEstimate& number = fitted.numbers[0][0];
    ASSERT_EQ(number.name, c.parameter);
    covered += number.lower <= c.truth && c.truth <= number.upper ? 1 : 0;
    widths += number.upper - number.lower;
    EXPECT_NEAR(0.5 * (number.lower + number.upper), number.estimate, 1e-9 * c.truth);
  }
  EXPECT_GE(covered, 54);
  EXPECT_LE(widths / 60.0, 0.1 * c.truth + 2.0 * c.clock);
}

INSTANTIATE_TEST_SUITE_P(FitCauses, Intervals,
                         testing::Values(Coverage{"coulomb", "c", 0.3},
                                         Coverage{"actuator_lag", "T", 0.03, 0.1 / 50.0}),
                         [](const testing::TestParamInfo<Coverage>& given) { return given.param.effect; });

// A lag in the middle between two points of its grid.
struct BetweenPoints {
  double truth = 0.0, to_the_next = 0.0;
  PreparedGap prepared;

  explicit BetweenPoints(bool with_baseline) {
    DiagnoseOptions options;
    options.catalogue = only({"actuator_lag"});
    const PreparedGap healthy = prepared_log(noisy_scenario(gap_example::counted_robot(), 1), false, options);
    std::vector<double> grid;
    for (const std::vector<double>& point : shape_grid(options.catalogue->front(), healthy.drive)) {
      grid.push_back(point[0]);
    }
    const auto above = std::lower_bound(grid.begin(), grid.end(), 0.03);
    truth = 0.5 * (*std::prev(above) + *above);
    to_the_next = *above - truth;
    prepared = prepared_log(noisy_scenario(robot_with("actuator_lag", {{"T", truth}}), 2), with_baseline, options);
  }
};

TEST(FitCauses, FindsShapesBetweenTheGridsPoints) {
  const BetweenPoints lag(false);
  EXPECT_NEAR(fitted_single(lag.prepared).effects[0].shape[0], lag.truth, 0.2 * lag.to_the_next);
}

TEST(AddShapesWithThetaHeld, FindsThoseBetweenTheGridsPoints) {
  const BetweenPoints lag(true);
  const Problem problem(lag.prepared);
  ShapeGrids grids = all_shapes(lag.prepared.catalogue, lag.prepared.drive);
  const std::size_t before = grids.front().size();
  add_shapes_with_theta_held(grids, lag.prepared, problem.problem, {});
  EXPECT_EQ(grids.front().size(), before) << "of no causes";
  const CauseSet found = problem.select().structural;
  ASSERT_EQ(found.members.size(), 1U);
  add_shapes_with_theta_held(grids, lag.prepared, problem.problem, found);
  ASSERT_EQ(grids.front().size(), before + 1);
  EXPECT_NEAR(grids.front().back()[0], lag.truth, 0.2 * lag.to_the_next);
}

TEST(FitCauses, GivesThetaBesideTheCausesOrHoldsIt) {
  DiagnoseOptions options;
  options.catalogue = only({"coulomb"});
  const PreparedGap prepared = prepared_log(noisy_scenario(robot_with("coulomb", {{"c", 0.3}}), 5), false, options);
  const FittedCauses free = fitted_single(prepared), held = fitted_single(prepared, BaseModel::nominal);
  const double mass = 0.0975 * 21.0;
  EXPECT_NEAR(free.theta[0], mass, std::max(4.0 * free.theta_error[0], 0.01 * mass));
  EXPECT_GT(free.theta_error[0], 0.0);
  EXPECT_EQ(held.theta, prepared.theta);
  EXPECT_TRUE((held.theta_error.array() == 0.0).all());
  EXPECT_NEAR(held.effects[0].coefficients[0], 0.3, 0.01);
  EXPECT_LT(held.intervals[0][0].upper - held.intervals[0][0].lower,
            free.intervals[0][0].upper - free.intervals[0][0].lower);
}

struct ThreeCauses {
  std::vector<RowSpace> spaces;
  CandidateTable table;

  // `alike`: of the first two columns.
  explicit ThreeCauses(double alike) {
    std::mt19937_64 generator(9);
    std::normal_distribution<double> normal;
    const Eigen::Index rows = 2000;
    const auto random = [&] {
      Eigen::VectorXd x(rows);
      for (double& value : x) {
        value = normal(generator);
      }
      return x;
    };
    RowSpace space;
    space.name = "made up";
    space.t = Eigen::VectorXd::LinSpaced(rows, 0.0, 60.0);
    space.columns = {random(), random(), random(), random()};
    space.columns[2] = alike * space.columns[1] + std::sqrt(1.0 - alike * alike) * space.columns[2];
    space.response = 0.5 * space.columns[0] + 2.0 * space.columns[1] + 1.0 * space.columns[2] + random();
    table.base = table.unknown = {0};
    for (std::size_t e = 0; e < 3; ++e) {
      table.names.push_back(std::to_string(e));
      table.candidates.push_back({e, {}, {e + 1}, {0}, false});
    }
    spaces.push_back(std::move(space));
  }
};

TEST(ShapleyShares, AddUpToWhatIsExplained) {
  for (const double alike : {0.0, 0.5, 0.95}) {
    ThreeCauses made(alike);
    const BlockGram gram(made.spaces);
    made.table.gram = &gram;
    const CauseSet nothing = evaluate(made.table, {}, BaseModel::refitted);
    const CauseSet all = evaluate(made.table, {0, 1, 2}, BaseModel::refitted);
    const double gap = nothing.held_out_error - 1.0;
    const std::vector<double> shares = shapley_shares(made.table, all, BaseModel::refitted, gap);
    EXPECT_NEAR(std::accumulate(shares.begin(), shares.end(), 0.0), (nothing.held_out_error - all.held_out_error) / gap,
                1e-12);
    EXPECT_NEAR(shares[2], 0.0, 0.01);  // it does nothing
    EXPECT_GT(shares[0], shares[1]);
  }
}

TEST(ShapleyShares, AreEachCausesOwnWhereTheyDoNotOverlapAndTheMeanOfBothOrdersWhereTheyDo) {
  ThreeCauses made(0.0);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  const auto error = [&](const std::vector<std::size_t>& members) {
    return evaluate(made.table, members, BaseModel::refitted).held_out_error;
  };
  const CauseSet both = evaluate(made.table, {0, 1}, BaseModel::refitted);
  const std::vector<double> shares = shapley_shares(made.table, both, BaseModel::refitted, 5.0);
  EXPECT_NEAR(shares[0], 4.0 / 5.0, 0.08);  // 2² of 2² + 1²
  EXPECT_NEAR(shares[1], 1.0 / 5.0, 0.04);
  EXPECT_NEAR(shares[0], 0.5 * (error({}) - error({0}) + error({1}) - error({0, 1})) / 5.0, 1e-12);
}

}  // namespace
}  // namespace wheelwright::gap::estimates_test
