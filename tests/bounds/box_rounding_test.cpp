// SPDX-License-Identifier: Apache-2.0
// Each step that rounds the support of a box outward, against rationals with zero tolerance.
// tests/campaigns/mutate_rounding.sh takes the steps away one by one, and these tests have to notice.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_int.hpp>

#include "bounds/box.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::box_rounding_test {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using testing_rows::Random;

void expect_outward(const Box& box, const std::vector<double>& a) {
  Rational exact = 0;
  for (std::size_t j = 0; j < a.size(); ++j) {
    const Rational low = Rational(a[j]) * Rational(box.sides[j].lower);
    const Rational high = Rational(a[j]) * Rational(box.sides[j].upper);
    exact += low > high ? low : high;
  }
  ASSERT_GE(Rational(box.support(a)), exact);
}

TEST(BoxRounding, SumsOfRoundedProductsAreNotBelowTheExactOne) {
  Random random(1);
  for (int k = 0; k < 5000; ++k) {
    const std::size_t p = 1 + static_cast<std::size_t>(k) % 6;
    Box box;
    for (std::size_t j = 0; j < p; ++j) {
      const double centre = 100.0 * random.symmetric();
      box.sides.push_back({centre - random.unit(), centre + random.unit()});
    }
    expect_outward(box, random.vector(p));
  }
}

TEST(BoxRounding, ProductsBelowTheSmallestNumberAreCovered) {
  const Box box{{{0.0, 1e-200}, {0.0, 3e-200}}};
  expect_outward(box, {1e-200, 1e-200});
  expect_outward(box, {1e-110, 7e-111});
}

}  // namespace
}  // namespace wheelwright::bounds::box_rounding_test
