// SPDX-License-Identifier: Apache-2.0
/// \file
/// One file of a recording, as open_bag() puts several together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/logs/bag.hpp>

namespace wheelwright::bag {

/// A topic as its file has it.
struct SourceTopic {
  std::string name;
  std::string type;
  std::string encoding;         ///< of its messages, e.g. "cdr"
  std::string schema_encoding;  ///< of `schema`, e.g. "ros2msg"; empty where there is none
  std::string schema;
};

/// A file that is being read.
class Source {
 public:
  virtual ~Source() = default;
  /// Those met so far; places stay.
  [[nodiscard]] virtual const std::vector<SourceTopic>& topics() const = 0;
  /// The next message, its topic as a place in topics(); false at the end.
  virtual bool next(BagMessage& message) = 0;
  /// Back to the first message, with a fresh report.
  virtual void rewind() = 0;
  /// What was met so far.
  [[nodiscard]] virtual BagReport report() const = 0;
  /// The first message on a topic, where it is cheap to say; does not move.
  [[nodiscard]] virtual std::optional<std::string> first_message(std::size_t topic);
};

/// What the first bytes of a file say it is.
enum class Content { empty, mcap, sqlite, zstd, other };

/// Looks at the first bytes. Throws InputError, naming the file, when it is missing, no regular file or unreadable.
[[nodiscard]] Content content_of(const std::filesystem::path& path);

/// Opens an MCAP file. `shown` is its name in sentences.
[[nodiscard]] std::unique_ptr<Source> open_mcap(const std::filesystem::path& path, const std::string& shown,
                                                bool hashed);
/// Opens a database of rosbag2. Throws InputError, naming `shown`, when it is none.
[[nodiscard]] std::unique_ptr<Source> open_sqlite(const std::filesystem::path& path, const std::string& shown,
                                                  bool hashed);
/// Opens a file, unpacking it where it is packed with zstd. Throws InputError as they do.
[[nodiscard]] std::unique_ptr<Source> open_source(const std::filesystem::path& path, bool hashed);

/// "1700000000.123456789 s" of a time in ns.
[[nodiscard]] std::string shown_time(std::int64_t time);

}  // namespace wheelwright::bag
