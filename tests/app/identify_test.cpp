// SPDX-License-Identifier: Apache-2.0
// `wheelwright identify` as a user runs it.
#include <cmath>

#include "tests/app/program.hpp"

namespace wheelwright::app::identify_test {

using files::read_json;

namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::Outcome;

class Identify : public testing::ProgramTest {
 protected:
  std::string shipped() const { return fmt::format("'{}'", (examples() / "healthy.csv.gz").string()); }

  void put_still() const {
    std::string still = "t,phi_r,phi_l,tau_r,tau_l\n";
    for (int k = 0; k < 2000; ++k) {
      still += std::to_string(0.01 * k) + ",0,0,0,0\n";
    }
    put("still.csv", still);
  }
};

TEST_F(Identify, ShippedLogGivesTheTruthAndTheWordsComeFirst) {
  const Outcome done = run("identify " + shipped() + " --robot robot.yaml --out result");
  ASSERT_EQ(done.code, 0) << done.err;
  EXPECT_THAT(names_in("result"), ElementsAre("identification.json", "report.html"));
  EXPECT_THAT(testing::lines_of(done.out).front(), HasSubstr("All 4 parameters are identified"));
  EXPECT_THAT(done.out, AllOf(HasSubstr("(taken)"), HasSubstr("what the intervals promise"), HasSubstr("\nnext\n")));
  const Json result = read_json(path("result/identification.json"));
  EXPECT_EQ(result.at("schema"), "wheelwright/identification/1");
  EXPECT_EQ(result.at("standing"), "good");
  const std::vector<double> truth = {21.0, 0.9, 4.0, 0.5};  // scenarios/shipped.yaml
  for (std::size_t j = 0; j < truth.size(); ++j) {
    EXPECT_NEAR(result.at("parameters")[j].at("physical").at("estimate").get<double>(), truth[j], 0.01 * truth[j]);
  }
  // θ_L and the physical quantity are tied by scale and offset.
  for (const Json& p : result.at("parameters")) {
    const Json& physical = p.at("physical");
    EXPECT_DOUBLE_EQ(
        physical.at("estimate").get<double>(),
        physical.at("scale").get<double>() * p.at("estimate").get<double>() - physical.at("offset").get<double>());
  }
}

TEST_F(Identify, SameSeedSameBytesAndAnotherSeedAnotherBootstrap) {
  for (const std::string options : {"--out a", "--out b --threads 2", "--out c --seed 2"}) {
    ASSERT_EQ(run("identify " + shipped() + " --robot robot.yaml --no-shapes --quiet " + options).code, 0);
  }
  const std::string first = bytes(path("a/identification.json"));
  EXPECT_FALSE(first.empty());
  EXPECT_EQ(bytes(path("b/identification.json")), first);
  const Json a = read_json(path("a/identification.json")), c = read_json(path("c/identification.json"));
  EXPECT_EQ(a.at("parameters"), c.at("parameters"));
  EXPECT_NE(a.at("regions"), c.at("regions"));
  EXPECT_THAT(a.at("shapes"), IsEmpty());
}

TEST_F(Identify, JsonIsAllThatGoesToStandardOutput) {
  const Outcome done = run("identify " + shipped() + " --robot robot.yaml --no-shapes --json --out result");
  EXPECT_EQ(done.code, 0);
  EXPECT_EQ(Json::parse(done.out), read_json(path("result/identification.json")));
  const Outcome quiet = run("identify " + shipped() + " --robot robot.yaml --no-shapes --quiet");
  EXPECT_THAT(quiet.out + quiet.err, IsEmpty());
}

TEST_F(Identify, ALogThatShowsNothingIsOne) {
  put_still();
  const Outcome still = run("identify still.csv --robot robot.yaml");
  EXPECT_EQ(still.code, 1) << still.err;
  EXPECT_THAT(still.out, AllOf(HasSubstr("shows no parameter"), HasSubstr("Accelerate and brake")));
}

TEST_F(Identify, BadInputIsTwoAndLeavesNoResult) {
  std::string no_effort = "t,phi_r,phi_l\n";
  for (int k = 0; k < 100; ++k) {
    no_effort += fmt::format("{},{},{}\n", 0.01 * k, 0.02 * k, 0.02 * k);
  }
  put("no_effort.csv", no_effort);
  put("short.csv", "t,phi_r,phi_l,tau_r,tau_l\n0,0,0,0,0\n0.01,0,0,0,0\n");
  for (const std::string words : {"no_effort.csv --robot robot.yaml", "short.csv --robot robot.yaml",
                                  "missing.csv --robot robot.yaml", "short.csv --robot missing.yaml", "short.csv"}) {
    const Outcome outcome = run("identify " + words + " --out result");
    EXPECT_EQ(outcome.code, 2) << words;
    EXPECT_THAT(outcome.out, IsEmpty()) << words;
    EXPECT_FALSE(outcome.err.empty()) << words;
    EXPECT_FALSE(std::filesystem::exists(path("result/identification.json"))) << words;
  }
  EXPECT_THAT(run("identify no_effort.csv --robot robot.yaml").err, HasSubstr("tau_r"));
}

TEST_F(Identify, FitsItsSchema) {
  if (testing_support::skip_unless(has_validator(), "python3-jsonschema is not installed")) {
    return;
  }
  put_still();
  put("line.yaml",
      "robot: robot.yaml\nparameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
      "trajectory: {kind: straight, speed: 0.6, period: 6}\nduration: 30\n"
      "sensors: {wheel_speed: 0.02, effort: 0.02, encoder_counts_per_turn: 4096}\n");
  ASSERT_EQ(run("simulate line.yaml --out line.csv").code, 0);
  simulate("healthy.yaml", "drive.csv");
  std::string kinematics = "t,omega_r,omega_l,x,y,theta\n";
  double x = 0.0, y = 0.0, theta = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const double t = 0.01 * k, r = 5.0 + 2.0 * std::sin(0.7 * t), l = 5.0 + 2.0 * std::cos(0.9 * t);
    // Without an error of its own it would be the wheels over again.
    kinematics += fmt::format("{},{},{},{},{},{}\n", t, r, l, x, y, theta + 0.003 * std::sin(1.7 * k));
    x += 0.01 * 0.0975 * 0.5 * (r + l) * std::cos(theta);
    y += 0.01 * 0.0975 * 0.5 * (r + l) * std::sin(theta);
    theta += 0.01 * 0.0975 * (r - l) / 0.381;
  }
  put("pose.csv", kinematics);
  for (const std::string log : {"still", "line", "drive", "pose"}) {
    const Outcome outcome = run("identify " + log + ".csv --robot robot.yaml --quiet --out " + log);
    EXPECT_EQ(outcome.code, log == "still" ? 1 : 0) << log << outcome.err;
    EXPECT_EQ(misfit("identification.schema.json", log + "/identification.json"), "") << log;
  }
  EXPECT_TRUE(read_json(path("line/identification.json")).at("parameters")[1].at("estimate").is_null());
  EXPECT_TRUE(read_json(path("pose/identification.json")).at("estimators").is_null());
  EXPECT_FALSE(read_json(path("pose/identification.json")).at("kinematics").is_null());

  Json changed = read_json(path("drive/identification.json"));
  changed["standing"] = "great";
  files::write_json(path("changed.json"), changed);
  EXPECT_NE(misfit("identification.schema.json", "changed.json"), "");
}

}  // namespace
}  // namespace wheelwright::app::identify_test
