// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small MCAP files for tests, and what reading one gives.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "formats/logs/mcap.hpp"

namespace wheelwright::testing {

/// A message with its own data.
struct OwnedMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;
  std::string data;

  bool operator==(const OwnedMessage&) const = default;
};

inline OwnedMessage owned(const logs::McapMessage& m) {
  return {m.channel_id, m.sequence, m.log_time, m.publish_time, std::string(m.data)};
}

/// Messages on the channels 1 to 3 whose `sequence` is their index; data of all lengths, the empty one too.
inline std::vector<OwnedMessage> sample_messages(std::size_t count) {
  std::vector<OwnedMessage> messages;
  for (std::size_t k = 0; k < count; ++k) {
    std::string data;
    for (std::size_t byte = 0; byte < 11 * k % 37; ++byte) {
      data += static_cast<char>(byte % 3 == 0 ? k : byte * byte + 5 * k);
    }
    const std::uint64_t time = 1'700'000'000'000'000'000ULL + 10'000'000ULL * k;
    messages.push_back(
        {static_cast<std::uint16_t>(1 + k % 3), static_cast<std::uint32_t>(k), time, time - 7 * k, data});
  }
  return messages;
}

/// Writes `messages` with two schemas and three channels, the last without a schema.
inline void write_sample(const std::filesystem::path& path, const std::vector<OwnedMessage>& messages,
                         const logs::McapWriterOptions& options) {
  logs::McapWriter writer(path, options);
  const auto joints = writer.add_schema("sensor_msgs/msg/JointState", "ros2msg", "float64[] position\n");
  const auto imu = writer.add_schema("sensor_msgs/msg/Imu", "ros2idl", "module sensor_msgs {};");
  writer.add_channel(joints, "/joint_states", "cdr", {{"offered_qos_profiles", ""}, {"a", "b"}});
  writer.add_channel(imu, "/imu", "cdr");
  writer.add_channel(0, "/note", "json");
  for (const OwnedMessage& m : messages) {
    writer.write({m.channel_id, m.sequence, m.log_time, m.publish_time, m.data});
  }
  writer.commit();
}

/// Everything that a reader hands out.
inline std::vector<OwnedMessage> all_messages(logs::McapReader& reader) {
  std::vector<OwnedMessage> messages;
  logs::McapMessage message;
  while (reader.next(message)) {
    messages.push_back(owned(message));
  }
  return messages;
}

inline std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) {
    text += line + "\n";
  }
  return text;
}

/// The ways in which a file may hold its messages.
struct McapKind {
  const char* name;
  logs::McapCompression compression;
  std::size_t chunk_bytes;

  [[nodiscard]] logs::McapWriterOptions options() const { return {compression, chunk_bytes, "ros2", "test"}; }
};

inline const std::vector<McapKind>& mcap_kinds() {
  static const std::vector<McapKind> kinds = {{"none", logs::McapCompression::none, 300},
                                              {"zstd", logs::McapCompression::zstd, 300},
                                              {"lz4", logs::McapCompression::lz4, 300},
                                              {"no_chunks", logs::McapCompression::none, 0}};
  return kinds;
}

}  // namespace wheelwright::testing
