// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_summary.hpp>

#include <string_view>

#include <wheelwright/logs/mcap_records.hpp>

namespace wheelwright::mcap {
namespace {

/// The content of the record at the front of `fields`, with its kind; ok() of `fields` says whether it was there.
std::string_view next_record(Fields& fields, std::uint8_t& op) {
  op = fields.u8();
  return fields.take(fields.u64());
}

/// Whether all of `bytes` is records of a summary; their content goes into `summary`.
bool parse_records(std::string_view bytes, Summary& summary) {
  Fields records(bytes);
  while (records.ok() && records.left() > 0) {
    std::uint8_t op = 0;
    Fields content(next_record(records, op));
    switch (static_cast<Op>(op)) {
      case Op::schema: {
        McapSchema schema = read_schema(content);
        if (schema.id != 0) {
          summary.schemas.try_emplace(schema.id, std::move(schema));
        }
        break;
      }
      case Op::channel: {
        McapChannel channel = read_channel(content);
        summary.channels.try_emplace(channel.id, std::move(channel));
        break;
      }
      case Op::statistics: summary.messages = content.u64(); break;
      case Op::chunk_index: summary.chunked = true; break;
      case Op::attachment_index:
      case Op::metadata_index:
      case Op::summary_offset: break;
      default:
        if (op < 0x10) {
          return false;
        }
    }
    if (!content.ok()) {
      return false;
    }
  }
  return records.ok();
}

/// CRC-32 of the data section when a data end record stands right before `end`.
std::optional<std::uint32_t> data_end_before(WindowedFile& file, std::uint64_t end) {
  if (end < magic.size() + data_end_bytes) {
    return {};
  }
  const std::string bytes = file.peek(end - data_end_bytes, data_end_bytes);
  Fields fields(bytes);
  if (fields.u8() != static_cast<std::uint8_t>(Op::data_end) || fields.u64() != 4) {
    return {};
  }
  return fields.u32();
}

}  // namespace

Summary read_summary(WindowedFile& file, std::size_t limit) {
  Summary summary;
  summary.data_end = file.size();
  const std::size_t tail_bytes = footer_bytes + magic.size();
  if (file.size() < magic.size() + tail_bytes) {
    return summary;
  }
  const std::uint64_t footer_at = file.size() - tail_bytes;
  const std::string tail = file.peek(footer_at, tail_bytes);
  Fields fields(tail);
  if (!tail.ends_with(magic) || fields.u8() != static_cast<std::uint8_t>(Op::footer) || fields.u64() != 20) {
    return summary;
  }
  const std::uint64_t start = fields.u64();
  const std::uint64_t offsets_start = fields.u64();
  const std::uint32_t crc = fields.u32();
  summary.has_footer = true;
  summary.data_end = footer_at;
  const auto unusable = [&](std::uint64_t at, const char* why) {
    Summary bare;
    bare.has_footer = true;
    bare.data_end = summary.data_end;
    bare.defect = why;
    bare.defect_offset = at;
    bare.defect_bytes = footer_at - at;
    return bare;
  };
  if (start == 0) {
    summary.data_crc = data_end_before(file, footer_at).value_or(0);
    return summary;
  }
  if (start > footer_at || start < magic.size() ||
      (offsets_start != 0 && (offsets_start < start || offsets_start > footer_at))) {
    return unusable(footer_at, "the footer points outside of the file: the summary is not used");
  }
  if (footer_at - start > limit) {
    return unusable(start, "the summary is longer than the limit for a record: it is not used");
  }
  const std::string bytes = file.peek(start, static_cast<std::size_t>(footer_at - start) + footer_bytes - 4);
  if (crc != 0 && crc32(bytes) != crc) {
    return unusable(start, "the checksum of the summary does not match: it is not used");
  }
  const auto data_crc = data_end_before(file, start);
  if ((crc == 0 && !data_crc) || !parse_records({bytes.data(), static_cast<std::size_t>(footer_at - start)}, summary)) {
    return unusable(start, "the summary cannot be parsed: it is not used");
  }
  summary.usable = true;
  summary.data_end = start;
  summary.data_crc = data_crc.value_or(0);
  return summary;
}

}  // namespace wheelwright::mcap
