// SPDX-License-Identifier: Apache-2.0
// The hull over all choices of outliers against exact enumeration: θ is admissible where it violates at most q instants.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/interval_hull.hpp>
#include <wheelwright/bounds/outlier_hull.hpp>
#include <wheelwright/bounds/slab_rows.hpp>

#include "bounds/exact.hpp"
#include "bounds/rows.hpp"

namespace wheelwright::outlier_hull_test {
namespace {

using exact::Rational;
using testing_rows::BlockSource;
using testing_rows::Random;
using testing_rows::Rows;

/// Lower and upper bounds per parameter.
using Bounds = std::vector<std::pair<Rational, Rational>>;

/// Where any p rows or sides meet, how many instants are violated; the extremes for q = 0, 1, 2. The union over the
/// choices has its extremes at such points, since each choice leaves a polytope.
class Oracle {
 public:
  Oracle(const RegressionBlock& block, const Box& prior) {
    const SlabRows slabs(prior);
    const std::size_t p = prior.dimension();
    std::vector<HalfSpace> rows(2 * static_cast<std::size_t>(block.rows()));
    for (Eigen::Index i = 0; i < block.rows(); ++i) {
      const auto k = 2 * static_cast<std::size_t>(i);
      slabs.half_spaces(block, i, rows[k], rows[k + 1]);
    }
    const std::vector<exact::Row> all = exact::rows_of(rows, prior);
    std::vector<char> chosen(all.size(), 0);
    std::fill(chosen.end() - static_cast<std::ptrdiff_t>(p), chosen.end(), 1);
    do {
      std::vector<std::size_t> numbers;
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (chosen[i] != 0) {
          numbers.push_back(i);
        }
      }
      if (const auto x = exact::meet(all, numbers)) {
        look(rows, all, *x);
      }
    } while (std::next_permutation(chosen.begin(), chosen.end()));
  }

  /// Nothing where no θ violates at most q instants.
  [[nodiscard]] const std::optional<Bounds>& with(std::size_t q) const { return bounds_.at(q); }

 private:
  void look(const std::vector<HalfSpace>& rows, const std::vector<exact::Row>& all, const std::vector<Rational>& x) {
    std::set<std::size_t> violated;
    for (std::size_t i = all.size(); i-- > 0 && violated.size() < bounds_.size();) {
      if (i < rows.size() && violated.contains(rows[i].origin.sample)) {
        continue;
      }
      if (exact::dot(all[i].a, x) > all[i].b) {
        if (i >= rows.size()) {
          return;
        }
        violated.insert(rows[i].origin.sample);
      }
    }
    for (std::size_t q = violated.size(); q < bounds_.size(); ++q) {
      if (!bounds_[q]) {
        bounds_[q].emplace();
        for (const Rational& value : x) {
          bounds_[q]->emplace_back(value, value);
        }
      }
      for (std::size_t j = 0; j < x.size(); ++j) {
        auto& [low, high] = (*bounds_[q])[j];
        low = std::min(low, x[j]);
        high = std::max(high, x[j]);
      }
    }
  }

