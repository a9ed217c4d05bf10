// SPDX-License-Identifier: Apache-2.0
// Each step that rounds a bound outward, against rationals with zero tolerance and where nothing else hides it: sets
// far from the origin and directions across it, so that products cancel; optima that are no doubles; multipliers that
// cancel. tests/campaigns/mutate_rounding.sh takes the steps away one by one, and these tests have to notice.
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "bounds/certificate.hpp"
#include "bounds/feasible_set.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/polytope.hpp"
#include "bounds/slab_rows.hpp"
#include "bounds/support_table.hpp"
#include "bounds/support_walk.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::rounding_test {
namespace {

using exact::Rational;
using exact::rational;
using testing_rows::Random;

/// A small set far from the origin: `groups` of q parameters each that no row couples with another. Thin: a large one,
/// a hundred million times as long as it is thick.
struct Far {
  std::vector<HalfSpace> rows;
  Box box;
  std::vector<double> centre, across;
  std::vector<std::vector<std::vector<Rational>>> vertices;  // of each group
  std::size_t q = 0;
  bool slim = false;

  Far(std::uint64_t seed, std::size_t groups, std::size_t parameters, bool thin = false) : q(parameters), slim(thin) {
    Random random(seed);
    const std::size_t p = groups * q;
    const double size = std::pow(10.0, thin ? 3.0 : -6.0 * random.unit());
    for (std::size_t j = 0; j < p; ++j) {
      centre.push_back((thin ? 1e-6 : 300.0) * random.symmetric());
      box.sides.push_back({centre[j] - 4.0 * size, centre[j] + 4.0 * size});
    }
    for (std::size_t g = 0; g < groups; ++g) {
      std::vector<HalfSpace> own;
      Box part;
      for (std::size_t j = 0; j < q; ++j) {
        part.sides.push_back(box.sides[g * q + j]);
      }
      std::vector<double> normal = random.vector(q);
      across.insert(across.end(), normal.begin(), normal.end());
      for (int r = 0; r < 8 && q > 1; ++r) {
        const bool wide = !thin || r > 3;
        HalfSpace small{Eigen::VectorXd(static_cast<Eigen::Index>(q)), 0.0, {}};
        HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p)),
                      size * (wide ? 1.0 : 1e-8) * (0.5 + random.unit()),
                      {}};
        for (std::size_t j = 0; j < q; ++j) {
          const double a =
              wide ? random.symmetric() : (r % 2 == 0 ? 1.0 : -1.0) * (normal[j] + 1e-10 * random.symmetric());
          small.a[static_cast<Eigen::Index>(j)] = row.a[static_cast<Eigen::Index>(g * q + j)] = a;
          row.b += a * centre[g * q + j];
        }
        small.b = row.b;
        own.push_back(small);
        rows.push_back(row);
      }
      vertices.push_back(exact::vertices(exact::rows_of(own, part), q));
    }
  }

  // Across the set half of the time: a·θ is then near zero and its terms are not.
  [[nodiscard]] std::vector<double> direction(Random& random, bool cancels) const {
    std::vector<double> a = random.vector(centre.size());
    if (slim && cancels) {
      for (std::size_t j = 0; j < a.size(); ++j) {
        a[j] = across[j] + 1e-10 * a[j];
      }
      return a;
    }
    double along = 0.0, square = 0.0;
    for (std::size_t j = 0; j < a.size(); ++j) {
      along += a[j] * centre[j];
      square += centre[j] * centre[j];
    }
    for (std::size_t j = 0; cancels && j < a.size(); ++j) {
      a[j] -= centre[j] * along / square;
    }
    return a;
  }

  [[nodiscard]] Rational support(const std::vector<double>& a) const {
    Rational sum = 0;
    for (std::size_t g = 0; g < vertices.size(); ++g) {
      std::vector<Rational> part;
      for (std::size_t j = 0; j < q; ++j) {
        part.push_back(rational(a[g * q + j]));
      }
      Rational best = exact::dot(part, vertices[g].front());
      for (const auto& vertex : vertices[g]) {
        const Rational value = exact::dot(part, vertex);
        best = value > best ? value : best;
      }
      sum += best;
    }
    return sum;
  }
};

using Support = std::function<double(const std::vector<double>&)>;

