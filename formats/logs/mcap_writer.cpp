// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/mcap.hpp"

#include <algorithm>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "core/check.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/mcap_format.hpp"

namespace wheelwright::logs {

using mcap::Bytes;
using mcap::head_bytes;
using mcap::Op;

namespace {

constexpr std::size_t most_ids = std::numeric_limits<std::uint16_t>::max();

/// Log times of some messages.
struct TimeRange {
  std::uint64_t first = 0, last = 0;
  std::uint64_t count = 0;

  void add(std::uint64_t time) {
    first = count == 0 ? time : std::min(first, time);
    last = count == 0 ? time : std::max(last, time);
    ++count;
  }
};

}  // namespace

struct McapWriter::Impl {
  Impl(const std::filesystem::path& path, McapWriterOptions how)
      : options(std::move(how)), file(path), packer(options.compression) {
    append(mcap::magic);
    append(Bytes().record(Op::header, Bytes().text(options.profile).text(options.library).str()).str());
  }

  void append(std::string_view bytes) {
    file.write(bytes);
    crc = mcap::crc32(bytes, crc);
    offset += bytes.size();
  }

  /// Where records of the data section go: the open chunk, or the file.
  void append_record(Op op, std::string_view bytes) {
    if (options.chunk_bytes > 0) {
      chunk.record(op, bytes);
    } else {
      append(Bytes().record(op, bytes).str());
    }
  }

  void close_chunk() {
    if (chunk.size() == 0) {
      return;
    }
    const std::string_view packed = packer.pack(chunk.str());
    const std::string_view word = mcap::compression_word(options.compression);
    Bytes head;
    head.u64(times.first).u64(times.last).u64(chunk.size()).u32(mcap::crc32(chunk.str())).text(word).u64(packed.size());
    const std::uint64_t chunk_at = offset;
    append(Bytes().u8(static_cast<std::uint8_t>(Op::chunk)).u64(head.size() + packed.size()).raw(head.str()).str());
    append(packed);
    const std::uint64_t index_at = offset;
    Bytes places;
    for (const auto& [channel, entries] : index) {
      places.u16(channel).u64(offset);
      append(Bytes().record(Op::message_index, Bytes().u16(channel).text(entries.str()).str()).str());
    }
    chunk_indexes.record(Op::chunk_index, Bytes()
                                              .u64(times.first)
                                              .u64(times.last)
                                              .u64(chunk_at)
                                              .u64(index_at - chunk_at)
                                              .text(places.str())
                                              .u64(offset - index_at)
                                              .text(word)
                                              .u64(packed.size())
                                              .u64(chunk.size())
                                              .str());
    ++chunks;
    chunk.clear();
    index.clear();
    times = {};
  }

  [[nodiscard]] std::string statistics() const {
    Bytes counts;
    for (const auto& [channel, count] : messages) {
      counts.u16(channel).u64(count);
    }
    return Bytes()
        .u64(all_times.count)
        .u16(static_cast<std::uint16_t>(schemas.size()))
        .u32(static_cast<std::uint32_t>(channels.size()))
        .u32(0)
        .u32(0)
        .u32(chunks)
        .u64(all_times.first)
        .u64(all_times.last)
        .text(counts.str())
        .str();
  }

