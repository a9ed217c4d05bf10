// SPDX-License-Identifier: Apache-2.0
// Oracle: the simulator, which knows what it did.
#include "gap/causes/selection.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <ostream>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::selection_test {
namespace {

using gap_example::counted_robot;
using gap_example::noisy_scenario;
using gap_example::prepared_log;
using gap_example::Problem;
using gap_example::robot_with;

using Names = std::vector<std::string>;

struct Found {
  Names causes;
  std::vector<Names> credible;
  Selection selection;
};

Found found_on(const Scenario& scenario, bool with_baseline, const DiagnoseOptions& options = {}) {
  const PreparedGap prepared = prepared_log(scenario, with_baseline, options);
  const Problem problem(prepared);
  Found found;
  found.selection = problem.select();
  found.causes = names_of(problem.problem.table, found.selection.all);
  for (const CredibleSet& member : found.selection.credible) {
    found.credible.push_back(names_of(problem.problem.table, member.set));
  }
  return found;
}

bool alarmed(const Selection& selection) { return selection.any_cause || !selection.reaches_floor; }

TEST(SlowSelectCauses, FindsNothingInNoise) {
  int alarms = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Scenario s = noisy_scenario(counted_robot(), seed);
    s.duration = 26.0;
    const PreparedGap prepared = prepared_log(s, false);
    alarms += alarmed(Problem(prepared, {.blocks = 16}).select()) ? 1 : 0;
  }
  EXPECT_LE(alarms, 1);
}

TEST(SelectCauses, FindsNothingInNoiseBesideAHealthyLog) {
  for (unsigned seed = 101; seed <= 103; ++seed) {
    EXPECT_FALSE(alarmed(found_on(noisy_scenario(counted_robot(), seed), true).selection)) << seed;
  }
}

// What comes out where one cause is at work.
struct Case {
  std::string name;
  std::function<Scenario()> scenario;
  Names causes;
  bool with_baseline = false;  // else the nominal values of the robot file are believed
  bool reaches_floor = true, theta_moved = false;
  friend std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.name; }
};

Case effect_case(const std::string& name, const std::map<std::string, double>& parameters) {
  return {name, [=] { return noisy_scenario(robot_with(name, parameters), 3); }, {name}};
}

Case parameter_case(const std::string& name, const std::function<void(model::DriveParameters&)>& change) {
  const auto scenario = [change] {
    Scenario s = noisy_scenario(counted_robot(), 4);
    change(s.parameters);
    return s;
  };
  return {name, scenario, {name}, true};
}

// Without its own effect in the catalogue.
Case missing_case(Case c, const Names& causes, bool reaches_floor, bool theta_moved) {
  c.causes = causes;
  c.reaches_floor = reaches_floor;
  c.theta_moved = theta_moved;
  return c;
}

Case with_baseline(Case c) {
  c.with_baseline = true;
  return c;
}

constexpr double kRadius = 0.0975, kHalfTrack = 0.1905;

class SingleCause : public testing::TestWithParam<Case> {};

TEST_P(SingleCause, IsFoundAndNothingElse) {
  const Case& c = GetParam();
  const Found found = found_on(c.scenario(), c.with_baseline);
  EXPECT_EQ(found.causes, c.causes);
  EXPECT_TRUE(found.selection.reaches_floor);
  EXPECT_FALSE(found.selection.theta_moved);
  EXPECT_LE(found.selection.left, 0.1 * found.selection.nominal_excess);
  ASSERT_FALSE(found.credible.empty());
  EXPECT_EQ(found.credible.front(), found.causes);
}

