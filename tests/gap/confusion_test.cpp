// SPDX-License-Identifier: Apache-2.0
// Oracle: columns of known angles.
#include "gap/causes/confusion.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/QR>

#include "gap/next/further_drive.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::confusion_test {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::StartsWith;

// Orthonormal columns: θ, a, b, c; "mixed" is cos of a and sin of b beside a good part of θ.
struct Angles {
  std::vector<RowSpace> spaces;
  CandidateTable table;

  explicit Angles(double cosine) {
    std::mt19937_64 generator(4);
    std::normal_distribution<double> normal;
    const Eigen::Index rows = 1200;
    Eigen::MatrixXd random(rows, 5);
    for (double& x : random.reshaped()) {
      x = normal(generator);
    }
    const Eigen::MatrixXd q =
        Eigen::HouseholderQR<Eigen::MatrixXd>(random).householderQ() * Eigen::MatrixXd::Identity(rows, 5);
    RowSpace space;
    space.name = "made up";
    space.t = Eigen::VectorXd::LinSpaced(rows, 0.0, 60.0);
    const double scale = std::sqrt(static_cast<double>(rows));
    for (Eigen::Index k = 0; k < 4; ++k) {
      space.columns.emplace_back(scale * q.col(k));
    }
    space.columns.emplace_back(scale *
                               (3.0 * q.col(0) + cosine * q.col(1) + std::sqrt(1.0 - cosine * cosine) * q.col(2)));
    space.columns.emplace_back(scale * q.col(0));
    space.response = scale * (q.col(0) + 2.0 * q.col(1) + q.col(4));
    table.base = {0};
    table.names = {"first", "mixed", "other", "like theta"};
    table.candidates = {
        {0, {}, {1}, {0}, false}, {1, {}, {4}, {0}, false}, {2, {}, {3}, {0}, false}, {3, {}, {5}, {0}, false}};
    spaces.push_back(std::move(space));
  }
};

std::vector<ConfusablePair> pairs_of(const CandidateTable& table, BaseModel base, double least = 0.9) {
  return confusable_pairs(table, signatures(table, base), base, least);
}

TEST(ConfusablePairs, HaveTheSquaredCosineOfWhatThetaLeaves) {
  for (const double cosine : {0.96, 0.99, 0.9999}) {
    Angles made(cosine);
    const BlockGram gram(made.spaces);
    made.table.gram = &gram;
    const std::vector<ConfusablePair> pairs = pairs_of(made.table, BaseModel::refitted);
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_EQ(pairs[0].first, "first");
    EXPECT_EQ(pairs[0].second, "mixed");
    EXPECT_NEAR(pairs[0].similarity, cosine * cosine, 1e-6);
  }
  Angles made(0.9);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  EXPECT_TRUE(pairs_of(made.table, BaseModel::refitted).empty());
  EXPECT_EQ(pairs_of(made.table, BaseModel::refitted, 0.8).size(), 1u);
}

// Held, θ hides nothing: "mixed" is nine parts θ's column of ten.
TEST(ConfusablePairs, AreOthersWhereThetaIsHeld) {
  Angles made(0.99);
  const BlockGram gram(made.spaces);
  made.table.gram = &gram;
  const std::vector<ConfusablePair> pairs = pairs_of(made.table, BaseModel::nominal, 0.85);
  ASSERT_EQ(pairs.size(), 1u);
  EXPECT_EQ(pairs[0].first, "mixed");
  EXPECT_EQ(pairs[0].second, "like theta");
  EXPECT_NEAR(pairs[0].similarity, 0.9, 1e-6);
}

// The twin has the columns of dry friction: no drive separates the two. A second copy of itself beside it makes another
// effect of which it is a special case. Straight ahead, a caster's drag is dry friction; in turns it is not.
TEST(JudgePairs, TellsWhatThisLogLacksFromWhatNoLogHas) {
  Scenario s = gap_example::noisy_scenario(gap_example::robot_with("coulomb", {{"c", 0.3}}), 1);
  s.trajectory.kind = sim::Trajectory::Kind::straight;
  DiagnoseOptions options;
  options.catalogue = gap_example::only({"coulomb", "coulomb_asymmetric", "caster_drag"});
  options.catalogue->push_back(options.catalogue->front());
  options.catalogue->back().name = "twin";
  const PreparedGap prepared = gap_example::prepared_log(s, false, options);
  const gap_example::Problem problem(prepared);
  const CandidateTable& table = problem.problem.table;
  std::vector<ConfusablePair> pairs = pairs_of(table, BaseModel::refitted, 0.0);
  judge_pairs(pairs, table, signatures(table, BaseModel::refitted), BaseModel::refitted, prepared,
              gap_example::counted_robot(), {});
  const auto pair = [&pairs](const std::string& first, const std::string& second) {
    return *std::ranges::find_if(pairs,
                                 [&](const ConfusablePair& p) { return p.first == first && p.second == second; });
  };
  EXPECT_NEAR(pair("coulomb", "twin").similarity, 1.0, 1e-6);
  EXPECT_TRUE(pair("coulomb", "twin").inseparable);
  EXPECT_THAT(pair("coulomb", "twin").reason, HasSubstr("lifted off the ground"));
  EXPECT_FALSE(pair("coulomb", "coulomb_asymmetric").inseparable);
  EXPECT_THAT(pair("coulomb", "coulomb_asymmetric").reason, StartsWith("coulomb is a special case"));
  EXPECT_GT(pair("coulomb", "caster_drag").similarity, 0.99);
  EXPECT_FALSE(pair("coulomb", "caster_drag").inseparable);
  EXPECT_THAT(pair("coulomb", "caster_drag").reason, StartsWith("not excited: reverse often"));
}

// Straight on without a turn: nothing can be said of what turning shows, and all else still is.
TEST(NotExcited, NamesWhatALogCannotShowAndWhatWould) {
  const auto sentences = [](double yaw_rate) {
    Scenario s = gap_example::noisy_scenario(gap_example::counted_robot(), 1);
    s.sensors.encoder_counts_per_turn.reset();
    s.trajectory.kind = yaw_rate > 0.0 ? sim::Trajectory::Kind::multi_sine : sim::Trajectory::Kind::straight;
    s.trajectory.yaw_rate = yaw_rate;
    DiagnoseOptions options;
    options.catalogue = gap_example::only({"coulomb", "lateral_scrub", "com_longitudinal", "payload"});
    const PreparedGap prepared = gap_example::prepared_log(s, false, options);
    const gap_example::Problem problem(prepared);
    return not_excited(problem.problem.table, prepared.catalogue, prepared.drive);
  };
  EXPECT_TRUE(sentences(1.6).empty());
  const std::vector<std::string> straight = sentences(0.0);
  EXPECT_THAT(straight, Contains(AllOf(StartsWith("lateral_scrub:"), HasSubstr("turn on the spot"))));
  EXPECT_THAT(straight, Contains(AllOf(StartsWith("com_longitudinal:"), HasSubstr("drive"))));
  EXPECT_THAT(straight, Not(Contains(StartsWith("payload:")))) << "a change of theta is no structure";
}

}  // namespace
}  // namespace wheelwright::gap::confusion_test
