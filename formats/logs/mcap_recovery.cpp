// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/mcap.hpp"

#include <algorithm>
#include <string_view>

#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs::mcap {
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

namespace {

constexpr std::size_t resume_piece = std::size_t{1} << 16;
constexpr std::size_t longest_head = head_bytes + chunk_head_bytes;

bool known_in_data_section(std::uint8_t op) {
  switch (static_cast<Op>(op)) {
    case Op::schema:
    case Op::channel:
    case Op::message:
    case Op::chunk:
    case Op::message_index:
    case Op::attachment:
    case Op::metadata:
    case Op::data_end: return true;
    default: return false;
  }
}

/// Whether `bytes` begin with the head of a whole chunk of a known compression.
bool is_chunk(std::string_view bytes, const DataSection& section, std::uint64_t offset) {
  Fields fields(bytes);
  if (fields.u8() != static_cast<std::uint8_t>(Op::chunk)) {
    return false;
  }
  const std::uint64_t length = fields.u64();
  Fields content(fields.take(fields.left()));
  const ChunkHead head = read_chunk_head(content);
  return content.ok() && compression_of(head.compression) && length >= content.used() &&
         length - content.used() == head.packed_size && head.unpacked_size <= section.max_bytes &&
         (section.cut_off || length <= section.end - offset - head_bytes);
}

/// Whether `bytes` begin with the head of a message, and where its record ends.
bool is_message(std::string_view bytes, const DataSection& section, std::uint64_t offset,
                const std::function<bool(std::uint16_t)>& messages, std::uint64_t& end) {
  Fields fields(bytes);
  if (fields.u8() != static_cast<std::uint8_t>(Op::message)) {
    return false;
  }
  const std::uint64_t length = fields.u64();
  const std::uint16_t channel = fields.u16();
  if (!fields.ok() || length < message_head_bytes || length > section.max_bytes ||
      length > section.end - offset - head_bytes || !messages(channel)) {
    return false;
  }
  end = offset + head_bytes + length;
  return true;
}

/// Whether `count` records follow each other from `offset` on, or the section ends behind some of them.
bool follow(WindowedFile& file, const DataSection& section, std::uint64_t offset, int count) {
  for (; count > 0 && offset < section.end; --count) {
    if (!begins_record(file, section, offset)) {
      return false;
    }
    if (section.end - offset < head_bytes) {
      return true;
    }
    const std::string head = file.peek(offset, head_bytes);
    Fields fields(std::string_view(head).substr(1));
    offset += head_bytes + fields.u64();
  }
  return true;
}

}  // namespace

bool begins_record(WindowedFile& file, const DataSection& section, std::uint64_t offset) {
  if (offset == section.end) {
    return true;
  }
  if (offset > section.end) {
    return false;
  }
  const std::uint64_t rest = section.end - offset;
  const std::string head = file.peek(offset, static_cast<std::size_t>(std::min<std::uint64_t>(rest, head_bytes)));
  Fields fields(head);
  const std::uint8_t op = fields.u8();
  if (rest < head_bytes) {
    return section.cut_off && known_in_data_section(op);
  }
  const std::uint64_t length = fields.u64();
  if (length <= rest - head_bytes) {
    return known_in_data_section(op) || op > static_cast<std::uint8_t>(Op::data_end);
  }
  return section.cut_off && known_in_data_section(op) && length <= section.max_bytes;
}

bool begins_damaged_record(WindowedFile& file, const DataSection& section, std::uint64_t offset,
                           const std::function<bool(std::uint16_t)>& messages) {
  if (offset >= section.end || section.end - offset < data_end_bytes) {
    return false;
  }
  const std::string head = file.peek(offset, head_bytes + 2);
  Fields fields(head);
  const std::uint8_t op = fields.u8();
  fields.u64();
  return (op == static_cast<std::uint8_t>(Op::message) && messages(fields.u16())) ||
         (op == static_cast<std::uint8_t>(Op::data_end) && offset + data_end_bytes == section.end);
}

std::optional<std::uint64_t> settled_end(WindowedFile& file, const DataSection& section, std::uint64_t offset,
                                         std::uint64_t length, std::uint64_t known) {
  const std::uint64_t room = section.end - offset - head_bytes;
  if (length == known) {
    return length <= room ? std::optional(offset + head_bytes + length) : std::nullopt;
  }
  if (known <= room && begins_record(file, section, offset + head_bytes + known)) {
    return offset + head_bytes + known;
  }
  if (known < length && length <= room && begins_record(file, section, offset + head_bytes + length)) {
    return offset + head_bytes + length;
  }
  return {};
}

std::uint64_t find_record(WindowedFile& file, const DataSection& section, std::uint64_t from,
                          const std::function<bool(std::uint16_t)>& messages) {
  std::uint64_t at = from;
  while (at < section.end) {
    file.leave(at);
    const auto size = static_cast<std::size_t>(std::min<std::uint64_t>(resume_piece + longest_head, section.end - at));
    const bool last = at + size == section.end;
    const std::size_t searched = last ? size : size - longest_head;
    std::string_view bytes = file.view(at, size);
    for (std::size_t k = 0; k < searched; ++k) {
      if (bytes[k] == static_cast<char>(Op::chunk) && is_chunk(bytes.substr(k, longest_head), section, at + k)) {
        return at + k;
      }
      std::uint64_t end = 0;
      if (messages && bytes[k] == static_cast<char>(Op::message) &&
          is_message(bytes.substr(k, longest_head), section, at + k, messages, end)) {
        if (follow(file, section, end, 2)) {
          return at + k;
        }
        bytes = file.view(at, size);  // peeking has ended the loan
      }
    }
    at += searched;
  }
  return section.end;
}

}  // namespace wheelwright::logs::mcap
