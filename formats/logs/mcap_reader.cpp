// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/mcap.hpp"

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs {
namespace {

std::string counted(std::uint64_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

std::vector<std::string> sentences(const McapReport& report) {
  std::vector<std::string> lines;
  for (const McapDamage& damage : report.damages) {
    std::string line = fmt::format("{}: at byte {}: {}", report.path, damage.offset, damage.why);
    if (damage.bytes > 0 || damage.messages) {
      line += fmt::format(" ({}", counted(damage.bytes, "byte"));
      line += damage.messages ? ", " + counted(*damage.messages, "message") + " lost)" : " not used)";
    }
    lines.push_back(std::move(line));
  }
  if (report.damage_count > report.damages.size()) {
    lines.push_back(fmt::format("{}: {} more damaged places, {} in all", report.path,
                                report.damage_count - report.damages.size(), counted(report.damaged_bytes, "byte")));
  }
  if (report.unknown.count > 0) {
    lines.push_back(fmt::format("{}: at byte {}: {} of an unknown kind skipped ({})", report.path, report.unknown.first,
                                counted(report.unknown.count, "record"), counted(report.unknown.bytes, "byte")));
  }
  if (report.finished && report.promised && *report.promised != report.messages) {
    lines.push_back(fmt::format("{}: {} read; its statistics say {}", report.path, counted(report.messages, "message"),
                                *report.promised));
  }
  return lines;
}

using mcap::Fields;
using mcap::head_bytes;
using mcap::Op;

namespace {

/// Names, media type and lengths of an attachment are looked for in so many bytes.
constexpr std::size_t attachment_head_bytes = std::size_t{1} << 16;

constexpr std::uint64_t always_unpacked_chunk = std::uint64_t{1} << 25;
constexpr std::uint64_t largest_chunk_ratio = 100;

}  // namespace

struct McapReader::Impl {
  Impl(const std::filesystem::path& path, McapReaderOptions options) : options_(options), file_(path, options.hashed) {
    const std::string first =
        file_.peek(0, static_cast<std::size_t>(std::min<std::uint64_t>(mcap::magic.size(), file_.size())));
    if (first != mcap::magic) {
      const bool other = first.size() == mcap::magic.size() && first.starts_with(mcap::magic.substr(0, 5));
      throw InputError(fmt::format("{}: at byte 0: {}: expected an MCAP file of version 0", file_.name(),
                                   first.empty() ? "is empty"
                                   : other       ? "is an MCAP file of another version"
                                                 : "is no MCAP file"));
    }
    summary_ = mcap::read_summary(file_, options_.max_record_bytes);
    begin();
  }

  /// The state before the first record.
  void begin() {
    report_ = {};
    report_.path = file_.name();
    report_.file_size = file_.size();
    report_.indexed = summary_.usable;
    report_.promised = summary_.messages;
    schemas_ = summary_.schemas;
    channels_ = summary_.channels;
    section_ = {summary_.data_end, !summary_.has_footer, options_.max_record_bytes};
    file_.rewind();
    file_.sum_until(summary_.data_crc != 0 ? section_.end - mcap::data_end_bytes : 0);
    at_ = mcap::magic.size();
    chunk_ = {};
    unpacked_ = 0;
    index_of_.reset();
    chunk_met_ = summary_.chunked;
    if (!summary_.defect.empty()) {
      damage(summary_.defect_offset, summary_.defect_bytes, summary_.defect);
    }
  }

  bool next(McapMessage& message) {
    while (true) {
      if (in_chunk_) {
        if (next_in_chunk(message)) {
          ++report_.messages;
          return true;
        }
        leave_chunk();
      } else if (report_.finished) {
        return false;
      } else if (next_record(message)) {
        ++report_.messages;
        ++report_.unchecked;
        return true;
      }
    }
  }

  // ---- The data section ----

  /// Reads the record at `at_` and moves behind it; true when it is a message to hand out.
  bool next_record(McapMessage& message) {
    file_.leave(at_);
    const std::uint64_t rest = section_.end - at_;
    if (rest == 0) {
      finish();
      return false;
    }
    if (rest < head_bytes) {
      resume("the file ends inside the head of a record");
      return false;
    }
    const std::string_view head = file_.view(at_, head_bytes);
    Fields fields(head);
    const std::uint8_t op = fields.u8();
    const std::uint64_t length = fields.u64();
    if (static_cast<Op>(op) != Op::message_index) {
      index_of_.reset();
    }
    if (static_cast<Op>(op) == Op::chunk) {
      chunk_met_ = true;
      chunk(length);
      return false;
    }
    if (length > rest - head_bytes) {
      resume(fmt::format("{} of {} bytes goes beyond the {}: cut off, or its length is damaged", mcap::op_name(op),
                         length, section_.cut_off ? "end of the file" : "data section"));
      return false;
    }
    switch (static_cast<Op>(op)) {
      case Op::message: return loose_message(message, length);
      case Op::attachment: attachment(length); return false;
      case Op::header:
      case Op::schema:
      case Op::channel:
      case Op::message_index:
      case Op::metadata:
      case Op::data_end: small_record(static_cast<Op>(op), length); return false;
      default: break;
    }
    if (op > static_cast<std::uint8_t>(Op::data_end)) {
      unknown(at_, head_bytes + length);
      at_ += head_bytes + length;
    } else {
      resume(op == 0 ? "no record begins here" : "a " + mcap::op_name(op) + " record inside the data section", length);
    }
    return false;
  }

  /// A message that is in no chunk.
  bool loose_message(McapMessage& message, std::uint64_t length) {
    const std::uint64_t end = at_ + head_bytes + length;
    if (length < mcap::message_head_bytes ||
        !(mcap::begins_record(file_, section_, end) ||
          mcap::begins_damaged_record(file_, section_, end, [this](std::uint16_t id) { return has(id); }))) {
      resume("the length of a message is damaged: no record follows it");
      return false;
    }
    const std::uint64_t offset = at_;
    at_ = end;
    if (length > options_.max_record_bytes) {
      damage(offset, head_bytes + length, beyond_limit("a message"), 1);
      return false;
    }
    Fields fields(file_.view(offset + head_bytes, static_cast<std::size_t>(length)));
    message = mcap::read_message(fields);
    return has_channel(message, offset, head_bytes + length);
  }

  void attachment(std::uint64_t length) {
    Fields fields(
        file_.view(at_ + head_bytes, static_cast<std::size_t>(std::min<std::uint64_t>(length, attachment_head_bytes))));
    fields.take(16);
    fields.text();
    fields.text();
    const std::uint64_t data = fields.u64();
    const auto end = fields.ok() && data < file_.size()
                         ? mcap::settled_end(file_, section_, at_, length, fields.used() + data + 4)
                         : std::nullopt;
    if (!end) {
      resume("a damaged attachment", length);
      return;
    }
    ++report_.attachments;
    move_to(*end, length, "an attachment");
  }

  /// A record that is parsed whole.
  void small_record(Op op, std::uint64_t length) {
    const std::string name = mcap::op_name(static_cast<std::uint8_t>(op));
    if (length > options_.max_record_bytes) {
      resume(beyond_limit(name), length);
      return;
    }
    Fields fields(file_.view(at_ + head_bytes, static_cast<std::size_t>(length)));
    const std::uint64_t offset = at_;
    std::function<void()> use;
    bool valid = true;
    switch (op) {
      case Op::header: {
        std::string profile(fields.text());
        std::string library(fields.text());
        valid = offset == mcap::magic.size();
        use = [this, profile, library] {
          report_.profile = profile;
          report_.library = library;
        };
        break;
      }
      case Op::schema:
        use = [this, offset, length, schema = mcap::read_schema(fields)] { add(schema, offset, length); };
        break;
      case Op::channel:
        use = [this, offset, length, channel = mcap::read_channel(fields)] { add(channel, offset, length); };
        break;
      case Op::message_index: {
        fields.u16();
        const std::size_t bytes = fields.text().size();
        valid = bytes % 16 == 0;
        use = [this, bytes] { count_lost(bytes / 16); };
        break;
      }
      case Op::metadata:
        fields.text();
        fields.text_map();
        use = [this] { ++report_.metadata; };
        break;
      default:
        fields.u32();
        valid = section_.cut_off || !summary_.defect.empty() || offset + head_bytes + length == section_.end;
        use = [this, end = offset + head_bytes + length] { finish(end); };
    }
    const auto end =
        fields.ok() && valid ? mcap::settled_end(file_, section_, offset, length, fields.used()) : std::nullopt;
    if (!end) {
      resume("a damaged " + name + " record", length);
      return;
    }
    move_to(*end, length, name);
    use();
  }

  // ---- Chunks ----

  void chunk(std::uint64_t length) {
    const std::uint64_t rest = section_.end - at_ - head_bytes;
    Fields fields(
        file_.view(at_ + head_bytes, static_cast<std::size_t>(std::min<std::uint64_t>({length, rest, 4096}))));
    const mcap::ChunkHead head = mcap::read_chunk_head(fields);
    const auto compression = mcap::compression_of(head.compression);
    const std::uint64_t records_at = at_ + head_bytes + fields.used();
    if (!fields.ok() || head.packed_size > ~std::uint64_t{0} - fields.used()) {
      resume("the head of a chunk is damaged or cut off", length);
      return;
    }
    const std::uint64_t known = fields.used() + head.packed_size;
    if (section_.cut_off && known == length && length > rest) {
      cut_off_chunk(head, compression, records_at);
      return;
    }
    const auto end = mcap::settled_end(file_, section_, at_, length, known);
    if (!end) {
      resume("the length of a chunk is damaged", length);
      return;
    }
    const std::uint64_t offset = at_;
    const std::string word = files::shown(head.compression);
    move_to(*end, length, "a chunk");
    const auto lost = [&](const std::string& why) {
      damage(offset, *end - offset, "a chunk is left out: " + why);
      index_of_ = report_.damages.size() - 1;
      if (report_.damage_count > report_.damages.size()) {
        index_of_.reset();
      }
    };
    if (!compression) {
      lost("compression " + word + " is not known: expected none, zstd or lz4");
    } else if (std::max(head.unpacked_size, head.packed_size) > options_.max_record_bytes) {
      lost(beyond_limit("it"));
    } else if (const std::uint64_t most = most_of_chunk(head); head.unpacked_size > most) {
      lost(fmt::format("by its head {} bytes come out of its {}: expected at most {}, or --trust", head.unpacked_size,
                       head.packed_size, most));
    } else {
      const auto result = unpacker_.unpack(
          *compression, file_.view(records_at, static_cast<std::size_t>(head.packed_size)), head.unpacked_size);
      if (!result.defect.empty()) {
        lost(result.defect);
      } else if (head.crc != 0 && mcap::crc32(result.bytes) != head.crc) {
        lost("its checksum does not match");
      } else {
        count_unpacked(result.bytes.size());
        enter_chunk(result.bytes, offset, head.crc != 0);
      }
    }
  }

  /// The last chunk of a recording that was cut off: its first messages, as far as they can be unpacked.
  void cut_off_chunk(const mcap::ChunkHead& head, std::optional<McapCompression> compression,
                     std::uint64_t records_at) {
    const std::uint64_t offset = at_;
    const std::uint64_t packed = section_.end - records_at;
    at_ = section_.end;
    if (!compression || packed > options_.max_record_bytes || head.unpacked_size > options_.max_record_bytes ||
        head.unpacked_size > most_of_chunk(head)) {
      damage(offset, section_.end - offset, "the file ends inside a chunk, which cannot be read");
      return;
    }
    const auto result =
        unpacker_.unpack(*compression, file_.view(records_at, static_cast<std::size_t>(packed)), head.unpacked_size);
    damage(offset, section_.end - offset, "the file ends inside a chunk");
    const std::size_t kept = report_.damages.size();
    enter_chunk(result.bytes, offset, false);
    cut_damage_ = report_.damage_count == kept ? kept - 1 : McapReport::kept;
  }

  [[nodiscard]] std::uint64_t most_of_chunk(const mcap::ChunkHead& head) const {
    return options_.trust ? options_.max_record_bytes
                          : std::max(always_unpacked_chunk, largest_chunk_ratio * head.packed_size);
  }

  void count_unpacked(std::uint64_t bytes) {
    unpacked_ += bytes;
    const std::uint64_t stored = options_.stored > 0 ? options_.stored : file_.size();
    if (!options_.trust && unpacked_ > files::most_unpacked(stored)) {
      throw InputError(fmt::format("{}: its chunks: {}", options_.shown.empty() ? file_.name() : options_.shown,
                                   files::too_much_unpacked(stored)));
    }
  }

  void enter_chunk(std::string_view records, std::uint64_t offset, bool checked) {
    ++report_.chunks;
    chunk_ = records;
    chunk_offset_ = offset;
    chunk_checked_ = checked;
    chunk_messages_ = 0;
    cut_damage_.reset();
    in_chunk_ = true;
  }

  void leave_chunk() {
    if (cut_damage_ && *cut_damage_ < report_.damages.size()) {
      report_.damages[*cut_damage_].why +=
          fmt::format(": its first {} messages were read, without a checksum", chunk_messages_);
    }
    in_chunk_ = false;
    chunk_ = {};
  }

  bool next_in_chunk(McapMessage& message) {
    while (!chunk_.empty()) {
      Fields fields(chunk_);
      const std::uint8_t op = fields.u8();
      const std::uint64_t length = fields.u64();
      const std::string_view bytes = fields.take(length);
      Fields content(bytes);
      if (!fields.ok()) {
        rest_of_chunk("a record goes beyond the chunk");
        return false;
      }
      bool found = false;
      switch (static_cast<Op>(op)) {
        case Op::message:
          message = mcap::read_message(content);
          found = content.ok();
          break;
        case Op::schema: {
          const McapSchema schema = mcap::read_schema(content);
          if (content.ok()) {
            add(schema, chunk_offset_, bytes.size());
          }
          break;
        }
        case Op::channel: {
          const McapChannel channel = mcap::read_channel(content);
          if (content.ok()) {
            add(channel, chunk_offset_, bytes.size());
          }
          break;
        }
        default:
          if (op <= static_cast<std::uint8_t>(Op::data_end)) {
            rest_of_chunk("no " + mcap::op_name(op) + " record may be inside a chunk");
            return false;
          }
          unknown(chunk_offset_, fields.used());
      }
      if (!content.ok()) {
        rest_of_chunk("a damaged " + mcap::op_name(op) + " record");
        return false;
      }
      chunk_.remove_prefix(fields.used());
      if (found && has_channel(message, chunk_offset_, fields.used())) {
        ++chunk_messages_;
        report_.unchecked += chunk_checked_ ? 0 : 1;
        return true;
      }
    }
    return false;
  }

  void rest_of_chunk(const std::string& why) {
    if (!cut_damage_) {
      damage(chunk_offset_, chunk_.size(), "the rest of a chunk is left out: " + why);
    }
  }

  // ---- What they share ----

  template <typename Item>
  void add_to(std::map<std::uint16_t, Item>& items, const Item& item, const char* what, std::uint64_t offset,
              std::uint64_t bytes) {
    const auto [place, added] = items.try_emplace(item.id, item);
    if (!added && !(place->second == item)) {
      damage(offset, bytes,
             fmt::format("{} {} is defined differently from before: the first definition stays", what, item.id));
    }
  }
  void add(const McapSchema& schema, std::uint64_t offset, std::uint64_t bytes) {
    if (schema.id != 0) {
      add_to(schemas_, schema, "schema", offset, bytes);
    }
  }
  void add(const McapChannel& channel, std::uint64_t offset, std::uint64_t bytes) {
    add_to(channels_, channel, "channel", offset, bytes);
  }

  [[nodiscard]] bool has(std::uint16_t channel) const { return channels_.contains(channel); }

  /// Whether the channel of a message is known; reports the message as lost otherwise.
  bool has_channel(const McapMessage& message, std::uint64_t offset, std::uint64_t bytes) {
    if (has(message.channel_id)) {
      return true;
    }
    const std::string why = fmt::format("messages on channel {}, which is not defined", message.channel_id);
    if (!report_.damages.empty() && report_.damages.back().why == why) {
      report_.damages.back().bytes += bytes;
      ++*report_.damages.back().messages;
      report_.damaged_bytes += bytes;
    } else {
      damage(offset, bytes, why, 1);
    }
    return false;
  }

  [[nodiscard]] std::string beyond_limit(const std::string& what) const {
    return fmt::format("{} is longer than {} bytes, the limit for a record", what, options_.max_record_bytes);
  }

  void damage(std::uint64_t offset, std::uint64_t bytes, std::string why, std::optional<std::uint64_t> messages = {}) {
    ++report_.damage_count;
    report_.damaged_bytes += bytes;
    if (report_.damages.size() < McapReport::kept) {
      report_.damages.push_back({offset, bytes, messages, std::move(why)});
    }
  }

  void unknown(std::uint64_t offset, std::uint64_t bytes) {
    if (report_.unknown.count++ == 0) {
      report_.unknown.first = offset;
    }
    report_.unknown.bytes += bytes;
  }

  /// The message index behind a chunk that was left out says how many messages that has cost.
  void count_lost(std::uint64_t messages) {
    if (index_of_) {
      auto& lost = report_.damages[*index_of_].messages;
      lost = lost.value_or(0) + messages;
    }
  }

  /// Moves behind a record which ends at `end`, and whose head says that it has `length` bytes.
  void move_to(std::uint64_t end, std::uint64_t length, const std::string& what) {
    if (end < at_ + head_bytes + length) {
      damage(at_, 0, fmt::format("the length of {} is damaged, but not its content: it is used", what));
    }
    at_ = end;
  }

  /// Reports what is at `at_` as damaged, up to the next place where reading can go on, and moves there. When a record
  /// begins behind `length` bytes of content, it is that.
  void resume(const std::string& why, std::uint64_t length = ~std::uint64_t{0}) {
    const std::uint64_t next = at_ + head_bytes + length;
    if (length < section_.end && next <= section_.end && mcap::begins_record(file_, section_, next)) {
      damage(at_, next - at_, why + ": it is left out");
      at_ = next;
      return;
    }
    std::function<bool(std::uint16_t)> messages;
    if (!chunk_met_) {
      messages = [this](std::uint16_t id) { return has(id); };
    }
    const std::uint64_t end = mcap::find_record(file_, section_, at_ + 1, messages);
    damage(at_, end - at_,
           why + (end == section_.end ? "; nothing behind it can be read" : "; reading goes on behind it"));
    at_ = end;
  }

  /// The end of the data section without a data end record.
  void finish() {
    if (section_.cut_off) {
      damage(at_, 0, "the file ends without a footer: it was cut off here or never closed; what came after is lost");
    }
    close();
  }

  /// The end of the data section at `end`, behind its data end record.
  void finish(std::uint64_t end) {
    if (section_.cut_off) {
      damage(end, file_.size() - end,
             "the file has no whole footer behind its data: it was cut off, or something follows it");
    }
    close();
  }

  void close() {
    file_.leave(file_.size());
    if (summary_.data_crc != 0 && file_.crc() != summary_.data_crc) {
      damage(
          section_.end - mcap::data_end_bytes, 0,
          "the checksum of the data section does not match: something before was changed; chunks that passed their own "
          "checksum are right all the same");
    }
    report_.hash = file_.hash();
    report_.finished = true;
  }

  McapReaderOptions options_;
  mcap::WindowedFile file_;
  mcap::Summary summary_;
  mcap::DataSection section_;
  mcap::Unpacker unpacker_;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, McapChannel> channels_;
  McapReport report_;
  std::uint64_t at_ = 0;                 ///< offset of the next record of the data section
  bool chunk_met_ = false;               ///< this is a file with chunks
  std::optional<std::size_t> index_of_;  ///< the damage that following message indexes belong to

  bool in_chunk_ = false;
  std::string_view chunk_;  ///< records still to be read
  std::uint64_t chunk_offset_ = 0;
  std::uint64_t chunk_messages_ = 0;
  std::uint64_t unpacked_ = 0;  ///< bytes of all chunks so far
  bool chunk_checked_ = false;
  std::optional<std::size_t> cut_damage_;  ///< the damage that says that the chunk is cut off
};

McapReader::McapReader(const std::filesystem::path& path, McapReaderOptions options)
    : impl_(std::make_unique<Impl>(path, options)) {}
McapReader::~McapReader() = default;
McapReader::McapReader(McapReader&&) noexcept = default;
McapReader& McapReader::operator=(McapReader&&) noexcept = default;

bool McapReader::next(McapMessage& message) { return impl_->next(message); }
const std::map<std::uint16_t, McapChannel>& McapReader::channels() const { return impl_->channels_; }
const std::map<std::uint16_t, McapSchema>& McapReader::schemas() const { return impl_->schemas_; }

const McapSchema* McapReader::schema_of(const McapChannel& channel) const {
  const auto found = impl_->schemas_.find(channel.schema_id);
  return found == impl_->schemas_.end() ? nullptr : &found->second;
}

const McapReport& McapReader::report() const { return impl_->report_; }

void McapReader::rewind() {
  impl_->leave_chunk();
  impl_->begin();
}

}  // namespace wheelwright::logs
