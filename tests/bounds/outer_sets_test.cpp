// SPDX-License-Identifier: Apache-2.0
// Ellipsoids and zonotopes around polytopes: inclusion in exact rationals, closed forms, units.
#include <limits>

#include <gtest/gtest.h>

#include <Eigen/LU>

#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/set_operations.hpp>
#include <wheelwright/bounds/zonotope.hpp>

#include "bounds/exact.hpp"
#include "bounds/rows.hpp"

namespace wheelwright::outer_sets_test {
namespace {

using exact::Rational;
using exact::rational;
using testing_rows::Random;
using Criterion = OuterEllipsoidOptions::Criterion;

Eigen::VectorXd vector(Random& random, std::size_t p) {
  const std::vector<double> x = random.vector(p);
  return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(p));
}

std::span<const double> span(const Eigen::VectorXd& a) { return {a.data(), static_cast<std::size_t>(a.size())}; }

struct Problem {
  std::vector<HalfSpace> rows;
  Box box;
};

/// Kinds: 0 generic; 1 quantised (many facets through one vertex); 2 nearly collinear columns; 3 columns from 1e-6 to
/// 1e6; 4 fewer slabs than parameters; 5 a slab of no width; 6 nearly no width; 7 far from zero.
Problem problem(std::uint64_t seed, std::size_t p, int kind) {
  Random random(seed);
  Problem result{{}, testing_rows::cube(p, 64.0)};
  Eigen::VectorXd truth = vector(random, p);
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(truth.size());
  for (std::size_t j = 0; j < p; ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    if (kind == 3) {
      scale[k] = std::pow(10.0, 6.0 * random.symmetric());
      result.box.sides[j] = {-64.0 / scale[k], 64.0 / scale[k]};
    } else if (kind == 7) {
      truth[k] += 1e9;
      result.box.sides[j] = {1e9 - 64.0, 1e9 + 64.0};
    }
  }
  const std::size_t count = kind == 4 ? p - 1 : 5;
  for (std::size_t r = 0; r < count; ++r) {
    Eigen::VectorXd a = vector(random, p);
    double half = 0.05 + random.unit(), shift = 0.5 * half * random.symmetric();
    if (kind == 1) {
      a = (4.0 * a.array()).round() / 4.0;
      half = 0.5;
      shift = 0.0;
    } else if (kind == 2) {
      a = Eigen::VectorXd(a[0] * (1.0 + 1e-7 * a.array()));
    } else if ((kind == 5 || kind == 6) && r == 0) {
      half = kind == 5 ? 0.0 : 1e-14;
      shift = 0.0;
    }
    double y = a.dot(truth) + shift;
    y = kind == 1 ? std::round(4.0 * y) / 4.0 : y;
    a = a.cwiseProduct(scale);
    result.rows.push_back({a, y + half, {}});
    result.rows.push_back({-a, half - y, {}});
  }
  return result;
}

using Point = std::vector<Rational>;

Point part(const Point& point, const std::vector<std::size_t>& parameters, const Eigen::VectorXd& centre) {
  Point result;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    result.push_back(point[parameters[k]] - rational(centre[static_cast<Eigen::Index>(k)]));
  }
  return result;
}

/// Whether u with shape u = point − centre has |u| <= 1, exactly.
bool holds(const Ellipsoid::Block& block, const Point& point) {
  const Point offset = part(point, block.parameters, block.centre);
  std::vector<exact::Row> system;
  std::vector<std::size_t> all;
  for (std::size_t k = 0; k < offset.size(); ++k) {
    exact::Row row{{}, offset[k]};
    for (Eigen::Index i = 0; i < block.shape.cols(); ++i) {
      row.a.push_back(rational(block.shape(static_cast<Eigen::Index>(k), i)));
    }
    system.push_back(row);
    all.push_back(k);
  }
  if (offset.size() == 1 && block.shape(0, 0) == 0.0) {
    return offset[0] == 0;
  }
  const auto u = exact::meet(system, all);
  return u && exact::dot(*u, *u) <= 1;
}

