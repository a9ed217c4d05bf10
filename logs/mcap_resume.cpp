// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_resume.hpp>

#include <algorithm>

#include <wheelwright/logs/mcap_packing.hpp>
#include <wheelwright/logs/mcap_records.hpp>

namespace wheelwright::mcap {
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

}  // namespace wheelwright::mcap
