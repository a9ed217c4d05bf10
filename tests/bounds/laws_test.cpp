// SPDX-License-Identifier: Apache-2.0
// Laws of a set of parameters, for every kind of set.
#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "tests/bounds/parameter_set.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::laws_test {
namespace {

using testing_rows::Random;
using testing_rows::Rows;

/// Makers of a set from a seed; `shrink` in (0, 1] gives a subset of what 1 gives.
struct MakeBox {
  static Box make(std::uint64_t seed, std::size_t p, double shrink) {
    Random random(seed);
    Box box;
    for (std::size_t j = 0; j < p; ++j) {
      const double centre = random.symmetric(), half = 0.1 + random.unit();
      box.sides.push_back({centre - shrink * half, centre + shrink * half});
    }
    return box;
  }
};

template <std::size_t Limit>
struct MakePolytope {
  static Polytope make(std::uint64_t seed, std::size_t p, double shrink) {
    Random random(seed);
    std::vector<HalfSpace> rows;
    const std::vector<double> centre = random.vector(p);
    for (std::size_t r = 0; r < 4 * p; ++r) {
      const std::vector<double> a = random.vector(p);
      HalfSpace row{Eigen::Map<const Eigen::VectorXd>(a.data(), static_cast<Eigen::Index>(p)), 0.0, {}};
      row.b = row.a.dot(Eigen::Map<const Eigen::VectorXd>(centre.data(), static_cast<Eigen::Index>(p))) +
              shrink * (0.05 + random.unit());
      rows.push_back(row);
    }
    return {rows, testing_rows::cube(p, 50.0), {Limit}};
  }
};

Eigen::VectorXd vector(Random& random, std::size_t p) {
  const std::vector<double> x = random.vector(p);
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(p));
}

static_assert(ParameterSet<Box> && ParameterSet<Polytope>);

template <class Maker>
class SupportFunction : public ::testing::Test {};
using Makers = ::testing::Types<MakeBox, MakePolytope<4096>, MakePolytope<0>>;  // the latter works by linear programs
TYPED_TEST_SUITE(SupportFunction, Makers);

/// Relative to the size of the set in both directions, as h alone may be near zero; facets may be shifted by 1e-10.
template <class Set>
double tolerance(const Set& set, const std::vector<double>& a) {
  std::vector<double> opposite(a);
  for (double& x : opposite) {
    x = -x;
  }
  return 1e-8 * (set.support(a) + set.support(opposite)) + 1e-12;
}

TYPED_TEST(SupportFunction, is_sublinear) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto set = TypeParam::make(p, p, 1.0);
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p), b = random.vector(p);
      std::vector<double> sum(p);
      for (std::size_t j = 0; j < p; ++j) {
        sum[j] = a[j] + b[j];
      }
      EXPECT_LE(set.support(sum), set.support(a) + set.support(b) + tolerance(set, sum));
    }
  }
}

TYPED_TEST(SupportFunction, is_positively_homogeneous) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto set = TypeParam::make(p, p, 1.0);
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p);
      const double factor = std::pow(10.0, 4.0 * random.symmetric());
      std::vector<double> scaled(a);
      for (double& x : scaled) {
        x *= factor;
      }
      EXPECT_NEAR(set.support(scaled), factor * set.support(a), factor * tolerance(set, a));
    }
    EXPECT_EQ(set.support(std::vector<double>(p, 0.0)), 0.0);
  }
}

TYPED_TEST(SupportFunction, is_smaller_for_a_subset) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto large = TypeParam::make(p, p, 1.0);
    const auto small = TypeParam::make(p, p, 0.5);
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p);
      EXPECT_LE(small.support(a), large.support(a) + tolerance(large, a));
    }
  }
}

TYPED_TEST(SupportFunction, is_attained) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto set = TypeParam::make(p, p, 1.0);
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p);
      std::vector<double> at(p);
      const double value = set.support(a, at);
      double reached = 0.0;
      for (std::size_t j = 0; j < p; ++j) {
        reached += a[j] * at[j];
      }
      EXPECT_NEAR(reached, value, tolerance(set, a));
      for (int other = 0; other < 5; ++other) {
        const std::vector<double> b = random.vector(p);
        double product = 0.0;
        for (std::size_t j = 0; j < p; ++j) {
          product += b[j] * at[j];
        }
        EXPECT_LE(product, set.support(b) + tolerance(set, b));
      }
    }
  }
}

