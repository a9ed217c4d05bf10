// SPDX-License-Identifier: Apache-2.0
/// \file
/// metadata.yaml, which rosbag2 puts into the directory of a recording.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace wheelwright::bag {

/// What reading needs of it.
struct Metadata {
  std::vector<std::string> files;         ///< relative to its directory, in their order
  std::optional<std::uint64_t> messages;  ///< in all files
};

/// Reads `path`. Throws InputError, naming file and line, when it is no YAML or names no file.
[[nodiscard]] Metadata read_metadata(const std::filesystem::path& path);

/// A topic that was written.
struct WrittenTopic {
  std::string name;
  std::string type;
  std::string qos;
  std::uint64_t messages = 0;
};

/// A recording of one file that was written.
struct WrittenBag {
  std::string storage;               ///< "mcap" or "sqlite3"
  std::string file;                  ///< its name
  std::int64_t first = 0, last = 0;  ///< log times, ns
  std::uint64_t messages = 0;
  std::vector<WrittenTopic> topics;
};

/// The text of metadata.yaml in version 5 (Humble), which later distributions read too.
[[nodiscard]] std::string metadata_text(const WrittenBag& bag);

}  // namespace wheelwright::bag