INSTANTIATE_TEST_SUITE_P(
    SelectCauses, SingleCause,
    testing::Values(
        effect_case("coulomb", {{"c", 0.3}}), effect_case("coulomb_asymmetric", {{"c_R", 0.5}, {"c_L", 0.1}}),
        effect_case("com_longitudinal", {{"a", 0.05}}), effect_case("slope", {{"g_x", 0.3}, {"g_y", 0.1}}),
        effect_case("actuator_lag", {{"T", 0.04}}), with_baseline(effect_case("wheel_radius", {{"eps", 0.03}})),
        with_baseline(effect_case("track_width", {{"eps", 0.05}})),
        parameter_case("payload",
                       [](model::DriveParameters& p) {
                         p.mass = 26.0;
                         p.yaw_inertia = 0.98;
                       }),
        parameter_case("armature",
                       [](model::DriveParameters& p) {
                         const double more = 2.0 * 0.02 / (kRadius * kRadius);  // two wheels of 0.02 kg·m²
                         p.mass += more;
                         p.yaw_inertia += more * kHalfTrack * kHalfTrack;
                       }),
        parameter_case("viscous",
                       [](model::DriveParameters& p) {
                         p.viscous_x = p.viscous_y = 8.0;
                         p.viscous_yaw *= 2.0;
                       }),
        parameter_case("torque_gain",
                       [](model::DriveParameters& p) {
                         for (double* x : {&p.mass, &p.yaw_inertia, &p.viscous_x, &p.viscous_y, &p.viscous_yaw}) {
                           *x *= 1.2;
                         }
                       })),
    [](const testing::TestParamInfo<Case>& given) { return given.param.name; });

TEST(SelectCauses, FindsTwoCausesTogether) {
  Robot world = robot_with("coulomb", {{"c", 0.3}});
  world.effects.push_back({"slope", {{"g_x", {0.2, 0.2}}, {"g_y", {-0.3, -0.3}}}});
  const Found found = found_on(noisy_scenario(world, 6), false);
  EXPECT_EQ(found.causes, (Names{"coulomb", "slope"}));
}

// Never another name with a clean bill: what is left is too much, or θ had to move to reach the floor, or what is named
// is of the same family. Which of these it is stands with each case.
class MissingCause : public testing::TestWithParam<Case> {};

TEST_P(MissingCause, IsNotBlamedOnAnother) {
  const Case& c = GetParam();
  DiagnoseOptions options;
  options.without = {c.name};
  for (const Effect& effect : effect_catalogue()) {  // nor one that has it as a part
    if (std::ranges::find(effect.stands_for, c.name) != effect.stands_for.end()) {
      options.without.push_back(effect.name);
    }
  }
  const Found found = found_on(c.scenario(), c.with_baseline, options);
  EXPECT_EQ(found.causes, c.causes);
  EXPECT_EQ(found.selection.reaches_floor, c.reaches_floor);
  EXPECT_EQ(found.selection.theta_moved, c.theta_moved);
}

INSTANTIATE_TEST_SUITE_P(
    SelectCauses, MissingCause,
    // A slope acts as a bias that turns with the heading: a bias is the best of what is left, and too little.
    testing::Values(missing_case(effect_case("slope", {{"g_x", 0.3}, {"g_y", 0.1}}), {"torque_bias"}, false, false),
                    missing_case(effect_case("coulomb", {{"c", 0.3}}), {"coulomb_asymmetric"}, true, false),
                    missing_case(effect_case("actuator_lag", {{"T", 0.04}}), {"delay"}, true, false),
                    missing_case(effect_case("com_longitudinal", {{"a", 0.05}}), {}, false, false)),
    [](const testing::TestParamInfo<Case>& given) { return given.param.name; });

// A spring that pulls the robot back to its start: in no catalogue but the user's.
Effect tether() {
  Effect effect;
  effect.name = "tether";
  effect.parameters = {{"stiffness", "N/m", 1}};
  effect.columns = [](const Drive& d, std::span<const double>) {
    Column column;
    column.effort = {d.wheel_radius *
                     (d.x.array() * d.heading.array().cos() + d.y.array() * d.heading.array().sin()).matrix()};
    return std::vector{column};
  };
  return effect;
}