/// Whether n·(point − centre) <= Σ|n·generator| + Σ|n_j| radius_j, exactly, for all normals of the facets: those across
/// q − 1 generators, the radius's among them. For q <= 3 and sets with an interior.
bool holds(const Zonotope::Block& block, const Point& point) {
  const Point offset = part(point, block.parameters, block.centre);
  const std::size_t q = offset.size();
  std::vector<Point> generators;
  for (const Eigen::VectorXd generator : block.generators.colwise()) {
    generators.emplace_back();
    for (const double x : generator) {
      generators.back().push_back(rational(x));
    }
  }
  for (std::size_t j = 0; j < q; ++j) {
    generators.emplace_back(q, 0);
    generators.back()[j] = rational(block.radius[static_cast<Eigen::Index>(j)]);
  }
  std::vector<Point> normals;
  for (std::size_t j = 0; j < q; ++j) {
    normals.emplace_back(q, 0);
    normals.back()[j] = 1;
  }
  for (const Point& g : generators) {
    if (q == 2) {
      normals.push_back({-g[1], g[0]});
    }
    for (const Point& h : generators) {
      if (q == 3) {
        normals.push_back({g[1] * h[2] - g[2] * h[1], g[2] * h[0] - g[0] * h[2], g[0] * h[1] - g[1] * h[0]});
      }
    }
  }
  for (const Point& normal : normals) {
    Rational size = 0;
    for (const Point& g : generators) {
      size += abs(exact::dot(normal, g));
    }
    if (abs(exact::dot(normal, offset)) > size) {
      return false;
    }
  }
  return true;
}

template <class Set>
::testing::AssertionResult holds(const Set& set, const std::vector<Point>& points) {
  for (const Point& point : points) {
    for (const auto& block : set.blocks()) {
      if (!holds(block, point)) {
        return ::testing::AssertionFailure() << "a vertex lies outside";
      }
    }
  }
  return ::testing::AssertionSuccess();
}

class OuterSets : public ::testing::TestWithParam<int> {};

TEST_P(OuterSets, contain_every_exact_vertex) {
  const int kind = GetParam();
  for (std::size_t p = 1; p <= 3; ++p) {
    for (std::uint64_t seed = 1; seed <= (p == 3 ? 4 : 10); ++seed) {
      const Problem each = problem(1000 * seed + static_cast<std::uint64_t>(kind), p, kind);
      const auto vertices = exact::vertices(exact::rows_of(each.rows, each.box), p);
      ASSERT_FALSE(vertices.empty());
      for (const std::size_t limit : {std::size_t{0}, std::size_t{4096}}) {
        const Polytope polytope(each.rows, each.box, {limit});
        for (const Criterion criterion : {Criterion::volume, Criterion::trace}) {
          const OuterEllipsoidOptions options{.criterion = criterion, .vertex_limit = limit};
          EXPECT_TRUE(holds(outer_ellipsoid(polytope, options), vertices)) << p << ' ' << seed;
        }
        EXPECT_TRUE(holds(outer_zonotope(polytope), vertices)) << p << ' ' << seed;
        EXPECT_TRUE(holds(outer_zonotope(polytope, {.order = 1}), vertices)) << p << ' ' << seed;
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(Kinds, OuterSets, ::testing::Range(0, 8));

// The published support is not below that of the stated set, with zero tolerance: squares instead of roots.
TEST(Ellipsoid, support_is_outward) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const std::size_t p = 1 + seed % 4;
    const double size = std::pow(10.0, 8.0 * random.symmetric());
    const Eigen::VectorXd centre = vector(random, p), a = size * vector(random, p);
    Eigen::MatrixXd shape(p, p);
    for (Eigen::Index k = 0; k < shape.cols(); ++k) {
      shape.col(k) = std::pow(10.0, 9.0 * random.symmetric()) * vector(random, p);
    }
    const Ellipsoid ellipsoid(centre, shape);
    Rational reach = rational(ellipsoid.support(span(a))), squares = 0;
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      reach -= rational(a[i]) * rational(centre[i]);
      Rational y = 0;
      for (Eigen::Index k = 0; k < a.size(); ++k) {
        y += rational(shape(k, i)) * rational(a[k]);
      }
      squares += y * y;
    }
    EXPECT_TRUE(reach >= 0 && reach * reach >= squares) << seed;
  }
}

TEST(Zonotope, support_is_outward) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const std::size_t p = 1 + seed % 4;
    const Eigen::VectorXd centre = vector(random, p), a = std::pow(10.0, 8.0 * random.symmetric()) * vector(random, p);
    Zonotope::Block block{{}, centre, Eigen::MatrixXd(p, 9), vector(random, p).cwiseAbs()};
    Rational exact = 0;
    for (std::size_t j = 0; j < p; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      block.parameters.push_back(j);
      exact += rational(a[k]) * rational(centre[k]) + abs(rational(a[k])) * rational(block.radius[k]);
    }
    for (Eigen::Index i = 0; i < block.generators.cols(); ++i) {
      block.generators.col(i) = std::pow(10.0, 9.0 * random.symmetric()) * vector(random, p);
      Rational product = 0;
      for (Eigen::Index k = 0; k < a.size(); ++k) {
        product += rational(a[k]) * rational(block.generators(k, i));
      }
      exact += abs(product);
    }
    const Zonotope zonotope(std::vector<Zonotope::Block>{block});
    EXPECT_TRUE(rational(zonotope.support(span(a))) >= exact) << seed;
  }
}