TYPED_TEST(SupportFunction, and_membership_agree) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto set = TypeParam::make(p, p, 1.0);
    ASSERT_EQ(set.dimension(), p);
    const std::vector<double> centre = set.centre();
    EXPECT_TRUE(set.contains(centre));
    Random random(p);
    for (int trial = 0; trial < 20; ++trial) {
      const std::vector<double> a = random.vector(p);
      std::vector<double> at(p), inside(p), outside(p);
      const double value = set.support(a, at);
      EXPECT_EQ(value, set.support(a));
      double middle = 0.0;
      for (std::size_t j = 0; j < p; ++j) {
        inside[j] = centre[j] + (1.0 - 1e-6) * (at[j] - centre[j]);
        outside[j] = centre[j] + 1.001 * (at[j] - centre[j]);
        middle += a[j] * centre[j];
      }
      EXPECT_TRUE(set.contains(inside)) << p;
      EXPECT_FALSE(set.contains(outside)) << p;
      EXPECT_LE(middle, value + tolerance(set, a));
    }
    std::vector<double> undefined(centre);
    undefined.back() = std::nan("");
    EXPECT_FALSE(set.contains(undefined));
  }
}

TYPED_TEST(SupportFunction, gives_widths_that_no_direction_reverses) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const auto set = TypeParam::make(p, p, 1.0);
    Random random(p);
    Eigen::MatrixXd directions(p, 20);
    for (Eigen::Index k = 0; k < directions.cols(); ++k) {
      directions.col(k) = vector(random, p);
      const Eigen::VectorXd opposite = -directions.col(k);
      const double across = width(set, std::span<const double>(directions.col(k).data(), p));
      EXPECT_GE(across, 0.0);
      EXPECT_EQ(across, width(set, std::span<const double>(opposite.data(), p)));
    }
  }
}

TEST(Box, contains_its_sides_and_nothing_beyond) {
  const Box box{{{0.0, 1.0}, {-2.0, 3.0}}};
  EXPECT_TRUE(box.contains(std::vector<double>{0.0, 3.0}));
  EXPECT_FALSE(box.contains(std::vector<double>{core::round_up(1.0), 0.0}));
  EXPECT_FALSE(box.contains(std::vector<double>{0.5, std::nan("")}));
  EXPECT_EQ(hull(box, Box{{{0.5, 2.0}, {0.0, 0.0}}}), (Box{{{0.0, 2.0}, {-2.0, 3.0}}}));
  EXPECT_THROW(check_finite(Box{{{1.0, 0.0}}}, "box"), InvalidArgument);
}

TEST(Polytope, vertices_agree_with_linear_programs) {
  for (std::size_t p = 1; p <= 6; ++p) {
    const Polytope by_vertices = MakePolytope<4096>::make(p, p, 1.0), by_programs = MakePolytope<0>::make(p, p, 1.0);
    ASSERT_TRUE(by_vertices.has_vertices()) << p;
    ASSERT_FALSE(by_programs.has_vertices());
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const std::vector<double> a = random.vector(p);
      EXPECT_NEAR(by_vertices.support(a), by_programs.support(a), tolerance(by_programs, a));
      EXPECT_LE(by_vertices.support(a), by_vertices.hull().support(a));
      EXPECT_LE(by_programs.support(a), by_programs.hull().support(a));
    }
  }
}

TEST(Polytope, chebyshev_centre_is_a_member_whatever_the_units) {
  for (std::size_t p = 1; p <= 5; ++p) {
    const Polytope polytope = MakePolytope<4096>::make(p, p, 1.0);
    EXPECT_TRUE(polytope.contains(polytope.chebyshev_centre()));
    std::vector<HalfSpace> scaled = polytope.facets();
    Box box = testing_rows::cube(p, 50.0);
    for (std::size_t j = 0; j < p; ++j) {
      const double unit = j % 2 == 0 ? 0x1.0p20 : 0x1.0p-20;
      for (HalfSpace& row : scaled) {
        row.a[static_cast<Eigen::Index>(j)] /= unit;
      }
      box.sides[j] = {-50.0 * unit, 50.0 * unit};
    }
    const Polytope other(scaled, box);
    ASSERT_EQ(other.blocks().size(), polytope.blocks().size());
    for (std::size_t b = 0; b < other.blocks().size(); ++b) {
      EXPECT_NEAR(other.blocks()[b].chebyshev_radius, polytope.blocks()[b].chebyshev_radius, 1e-7);
    }
  }
}

TEST(Polytope, rejects_the_empty_set_and_bad_shapes) {
  const std::vector<HalfSpace> contradictory{{Eigen::Vector2d(1.0, 1.0), -5.0, {}}};
  EXPECT_THROW(Polytope(contradictory, Box{{{0.0, 1.0}, {0.0, 1.0}}}), InvalidArgument);
  EXPECT_THROW(Polytope({{Eigen::Vector3d::Ones(), 1.0, {}}}, testing_rows::cube(2, 1.0)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::bounds::laws_test
