// SPDX-License-Identifier: Apache-2.0
// Commands as a recording: byte for byte what CDR laid down by hand says.
#include "formats/logs/velocity_commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/mcap.hpp"
#include "tests/logs/ros_cdr.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::velocity_commands_test {
namespace {

class VelocityCommands : public testing::ScratchTest {};

TEST_F(VelocityCommands, AreTwistsWithAStampOfZero) {
  const LogTable commands{{"linear_x", "angular_z"}, {0.0, 0.5, 1.25}, {{0.0, 0.4, -0.1}, {0.0, -1.5, 2.0}}, {0}};
  write_velocity_commands(path("drive.mcap"), commands);
  McapReader reader(path("drive.mcap"));
  std::size_t stamped = 0, bare = 0;
  for (McapMessage message; reader.next(message);) {
    const std::string& topic = reader.channels().at(message.channel_id).topic;
    const bool has_header = topic == "/cmd_vel";
    const std::size_t k = has_header ? stamped++ : bare++;
    testing::HandCdr expected(true);
    if (has_header) {
      expected.put(std::int32_t{0}).put(std::uint32_t{0}).put("base_link");
    }
    expected.put(commands.columns[0][k]).put(0.0).put(0.0).put(0.0).put(0.0).put(commands.columns[1][k]);
    EXPECT_EQ(message.log_time, static_cast<std::uint64_t>(commands.t[k] * 1e9));
    EXPECT_EQ(message.data.size(), expected.str().size());
    // The fields apart: what padding holds does not matter.
    EXPECT_EQ(message.data.substr(message.data.size() - 48), expected.str().substr(expected.str().size() - 48));
    EXPECT_EQ(message.data.substr(0, has_header ? 26 : 4), expected.str().substr(0, has_header ? 26 : 4));
    EXPECT_TRUE(has_header || topic == "/cmd_vel_unstamped");
  }
  EXPECT_EQ(stamped, 3U);
  EXPECT_EQ(bare, 3U);
}

TEST_F(VelocityCommands, WithoutTheirColumnsAreRefused) {
  EXPECT_THROW(write_velocity_commands(path("drive.mcap"), {{"linear_x"}, {0.0}, {{0.0}}, {0}}), InvalidArgument);
  EXPECT_FALSE(std::filesystem::exists(path("drive.mcap")));
}

}  // namespace
}  // namespace wheelwright::logs::velocity_commands_test
