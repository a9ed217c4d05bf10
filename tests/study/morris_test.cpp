// SPDX-License-Identifier: Apache-2.0
/// \file
/// Elementary effects of functions whose effects are known at every point of the grid.
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>
#include <boost/math/distributions/binomial.hpp>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "study/global_sensitivity.hpp"
#include "tests/study/test_functions.hpp"

namespace wheelwright::study::morris_test {
namespace {

namespace example = sensitivity_example;

std::vector<ElementaryEffects> effects(const example::TestFunction& f, const MorrisOptions& options = {}) {
  return morris_effects(example::evaluate(f, morris_design(f.inputs, options)), f.inputs, options).at(0);
}

TEST(MorrisDesign, MovesEachInputOnceByTheStep) {
  for (const Eigen::Index levels : {2, 4, 8}) {
    const double step = static_cast<double>(levels) / (2.0 * static_cast<double>(levels - 1));
    const Eigen::MatrixXd design = morris_design(5, {.trajectories = 30, .levels = levels});
    ASSERT_EQ(design.rows(), 30 * 6);
    std::set<double> seen;
    for (Eigen::Index row = 0; row < design.rows(); ++row) {
      for (Eigen::Index i = 0; i < 5; ++i) {
        const double level = design(row, i) * static_cast<double>(levels - 1);
        EXPECT_NEAR(level, std::round(level), 1e-12);
        EXPECT_TRUE(design(row, i) >= 0.0 && design(row, i) <= 1.0);
        seen.insert(std::round(level));
      }
    }
    EXPECT_EQ(seen.size(), static_cast<std::size_t>(levels));
    for (Eigen::Index r = 0; r < 30; ++r) {
      std::set<Eigen::Index> moved;
      for (Eigen::Index m = 0; m < 5; ++m) {
        const Eigen::ArrayXd change = (design.row(6 * r + m + 1) - design.row(6 * r + m)).transpose().array();
        Eigen::Index i = 0;
        EXPECT_NEAR(change.abs().maxCoeff(&i), step, 1e-15);
        EXPECT_EQ((change != 0.0).count(), 1);
        moved.insert(i);
      }
      EXPECT_EQ(moved.size(), 5U);
    }
  }
}

// Up and down, first and last: each of them in half, or a fifth, of 2000 trajectories.
TEST(MorrisDesign, IsBalanced) {
  const Eigen::MatrixXd design = morris_design(5, {.trajectories = 2000});
  int up = 0, first = 0;
  for (Eigen::Index r = 0; r < 2000; ++r) {
    up += design(6 * r + 5, 2) > design(6 * r, 2) ? 1 : 0;
    first += design(6 * r + 1, 2) != design(6 * r, 2) ? 1 : 0;
  }
  EXPECT_NEAR(up, 1000, 4.0 * std::sqrt(2000 * 0.25));
  EXPECT_NEAR(first, 400, 4.0 * std::sqrt(2000 * 0.16));
}

TEST(MorrisDesign, DependsOnTheSeedAndGrows) {
  const Eigen::MatrixXd once = morris_design(4, {.trajectories = 10, .seed = 3});
  EXPECT_EQ(once, morris_design(4, {.trajectories = 10, .seed = 3}));
  EXPECT_NE(once, morris_design(4, {.trajectories = 10, .seed = 4}));
  EXPECT_EQ(once, morris_design(4, {.trajectories = 25, .seed = 3}).topRows(once.rows()));
}

TEST(MorrisEffects, OfALinearFunctionAreItsCoefficients) {
  const Eigen::Vector4d c(4.0, -3.0, 0.5, 0.0);
  const auto found = effects(example::additive(c));
  for (Eigen::Index i = 0; i < 4; ++i) {
    const ElementaryEffects& e = found[static_cast<std::size_t>(i)];
    EXPECT_NEAR(e.mean, c[i], 1e-13);
    EXPECT_NEAR(e.mean_absolute, std::abs(c[i]), 1e-13);
    EXPECT_NEAR(e.deviation, 0.0, 1e-13);
    EXPECT_NEAR(e.lower, std::abs(c[i]), 1e-13);
    EXPECT_NEAR(e.upper, std::abs(c[i]), 1e-13);
    EXPECT_EQ(e.effects, 20);
  }
}

// x y on {−1, 1}²: an effect of x is 2 y, whose mean is 0 and whose size is 2.
TEST(MorrisEffects, ShowAnInteraction) {
  const example::TestFunction f{
      "product", 3, [](const Eigen::VectorXd& u) { return (2.0 * u[0] - 1.0) * (2.0 * u[1] - 1.0) + u[2]; }, {}, {}};
  const auto found = effects(f, {.trajectories = 200, .levels = 2});
  for (const std::size_t i : {0U, 1U}) {
    EXPECT_NEAR(found[i].mean, 0.0, 4.0 * 2.0 / std::sqrt(200.0));
    EXPECT_NEAR(found[i].mean_absolute, 2.0, 1e-13);
    EXPECT_NEAR(found[i].deviation, 2.0, 0.1);
  }
  EXPECT_NEAR(found[2].deviation, 0.0, 1e-13);
}

// The exact μ* is a mean over the points of the grid from which an input can go up.
TEST(MorrisEffects, HaveIntervalsThatHoldTheExactMean) {
  constexpr int seeds = 200;
  const auto f = example::ishigami();
  const Grid grid{{4, 4, 4}, Eigen::Vector3d::Zero()};
  const Eigen::MatrixXd points = grid_design(grid);
  Eigen::Vector3d exact = Eigen::Vector3d::Zero();
  for (Eigen::Index n = 0; n < points.rows(); ++n) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      Eigen::VectorXd from = points.row(n), to = from;
      to[i] += 2.0 / 3.0;
      if (to[i] < 1.0 + 1e-9) {
        exact[i] += std::abs(f.value(to) - f.value(from)) / (2.0 / 3.0) / 32.0;
      }
    }
  }
  for (const Eigen::Index trajectories : {10, 20, 100}) {
    std::vector<int> hits(3, 0);
    for (int seed = 1; seed <= seeds; ++seed) {
      const auto found = effects(f, {.trajectories = trajectories, .seed = static_cast<std::uint64_t>(seed)});
      for (std::size_t i = 0; i < 3; ++i) {
        const double mean = exact[static_cast<Eigen::Index>(i)];
        hits[i] += found[i].lower - 1e-9 <= mean && mean <= found[i].upper + 1e-9 ? 1 : 0;
      }
    }
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_GE(hits[i], boost::math::quantile(boost::math::binomial(seeds, 0.95), 1e-4))
          << "input " << i << ", " << trajectories << " trajectories";
    }
  }
}

