// SPDX-License-Identifier: Apache-2.0
// wheelwright compare: what was changed in the simulated robot is told and named, what was not is not.
#include "core/words.hpp"

#include "tests/app/program.hpp"

namespace wheelwright::app::compare_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Outcome;

class Compare : public testing::ProgramTest {
 protected:
  /// NAME/model.json of the robot of the shipped scenario with `from` replaced by `to`.
  void commission(const std::string& name, int seed, const std::string& from = "", const std::string& to = "") const {
    std::string scenario = bytes(examples() / "scenarios" / "healthy.yaml");
    core::replace_all(scenario, "../robot.yaml", "robot.yaml");
    core::replace_all(scenario, "duration: 60", "duration: 40");
    if (!from.empty()) {
      ASSERT_THAT(scenario, HasSubstr(from));
      core::replace_all(scenario, from, to);
    }
    put(name + ".yaml", scenario);
    ASSERT_EQ(run(fmt::format("simulate {0}.yaml --out {0}.csv --seed {1}", name, seed)).code, 0);
    const Outcome done = run(fmt::format("commission {0}.csv --robot robot.yaml --out {0}", name));
    ASSERT_EQ(done.code, 0) << done.err;
  }

  Json compared(const std::string& before, const std::string& after, int code) const {
    const Outcome outcome = run(fmt::format("compare {}/model.json {}/model.json --json", before, after));
    EXPECT_EQ(outcome.code, code) << outcome.out << outcome.err;
    put("said.json", outcome.out);
    if (has_validator()) {
      EXPECT_EQ(misfit("comparison.schema.json", "said.json"), "");
    }
    return Json::parse(outcome.out, nullptr, false);
  }

  static const Json& parameter(const Json& said, const std::string& quantity) {
    for (const Json& set : said.at("sets")) {
      for (const Json& each : set.at("parameters")) {
        if (each.at("quantity") == quantity) {
          return each;
        }
      }
    }
    throw std::runtime_error("no " + quantity);
  }
};

TEST_F(Compare, ARobotThatStayedAsItWasIsNotSaidToHaveChanged) {
  commission("monday", 5);
  commission("friday", 6);
  const Json said = compared("monday", "friday", 0);
  EXPECT_FALSE(said.at("changed").get<bool>());
  EXPECT_THAT(said.at("message").get<std::string>(), HasSubstr("one robot explains both logs"));
  for (const Json& set : said.at("sets")) {
    EXPECT_TRUE(set.at("compatible").get<bool>());
  }
  const Json& mass = parameter(said, "mass");
  EXPECT_LE(mass.at("together").at(0).get<double>(), 21.0);
  EXPECT_GE(mass.at("together").at(1).get<double>(), 21.0);
  EXPECT_GE(said.at("sets").size(), 2U) << "of the wheels too";
}

TEST_F(Compare, ALoadIsTold) {
  commission("empty", 5);
  commission("loaded", 6, "mass: 21.0", "mass: 26.0");
  const Json said = compared("empty", "loaded", 1);
  EXPECT_TRUE(said.at("changed").get<bool>());
  const Json& mass = parameter(said, "mass");
  EXPECT_TRUE(mass.at("certain").get<bool>());
  EXPECT_LE(mass.at("change").at(0).get<double>(), 5.0);
  EXPECT_GE(mass.at("change").at(1).get<double>(), 5.0);
  EXPECT_GE(mass.at("change").at(0).get<double>(), 2.0) << "and not by little";
  EXPECT_FALSE(parameter(said, "yaw_inertia").at("certain").get<bool>());

  const Outcome told = run("compare empty/model.json loaded/model.json --out wear");
  EXPECT_EQ(told.code, 1);
  EXPECT_THAT(told.out, AllOf(HasSubstr("Mass has changed between the logs"), HasSubstr("more) alone explains it"),
                              HasSubstr("loaded.csv")));
  EXPECT_THAT(names_in("wear"), ElementsAre("comparison.json", "report.html"));
  EXPECT_NE(bytes(path("wear/report.html")).find("Mass has changed between the logs"), std::string::npos);
  EXPECT_THAT(run("compare loaded/model.json empty/model.json").out, HasSubstr("less) alone explains it"));
}

