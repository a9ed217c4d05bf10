// SPDX-License-Identifier: Apache-2.0
// The schema of the robot object and its reader know the same keys.
#include <algorithm>
#include <filesystem>
#include <string>

#include <nlohmann/json.hpp>

#include "formats/robots/robot_file.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::robots::robot_schema_test {
namespace {

using ::testing::HasSubstr;

Json schema() {
  return files::read_json(std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "results" / "robot.schema.json");
}

TEST(RobotSchema, NamesTheKeysThatTheReaderKnows) {
  const std::string message = testing::input_error([] { (void)parse_robot("unheard_of: 1\n", "f"); });
  std::size_t count = 0;
  const Json document = schema();
  for (const auto& property : document.at("properties").items()) {
    EXPECT_THAT(message, HasSubstr(property.key()));
    ++count;
  }
  const std::string list = message.substr(message.find("expected one of ") + 16);
  EXPECT_EQ(static_cast<std::size_t>(std::count(list.begin(), list.end(), ',')) + 1, count) << list;
}

TEST(RobotSchema, CoversWhatIsWritten) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.5;
  robot.footprint_radius = 0.4;
  robot.parameters = {"mass", "yaw_inertia"};
  robot.nominal["mass"] = 3.0;
  robot.prior["mass"] = {1.0, 5.0};
  robot.filter.order = 2;
  robot.encoder_counts_per_turn = 4096.0;
  robot.pose_source = model::PoseSource::independent;
  robot.speed_filter = {.time = {0.02, 0.03}};
  robot.speed_cut = {.unit = 0.1};
  robot.clock = EvenClock{.step = 0.01, .drift = 1e-6};
  robot.heading_offset = 0.7;
  robot.wheel_directions_checked = true;
  robot.limits["effort"] = 1.0;
  robot.motor.emplace();
  robot.kinematic_window = 0.5;
  robot.thresholds["sum"] = 0.2;
  robot.effects.push_back({"coulomb", {{"c", {0.1, 0.1}}}});
  const Json document = schema();
  const Json written = to_json(robot);
  for (const auto& member : written.items()) {
    ASSERT_TRUE(document.at("properties").contains(member.key())) << member.key();
  }
  for (const auto& member : written.at("effort").items()) {
    EXPECT_TRUE(document.at("properties").at("effort").at("properties").contains(member.key())) << member.key();
  }
  // `columns` is the log's, and is written by columns_yaml().
  ASSERT_TRUE(document.at("properties").contains("columns"));
  EXPECT_EQ(written.size() + 1, document.at("properties").size()) << "a key of the schema is never written";
}

}  // namespace
}  // namespace wheelwright::robots::robot_schema_test
