// SPDX-License-Identifier: Apache-2.0
// Recordings of real machines, read where they lie beside the project.
#include <algorithm>
#include <filesystem>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/logs/csv.hpp"
#include "formats/robots/robot_file.hpp"
#include "tests/support/skip.hpp"

namespace wheelwright::logs::recordings_test {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;

class Recordings : public ::testing::Test {
 protected:
  void SetUp() override { (void)testing_support::skip_without_recordings(root / "data"); }
  std::vector<fs::path> all(const fs::path& folder, const std::string& ending) const {
    std::vector<fs::path> found;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      if (entry.path().string().ends_with(ending)) {
        found.push_back(entry.path());
      }
    }
    std::sort(found.begin(), found.end());
    return found;
  }
  const fs::path root = WHEELWRIGHT_SHARED_DIR;
};

TEST_F(Recordings, RobotFiles) {
  EXPECT_EQ(read_robot(root / "data/emps.yaml").noise.position.value, 2e-6);
  EXPECT_TRUE(read_robot(root / "data/warthog.yaml").effort_unsigned);
  EXPECT_EQ(read_robot(root / "data/regbot.yaml").effort, model::EffortKind::current);
  EXPECT_EQ(read_robot(root / "data/husky.yaml").track_width, 0.57);
  const auto cases = all("withheld-dev", "robot.yaml");
  EXPECT_EQ(cases.size(), 24u);
  for (const auto& file : cases) {
    const Robot robot = read_robot(file);
    EXPECT_EQ(robot.name, file.parent_path().filename());
    EXPECT_EQ(robot.hold, Hold::first_order);
  }
}

TEST_F(Recordings, Emps) {
  CsvLog log({root / "data/emps/emps.csv"});
  EXPECT_THAT(log.columns(), ElementsAre("position", "effort"));
  EXPECT_TRUE(log.report().clean());
  EXPECT_EQ(log.report().segments, 1u);
  EXPECT_NEAR(log.median_step(), 1e-3, 1e-9);
}

TEST_F(Recordings, Fleet) {
  const auto runs = all("data/regbot_fleet", ".csv");
  EXPECT_EQ(runs.size(), 38u);
  CsvLog log(runs);
  EXPECT_THAT(log.columns(), ElementsAre("omega_r", "omega_l", "current_r", "current_l", "voltage_r", "voltage_l"));
  EXPECT_EQ(log.report().segments, runs.size());
  EXPECT_THAT(log.report().files[0].ignored, ElementsAre("battery"));
}

TEST_F(Recordings, SkidSteer) {
  CsvLog current({root / "data/warthog/current.csv"});
  EXPECT_THAT(current.columns(), ElementsAre("omega_r", "omega_l", "current_r", "current_l"));
  CsvLog windows({root / "data/warthog/warthog_pose.csv"});
  EXPECT_GT(windows.report().gaps.count, 10u) << "windows that lie 100 s apart";
  EXPECT_THAT(windows.columns(),
              ElementsAre("omega_r", "omega_l", "x", "y", "theta", "gyro_z", "command_r", "command_l"));
}

TEST_F(Recordings, PackedBaselines) {
  const auto logs = all("withheld-dev", "baseline.csv.gz");
  EXPECT_EQ(logs.size(), 24u);
  for (const auto& file : logs) {
    CsvLog log({file});
    EXPECT_THAT(log.columns(), ElementsAre("omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta")) << file;
    EXPECT_TRUE(log.report().clean()) << file;
    EXPECT_EQ(log.report().segments, 1u) << file;
    EXPECT_EQ(log.report().files[0].packing, "gzip");
  }
}

}  // namespace
}  // namespace wheelwright::logs::recordings_test
