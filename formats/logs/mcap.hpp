// SPDX-License-Identifier: Apache-2.0
/// \file
/// MCAP files, message by message in bounded memory; damaged and cut-off files as far as they can be read, and a report
/// of what was lost; written with chunks, indexes and statistics, as Foxglove, PlotJuggler and rosbag2 read them.
///
/// Integrity: a chunk is unpacked whole and compared with its checksum before a message of it is handed out, and left
/// out when it does not match. A recording that was cut off is read to its last whole message. Where the length of a
/// record is damaged, reading goes on at the next chunk (or, in a file without chunks, at the next place where three
/// records follow each other). All of that is in report(). Attachments, metadata and message indexes are skipped, as
/// are records of unknown kinds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs::mcap {

/// Summary at the end of a file.
struct Summary {
  bool has_footer = false;  ///< footer and trailing magic are there
  bool usable = false;      ///< and a summary which is whole: its checksum is right, or it has none and can be parsed
  std::uint64_t data_end = 0;  ///< where the data section ends; the size of the file where that is not known
  bool chunked = false;        ///< the summary has an index of chunks
  std::uint32_t data_crc = 0;  ///< CRC-32 of the file up to the data end record; 0 where there is none
  std::map<std::uint16_t, McapSchema> schemas;
  std::map<std::uint16_t, McapChannel> channels;
  std::optional<std::uint64_t> messages;  ///< of the statistics
  std::uint64_t defect_offset = 0;        ///< where the defect is
  std::uint64_t defect_bytes = 0;         ///< how many bytes are not used for it
  std::string defect;                     ///< why the summary that is there is not usable; empty otherwise
};

/// Reads the end of `file`. A summary of more than `limit` bytes is not read.
[[nodiscard]] Summary read_summary(WindowedFile& file, std::size_t limit);

/// The data section of a file.
struct DataSection {
  std::uint64_t end = 0;      ///< where it ends, or the file
  bool cut_off = false;       ///< the file has no footer: records may go beyond the end
  std::size_t max_bytes = 0;  ///< longest record that is looked for
};

/// True if a record of a data section may begin at `offset`: the end of the section, or an opcode with a length that
/// fits (in a file that is cut off also a known opcode with a length within max_bytes). Bytes at random look like that
/// in one case of 10⁹ or less, but for the last eight bytes of a file that is cut off.
[[nodiscard]] bool begins_record(WindowedFile& file, const DataSection& section, std::uint64_t offset);

/// True if a record whose own length is damaged may begin at `offset`: a message on a channel for which `messages`
/// holds, or the data end record at the end of the section. Bytes at random look like that in one case of 10⁵ or less.
[[nodiscard]] bool begins_damaged_record(WindowedFile& file, const DataSection& section, std::uint64_t offset,
                                         const std::function<bool(std::uint16_t)>& messages);

/// End of the record at `offset` whose head says that its content has `length` bytes, and whose content says that it
/// has `known` (more where fields were added that this reader does not know). When the two differ, the one behind which
/// a record begins is right, the content's before the head's; nothing when neither is.
[[nodiscard]] std::optional<std::uint64_t> settled_end(WindowedFile& file, const DataSection& section,
                                                       std::uint64_t offset, std::uint64_t length, std::uint64_t known);

/// The first offset >= `from` at which reading can go on, or the end of the section: a chunk record whose two lengths
/// agree and whose compression is known; where `messages` is given, also a message record of at most max_bytes on a
/// channel for which it holds, with two more records behind it. Leaves behind what it has searched.
[[nodiscard]] std::uint64_t find_record(WindowedFile& file, const DataSection& section, std::uint64_t from,
                                        const std::function<bool(std::uint16_t)>& messages);

}  // namespace wheelwright::logs::mcap

namespace wheelwright::logs {

/// A place of the file that is damaged, cut off or beyond a limit.
struct McapDamage {
  std::uint64_t offset = 0;  ///< from the start of the file
  std::uint64_t bytes = 0;   ///< that could not be used, of the file (of an unpacked record inside a chunk);
                             ///< 0 where something is wrong and nothing was left out for it
  std::optional<std::uint64_t> messages;  ///< that were lost with them, where the file says how many
  std::string why;                        ///< what was found, and what was done
};

/// Records of kinds that this reader does not know, which the format allows; they were skipped.
struct McapUnknown {
  std::size_t count = 0;
  std::uint64_t bytes = 0;
  std::uint64_t first = 0;  ///< offset of the first (of the chunk that holds it); 0 when there is none
};

/// A file, or what was read of it so far.
struct McapReport {
  std::string path;             ///< as it was given
  std::uint64_t file_size = 0;  ///< bytes
  std::string hash;     ///< "xxh64:…" of the file (Xxh64::text) when it was asked for and the file read to its end
  std::string profile;  ///< of the header, e.g. "ros2"
  std::string library;  ///< of the header: what wrote the file

  std::uint64_t messages = 0;   ///< handed out
  std::uint64_t unchecked = 0;  ///< of these, from a chunk that is cut off or has no checksum, or from no chunk
  std::optional<std::uint64_t> promised;  ///< messages that the file says it has (its statistics)
  std::uint64_t chunks = 0;               ///< unpacked, wholly or in part
  std::uint64_t attachments = 0;          ///< skipped
  std::uint64_t metadata = 0;             ///< records of it, skipped
  McapUnknown unknown;
  bool indexed = false;   ///< a whole footer, and a summary that can be used
  bool finished = false;  ///< the file was read to its end; what follows is final

  std::vector<McapDamage> damages;  ///< in the order in which they were met, at most `kept`
  std::size_t damage_count = 0;     ///< all of them
  std::uint64_t damaged_bytes = 0;  ///< sum over all of them
  static constexpr std::size_t kept = 1000;

  /// True if nothing was found wrong: no damage, and as many messages as were promised.
  [[nodiscard]] bool clean() const { return damage_count == 0 && (!promised || !finished || *promised == messages); }
};

/// Defects in `report`, one sentence each, naming file and offset; empty where there is nothing.
[[nodiscard]] std::vector<std::string> sentences(const McapReport& report);

/// Options for reading an MCAP file.
struct McapReaderOptions {
  /// Longest record, and longest unpacked chunk, that is read; longer ones are left out and reported. Memory is at most
  /// about twice this, and in practice twice the longest chunk.
  std::size_t max_record_bytes = std::size_t{1} << 29;
  bool hashed = false;  ///< whether McapReport::hash is wanted
  /// Whether a chunk may unpack to more than 32 MiB and 100 times its size (otherwise it is left out and reported), and
  /// all chunks to more than files::most_unpacked() of the file (otherwise next() throws InputError).
  bool trust = false;
  std::uint64_t stored = 0;  ///< bytes of the file that this one was unpacked from; 0 where it was not
  std::string shown = {};    ///< name of the file in InputErrors about its chunks; its path where empty
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
