// SPDX-License-Identifier: Apache-2.0
// Oracle: every pair of candidates tried one after the other.
#include "gap/causes/candidate.hpp"

#include <algorithm>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/QR>

namespace wheelwright::gap::candidate_test {
namespace {

constexpr Eigen::Index kRows = 600;
constexpr std::size_t kEffects = 7, kShapes = 3;

// θ of two columns; effect e has one column at each of 1 to 3 shapes, effect 4 two, and effect 6 no coefficient.
struct MadeUp {
  std::vector<RowSpace> spaces;
  CandidateTable table;

  explicit MadeUp(unsigned seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal;
    const auto random = [&] {
      Eigen::VectorXd x(kRows);
      for (double& value : x) {
        value = normal(generator);
      }
      return x;
    };
    RowSpace space;
    space.name = "made up";
    space.t = Eigen::VectorXd::LinSpaced(kRows, 0.0, 60.0);
    space.columns = {random(), random()};
    table.base = {0, 1};
    table.unknown = {1};
    for (std::size_t e = 0; e < kEffects; ++e) {
      table.names.push_back("effect " + std::to_string(e));
      const Eigen::VectorXd common = random();
      for (std::size_t shape = 0; shape < 1 + e % kShapes; ++shape) {
        Candidate candidate{e, {static_cast<double>(shape)}, {}, {}, false};
        for (int k = 0; k < (e == 4 ? 2 : 1); ++k) {
          candidate.columns.push_back(space.columns.size());
          candidate.sign.push_back(e == 1 ? 1 : 0);
          space.columns.push_back(common + 0.6 * random());
        }
        candidate.unit_coefficient = e == 6;
        table.candidates.push_back(candidate);
      }
    }
    // Two effects at their middle shapes, a third one at a tenth, and θ.
    space.response = random() + 0.7 * space.columns[0] - 0.4 * space.columns[1] + column(space, 2, 1) +
                     0.8 * column(space, 5, 2) + 0.1 * column(space, 3, 0);
    spaces.push_back(std::move(space));
  }