  std::array<std::optional<Bounds>, 3> bounds_;
};

void expect_encloses(const OutlierHull& found, const Bounds& exact, bool tight) {
  for (std::size_t j = 0; j < exact.size(); ++j) {
    const auto& [low, high] = exact[j];
    const Rational lower = exact::rational(found.hull.sides[j].lower),
                   upper = exact::rational(found.hull.sides[j].upper);
    EXPECT_LE(lower, low);
    EXPECT_GE(upper, high);
    if (tight) {
      const Rational room = (high - low) / 1000000000;
      EXPECT_LE(low - lower, room) << "parameter " << j;
      EXPECT_LE(upper - high, room) << "parameter " << j;
      EXPECT_TRUE(found.lower[j].exact);
      EXPECT_TRUE(found.upper[j].exact);
    }
  }
}

/// Whether every choice of at most q of `instants` leaves at least one contradiction untouched, and each is proved.
bool proves_empty_for_all(const OutlierHull& found, const Box& prior, std::size_t instants, std::size_t q) {
  std::vector<std::set<std::size_t>> members;
  for (const OutlierContradiction& each : found.contradictions) {
    std::set<std::size_t> own;
    for (const WeightedRow& weighted : each.rows) {
      own.insert(weighted.row.origin.sample);
    }
    members.push_back(own);
    if (!exact::contradict(each.rows, prior)) {
      return false;
    }
  }
  for (std::size_t i = 0; i < instants; ++i) {
    for (std::size_t k = 0; k < instants; ++k) {
      const std::size_t a = q > 0 ? i : instants, b = q > 1 ? k : instants;
      if (std::none_of(members.begin(), members.end(),
                       [&](const auto& own) { return !own.contains(a) && !own.contains(b); })) {
        return false;
      }
    }
  }
  return true;
}

/// `gross` of the instants are wrong by up to ten.
Rows simulate(std::uint64_t seed, std::size_t p, std::size_t instants, std::size_t outputs, std::size_t gross,
              double noise, double dY = 0.0) {
  Random random(seed);
  Rows rows(p, outputs);
  for (std::size_t k = 0; k < instants * outputs; ++k) {
    const std::vector<double> Y = random.vector(p);
    double y = noise * random.symmetric() + (k / outputs < gross ? 10.0 * random.symmetric() : 0.0);
    for (std::size_t j = 0; j < p; ++j) {
      y += Y[j] * (1.0 + static_cast<double>(j));
    }
    rows.add(Y, y, noise, std::vector<double>(p, dY));
  }
  return rows;
}

class AgainstEnumeration : public testing::TestWithParam<int> {};

TEST_P(AgainstEnumeration, encloses_and_is_tight) {
  const auto seed = static_cast<std::uint64_t>(GetParam());
  const std::size_t p = 1 + seed % 3, outputs = p == 2 && seed % 2 == 0 ? 2 : 1;
  const std::size_t instants = (p == 3 ? 8 : 12) / outputs;
  const Rows rows = simulate(seed, p, instants, outputs, seed % 4, 0.3, seed % 5 == 0 ? 0.05 : 0.0);
  const Box prior = testing_rows::cube(p, 20.0);
  const Oracle oracle(rows.block(0, instants), prior);
  for (std::size_t q = 0; q <= 2; ++q) {
    RegressionTable table = rows.table();
    const OutlierHull found = hull_with_outliers(table, prior, {.most = q});
    ASSERT_EQ(found.empty, !oracle.with(q).has_value()) << "q = " << q;
    if (found.empty) {
      EXPECT_TRUE(proves_empty_for_all(found, prior, instants, q)) << "q = " << q;
      continue;
    }
    SCOPED_TRACE(q);
    expect_encloses(found, *oracle.with(q), true);
    RegressionTable again = rows.table();
    const OutlierHull fallback = hull_with_outliers(again, prior, {.most = q, .budget = 0});
    ASSERT_FALSE(fallback.empty);
    expect_encloses(fallback, *oracle.with(q), false);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, AgainstEnumeration, testing::Range(0, 24));

TEST(OutlierHull, without_outliers_is_the_interval_hull) {
  const Rows rows = simulate(7, 3, 2000, 1, 0, 0.1);
  const Box prior = testing_rows::cube(3, 50.0);
  RegressionTable table = rows.table();
  const IntervalHull plain = interval_hull(table, prior);
  const OutlierHull found = hull_with_outliers(table, prior, {.most = 0});
  for (std::size_t j = 0; j < 3; ++j) {
    const Interval &is = found.hull.sides[j], &shall = plain.hull.sides[j];
    EXPECT_NEAR(is.lower, shall.lower, 1e-9 * shall.width());
    EXPECT_NEAR(is.upper, shall.upper, 1e-9 * shall.width());
  }
}

// θ in [k − 3, k + 3] for instants k = 0..4 is [1, 3]; without one instant [0, 3] or [1, 4]; without two [−1, 3],
// [0, 4] or [1, 5]. One more that says [90, 92] must be the one dropped.
TEST(OutlierHull, intervals_in_closed_form) {
  const auto hull = [](bool gross, std::size_t q) {
    Rows rows(1);
    for (int k = 0; k < 5; ++k) {
      rows.add({1.0}, k, 3.0);
    }
    if (gross) {
      rows.add({1.0}, 91.0, 1.0);
    }
    RegressionTable table = rows.table();
    return hull_with_outliers(table, testing_rows::cube(1, 1000.0), {.most = q});
  };
  const auto expect = [](const OutlierHull& found, double low, double high) {
    ASSERT_FALSE(found.empty);
    EXPECT_NEAR(found.hull.sides[0].lower, low, 1e-12);
    EXPECT_NEAR(found.hull.sides[0].upper, high, 1e-12);
  };
  expect(hull(false, 0), 1.0, 3.0);
  expect(hull(false, 1), 0.0, 4.0);
  expect(hull(false, 2), -1.0, 5.0);
  EXPECT_TRUE(hull(true, 0).empty);
  expect(hull(true, 1), 1.0, 3.0);
  expect(hull(true, 2), 0.0, 4.0);
  expect(hull(true, 5), -3.0, 92.0);  // the sixth alone is consistent, too
  expect(hull(true, 6), -1000.0, 1000.0);
  EXPECT_EQ(hull(true, 1).upper[0].dropped, (std::vector<std::size_t>{5}));
}

TEST(OutlierHull, bounds_are_proved_and_attained_where_they_say) {
  const Rows rows = simulate(11, 4, 3000, 2, 2, 0.1);
  const Box prior = testing_rows::cube(4, 50.0);
  const RegressionBlock block = rows.block(0, 3000);
  RegressionTable table = rows.table();
  const OutlierHull found = hull_with_outliers(table, prior, {.most = 3});
  ASSERT_FALSE(found.empty);
  for (std::size_t d = 0; d < 8; ++d) {
    const OutlierBound& bound = d % 2 == 0 ? found.lower[d / 2] : found.upper[d / 2];
    const double sign = d % 2 == 0 ? -1.0 : 1.0, width = found.hull.sides[d / 2].width();
    ASSERT_TRUE(bound.exact);
    EXPECT_LE(bound.dropped.size(), 3U);
    std::set<std::size_t> violated;
    const Eigen::VectorXd excess = (block.y - block.Y * bound.at).cwiseAbs() - block.dy;
    for (Eigen::Index i = 0; i < excess.size(); ++i) {
      if (excess[i] > 1e-9) {
        violated.insert(block.sample[static_cast<std::size_t>(i) / 2]);
      }
    }
    EXPECT_TRUE(std::includes(bound.dropped.begin(), bound.dropped.end(), violated.begin(), violated.end()));
    EXPECT_NEAR(bound.at[static_cast<Eigen::Index>(d / 2)], bound.value, 1e-9 * width);
    std::vector<double> axis(4, 0.0);
    axis[d / 2] = sign;
    EXPECT_NEAR(certified_upper_bound(axis, bound.binding, found.layers), sign * bound.value, 1e-9 * width);
    for (const WeightedRow& weighted : bound.binding) {
      EXPECT_FALSE(std::binary_search(bound.dropped.begin(), bound.dropped.end(), weighted.row.origin.sample));
    }
  }
}

TEST(OutlierHull, grows_with_their_number_and_not_with_blocks) {
  const Rows rows = simulate(13, 3, 2000, 1, 1, 0.1, 0.01);
  const Box prior = testing_rows::cube(3, 50.0);
  Box last;
  for (std::size_t q = 1; q <= 3; ++q) {
    RegressionTable table = rows.table();
    const OutlierHull whole = hull_with_outliers(table, prior, {.most = q});
    ASSERT_FALSE(whole.empty);
    for (std::size_t j = 0; j < 3 && q > 1; ++j) {
      EXPECT_LE(whole.hull.sides[j].lower, last.sides[j].lower);
      EXPECT_GE(whole.hull.sides[j].upper, last.sides[j].upper);
    }
    last = whole.hull;
    for (const std::size_t size : {7U, 999U}) {
      BlockSource source(rows, size);
      EXPECT_EQ(hull_with_outliers(source, prior, {.most = q}).hull, whole.hull);
    }
  }
}

TEST(OutlierHull, leaves_out_what_it_is_told_to) {
  const Rows rows = simulate(17, 2, 200, 1, 3, 0.1);
  const Box prior = testing_rows::cube(2, 50.0);
  RegressionTable table = rows.table();
  EXPECT_TRUE(hull_with_outliers(table, prior, {.most = 0}).empty);
  const OutlierHull found = hull_with_outliers(table, prior, {.most = 1, .excluded_samples = {2, 0, 1}});
  ASSERT_FALSE(found.empty);
  EXPECT_TRUE(found.hull.contains(std::vector<double>{1.0, 2.0}));
}

}  // namespace
}  // namespace wheelwright::outlier_hull_test