TEST(MorrisEffects, AreCountedWhereValuesAreMissing) {
  const auto f = example::additive(Eigen::Vector3d(1.0, 2.0, 3.0));
  const MorrisOptions options{.trajectories = 6};
  Eigen::MatrixXd values = example::evaluate(f, morris_design(3, options)).replicate(1, 3);
  values(1, 0) = core::kNan;                          // the end of one move, the start of the next
  values.col(1).tail(5 * 4).setConstant(core::kNan);  // one trajectory is left
  values.col(2).setConstant(std::numeric_limits<double>::infinity());
  const auto found = morris_effects(values, 3, options);
  Eigen::Index count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double c = static_cast<double>(i + 1);
    count += found[0][i].effects;
    EXPECT_NEAR(found[0][i].mean_absolute, c, 1e-12);
    EXPECT_EQ(found[1][i].effects, 1);
    EXPECT_NEAR(found[1][i].mean, c, 1e-12);
    EXPECT_TRUE(std::isnan(found[1][i].upper));
    EXPECT_EQ(found[2][i].effects, 0);
    EXPECT_TRUE(std::isnan(found[2][i].mean_absolute));
  }
  EXPECT_EQ(count, 3 * 6 - 2);
}

TEST(MorrisEffects, RefuseWhatIsNoScreening) {
  EXPECT_THROW((void)morris_design(0), InvalidArgument);
  EXPECT_THROW((void)morris_design(2, {.trajectories = 1}), InvalidArgument);
  EXPECT_THROW((void)morris_design(2, {.levels = 5}), InvalidArgument);
  EXPECT_THROW((void)morris_design(2, {.levels = 0}), InvalidArgument);
  EXPECT_THROW((void)morris_design(2, {.confidence = core::kNan}), InvalidArgument);
  EXPECT_THROW((void)morris_effects(Eigen::MatrixXd::Zero(59, 1), 2), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::morris_test