/// A p × p matrix that couples all parameters, and the parallelotope |A(θ − c)|_i <= half_i.
struct Parallelotope {
  Eigen::MatrixXd a;
  Eigen::VectorXd centre, half;
  Polytope polytope;
};
Parallelotope parallelotope(std::uint64_t seed, std::size_t p) {
  Random random(seed);
  Eigen::MatrixXd a = 2.0 * Eigen::MatrixXd::Identity(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(p));
  const Eigen::VectorXd centre = vector(random, p), half = vector(random, p).array().abs() + 0.1;
  std::vector<HalfSpace> rows;
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    a.row(i) += vector(random, p);
    rows.push_back({a.row(i), a.row(i).dot(centre) + half[i], {}});
    rows.push_back({-a.row(i), -a.row(i).dot(centre) + half[i], {}});
  }
  return {a, centre, half, Polytope(rows, testing_rows::cube(p, 100.0))};
}

TEST(OuterSets, of_a_parallelotope_are_the_inscribing_ellipsoid_and_itself) {
  for (std::size_t p = 2; p <= 6; ++p) {
    const Parallelotope each = parallelotope(p, p);
    const Ellipsoid ellipsoid = outer_ellipsoid(each.polytope);
    const Zonotope zonotope = outer_zonotope(each.polytope);
    EXPECT_EQ(zonotope.generator_count(), p);
    const Eigen::MatrixXd edges = each.a.inverse() * each.half.asDiagonal();
    Random random(p);
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::VectorXd a = vector(random, p);
      const double root = std::sqrt(static_cast<double>(p)) * (edges.transpose() * a).norm();
      EXPECT_NEAR(ellipsoid.support(span(a)), a.dot(each.centre) + root, 2e-6 * root) << p;
      const double sum = (edges.transpose() * a).cwiseAbs().sum();
      EXPECT_NEAR(zonotope.support(span(a)), a.dot(each.centre) + sum, 1e-9 * sum) << p;
    }
  }
}

TEST(OuterSets, of_a_box_are_the_box) {
  const Box box{{{-1.0, 2.0}, {3.0, 3.0}, {1e6, 1e6 + 1.0}, {-1e-9, 1e-9}}};
  const Polytope polytope({}, box);
  const Ellipsoid ellipsoid = outer_ellipsoid(polytope);
  const Zonotope zonotope = outer_zonotope(polytope);
  const double rounding = 64.0 * std::numeric_limits<double>::epsilon();
  for (std::size_t j = 0; j < 4; ++j) {
    std::vector<double> a(4, 0.0);
    for (const double sign : {1.0, -1.0}) {
      a[j] = sign;
      EXPECT_NEAR(ellipsoid.support(a), box.support(a), rounding * std::abs(box.support(a)));
      EXPECT_NEAR(zonotope.support(a), box.support(a), rounding * std::abs(box.support(a)));
    }
  }
}

