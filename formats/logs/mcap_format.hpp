// SPDX-License-Identifier: Apache-2.0
/// \file
/// The MCAP container (https://mcap.dev/spec, version 0): schemas, channels and messages, records as bytes, packed
/// chunks, checksums.
///
/// The records of an MCAP file as bytes: opcodes, little-endian fields, both ways (https://mcap.dev/spec, sections
/// Records and Serialization).
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/bytes.hpp"

namespace wheelwright::logs {

/// Compression of the records of a chunk. `lz4` is the LZ4 frame format.
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

}  // namespace wheelwright::logs

namespace wheelwright::logs::mcap {

/// First and last bytes of a file.
inline constexpr std::string_view magic{"\x89MCAP0\r\n", 8};

/// Bytes before the content of a record: its opcode and the length of the content (uint64).
inline constexpr std::size_t head_bytes = 9;
/// Bytes of a message record's content before the data.
inline constexpr std::size_t message_head_bytes = 22;
/// Bytes of a whole footer record, and of a whole data end record.
inline constexpr std::size_t footer_bytes = head_bytes + 20, data_end_bytes = head_bytes + 4;

/// Kinds of records. 0 is none, 0x10 to 0x7F are reserved, 0x80 and above belong to applications.
enum class Op : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0A,
  statistics = 0x0B,
  metadata = 0x0C,
  metadata_index = 0x0D,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

/// "chunk", "message index", …; "record of an unknown kind (0x42)".
[[nodiscard]] std::string op_name(std::uint8_t op);

/// Takes fields from the front of some bytes. What goes beyond the end is 0 or empty, and ok() is false from then on.
class Fields {
 public:
  explicit Fields(std::string_view bytes) : bytes_(bytes) {}

  std::uint8_t u8() { return static_cast<std::uint8_t>(number(1)); }
  std::uint16_t u16() { return static_cast<std::uint16_t>(number(2)); }
  std::uint32_t u32() { return static_cast<std::uint32_t>(number(4)); }
  std::uint64_t u64() { return number(8); }
  /// The next `size` bytes.
  std::string_view take(std::uint64_t size);
  /// Bytes behind their length (uint32): a string, an array, a map.
  std::string_view text() { return take(u32()); }
  /// Map<string, string>.
  std::map<std::string, std::string> text_map();

  /// True if all that was asked for was there.
  [[nodiscard]] bool ok() const { return ok_; }
  /// Bytes taken so far.
  [[nodiscard]] std::size_t used() const { return used_; }
  /// Bytes left.
  [[nodiscard]] std::size_t left() const { return bytes_.size() - used_; }

 private:
  std::uint64_t number(std::size_t size);

  std::string_view bytes_;
  std::size_t used_ = 0;
  bool ok_ = true;
};

/// Content of a schema record.
[[nodiscard]] McapSchema read_schema(Fields& fields);
/// Content of a channel record.
[[nodiscard]] McapChannel read_channel(Fields& fields);
/// Content of a message record; everything that is left is its data, which is borrowed.
[[nodiscard]] McapMessage read_message(Fields& fields);

/// Head of a chunk, before its records.
struct ChunkHead {
  std::uint64_t start_time = 0;     ///< earliest log time, ns
  std::uint64_t end_time = 0;       ///< latest log time, ns
  std::uint64_t unpacked_size = 0;  ///< bytes of the records, unpacked
  std::uint32_t crc = 0;            ///< CRC-32 of the unpacked records; 0 when there is none
  std::string_view compression;     ///< "", "zstd" or "lz4"; borrowed
  std::uint64_t packed_size = 0;    ///< bytes of the records in the file
};

/// Longest head of a chunk whose compression is known.
inline constexpr std::size_t chunk_head_bytes = 44;

/// Content of a chunk record up to its records.
[[nodiscard]] ChunkHead read_chunk_head(Fields& fields);

/// CRC-32 (ISO 3309, as zlib has it) of what `crc` is the CRC-32 of, followed by `bytes`; `crc` is 0 at the beginning.
[[nodiscard]] std::uint32_t crc32(std::string_view bytes, std::uint32_t crc = 0);

/// Puts fields behind each other.
class Bytes {
 public:
  Bytes& u8(std::uint8_t value) { return number(value, 1); }
  Bytes& u16(std::uint16_t value) { return number(value, 2); }
  Bytes& u32(std::uint32_t value) { return number(value, 4); }
  Bytes& u64(std::uint64_t value) { return number(value, 8); }
  /// Bytes as they are.
  Bytes& raw(std::string_view bytes);
  /// Bytes behind their length (uint32). Throws InvalidArgument from 4 GiB on.
  Bytes& text(std::string_view bytes);
  /// Map<string, string>.
  Bytes& text_map(const std::map<std::string, std::string>& map);
  /// A whole record.
  Bytes& record(Op op, std::string_view content);
  /// Removes everything.
  void clear() { bytes_.clear(); }

