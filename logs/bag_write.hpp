// SPDX-License-Identifier: Apache-2.0
/// \file
/// Writes recordings that rosbag2, Foxglove and PlotJuggler read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include <wheelwright/logs/mcap_format.hpp>

namespace wheelwright::logs {

/// Options for writing a recording.
struct BagWriterOptions {
  McapCompression compression = McapCompression::zstd;  ///< of an MCAP file; a database is not packed
  bool sqlite = false;  ///< whether a directory gets a database rather than an MCAP file
};

/// A writer of one recording, which appears whole at commit() or not at all.
class BagWriter {
 public:
  /// Begins a recording at `path`: an MCAP file (profile "ros2") or a database of rosbag2 by its ending, .mcap or .db3;
  /// otherwise a directory that is not there yet, with one such file and a metadata.yaml. Throws InputError, naming it,
  /// when it cannot be written, and when the directory is there and is not empty.
  explicit BagWriter(const std::filesystem::path& path, BagWriterOptions options = {});
  ~BagWriter();
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;

  /// Adds a topic and returns its number (0, 1, …). `type` is "pkg/msg/Type", `definition` its text
  /// (ros_definition_text), which is kept in the recording. Throws InvalidArgument from the 65 536th on.
  std::size_t add_topic(const std::string& name, const std::string& type, const std::string& definition);
  /// Appends a message in CDR; `log_time` in ns, >= 0. Throws InvalidArgument unless the topic has been added and the
  /// time is not negative; InputError when the disk is full.
  void write(std::size_t topic, std::int64_t log_time, std::string_view cdr);
  /// Puts the recording in its place. To be called once, last. Throws InputError when that fails.
  void commit();

  /// What writes one file.
  class Sink;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::logs