// Löwner's ellipsoid of the simplex with vertices v: centre their mean, (θ − c)ᵀS⁻¹(θ − c) <= 1 with S = p/(p + 1)
// Σ(v − c)(v − c)ᵀ.
TEST(OuterSets, of_a_simplex_are_at_least_its_loewner_ellipsoid) {
  for (std::size_t p = 2; p <= 6; ++p) {
    const auto n = static_cast<double>(p);
    Box box;
    Eigen::VectorXd slope(p);
    Eigen::MatrixXd vertices = Eigen::MatrixXd::Zero(slope.size(), slope.size() + 1);
    for (std::size_t j = 0; j < p; ++j) {
      const double side = std::ldexp(1.0, static_cast<int>(3 * j));
      box.sides.push_back({0.0, side});
      slope[static_cast<Eigen::Index>(j)] = 1.0 / side;
      vertices(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(j)) = side;
    }
    const Polytope polytope({{slope, 1.0, {}}}, box);
    const Ellipsoid ellipsoid = outer_ellipsoid(polytope);
    const Eigen::VectorXd centre = vertices.rowwise().mean();
    const Eigen::MatrixXd offsets = vertices.colwise() - centre;
    Random random(p);
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::VectorXd a = slope.cwiseProduct(vector(random, p));
      const double size = std::sqrt(n / (n + 1.0)) * (offsets.transpose() * a).norm();
      EXPECT_NEAR(ellipsoid.support(span(a)), a.dot(centre) + size, 1e-5 * size) << p;
    }
  }
}

/// Coupled random sets, with all parameters in one block.
Polytope random_polytope(std::uint64_t seed, std::size_t p, const Eigen::VectorXd& units, std::size_t limit = 4096) {
  Random random(seed);
  const Eigen::VectorXd centre = vector(random, p);
  Box box = testing_rows::cube(p, 20.0);
  for (std::size_t j = 0; j < p; ++j) {
    const double unit = units[static_cast<Eigen::Index>(j)];
    box.sides[j] = {-20.0 * unit, 20.0 * unit};
  }
  std::vector<HalfSpace> rows;
  for (std::size_t r = 0; r < 6 * p; ++r) {
    const Eigen::VectorXd a = vector(random, p);
    rows.push_back({a.cwiseQuotient(units), a.dot(centre) + 0.05 + random.unit(), {}});
  }
  return {rows, box, {limit}};
}

TEST(OuterSets, do_not_depend_on_units) {
  for (std::size_t p = 2; p <= 4; ++p) {
    const auto n = static_cast<Eigen::Index>(p);
    Eigen::VectorXd units(n);
    for (Eigen::Index j = 0; j < n; ++j) {
      units[j] = j % 2 == 0 ? 0x1.0p30 : 0x1.0p-30;
    }
    const Polytope plain = random_polytope(p, p, Eigen::VectorXd::Ones(n)), scaled = random_polytope(p, p, units);
    const auto same = [&](const auto& x, const auto& y) {
      Random random(p);
      for (int trial = 0; trial < 20; ++trial) {
        const Eigen::VectorXd a = vector(random, p), b = a.cwiseQuotient(units);
        EXPECT_NEAR(x.support(span(a)), y.support(span(b)), 1e-5 * width(x, span(a)));
      }
    };
    same(outer_ellipsoid(plain), outer_ellipsoid(scaled));
    same(outer_ellipsoid(plain, {.criterion = Criterion::trace}),
         outer_ellipsoid(scaled, {.criterion = Criterion::trace}));
    same(outer_zonotope(plain), outer_zonotope(scaled));
  }
}

// John 1948: the ellipsoid of least volume, shrunk p times about its centre, lies inside.
TEST(OuterSets, of_known_vertices_are_loewner_ellipsoids) {
  for (std::size_t p = 2; p <= 5; ++p) {
    const auto n = static_cast<Eigen::Index>(p);
    const Polytope polytope = random_polytope(p, p, Eigen::VectorXd::Ones(n));
    ASSERT_TRUE(polytope.has_vertices());
    const Ellipsoid outer = outer_ellipsoid(polytope);
    const Ellipsoid::Block& block = outer.blocks()[0];
    const Ellipsoid inner(block.centre, block.shape * ((1.0 - 1e-4) / static_cast<double>(p)));
    EXPECT_LE(protrusion(polytope.facets(), inner), 0.0) << p;
    // And it is no larger than the best one from slabs.
    const Ellipsoid slabs = outer_ellipsoid(random_polytope(p, p, Eigen::VectorXd::Ones(n), 0), {.vertex_limit = 0});
    EXPECT_LE(std::abs(block.shape.determinant()), std::abs(slabs.blocks()[0].shape.determinant()) * (1.0 + 1e-5));
  }
}