  void end() {
    close_chunk();
    append(Bytes().record(Op::data_end, Bytes().u32(crc).str()).str());

    Bytes summary, offsets;
    const std::uint64_t start = offset;
    const auto group = [&](Op op, const std::function<void()>& fill) {
      const std::size_t before = summary.size();
      fill();
      if (summary.size() > before) {
        offsets.record(
            Op::summary_offset,
            Bytes().u8(static_cast<std::uint8_t>(op)).u64(start + before).u64(summary.size() - before).str());
      }
    };
    group(Op::schema, [&] {
      for (const McapSchema& schema : schemas) {
        summary.record(Op::schema, mcap::write_schema(schema));
      }
    });
    group(Op::channel, [&] {
      for (const McapChannel& channel : channels) {
        summary.record(Op::channel, mcap::write_channel(channel));
      }
    });
    group(Op::statistics, [&] { summary.record(Op::statistics, statistics()); });
    group(Op::chunk_index, [&] { summary.raw(chunk_indexes.str()); });

    const std::uint64_t offsets_start = start + summary.size();
    summary.raw(offsets.str());
    summary.u8(static_cast<std::uint8_t>(Op::footer)).u64(20).u64(start).u64(offsets_start);
    summary.u32(mcap::crc32(summary.str())).raw(mcap::magic);
    append(summary.str());
    file.commit();
  }

  McapWriterOptions options;
  files::AtomicFile file;
  mcap::Packer packer;
  std::uint64_t offset = 0;
  std::uint32_t crc = 0;  ///< of everything so far
  std::vector<McapSchema> schemas;
  std::vector<McapChannel> channels;

  Bytes chunk;  ///< records of the open chunk
  TimeRange times;
  std::map<std::uint16_t, Bytes> index;  ///< of the open chunk: channel -> (log time, offset in the chunk)...

  Bytes chunk_indexes;  ///< records
  std::uint32_t chunks = 0;
  TimeRange all_times;
  std::map<std::uint16_t, std::uint64_t> messages;  ///< by channel
  Bytes content;                                    ///< of the message being written
};

McapWriter::McapWriter(const std::filesystem::path& path, McapWriterOptions options)
    : impl_(std::make_unique<Impl>(path, std::move(options))) {}
McapWriter::~McapWriter() = default;
McapWriter::McapWriter(McapWriter&&) noexcept = default;
McapWriter& McapWriter::operator=(McapWriter&&) noexcept = default;

std::uint16_t McapWriter::add_schema(std::string name, std::string encoding, std::string text) {
  auto& schemas = impl_->schemas;
  check::that(schemas.size() < most_ids, "number of schemas of an MCAP file", "at most 65 535");
  const auto id = static_cast<std::uint16_t>(schemas.size() + 1);
  schemas.push_back({id, std::move(name), std::move(encoding), std::move(text)});
  impl_->append_record(Op::schema, mcap::write_schema(schemas.back()));
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema_id, std::string topic, std::string message_encoding,
                                      std::map<std::string, std::string> metadata) {
  auto& channels = impl_->channels;
  check::that(channels.size() < most_ids, "number of channels of an MCAP file", "at most 65 535");
  check::that(schema_id <= impl_->schemas.size(), "schema_id of an MCAP channel", "0 or the id of a schema");
  const auto id = static_cast<std::uint16_t>(channels.size() + 1);
  channels.push_back({id, schema_id, std::move(topic), std::move(message_encoding), std::move(metadata)});
  impl_->append_record(Op::channel, mcap::write_channel(channels.back()));
  return id;
}

void McapWriter::write(const McapMessage& message) {
  Impl& impl = *impl_;
  check::that(message.channel_id >= 1 && message.channel_id <= impl.channels.size(), "channel_id of an MCAP message",
              "the id of a channel that was added");
  impl.content.clear();
  impl.content.u16(message.channel_id).u32(message.sequence).u64(message.log_time).u64(message.publish_time);
  impl.content.raw(message.data);
  if (impl.options.chunk_bytes > 0) {
    impl.times.add(message.log_time);
    impl.index[message.channel_id].u64(message.log_time).u64(impl.chunk.size());
  }
  impl.append_record(Op::message, impl.content.str());
  impl.all_times.add(message.log_time);
  ++impl.messages[message.channel_id];
  if (impl.chunk.size() >= std::max<std::size_t>(impl.options.chunk_bytes, 1)) {
    impl.close_chunk();
  }
}

void McapWriter::commit() { impl_->end(); }

}  // namespace wheelwright::logs