void expect_outward(const std::function<Support(const Far&)>& support_of, bool thin = false) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    for (const auto& [groups, q] : {std::pair<std::size_t, std::size_t>{1, 2}, {1, 3}, {2, 2}, {3, 1}, {1, 1}}) {
      const Far far(seed, groups, q, thin);
      const Support support = support_of(far);
      Random random(seed + 100);
      for (int k = 0; k < 60; ++k) {
        const std::vector<double> a = far.direction(random, k % 2 == 1);
        ASSERT_TRUE(far.support(a) <= rational(support(a))) << groups << " of " << q << ", seed " << seed << ", " << k;
      }
    }
  }
}

TEST(Rounding, SupportOfAPolytope) {
  expect_outward([](const Far& far) -> Support {
    return [set = Polytope(far.rows, far.box)](const std::vector<double>& a) { return set.support(a); };
  });
}

TEST(Rounding, SupportOfATable) {
  for (const std::size_t budget : {0, 64}) {
    expect_outward([budget](const Far& far) -> Support {
      auto table = std::make_shared<SupportTable>(
          SupportTable::make(Polytope(far.rows, far.box), {.slots = 1, .budget = budget}).value());
      return [table](const std::vector<double>& a) { return table->support(a); };
    });
  }
}

TEST(Rounding, SupportOfATableAcrossAThinSet) {
  expect_outward(
      [](const Far& far) -> Support {
        auto table =
            std::make_shared<SupportTable>(SupportTable::make(Polytope(far.rows, far.box), {.slots = 1}).value());
        return [table](const std::vector<double>& a) { return table->support(a); };
      },
      true);
}

TEST(Rounding, SupportOfAWalk) {
  for (const std::size_t budget : {0, 64}) {
    expect_outward([budget](const Far& far) -> Support {
      auto walk = std::make_shared<SupportWalk>(Polytope(far.rows, far.box),
                                                SupportWalkOptions{.slots = 1, .budget = budget, .few = 0});
      return [walk](const std::vector<double>& a) { return walk->support(a); };
    });
  }
}

TEST(Rounding, SupportOfAWalkAcrossAThinSet) {
  expect_outward(
      [](const Far& far) -> Support {
        auto walk =
            std::make_shared<SupportWalk>(Polytope(far.rows, far.box), SupportWalkOptions{.slots = 1, .few = 0});
        return [walk](const std::vector<double>& a) { return walk->support(a); };
      },
      true);
}

// A block without a list of vertices has the support of its sides.
TEST(Rounding, SupportOfSidesAlone) {
  expect_outward([](const Far& far) -> Support {
    Polytope::Block block;
    for (std::size_t j = 0; j < far.centre.size(); ++j) {
      block.parameters.push_back(j);
    }
    return [block, box = far.box](const std::vector<double>& a) { return support_of_vertices(block, box, a); };
  });
}

TEST(Rounding, SupportOfAWalkThatLooksThroughItsVertices) {
  expect_outward([](const Far& far) -> Support {
    auto walk = std::make_shared<SupportWalk>(Polytope(far.rows, far.box), SupportWalkOptions{.slots = 1, .few = 64});
    return [walk](const std::vector<double>& a) { return walk->support(a); };
  });
}

// Directions so small that their products underflow.
TEST(Rounding, SupportInTheTiniestDirections) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Far far(seed, 1, 2);
    SupportTable table = SupportTable::make(Polytope(far.rows, far.box), {.slots = 1}).value();
    SupportWalk walk(Polytope(far.rows, far.box), {.slots = 1, .few = 0});
    for (int k = 0; k < 20; ++k) {
      std::vector<double> a = far.direction(random, k % 2 == 1);
      for (double& x : a) {
        x *= 1e-320;
      }
      const Rational exact = far.support(a);
      EXPECT_TRUE(exact <= rational(table.support(a))) << seed << ' ' << k;
      EXPECT_TRUE(exact <= rational(walk.support(a))) << seed << ' ' << k;
    }
  }
}

// max θ subject to aθ <= b is b/a, mostly no double: λ = 1/a is rounded, and so is what it proves.
TEST(Rounding, CertificateOfAQuotient) {
  Random random(3);
  const std::vector<double> axis{1.0};
  for (int k = 0; k < 2000; ++k) {
    const double a = 1.0 + random.unit(), b = random.unit();
    const WeightedRow row{{Eigen::VectorXd::Constant(1, a), b, {}}, 1.0 / a};
    const std::vector<WeightedRow> rows{row};
    // A box that does not help, and one that ends just beyond the answer, so that next to nothing is added.
    for (const double end : {2.0, core::round_up(core::round_up(b / a))}) {
      const double bound = certified_upper_bound(axis, rows, Box{{{0.0, end}}});
      ASSERT_TRUE(rational(b) / rational(a) <= rational(bound)) << k << ' ' << end;
    }
  }
}