// The affine image of a regular polygon has that of its circumscribed circle.
TEST(OuterSets, of_an_affinely_regular_polygon_are_its_circumscribed_ellipse) {
  for (int corners = 3; corners <= 9; ++corners) {
    const Eigen::Matrix2d image{{3.0, 1.0}, {-0.5, 0.25}};
    const Eigen::Vector2d centre(10.0, -1.0);
    const double step = 2.0 * std::acos(-1.0) / corners, inner = std::cos(0.5 * step);
    std::vector<HalfSpace> rows;
    for (int k = 0; k < corners; ++k) {
      const Eigen::Vector2d normal(std::cos(step * k), std::sin(step * k));
      const Eigen::VectorXd a = image.inverse().transpose() * normal;
      rows.push_back({a, inner + a.dot(centre), {}});
    }
    const Ellipsoid ellipse = outer_ellipsoid(Polytope(rows, testing_rows::cube(2, 100.0)));
    Random random(static_cast<std::uint64_t>(corners));
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::VectorXd a = vector(random, 2);
      const double size = (image.transpose() * a).norm();
      EXPECT_NEAR(ellipse.support(span(a)), a.dot(centre) + size, 1e-5 * size) << corners;
    }
  }
}

// In the plane any zonotope is its own smallest outer zonotope, wherever its centre is.
TEST(OuterSets, of_a_zonogon_are_itself) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    Random random(seed);
    const Eigen::Vector2d centre = vector(random, 2);
    Eigen::MatrixXd generators(2, 2 + static_cast<Eigen::Index>(seed) % 5);
    for (Eigen::Index i = 0; i < generators.cols(); ++i) {
      generators.col(i) = vector(random, 2);
    }
    const Zonotope zonogon(centre, generators);
    std::vector<HalfSpace> rows;
    for (Eigen::Index i = 0; i < generators.cols(); ++i) {
      for (const double sign : {1.0, -1.0}) {
        const Eigen::VectorXd normal = sign * Eigen::Vector2d(-generators(1, i), generators(0, i));
        rows.push_back({normal, zonogon.support(span(normal)), {}});
      }
    }
    const Zonotope outer = outer_zonotope(Polytope(rows, testing_rows::cube(2, 50.0)));
    for (int trial = 0; trial < 20; ++trial) {
      const Eigen::VectorXd a = vector(random, 2);
      EXPECT_NEAR(outer.support(span(a)), zonogon.support(span(a)), 1e-6 * width(zonogon, span(a))) << seed;
    }
  }
}

double relative_trace(const Ellipsoid& ellipsoid, const Box& hull) {
  double sum = 0.0;
  for (std::size_t j = 0; j < hull.dimension(); ++j) {
    Eigen::VectorXd a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(hull.dimension()));
    a[static_cast<Eigen::Index>(j)] = 1.0;
    const double ratio = width(ellipsoid, span(a)) / hull.sides[j].width();
    sum += ratio * ratio;
  }
  return sum;
}

TEST(OuterSets, each_criterion_is_best_by_its_own_measure) {
  for (std::size_t p = 2; p <= 5; ++p) {
    const Polytope polytope = random_polytope(p, p, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(p)));
    ASSERT_EQ(polytope.blocks().size(), 1U);
    const Ellipsoid by_volume = outer_ellipsoid(polytope),
                    by_trace = outer_ellipsoid(polytope, {.criterion = Criterion::trace});
    const auto volume = [](const Ellipsoid& e) { return std::abs(e.blocks()[0].shape.determinant()); };
    EXPECT_LE(volume(by_volume), volume(by_trace) * (1.0 + 1e-5));
    EXPECT_LE(relative_trace(by_trace, polytope.hull()), relative_trace(by_volume, polytope.hull()) * (1.0 + 1e-5));
    // The ellipsoid of the interval hull is one that either could have chosen.
    double box = 1.0;
    for (const Interval& side : polytope.hull().sides) {
      box *= std::sqrt(static_cast<double>(p)) * 0.5 * side.width();
    }
    EXPECT_LE(volume(by_volume), box * (1.0 + 1e-5));
    const auto n = static_cast<double>(p);
    EXPECT_LE(relative_trace(by_trace, polytope.hull()), n * n * (1.0 + 1e-5));
    // More generators are no wider in the measure that is minimised: Σ|generator| where the ellipsoid is round.
    const Eigen::MatrixXd round = by_volume.blocks()[0].shape.inverse();
    double last = std::numeric_limits<double>::infinity();
    for (const std::size_t order : {1U, 2U, 8U}) {
      const Zonotope zonotope = outer_zonotope(polytope, {.order = order});
      EXPECT_LE(zonotope.generator_count(), order * p);
      const double size = (round * zonotope.blocks()[0].generators).colwise().norm().sum();
      EXPECT_LE(size, last * (1.0 + 1e-5)) << p << ' ' << order;
      last = size;
    }
  }
}

