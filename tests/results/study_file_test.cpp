// SPDX-License-Identifier: Apache-2.0
#include "results/study_json.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::results::study_file_test {
namespace {

const std::filesystem::path kFolder = std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "examples" / "studies";

StudyFile parsed(const std::string& text) { return parse_study(text, "study.yaml", kFolder); }

const std::string kHead = "scenario: ../scenarios/commissioning.yaml\n";

std::string message(const std::string& text) {
  try {
    static_cast<void>(parsed(text));
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(StudyFile, ReadsWhatIsThere) {
  const StudyFile file = parsed(kHead +
                                "name: a study\n"
                                "inputs:\n"
                                "  noise.effort: [0.01, 0.05]\n"
                                "  wheel_radius: {relative: [-0.02, 0.02]}\n"
                                "  filter.beta: {range: [5, 40], scale: log, nominal: 10}\n"
                                "quantities: [width.mass, threshold.peak.sum]\n"
                                "window: 0.5\n"
                                "seed: 7\n"
                                "methods:\n"
                                "  local: true\n"
                                "  one_at_a_time: {levels: 3}\n"
                                "  morris: {trajectories: 4}\n"
                                "  sobol: {points: 8, replicates: 4, confidence: 0.9}\n"
                                "  grid: {levels: {noise.effort: 3, filter.beta: 2}}\n");
  const study::Study& study = file.study;
  EXPECT_EQ(study.name, "a study");
  ASSERT_EQ(study.inputs.size(), 3U);
  EXPECT_EQ(study.inputs[0].nominal, 0.02);
  EXPECT_NEAR(study.inputs[1].lower, 0.98 * 0.0975, 1e-15);
  EXPECT_EQ(study.inputs[1].unit, "m");
  EXPECT_TRUE(study.inputs[2].logarithmic);
  EXPECT_EQ(study.inputs[2].nominal, 10.0);
  ASSERT_EQ(study.quantities.size(), 2U);
  EXPECT_EQ(study.evaluate.window, 0.5);
  EXPECT_TRUE(study.methods.local);
  EXPECT_EQ(study.methods.one_at_a_time, 3);
  EXPECT_EQ(study.methods.morris->trajectories, 4);
  EXPECT_EQ(study.methods.morris->seed, 7U);
  EXPECT_EQ(study.methods.sobol->replicates, 4);
  EXPECT_EQ(study.methods.sobol->confidence, 0.9);
  EXPECT_EQ(study.methods.grid->levels, (std::vector<Eigen::Index>{3, 1, 2}));
  const study::StudyDesign design = study::design_of(study);
  EXPECT_EQ(design.one_at_a_time.count, 10);
  EXPECT_EQ(design.morris.count, 16);
  EXPECT_EQ(design.sobol.count, 8 * 4 * 5);
  EXPECT_EQ(design.grid.count, 6);
  EXPECT_LT(design.rows.size(), static_cast<std::size_t>(design.points.rows()));  // methods share points
}

// A filter that the tool would choose anew at every point gets the constants of the nominal drive.
TEST(StudyFile, AFilterThatIsVariedHasANominalValue) {
  const StudyFile file = parsed(kHead + "inputs: {filter.beta: [4, 40]}\nmethods: {one_at_a_time: {levels: 2}}\n");
  EXPECT_TRUE(file.study.subject.robot.filter.beta);
  ASSERT_FALSE(file.notes.empty());
  EXPECT_NE(file.notes[0].find("β"), std::string::npos);
}

TEST(StudyFile, ShippedStudiesAreRead) {
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    EXPECT_NO_THROW(static_cast<void>(study::design_of(read_study(entry.path()).study))) << entry.path();
  }
}

TEST(StudyFile, SaysFileLineKeyValueAndWhatWasExpected) {
  const std::vector<std::pair<std::string, std::vector<std::string>>> cases = {
      {"inputs: {rate: [1, 2]}\n", {"study.yaml", "scenario", "log"}},
      {"log: a.csv\ninputs: {rate: [1, 2]}\n", {"robot"}},
      {kHead, {"inputs"}},
      {kHead + "inputs: {}\n", {":2", "at least one input"}},
      {kHead + "inputs: {noise.efort: [1, 2]}\n", {":2", "noise.efort", "wheel_speed"}},
      {kHead + "inputs: {rate: [2, 1]}\n", {":2", "rate", "the first below the second"}},
      {kHead + "inputs: {rate: [2]}\n", {":2", "rate", "two numbers"}},
      {kHead + "inputs: {rate: {scale: log}}\n", {":2", "rate", "range"}},
      {kHead + "inputs: {filter.beta: {range: [0, 1], scale: log}}\n", {":2", "filter.beta", "above 0"}},
      {kHead + "inputs: {prior.mass: [0.5, 2]}\n", {":2", "prior.mass"}},
      {kHead + "inputs: {rate: [50, 100]}\nquantities: [width.colour]\n", {":3", "width.colour", "r_mass"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {sobol: {points: 12}}\n", {":3", "power of two"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {sobol: {points: 4294967296}}\n",
       {":3", "points", "4294967296", "100000"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {sobol: {points: 65536, replicates: 65536}}\n",
       {":3", "points times replicates", "100000"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {morris: {trajectories: 1000000000}}\n",
       {":3", "trajectories", "1000000000", "100000"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {one_at_a_time: {levels: 1000000000}}\n",
       {":3", "levels", "1000000000", "100000"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {grid: {levels: 1000000000}}\n",
       {":3", "levels", "1000000000", "100000"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {sobols: {}}\n", {":3", "sobols", "sobol"}},
      {kHead + "inputs: {rate: [50, 100]}\nmethods: {local: false}\n", {":3", "at least one of"}},
      {kHead + "inputs: {rate: [50, 100]}\nwindows: 2\n", {":3", "windows", "window"}},
  };
  for (const auto& [text, parts] : cases) {
    const std::string said = message(text);
    EXPECT_NE(said, "") << text;
    for (const std::string& part : parts) {
      EXPECT_NE(said.find(part), std::string::npos) << text << "\n" << said;
    }
  }
}

}  // namespace
}  // namespace wheelwright::results::study_file_test
