// SPDX-License-Identifier: Apache-2.0
/// \file
/// Projections of the feasible set against sets whose corners are known.
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "results/report/commission_report.hpp"
#include "results/report/drawing.hpp"
#include "tests/report/example.hpp"

namespace wheelwright::report::set_drawings_test {
namespace {

namespace example = report_example;

// The polygons of a page, each as the set of its corners in shares of the drawn box.
std::vector<std::set<std::string>> polygons(const std::string& html) {
  std::vector<std::set<std::string>> found;
  const std::string open = "<polygon class=\"bar\" points=\"";
  for (std::size_t at = html.find(open); at != std::string::npos; at = html.find(open, at)) {
    at += open.size();
    std::istringstream points(html.substr(at, html.find('"', at) - at));
    found.emplace_back();
    for (std::string point; points >> point;) {
      found.back().insert(point);
    }
  }
  return found;
}

// The box of the example, and half of it in the plane of mass and viscous friction.
Commissioning half_a_box() {
  Commissioning c = example::done();
  Box box;
  for (const commission::ParameterResult& p : c.parameters) {
    box.sides.push_back({p.lower, p.upper});
  }
  bounds::HalfSpace row{Eigen::VectorXd::Zero(4), 1.0, {}};
  for (const int j : {0, 2}) {
    const Interval& side = box.sides[static_cast<std::size_t>(j)];
    row.a[j] = 1.0 / side.width();
    row.b += side.lower / side.width();
  }
  c.feasible.polytope = Polytope({row}, box);
  return c;
}

TEST(SetProjections, AreTheCornersOfTheSet) {
  const auto found = polygons(report::set_projections(half_a_box()));
  ASSERT_EQ(found.size(), 1U);  // the other pairs do not limit each other
  EXPECT_EQ(found[0], (std::set<std::string>{"66.0,10.0", "66.0,200.0", "256.0,200.0"}));
}

TEST(SetProjections, AreNoneWithoutASet) {
  EXPECT_EQ(report::set_projections(example::done()), "");
  EXPECT_EQ(report::set_projections({}), "");
}

TEST(SetProjections, StandOnThePage) {
  EXPECT_TRUE(
      example::holds(commission_report(half_a_box(), {}), {"aria-label=\"feasible set: mass and viscous linear\""}));
}

}  // namespace
}  // namespace wheelwright::report::set_drawings_test