TEST(SelectCauses, FindsAUsersOwnEffect) {
  const Scenario s = noisy_scenario(counted_robot(), 8);
  LogTable log = sim::simulate(s), healthy = sim::simulate(gap_example::healthy_scenario(s));
  const auto column = [&log](const std::string& name) -> std::vector<double>& {
    return log
        .columns[static_cast<std::size_t>(std::find(log.names.begin(), log.names.end(), name) - log.names.begin())];
  };
  for (std::size_t k = 0; k < log.t.size(); ++k) {
    const double along = std::cos(column("theta")[k]) * column("x")[k] + std::sin(column("theta")[k]) * column("y")[k];
    column("tau_r")[k] += 0.5 * kRadius * 3.0 * along;
    column("tau_l")[k] += 0.5 * kRadius * 3.0 * along;
  }
  DiagnoseOptions options;
  options.catalogue = effect_catalogue();
  const auto selected = [&] {
    TableSource real(log), before(healthy);
    const PreparedGap prepared = prepare_gap(real, &before, counted_robot(), options);
    const Problem problem(prepared);
    const Selection selection = problem.select();
    return std::pair(names_of(problem.problem.table, selection.all), selection.reaches_floor);
  };
  const auto [unknown, reached] = selected();
  EXPECT_FALSE(reached) << (unknown.empty() ? "nothing" : unknown[0]);
  options.catalogue->push_back(tether());
  EXPECT_EQ(selected(), std::pair(Names{"tether"}, true));
}

// A table by hand: one column that is there, one of noise, and the same one again beside a further column.
struct Table {
  std::vector<RowSpace> spaces;
  CandidateTable table;
  std::vector<EffectKind> kinds;

  Table(double size, double noise, Eigen::Index rows = 960) {
    std::mt19937_64 generator(2);
    std::normal_distribution<double> normal;
    const auto random = [&] {
      Eigen::VectorXd x(rows);
      for (double& value : x) {
        value = normal(generator);
      }
      return x;
    };
    RowSpace space;
    space.name = "by hand";
    space.t = Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows) / 16.0);
    space.columns = {random(), random(), random(), random()};
    space.response = size * space.columns[1] + noise * random();
    table.base = {0};
    table.names = {"there", "chance", "there and more"};
    table.candidates = {{0, {}, {1}, {0}, false}, {1, {}, {2}, {0}, false}, {2, {}, {1, 3}, {0, 0}, false}};
    kinds.resize(3);
    spaces.push_back(std::move(space));
  }

  [[nodiscard]] Selection select(double floor = 1.0) {
    const BlockGram gram(spaces);
    table.gram = &gram;
    return select_causes(table, kinds, false, floor);
  }
};

TEST(SelectCauses, PrefersTheSimplerOfNestedEffects) {
  const Selection found = Table(2.0, 1.0).select();
  EXPECT_EQ(found.all.members, std::vector<std::size_t>{0});
  ASSERT_EQ(found.credible.size(), 1u);
  EXPECT_TRUE(found.reaches_floor);
}

// Random columns, and a response that is a sum of some of them with noise of one floor.
struct DrawnTable {
  std::mt19937_64 generator;
  std::vector<RowSpace> spaces{1};
  CandidateTable table;
  std::vector<EffectKind> kinds;

  explicit DrawnTable(unsigned seed, Eigen::Index rows = 960) : generator(seed) {
    spaces[0].name = "drawn";
    spaces[0].t = Eigen::VectorXd::LinSpaced(rows, 0.0, static_cast<double>(rows) / 16.0);
    spaces[0].response = random();
  }
  [[nodiscard]] Eigen::VectorXd random() {
    std::normal_distribution<double> normal;
    Eigen::VectorXd x(spaces[0].t.size());
    for (double& value : x) {
      value = normal(generator);
    }
    return x;
  }
  [[nodiscard]] double uniform(double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(generator);
  }
  std::size_t add(Eigen::VectorXd column) {
    spaces[0].columns.push_back(std::move(column));
    return spaces[0].columns.size() - 1;
  }
  [[nodiscard]] const Eigen::VectorXd& column(std::size_t k) const { return spaces[0].columns[k]; }
  void effect(const std::string& name, std::vector<std::size_t> columns, std::vector<int> sign) {
    table.candidates.push_back({table.names.size(), {}, std::move(columns), std::move(sign), false});
    table.names.push_back(name);
    kinds.emplace_back();
  }
  [[nodiscard]] Selection select(bool nominal_trusted = false) {
    const BlockGram gram(spaces);
    table.gram = &gram;
    return select_causes(table, kinds, nominal_trusted, 1.0);
  }
  [[nodiscard]] std::vector<Names> credible(const Selection& found) const {
    std::vector<Names> sets;
    for (const CredibleSet& member : found.credible) {
      sets.push_back(names_of(table, member.set));
    }
    return sets;
  }
};

