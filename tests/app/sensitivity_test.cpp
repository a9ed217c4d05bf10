// SPDX-License-Identifier: Apache-2.0
#include "tests/app/program.hpp"

namespace wheelwright::app::sensitivity_test {
namespace {

using testing::Outcome;

class Sensitivity : public testing::ProgramTest {
 protected:
  void SetUp() override {
    put("scenario.yaml",
        "robot: robot.yaml\n"
        "parameters: {mass: 21.0, yaw_inertia: 0.9, viscous_linear: 4.0, viscous_yaw: 0.5}\n"
        "trajectory: {kind: commissioning, speed: 0.6, yaw_rate: 1.2, period: 3}\n"
        "duration: 15\n"
        "rate: 50\n"
        "sensors: {noise: uniform, wheel_speed: 0.02, effort: 0.02, position: 0.002, heading: 0.003, "
        "encoder_counts_per_turn: 4096}\n");
    put("study.yaml",
        "scenario: scenario.yaml\n"
        "inputs:\n"
        "  noise.effort: {range: [0.01, 0.05], scale: log}\n"
        "  filter.beta: {range: [5, 20], nominal: 8}\n"
        "quantities: [width, threshold.mean, smallest_fault.wheel_radius, commissioned]\n"
        "methods:\n"
        "  local: true\n"
        "  one_at_a_time: {levels: 3}\n"
        "  morris: {trajectories: 2}\n"
        "  sobol: {points: 2, replicates: 2}\n"
        "  grid: {levels: 2}\n");
  }
};

TEST_F(Sensitivity, WritesResultPageAndTables) {
  const Outcome done = run("sensitivity study.yaml --out result");
  ASSERT_EQ(done.code, 0) << done.err;
  for (const char* part : {"width.r_mass", "noise.effort", "as it is", "share of the variance", "elementary effects",
                           "per cent of width"}) {
    EXPECT_NE(done.out.find(part), std::string::npos) << part << "\n" << done.out;
  }
  const Json result = files::read_json(path("result/sensitivity.json"));
  EXPECT_EQ(result.at("quantities").size(), 4U + 2U + 1U + 1U);
  const Json& width = result.at("quantities").at(0);
  // More noise, wider bounds, at every level and by the duals.
  const Json& curves = width.at("one_at_a_time").at("inputs");
  for (const Json& input : curves) {
    if (input.at("input") == "noise.effort") {
      EXPECT_LT(input.at("low").get<double>(), input.at("high").get<double>());
    }
  }
  const Json& local = result.at("local").at("inputs").at(0);
  EXPECT_EQ(local.at("input"), "noise.effort");
  EXPECT_GT(local.at("parameters").at(0).at("width").at("right").get<double>(), 0.0);
  const std::string page = bytes(path("result/report.html"));
  EXPECT_NE(page.find("Derivatives of the bounds"), std::string::npos);
  if (has_validator()) {
    EXPECT_EQ(misfit("sensitivity.schema.json", "result/sensitivity.json"), "");
  }
}

// Threads and shards share out, and change nothing; a second run evaluates nothing.
TEST_F(Sensitivity, TheResultDoesNotDependOnHowItIsSharedOut) {
  ASSERT_EQ(run("sensitivity study.yaml --out one --quiet").code, 0);
  ASSERT_EQ(run("sensitivity study.yaml --out two --threads 2 --quiet").code, 0);
  for (int shard = 1; shard <= 3; ++shard) {
    ASSERT_EQ(run(fmt::format("sensitivity study.yaml --out shards --shard {}/3 --quiet", shard)).code, 0);
  }
  const Outcome merged = run("sensitivity study.yaml --out shards --merge --quiet");
  ASSERT_EQ(merged.code, 0) << merged.err;
  const std::string json = bytes(path("one/sensitivity.json"));
  EXPECT_EQ(json, bytes(path("two/sensitivity.json")));
  EXPECT_EQ(json, bytes(path("shards/sensitivity.json")));
  // More levels are more points, and those that are there are not evaluated again: the store is of the same plan.
  const std::string study = bytes(path("study.yaml"));
  put("study.yaml", study + "name: the same, with a name\n");
  EXPECT_EQ(run("sensitivity study.yaml --out one --quiet").code, 0);
  put("study.yaml", study + "window: 0.5\n");
  const Outcome other = run("sensitivity study.yaml --out one --quiet");
  EXPECT_EQ(other.code, 2);
  EXPECT_NE(other.err.find("window"), std::string::npos) << other.err;
}

TEST_F(Sensitivity, SaysWhatIsWrongInTheStudy) {
  put("study.yaml", "scenario: scenario.yaml\ninputs: {noise.efort: [1, 2]}\n");
  const Outcome done = run("sensitivity study.yaml");
  EXPECT_EQ(done.code, 2);
  EXPECT_NE(done.err.find("study.yaml:2"), std::string::npos) << done.err;
}

}  // namespace
}  // namespace wheelwright::app::sensitivity_test
