// SPDX-License-Identifier: Apache-2.0
/// \file
/// Recordings of rosbag2, message by message, in any storage format, as one file or several.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {

/// A stream of messages of one type.
struct BagTopic {
  std::string name;      ///< e.g. "/joint_states"
  std::string type;      ///< "pkg/msg/Type"
  std::string encoding;  ///< of its messages; only "cdr" can be read
  /// Of the recording, else of BagOptions::msg_path, else bundled; topics may share one. Null where there is none.
  std::shared_ptr<const RosDefinition> definition;
  std::string no_definition;   ///< why there is none, and what to do; empty where there is one
  std::uint64_t messages = 0;  ///< handed out so far
};

/// One message.
struct BagMessage {
  std::size_t topic = 0;      ///< its place in BagReader::topics()
  std::int64_t log_time = 0;  ///< when it was recorded, ns
  std::string_view data;      ///< borrowed until the next call of next() or rewind()
};

/// Report on reading one file; final when the file has been read to its end.
struct BagReport {
  std::string path;                 ///< as it was given, or found in the directory that was given
  std::string storage;              ///< "mcap" or "sqlite3"
  std::uint64_t bytes = 0;          ///< of the file
  std::string hash;                 ///< "xxh64:…" of the file (Xxh64::text) where BagOptions::hashed
  std::uint64_t messages = 0;       ///< handed out
  std::vector<std::string> losses;  ///< what could not be read, one sentence each, with file and place
};

/// Options for reading recordings.
struct BagOptions {
  std::vector<std::filesystem::path> msg_path = {};  ///< directories with definitions: see ros_definitions_from()
  bool hashed = false;                               ///< whether BagReport::hash is wanted
  bool trust = false;                                ///< see LogOptions::trust
};

/// Reads files one behind the other. Nothing is written beside them.
class BagReader {
 public:
  virtual ~BagReader() = default;

  /// Those met so far, which may become more while reading; places stay. A name with two types, or
  /// two definitions of one, is two topics.
  [[nodiscard]] virtual const std::vector<BagTopic>& topics() const = 0;
  /// The next message in the order of the files and of the recording in them, which need not be that of time; false at
  /// the end. Damage is no error but is reported; throws InputError, naming the file, when the disk cannot be read.
  virtual bool next(BagMessage& message) = 0;
  /// Back to the first message, with fresh reports; topics stay, their counts begin again.
  virtual void rewind() = 0;
  /// One for each file, in the order of reading.
  [[nodiscard]] virtual const std::vector<BagReport>& reports() const = 0;
};

/// True if `path` looks like a recording: an MCAP file or an SQLite database by its first bytes, plain or in zstd, or a
/// directory with a metadata.yaml or with such a file (*.mcap, *.db3, *.mcap.zstd, *.db3.zstd). False where it cannot
/// be read.
[[nodiscard]] bool is_bag(const std::filesystem::path& path);

/// Opens recordings: files, or directories as rosbag2 writes them, whose metadata.yaml says which files in which order
/// (where it is missing or cannot be read: all that are there, "_2" before "_10"). Several continue one stream, in the
/// order given.
///
/// Files packed with zstd, and a database with a journal beside it (a recording that was not closed), are read from a
/// copy in the system's directory for temporary files, which is gone afterwards. Messages packed with zstd one by one
/// are unpacked. A file of a directory that is missing or of no use is a loss while others can be read. Without
/// BagOptions::trust metadata and links reach no file outside the directory.
///
/// Throws InputError, naming the file, when it is missing or no recording, when a directory has none, and for a
/// BagOptions::msg_path as ros_definitions_from() does; InvalidArgument when `paths` is empty.
[[nodiscard]] std::unique_ptr<BagReader> open_bag(const std::vector<std::filesystem::path>& paths,
                                                  const BagOptions& options = {});

}  // namespace wheelwright::logs

namespace wheelwright::logs::bag {

/// A topic as its file has it.
struct SourceTopic {
  std::string name;
  std::string type;
  std::string encoding;                       ///< of its messages, e.g. "cdr"
  std::string schema_encoding;                ///< of `schema`, e.g. "ros2msg"; empty where there is none
  std::shared_ptr<const std::string> schema;  ///< its text, which topics share; null where there is none
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
  /// The first message on a topic, where it is cheap to say (also the hundredth time); does not move.
  [[nodiscard]] virtual std::optional<std::string> first_message(std::size_t topic);
};

/// Content of a file by its first bytes.
enum class Content { empty, mcap, sqlite, zstd, other };

/// Looks at the first bytes. Throws InputError, naming the file, when it is missing, no regular file or unreadable.
[[nodiscard]] Content content_of(const std::filesystem::path& path);

/// How to open a file.
struct SourceOptions {
  bool hashed = false;       ///< whether BagReport::hash is wanted
  bool trust = false;        ///< see LogOptions::trust
  std::uint64_t stored = 0;  ///< bytes of the file that this one was unpacked from; 0 where it was not
};

/// Opens an MCAP file. `shown` is its name in sentences.
[[nodiscard]] std::unique_ptr<Source> open_mcap(const std::filesystem::path& path, const std::string& shown,
                                                const SourceOptions& options);
/// Opens a database of rosbag2. Throws InputError, naming `shown`, when it is none, and for one that would run what it
/// says: tables with generated columns, virtual tables.
[[nodiscard]] std::unique_ptr<Source> open_sqlite(const std::filesystem::path& path, const std::string& shown,
                                                  const SourceOptions& options);
/// Opens a file, unpacking it where it is packed with zstd. Throws InputError as they do, and without trust for a file
/// of holes (refuse_holes()) and where more than files::most_unpacked() or `largest_copy` bytes come out.
[[nodiscard]] std::unique_ptr<Source> open_source(const std::filesystem::path& path, const SourceOptions& options);

/// "1700000000.123456789 s" of a time in ns.
[[nodiscard]] std::string shown_time(std::int64_t time);

}  // namespace wheelwright::logs::bag
