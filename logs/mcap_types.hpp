// SPDX-License-Identifier: Apache-2.0
/// \file
/// What an MCAP file holds: schemas, channels, messages (MCAP specification, https://mcap.dev/spec, version 0).
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace wheelwright {

/// How the records of a chunk are packed. `lz4` is the LZ4 frame format.
enum class McapCompression { none, zstd, lz4 };

/// The description of a type of messages.
struct McapSchema {
  std::uint16_t id = 0;  ///< > 0, unique in the file
  std::string name;      ///< of the type, e.g. "sensor_msgs/msg/JointState"
  std::string encoding;  ///< what `text` is written in, e.g. "ros2msg", "ros2idl"; empty when there is no text
  std::string text;      ///< the definition, as bytes

  bool operator==(const McapSchema&) const = default;
};

/// A stream of messages of one type.
struct McapChannel {
  std::uint16_t id = 0;         ///< unique in the file
  std::uint16_t schema_id = 0;  ///< 0 when it has no schema
  std::string topic;
  std::string message_encoding;                 ///< e.g. "cdr"
  std::map<std::string, std::string> metadata;  ///< e.g. "offered_qos_profiles"

  bool operator==(const McapChannel&) const = default;
};

/// One message. `data` is borrowed: see who hands it out for how long.
struct McapMessage {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;      ///< counter of the publisher or of the recorder; 0 where neither counts
  std::uint64_t log_time = 0;      ///< when it was recorded, ns since an epoch that the file does not name
  std::uint64_t publish_time = 0;  ///< when it was published, ns; the log time where that is not known
  std::string_view data;           ///< to be decoded as the channel says
};

}  // namespace wheelwright
