// SPDX-License-Identifier: Apache-2.0
/// \file
/// Writes MCAP files with chunks, indexes and statistics, as Foxglove, PlotJuggler and rosbag2 read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

#include <wheelwright/logs/mcap_format.hpp>

namespace wheelwright::logs {

/// Options for writing an MCAP file.
struct McapWriterOptions {
  McapCompression compression = McapCompression::zstd;
  /// A chunk is closed when its unpacked records reach this; 0 writes messages outside of chunks, unpacked and without
  /// an index.
  std::size_t chunk_bytes = std::size_t{1} << 20;
  std::string profile;                  ///< e.g. "ros2"
  std::string library = "wheelwright";  ///< what writes
};

/// A writer of one file, which appears whole at commit() or not at all. Memory holds one chunk and the index of those
/// before.
class McapWriter {
 public:
  /// Begins the file. Throws InputError as AtomicFile does.
  explicit McapWriter(const std::filesystem::path& path, McapWriterOptions options = {});
  ~McapWriter();
  McapWriter(McapWriter&&) noexcept;
  McapWriter& operator=(McapWriter&&) noexcept;

  /// Adds a schema and returns its id (1, 2, …). Throws InvalidArgument from the 65 536th on.
  std::uint16_t add_schema(std::string name, std::string encoding, std::string text);
  /// Adds a channel and returns its id (1, 2, …). Throws InvalidArgument unless `schema_id` is 0 or that of a schema,
  /// and from the 65 536th on.
  std::uint16_t add_channel(std::uint16_t schema_id, std::string topic, std::string message_encoding,
                            std::map<std::string, std::string> metadata = {});
  /// Appends a message. Throws InvalidArgument unless its channel has been added; InputError when the disk is full.
  void write(const McapMessage& message);
  /// Writes index, statistics and footer, and puts the file in its place. To be called once, last.
  void commit();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::logs