// Opposite rows with multipliers of 2¹²⁰: of a − Aᵀλ = a nothing is left in 113 bits, and yet max a·θ = 1.
TEST(Rounding, CertificateOfMultipliersThatCancel) {
  const std::vector<double> first{1.0, 0.0};
  const Eigen::Vector2d equal(1.0, -1.0);
  const std::vector<WeightedRow> rows{{{equal, 0.0, {}}, 0x1p120}, {{-equal, 0.0, {}}, 0x1p120}};
  EXPECT_GE(certified_upper_bound(first, rows, Box{{{-1.0, 1.0}, {-1.0, 1.0}}}), 1.0);
}

// The same through the whole engine: the hull of aθ <= b, and of |y − aθ| <= dy.
TEST(Rounding, HullOfOneRow) {
  Random random(4);
  for (int k = 0; k < 400; ++k) {
    const double a = 0.5 + random.unit(), y = random.symmetric(), dy = 0.01 * random.unit();
    core::RegressionTable table = testing_rows::Rows(1).add({a}, y, dy).table();
    const Box prior{{{-16.0, 16.0}}};
    const Rational low = (rational(y) - rational(dy)) / rational(a), high = (rational(y) + rational(dy)) / rational(a);
    const IntervalHull hull = interval_hull(static_cast<core::RegressionSource&>(table), prior);
    ASSERT_FALSE(hull.empty);
    EXPECT_TRUE(rational(hull.hull.sides[0].lower) <= low && high <= rational(hull.hull.sides[0].upper)) << k;
    const Polytope set({{Eigen::VectorXd::Constant(1, a), y, {}}}, prior);
    EXPECT_TRUE(rational(y) / rational(a) <= rational(set.hull().sides[0].upper)) << k;
  }
}

// A row |y − Y°θ| <= dy, |Y° − Y| <= dY that its worst Y° meets with equality as nearly as a double y can say: θ stays.
TEST(Rounding, RowsWithErrorsInVariables) {
  Random random(11);
  Box prior;
  prior.sides = {{0.0, 3.0}, {-3.0, 0.0}, {-1.3, 2.9}};
  const SlabRows slabs(prior);
  for (int trial = 0; trial < 4000; ++trial) {
    const double size = trial % 8 < 4 ? 0.1 : 1e-5;
    std::vector<double> Y = random.vector(3), dY{size * random.unit(), size * random.unit(), size * random.unit()};
    // An open sign is exact at the ends of its side and at zero; in between it is relaxed to a chord.
    const double open = trial % 2 == 0 ? -1.3 : 2.9;
    const std::vector<double> theta{3.0 * random.unit(), -3.0 * random.unit(), open};
    // Terms that cancel, so that y is small and its own rounding hides nothing.
    Y[1] = -(Y[0] * theta[0] + Y[2] * theta[2]) / theta[1];
    const double dy = size * random.unit(), side = trial % 4 < 2 ? 1.0 : -1.0;
    Rational product = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const double sign = side * (theta[j] >= 0.0 ? 1.0 : -1.0);
      product += (rational(Y[j]) - rational(sign) * rational(dY[j])) * rational(theta[j]);
    }
    // side = 1: the largest of Y°θ − dy that y may not be below; the other way round for −1. Rounded into what is
    // allowed.
    const Rational limit = product - rational(side) * rational(dy);
    auto y = static_cast<double>(limit);
    while (rational(side) * rational(y) < rational(side) * limit) {
      y = side > 0.0 ? core::round_up(y) : core::round_down(y);
    }
    HalfSpace upper, lower;
    slabs.half_spaces(Y, dY, y, dy, {}, upper, lower);
    for (const HalfSpace& row : {upper, lower}) {
      Rational left = 0;
      for (std::size_t j = 0; j < 3; ++j) {
        left += rational(row.a[static_cast<Eigen::Index>(j)]) * rational(theta[j]);
      }
      ASSERT_TRUE(left <= rational(row.b)) << trial;
    }
  }
}

}  // namespace
}  // namespace wheelwright::bounds::rounding_test