// A load may be taken away, one off the axle is only added: the signs of its columns say that the one is no part of the
// other, and yet it is as soon as something was added.
TEST(SelectCauses, ASetThatContainsAnotherLeavesUnlessItIsWorthItsCoefficients) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const bool more = seed % 2 == 0;
    DrawnTable drawn(5910 + seed);
    drawn.table.base = {drawn.add(drawn.random())};
    const std::size_t part = drawn.add(drawn.random()), beyond = drawn.add(drawn.random());
    drawn.effect("whole", {part, beyond}, {1, 1});
    drawn.effect("part", {part}, {0});
    drawn.spaces[0].response += drawn.uniform(1.5, 6.0) * drawn.column(part);
    drawn.spaces[0].response += (more ? drawn.uniform(1.5, 3.0) : 0.0) * drawn.column(beyond);
    const Selection found = drawn.select();
    const Names truth{more ? "whole" : "part"};
    EXPECT_EQ(names_of(drawn.table, found.all), truth) << seed;
    EXPECT_EQ(drawn.credible(found), std::vector<Names>{truth}) << seed;
    EXPECT_TRUE(found.reaches_floor) << seed;
  }
}

// What is left beside a cause is a three-hundredth of the gap, and two causes make it up alike.
TEST(SelectCauses, ATrifleMakesNothingAmbiguous) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    DrawnTable drawn(5930 + seed, 1920);
    drawn.table.base = {drawn.add(drawn.random())};
    const std::size_t large = drawn.add(drawn.random());
    const Eigen::VectorXd chance = drawn.random(), &first = drawn.column(large);
    const std::size_t small = drawn.add(chance - first * (first.dot(chance) / first.squaredNorm()));
    const std::size_t twin = drawn.add(drawn.column(small) + 0.02 * drawn.random());
    drawn.effect("large", {large}, {0});
    drawn.effect("small", {small}, {0});
    drawn.effect("twin of small", {twin}, {0});
    const double size = drawn.uniform(14.0, 16.0);
    drawn.spaces[0].response += size * drawn.column(large) + size * std::sqrt(0.0035) * drawn.column(small);
    const Selection found = drawn.select();
    EXPECT_EQ(names_of(drawn.table, found.all), Names{"large"}) << seed;
    EXPECT_EQ(found.credible.size(), 1u) << seed;
    EXPECT_EQ(found.trifles.size(), 2u) << seed;
    EXPECT_TRUE(found.reaches_floor) << seed;
    // The same as a tenth of the gap is no trifle.
    drawn.spaces[0].response += size * 0.25 * drawn.column(small);
    const Selection told = drawn.select();
    EXPECT_EQ(told.all.members.size(), 2u) << seed;
    EXPECT_EQ(told.credible.size(), 2u) << seed;
    EXPECT_TRUE(told.trifles.empty()) << seed;
  }
}

// By the efforts alone other lengths are other parameters: every pair of two of these does as well.
TEST(SelectCauses, OnALogWithoutAPoseLengthsComeAfterParameters) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    for (const bool pose : {false, true}) {
      DrawnTable drawn(5950 + seed);
      drawn.table.base = {drawn.add(drawn.random()), drawn.add(drawn.random())};
      const Eigen::VectorXd a = drawn.column(0), b = drawn.column(1);
      const double x = drawn.uniform(3.0, 5.0), y = drawn.uniform(0.3, 3.0);  // neither alone is the response
      drawn.effect("radius", {drawn.add(a + x * b)}, {0});
      drawn.effect("track", {drawn.add(a - y * b)}, {0});
      drawn.effect("payload", {drawn.add(a)}, {0});
      drawn.effect("viscous", {drawn.add(b)}, {0});
      drawn.kinds[0].unseen_length = drawn.kinds[1].unseen_length = !pose;
      drawn.spaces[0].response += drawn.uniform(2.0, 4.0) * a + drawn.uniform(2.0, 4.0) * b;
      const Selection found = drawn.select(true);
      const std::vector<Names> credible = drawn.credible(found);
      const bool both_lengths = std::ranges::find(credible, Names{"radius", "track"}) != credible.end();
      EXPECT_EQ(both_lengths, pose) << seed;
      if (!pose) {
        EXPECT_EQ(names_of(drawn.table, found.all), (Names{"payload", "viscous"})) << seed;
        EXPECT_EQ(credible.front(), (Names{"payload", "viscous"})) << seed;
      }
    }
  }
}