  [[nodiscard]] const std::string& str() const { return bytes_; }
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }

 private:
  Bytes& number(std::uint64_t value, std::size_t size);

  std::string bytes_;
};

/// Content of a schema record.
[[nodiscard]] std::string write_schema(const McapSchema& schema);
/// Content of a channel record.
[[nodiscard]] std::string write_channel(const McapChannel& channel);

/// A regular file, read in large pieces. Its size is that of the moment of opening: a recording that grows meanwhile is
/// read up to there.
class WindowedFile {
 public:
  /// Opens `path`. Throws InputError, naming it, when it is missing, a directory, not a regular file or unreadable.
  WindowedFile(const std::filesystem::path& path, bool hashed);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Bytes [offset, offset + size), which must lie in the file and not before what has been left behind; borrowed until
  /// the next call of any member. The window grows to `size`. Throws InputError, naming file and offset, when they
  /// cannot be read.
  std::string_view view(std::uint64_t offset, std::size_t size);

  /// The same for a few bytes anywhere; the window stays where it is.
  std::string peek(std::uint64_t offset, std::size_t size);

  /// Leaves behind everything before `offset`, which is read where it was not: it goes into the checksums.
  void leave(std::uint64_t offset);

  /// CRC-32 of the bytes left behind up to `end` (fixed by sum_until); valid when `end` has been left behind.
  [[nodiscard]] std::uint32_t crc() const { return crc_; }
  /// From the start: bytes from `end` on do not go into crc(), 0 means none do. To be called before leave().
  void sum_until(std::uint64_t end) { sum_end_ = end; }
  /// Xxh64::text() of the bytes left behind; empty where hashing was not asked for.
  [[nodiscard]] std::string hash() const { return hashed_ ? hash_.text() : std::string(); }

  /// Back to the beginning, checksums too.
  void rewind();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void read(std::uint64_t offset, char* to, std::size_t size);
  void sum(std::string_view bytes);

  std::string name_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;  ///< of file_
  std::vector<char> window_;
  std::uint64_t start_ = 0;  ///< of the window in the file
  std::size_t filled_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t sum_end_ = 0;
  std::uint32_t crc_ = 0;
  bool hashed_;
  files::Xxh64 hash_;
};

/// The word for it in the file: "", "zstd" or "lz4".
[[nodiscard]] std::string_view compression_word(McapCompression compression);
/// The compression that a word stands for; nothing for words that are not known.
[[nodiscard]] std::optional<McapCompression> compression_of(std::string_view word);

/// Unpacks chunk after chunk with the same memory.
class Unpacker {
 public:
  /// What came out.
  struct Result {
    std::string_view bytes;  ///< what could be unpacked, at most the expected size; until the next call
    std::string defect;      ///< empty when `packed` is whole and has exactly the expected size
  };

  Unpacker();
  ~Unpacker();
  Unpacker(Unpacker&&) noexcept;
  Unpacker& operator=(Unpacker&&) noexcept;

  /// Unpacks `packed`, which ought to give `expected` bytes. Memory grows with what comes out and not with `expected`.
  /// With McapCompression::none the result borrows `packed`.
  Result unpack(McapCompression compression, std::string_view packed, std::uint64_t expected);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Packs chunk after chunk with the same memory.
class Packer {
 public:
  explicit Packer(McapCompression compression);
  ~Packer();
  Packer(Packer&&) noexcept;
  Packer& operator=(Packer&&) noexcept;

  /// `bytes`, packed; until the next call.
  std::string_view pack(std::string_view bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::logs::mcap