// Beyond the vertices that rationals can list: points of the polytope next to its maximisers are held, exactly.
TEST(OuterSets, hold_the_extreme_points_of_larger_polytopes) {
  for (const std::size_t p : {5U, 8U}) {
    const Polytope polytope = random_polytope(p, p, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(p)), 0);
    const Ellipsoid ellipsoid = outer_ellipsoid(polytope, {.vertex_limit = 1000});
    const Zonotope zonotope = outer_zonotope(polytope);
    Random random(p);
    for (int trial = 0; trial < 50; ++trial) {
      const Eigen::VectorXd a = vector(random, p);
      std::vector<double> at(p);
      static_cast<void>(polytope.support(span(a), at));
      const std::vector<double> point = exact::pulled_inside(polytope.facets(), at, polytope.centre());
      const exact::Rational value = exact::dot(span(a), point);
      EXPECT_TRUE(ellipsoid.contains(point));
      EXPECT_TRUE(zonotope.contains(point));
      EXPECT_TRUE(value <= exact::rational(ellipsoid.support(span(a))));
      EXPECT_TRUE(value <= exact::rational(zonotope.support(span(a))));
    }
  }
}

TEST(OuterSets, reject_bad_shapes) {
  EXPECT_THROW(Ellipsoid(Eigen::Vector2d(0, 0), Eigen::MatrixXd::Identity(3, 3)), InvalidArgument);
  EXPECT_THROW(Ellipsoid(Eigen::Vector2d(0, std::nan("")), Eigen::MatrixXd::Identity(2, 2)), InvalidArgument);
  EXPECT_THROW(Ellipsoid({{{0, 2}, Eigen::Vector2d(0, 0), Eigen::Matrix2d::Identity()}}), InvalidArgument);
  EXPECT_THROW(Zonotope(Eigen::Vector2d(0, 0), Eigen::MatrixXd::Identity(3, 3)), InvalidArgument);
  EXPECT_THROW(
      Zonotope({{{0}, Eigen::VectorXd::Zero(1), Eigen::MatrixXd::Ones(1, 1), Eigen::VectorXd::Constant(1, -1.0)}}),
      InvalidArgument);
  const Polytope square({}, testing_rows::cube(2, 1.0));
  EXPECT_THROW(static_cast<void>(outer_zonotope(square, {.order = 0})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(outer_ellipsoid(square, {.tolerance = 0.0})), InvalidArgument);
}

// A point is an ellipsoid and a zonotope too.
TEST(OuterSets, may_be_a_point) {
  const Eigen::Vector2d centre(1.0, -2.0);
  const Ellipsoid ellipsoid(centre, Eigen::Matrix2d::Zero());
  const Zonotope zonotope(centre, Eigen::MatrixXd(2, 0));
  const std::vector<double> at{1.0, -2.0}, off{1.0, -2.0000001}, a{3.0, 1.0};
  EXPECT_TRUE(ellipsoid.contains(at) && zonotope.contains(at));
  EXPECT_FALSE(ellipsoid.contains(off) || zonotope.contains(off));
  EXPECT_NEAR(ellipsoid.support(a), 1.0, 1e-13);
  EXPECT_NEAR(zonotope.support(a), 1.0, 1e-13);
}

}  // namespace
}  // namespace wheelwright::outer_sets_test