  [[nodiscard]] const Eigen::VectorXd& column(const RowSpace& space, std::size_t effect, std::size_t shape) const {
    for (const Candidate& c : table.candidates) {
      if (c.effect == effect && c.shape[0] == static_cast<double>(shape)) {
        return space.columns[c.columns[0]];
      }
    }
    return space.response;
  }
};

CauseSearchOptions wide_search(std::size_t threads) {
  CauseSearchOptions options;
  options.largest = 2;
  options.pair_beam = kEffects;
  options.kept = 100;
  options.threads = threads;
  return options;
}

// Held-out mean square by QR, block of 2.5 s by block, without BlockGram.
double held_out_by_hand(const RowSpace& space, const std::vector<std::size_t>& columns) {
  const int blocks = 24;
  const double length = 60.0 / blocks, purge = 0.5;
  const auto block_of = [&](double t) { return std::min(blocks - 1, static_cast<int>(t / length)); };
  const auto inner = [&](double t) {
    const int b = block_of(t);
    return (b == 0 || t - b * length >= purge) && (b + 1 == blocks || (b + 1) * length - t > purge);
  };
  double sum = 0.0, count = 0.0;
  for (int out = 0; out < blocks; ++out) {
    std::vector<Eigen::Index> train, test;
    for (Eigen::Index k = 0; k < kRows; ++k) {
      if (inner(space.t[k])) {
        (block_of(space.t[k]) == out ? test : train).push_back(k);
      }
    }
    const auto at = [&](const std::vector<Eigen::Index>& rows) {
      Eigen::MatrixXd A(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(columns.size()));
      for (Eigen::Index i = 0; i < A.rows(); ++i) {
        for (Eigen::Index j = 0; j < A.cols(); ++j) {
          A(i, j) = space.columns[columns[static_cast<std::size_t>(j)]][rows[static_cast<std::size_t>(i)]];
        }
      }
      return A;
    };
    const Eigen::VectorXd x = at(train).colPivHouseholderQr().solve(space.response(train));
    sum += (space.response(test) - at(test) * x).squaredNorm();
    count += static_cast<double>(test.size());
  }
  return sum / count;
}

TEST(SearchCauses, FindsTheBestPairAsTryingAllOfThemDoes) {
  for (const unsigned seed : {1U, 2U, 3U, 4U, 5U}) {
    MadeUp made(seed);
    const BlockGram gram(made.spaces);
    made.table.gram = &gram;
    double best = std::numeric_limits<double>::infinity();
    std::vector<std::size_t> pair;
    for (std::size_t a = 0; a < made.table.candidates.size(); ++a) {
      for (std::size_t b = a + 1; b < made.table.candidates.size(); ++b) {
        if (made.table.candidates[a].effect == made.table.candidates[b].effect) {
          continue;
        }
        const double error = gram.held_out_error(subset_of(made.table, {a, b}, BaseModel::refitted));
        if (error < best) {
          best = error;
          pair = {a, b};
        }
      }
    }
    const auto levels = search_causes(made.table, wide_search(1));
    ASSERT_EQ(levels.size(), 3u);
    ASSERT_EQ(levels[1].size(), kEffects);
    EXPECT_EQ(levels[2].size(), kEffects * (kEffects - 1) / 2);
    EXPECT_EQ(levels[2].front().members, pair);
    EXPECT_DOUBLE_EQ(levels[2].front().held_out_error, best);
    EXPECT_EQ(names_of(made.table, levels[2].front()), (std::vector<std::string>{"effect 2", "effect 5"}));
    for (const std::vector<CauseSet>& level : levels) {
      for (std::size_t k = 1; k < level.size(); ++k) {
        EXPECT_LE(level[k - 1].held_out_error, level[k].held_out_error);
      }
    }
  }
}

TEST(SearchCauses, DoesNotDependOnTheNumberOfThreads) {
  MadeUp made(7);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  CauseSearchOptions one, three;
  one.largest = three.largest = 3;
  three.threads = 3;
  const auto a = search_causes(made.table, one), b = search_causes(made.table, three);
  ASSERT_EQ(a.size(), 4u);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t size = 0; size < a.size(); ++size) {
    ASSERT_EQ(a[size].size(), b[size].size());
    for (std::size_t k = 0; k < a[size].size(); ++k) {
      EXPECT_EQ(a[size][k].members, b[size][k].members);
      EXPECT_EQ(a[size][k].held_out_error, b[size][k].held_out_error);
      EXPECT_EQ(a[size][k].loss, b[size][k].loss);
    }
  }
}

TEST(SearchCauses, LooksForWhatIsAllowedOnly) {
  MadeUp made(3);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  CauseSearchOptions options;
  options.allowed.assign(kEffects, true);
  options.allowed[2] = false;
  options.kept = 4;
  const auto levels = search_causes(made.table, options);
  EXPECT_EQ(levels[1].size(), kEffects - 1);
  EXPECT_LE(levels[2].size(), 4u);
  for (const std::vector<CauseSet>& level : levels) {
    for (const CauseSet& set : level) {
      for (const std::size_t e : effects_of(made.table, set)) {
        EXPECT_NE(e, 2u);
      }
    }
  }
  options.allowed.assign(kEffects, false);
  const auto nothing = search_causes(made.table, options);
  ASSERT_GE(nothing.size(), 1u);
  EXPECT_TRUE(nothing[0][0].members.empty());
  for (std::size_t size = 1; size < nothing.size(); ++size) {
    EXPECT_TRUE(nothing[size].empty());
  }
}

TEST(CauseSet, HasTheHeldOutErrorOfItsColumnsBesideTheta) {
  MadeUp made(11);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  std::size_t two = 0;
  while (made.table.candidates[two].effect != 4) {
    ++two;
  }
  const std::vector<std::size_t>& columns = made.table.candidates[two].columns;
  const CauseSet refitted = evaluate(made.table, {two}, BaseModel::refitted);
  EXPECT_NEAR(refitted.held_out_error, held_out_by_hand(made.spaces[0], {0, 1, columns[0], columns[1]}), 1e-9);
  EXPECT_EQ(refitted.coefficients, 3.0);  // two columns and a shape
  EXPECT_DOUBLE_EQ(refitted.loss.sum() / gram.rows().sum(), refitted.held_out_error);
  // Held: only the column without a nominal value is fitted beside.
  const CauseSet held = evaluate(made.table, {two}, BaseModel::nominal);
  EXPECT_NEAR(held.held_out_error, held_out_by_hand(made.spaces[0], {1, columns[0], columns[1]}), 1e-9);
  EXPECT_EQ(held.coefficients, 3.0);
}

TEST(CauseSet, SubtractsWhatHasNoCoefficient) {
  MadeUp made(12);
  const std::size_t unit = made.table.candidates.size() - 1;
  ASSERT_TRUE(made.table.candidates[unit].unit_coefficient);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  const CauseSet set = evaluate(made.table, {unit}, BaseModel::refitted);
  EXPECT_EQ(set.coefficients, 1.0);  // its shape
  RowSpace less = made.spaces[0];
  less.response -= less.columns[made.table.candidates[unit].columns[0]];
  EXPECT_NEAR(set.held_out_error, held_out_by_hand(less, {0, 1}), 1e-9);
}

}  // namespace
}  // namespace wheelwright::gap::candidate_test