TEST(SelectCauses, AsksForNothingBelowTheFloor) {
  const Selection found = Table(2.0, 1.0).select(6.0);
  EXPECT_FALSE(found.any_cause);
  EXPECT_TRUE(found.reaches_floor);
  EXPECT_LT(found.refitted_excess, 0.0);
}

TEST(SelectCauses, SaysWhenNothingCouldBeSignificant) {
  Table table(5.0, 1.0);
  const BlockGram few(table.spaces, {.blocks = 8});
  table.table.gram = &few;
  const Selection found = select_causes(table.table, table.kinds, false, 1.0);
  EXPECT_EQ(found.enough_time, true) << "the signs of eight blocks have a chance of 1/256, three effects want 1/120";
  table.kinds.resize(30);
  for (std::size_t e = table.table.names.size(); e < 30; ++e) {
    table.table.names.push_back(fmt::format("effect {}", e));
  }
  const Selection many = select_causes(table.table, table.kinds, false, 1.0);
  EXPECT_FALSE(many.enough_time);
  EXPECT_FALSE(many.any_cause);
  table.table.spaces = &table.spaces;
  EXPECT_TRUE(select_causes(table.table, table.kinds, false, 1.0).enough_time) << "blocks of six pieces and more";
}

// Two blocks of 24 may both have gained by chance, 22 pieces of a second may not.
TEST(SelectCauses, TakesACauseThatActsForAShortWhile) {
  Table table(5.0, 1.0, 4800);
  RowSpace& space = table.spaces[0];
  for (Eigen::Index k = 0; k < space.t.size(); ++k) {
    if (space.t[k] < 100.0 || space.t[k] > 125.0) {
      space.response[k] -= 5.0 * space.columns[1][k];
      space.columns[1][k] = 0.0;
    }
  }
  const BlockGram gram(table.spaces);
  table.table.gram = &gram;
  EXPECT_FALSE(select_causes(table.table, table.kinds, false, 1.0).any_cause);
  table.table.spaces = &table.spaces;
  EXPECT_EQ(select_causes(table.table, table.kinds, false, 1.0).all.members, std::vector<std::size_t>{0});
}

TEST(SelectCauses, NeedsAGramAndAKindForEachEffect) {
  Table table(1.0, 1.0);
  EXPECT_THROW((void)select_causes(table.table, table.kinds, false, 1.0), InvalidArgument);
  const BlockGram gram(table.spaces);
  table.table.gram = &gram;
  table.kinds.pop_back();
  EXPECT_THROW((void)select_causes(table.table, table.kinds, false, 1.0), InvalidArgument);
}

TEST(UnexplainedBy, IsTheShareThatAnotherSetCannotMakeUp) {
  Table table(1.0, 1.0);
  const BlockGram gram(table.spaces);
  table.table.gram = &gram;
  EXPECT_LT(unexplained_by(table.table, {0}, {2}, BaseModel::refitted), 1e-8);
  EXPECT_GT(unexplained_by(table.table, {2}, {0}, BaseModel::refitted), 0.9);
  const RowSpace& space = table.spaces[0];
  const auto freed = [&space](std::size_t k) {
    const Eigen::VectorXd& theta = space.columns[0];
    return Eigen::VectorXd(space.columns[k] - theta * (theta.dot(space.columns[k]) / theta.squaredNorm()));
  };
  const Eigen::VectorXd a = freed(1), b = freed(2);
  const double cosine = a.dot(b) / (a.norm() * b.norm());
  EXPECT_NEAR(unexplained_by(table.table, {0}, {1}, BaseModel::refitted), 1.0 - cosine * cosine, 1e-8);
}

}  // namespace
}  // namespace wheelwright::gap::selection_test
