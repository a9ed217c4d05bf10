// SPDX-License-Identifier: Apache-2.0
/// \file
/// The records of an MCAP file as bytes: opcodes, little-endian fields, both ways (https://mcap.dev/spec, sections
/// Records and Serialization).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include <wheelwright/logs/mcap_types.hpp>

namespace wheelwright::mcap {

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

  /// Whether all that was asked for was there.
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

/// What stands before the records of a chunk.
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

}  // namespace wheelwright::mcap