// 7 % more friction, of which no bound is sure.
TEST_F(Compare, WhatIsLikelyButNotCertainIsToldAsThat) {
  commission("before", 5);
  commission("again", 7);
  commission("after", 6, "viscous_linear: 4.0", "viscous_linear: 4.3");
  const Json said = compared("before", "after", 1);
  EXPECT_FALSE(said.at("changed").get<bool>()) << "for certain";
  EXPECT_THAT(said.at("message").get<std::string>(),
              AllOf(HasSubstr("a change is likely, but not certain: viscous linear"), HasSubstr("standard errors")));
  int told = 0;
  for (const Json& guess : said.at("guesses")) {
    told += guess.at("told").get<bool>() ? 1 : 0;
    EXPECT_EQ(guess.at("told").get<bool>(), guess.at("quantity") == "viscous_linear") << guess.dump();
  }
  EXPECT_EQ(told, 1);
  const Outcome page = run("compare before/model.json after/model.json --out page");
  EXPECT_EQ(page.code, 1);
  EXPECT_NE(bytes(path("page/report.html")).find("A change is likely, but not certain"), std::string::npos);
  EXPECT_THAT(compared("before", "again", 0).at("message").get<std::string>(), HasSubstr("no change is told"));
}

TEST_F(Compare, WornTyresAreToldByThePose) {
  commission("new", 5);
  commission("worn", 6, "duration: 40",
             "duration: 40\nfaults: [{kind: wheel_radius, magnitude: -0.006, onset: 0, shape: step}]");
  const Json said = compared("new", "worn", 1);
  for (const std::string side : {"radius_right", "radius_left"}) {
    const Json& radius = parameter(said, side);
    EXPECT_TRUE(radius.at("certain").get<bool>()) << side;
    EXPECT_LE(radius.at("change").at(0).get<double>(), -0.006);
    EXPECT_GE(radius.at("change").at(1).get<double>(), -0.006);
  }
}

TEST_F(Compare, WhatBothHaveIsComparedWhereOneHasDryFrictionToo) {
  commission("one", 5);
  const std::string dry = bytes(path("robot.yaml"));
  put("dry.yaml", dry + "parameters: [mass, yaw_inertia, viscous_linear, viscous_yaw, coulomb]\n");
  ASSERT_EQ(run("commission one.csv --robot dry.yaml --out other").code, 0);
  for (const auto& [before, after] : {std::pair("one", "other"), std::pair("other", "one")}) {
    const Json said = compared(before, after, 0);
    EXPECT_LT(parameter(said, "mass").at("change").at(0).get<double>(), 0.0);
    EXPECT_GT(parameter(said, "mass").at("change").at(1).get<double>(), 0.0);
    EXPECT_THROW((void)parameter(said, "coulomb"), std::runtime_error);
    EXPECT_THAT(said.at("not_compared").get<std::string>(), HasSubstr("coulomb"));
  }
}

TEST_F(Compare, WhatDoesNotCompareIsRefusedWithAWayOut) {
  commission("one", 5);
  std::string wide = bytes(path("robot.yaml"));
  core::replace_all(wide, "track_width: 0.381", "track_width: 0.5");
  put("robot.yaml", wide);
  ASSERT_EQ(run("commission one.csv --robot robot.yaml --out other").code, 0);
  const Outcome outcome = run("compare one/model.json other/model.json");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_THAT(outcome.err, AllOf(HasSubstr("one/model.json and other/model.json"), HasSubstr("track_width"),
                                 HasSubstr("expected two models of one robot file")));
  EXPECT_EQ(run("compare one/model.json robot.yaml").code, 2);
  EXPECT_EQ(run("compare one/model.json gone.json").code, 2);
  const Outcome same = run("compare one/model.json one/model.json");
  EXPECT_EQ(same.code, 0);
  EXPECT_THAT(same.out, HasSubstr("from the same log"));
}

}  // namespace
}  // namespace wheelwright::app::compare_test
