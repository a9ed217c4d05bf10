// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_records.hpp>

#include <array>
#include <bit>
#include <cstring>
#include <limits>

#include <fmt/format.h>
#include <zlib.h>

#include <wheelwright/core/check.hpp>

namespace wheelwright::mcap {

static_assert(std::endian::native == std::endian::little, "MCAP has little-endian fields");

std::string op_name(std::uint8_t op) {
  static constexpr std::array<std::string_view, 16> names = {
      "",         "header",         "footer",         "schema",     "channel",          "message",
      "chunk",    "message index",  "chunk index",    "attachment", "attachment index", "statistics",
      "metadata", "metadata index", "summary offset", "data end"};
  if (op > 0 && op < names.size()) {
    return std::string(names[op]);
  }
  return fmt::format("record of an unknown kind (0x{:02X})", op);
}

std::uint64_t Fields::number(std::size_t size) {
  std::uint64_t value = 0;
  const std::string_view bytes = take(size);
  if (!bytes.empty()) {
    std::memcpy(&value, bytes.data(), bytes.size());
  }
  return value;
}

std::string_view Fields::take(std::uint64_t size) {
  ok_ = ok_ && size <= left();
  if (!ok_) {
    return bytes_.substr(0, 0);
  }
  const std::string_view bytes = bytes_.substr(used_, size);
  used_ += size;
  return bytes;
}

std::map<std::string, std::string> Fields::text_map() {
  std::map<std::string, std::string> map;
  Fields entries(text());
  while (entries.ok() && entries.left() > 0) {
    std::string key(entries.text());
    map.insert_or_assign(std::move(key), std::string(entries.text()));
  }
  ok_ = ok_ && entries.ok();
  return map;
}

McapSchema read_schema(Fields& fields) {
  McapSchema schema;
  schema.id = fields.u16();
  schema.name = fields.text();
  schema.encoding = fields.text();
  schema.text = fields.text();
  return schema;
}

McapChannel read_channel(Fields& fields) {
  McapChannel channel;
  channel.id = fields.u16();
  channel.schema_id = fields.u16();
  channel.topic = fields.text();
  channel.message_encoding = fields.text();
  channel.metadata = fields.text_map();
  return channel;
}

McapMessage read_message(Fields& fields) {
  McapMessage message;
  message.channel_id = fields.u16();
  message.sequence = fields.u32();
  message.log_time = fields.u64();
  message.publish_time = fields.u64();
  message.data = fields.take(fields.left());
  return message;
}

ChunkHead read_chunk_head(Fields& fields) {
  ChunkHead head;
  head.start_time = fields.u64();
  head.end_time = fields.u64();
  head.unpacked_size = fields.u64();
  head.crc = fields.u32();
  head.compression = fields.text();
  head.packed_size = fields.u64();
  return head;
}

std::uint32_t crc32(std::string_view bytes, std::uint32_t crc) {
  if (bytes.empty()) {
    return crc;  // zlib takes a null pointer for the beginning
  }
  return static_cast<std::uint32_t>(::crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

Bytes& Bytes::number(std::uint64_t value, std::size_t size) {
  std::array<char, sizeof value> bytes{};
  std::memcpy(bytes.data(), &value, sizeof value);
  bytes_.append(bytes.data(), size);
  return *this;
}

Bytes& Bytes::raw(std::string_view bytes) {
  bytes_ += bytes;
  return *this;
}

Bytes& Bytes::text(std::string_view bytes) {
  check::that(bytes.size() <= std::numeric_limits<std::uint32_t>::max(), "length of an MCAP field", "below 4 GiB");
  return u32(static_cast<std::uint32_t>(bytes.size())).raw(bytes);
}

Bytes& Bytes::text_map(const std::map<std::string, std::string>& map) {
  Bytes entries;
  for (const auto& [key, value] : map) {
    entries.text(key).text(value);
  }
  return text(entries.str());
}

Bytes& Bytes::record(Op op, std::string_view content) {
  return u8(static_cast<std::uint8_t>(op)).u64(content.size()).raw(content);
}

std::string write_schema(const McapSchema& schema) {
  return Bytes().u16(schema.id).text(schema.name).text(schema.encoding).text(schema.text).str();
}

std::string write_channel(const McapChannel& channel) {
  return Bytes()
      .u16(channel.id)
      .u16(channel.schema_id)
      .text(channel.topic)
      .text(channel.message_encoding)
      .text_map(channel.metadata)
      .str();
}

}  // namespace wheelwright::mcap
