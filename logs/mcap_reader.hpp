// SPDX-License-Identifier: Apache-2.0
/// \file
/// MCAP files, message by message in bounded memory; damaged and cut-off files as far as they can be read.
///
/// What can be trusted: a chunk is unpacked whole and compared with its checksum before a message of it is handed out,
/// and left out when it does not match. A recording that was cut off is read to its last whole message. Where the length
/// of a record is damaged, reading goes on at the next chunk (or, in a file without chunks, at the next place where three
/// records follow each other). All of that is in report(). Attachments, metadata and message indexes are skipped, as are
/// records of unknown kinds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>

#include <wheelwright/logs/mcap_report.hpp>
#include <wheelwright/logs/mcap_types.hpp>

namespace wheelwright {

/// How to read an MCAP file.
struct McapReaderOptions {
  /// Longest record, and longest unpacked chunk, that is read; longer ones are left out and reported. Memory is at most
  /// about twice this, and in practice twice the longest chunk.
  std::size_t max_record_bytes = std::size_t{1} << 29;
  bool hashed = false;  ///< whether McapReport::hash is wanted
};

/// A reader of one file.
class McapReader {
 public:
  /// Opens `path` and reads the index at its end where it has one. Throws InputError, naming the file, when it is
  /// missing, not a regular file, unreadable, or does not begin as an MCAP file of version 0.
  explicit McapReader(const std::filesystem::path& path, McapReaderOptions options = {});
  ~McapReader();
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) noexcept;

  /// The next message in the order of the file, which need not be that of time; false at the end. The channel of the
  /// message is in channels(). McapMessage::data is borrowed until the next call. Damage is no error but is reported;
  /// throws InputError, naming file and offset, when the disk cannot be read or the file has become shorter.
  bool next(McapMessage& message);

  /// Channels by id: all of the file from the start where it has a summary, otherwise those met so far.
  [[nodiscard]] const std::map<std::uint16_t, McapChannel>& channels() const;
  /// Schemas by id, likewise. A channel may name a schema that is not there.
  [[nodiscard]] const std::map<std::uint16_t, McapSchema>& schemas() const;
  /// The schema of a channel; nullptr where it has none.
  [[nodiscard]] const McapSchema* schema_of(const McapChannel& channel) const;

  /// What was met so far; final when McapReport::finished.
  [[nodiscard]] const McapReport& report() const;

  /// Back to the first message, with a fresh report.
  void rewind();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright
