// SPDX-License-Identifier: Apache-2.0
// One side of tools/check_mcap.sh: MCAP files by Wheelwright.
//
//   check_mcap write DIRECTORY    writes none.mcap, zstd.mcap, lz4.mcap and loose.mcap
//   check_mcap read FILE          every message on a line, as check_mcap.mjs prints it
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/logs/mcap.hpp"

namespace {

using namespace wheelwright;

std::string hex(std::string_view bytes) {
  std::string text;
  for (const char byte : bytes) {
    text += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  }
  return text;
}

void write(const std::filesystem::path& path, logs::McapCompression compression, std::size_t chunk_bytes) {
  logs::McapWriter writer(path, {compression, chunk_bytes, "ros2", "wheelwright"});
  const auto joints = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", "float64[] position\n");
  writer.add_channel(joints, "/joint_states", "cdr", {{"offered_qos_profiles", ""}});
  writer.add_channel(0, "/note", "json");
  for (std::uint32_t k = 0; k < 5000; ++k) {
    const std::string data(k * k % 97, static_cast<char>(k % 7));
    const std::uint64_t time = 1'700'000'000'000'000'000ULL + 1000 * k;
    writer.write({static_cast<std::uint16_t>(1 + k % 2), k, time, time - k, data});
  }
  writer.commit();
}

void read(const std::filesystem::path& path) {
  logs::McapReader reader(path);
  logs::McapMessage message;
  while (reader.next(message)) {
    const logs::McapChannel& channel = reader.channels().at(message.channel_id);
    const logs::McapSchema* schema = reader.schema_of(channel);
    fmt::print("{} {} {} {} {} {} {} {} {}\n", channel.topic, channel.message_encoding, schema ? schema->name : "-",
               schema ? schema->encoding : "-", schema ? hex(schema->text) : "-", message.sequence, message.log_time,
               message.publish_time, hex(message.data));
  }
  for (const std::string& line : logs::sentences(reader.report())) {
    fmt::print("{}\n", line);
  }
}

}  // namespace

int main(int count, char** words) {
  try {
    const std::string verb = count == 3 ? words[1] : "";
    if (verb == "write") {
      const std::filesystem::path folder = words[2];
      write(folder / "none.mcap", logs::McapCompression::none, 4096);
      write(folder / "zstd.mcap", logs::McapCompression::zstd, 4096);
      write(folder / "lz4.mcap", logs::McapCompression::lz4, 4096);
      write(folder / "loose.mcap", logs::McapCompression::none, 0);
    } else if (verb == "read") {
      read(words[2]);
    } else {
      std::fputs("usage: check_mcap write DIRECTORY | read FILE\n", stderr);
      return 2;
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "check_mcap: {}\n", error.what());
    return 3;
  }
}
