// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/mcap_format.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include "core/check.hpp"
#include "core/error.hpp"

namespace wheelwright::logs::mcap {

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

namespace {

constexpr std::size_t piece = std::size_t{1} << 20;

}  // namespace

WindowedFile::WindowedFile(const std::filesystem::path& path, bool hashed) : name_(path.string()), hashed_(hashed) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(name_ + ": no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError(name_ + ": is a directory: expected a file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(name_ + ": is a pipe or a device: expected a regular file, whose end can be read first");
  }
  file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file_) {
    throw InputError(name_ + ": cannot be opened (" + std::strerror(errno) + "): expected a readable file");
  }
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  size_ = std::filesystem::file_size(path, error);
  if (error) {
    throw InputError(name_ + ": has no known size (" + error.message() + "): expected a regular file");
  }
}

void WindowedFile::read(std::uint64_t offset, char* to, std::size_t size) {
  if (offset != position_ && std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) != 0) {
    throw InputError(fmt::format("{}: at byte {}: cannot be read ({})", name_, offset, std::strerror(errno)));
  }
  position_ = offset + std::fread(to, 1, size, file_.get());
  if (position_ != offset + size) {
    const std::string why = std::ferror(file_.get()) != 0 ? std::strerror(errno) : "the file has become shorter";
    throw InputError(fmt::format("{}: at byte {}: cannot be read ({})", name_, position_, why));
  }
}

std::string_view WindowedFile::view(std::uint64_t offset, std::size_t size) {
  if (offset < start_ || offset + size > start_ + filled_) {
    const std::uint64_t keep = std::min(left_, offset);  // what is not left behind stays
    if (keep > start_ && keep < start_ + filled_) {
      const auto drop = static_cast<std::size_t>(keep - start_);
      std::memmove(window_.data(), window_.data() + drop, filled_ - drop);
      filled_ -= drop;
      start_ = keep;
    } else if (keep != start_) {
      filled_ = 0;
      start_ = keep;
    }
    const auto needed = static_cast<std::size_t>(offset + size - start_);
    if (window_.size() < needed) {
      window_.resize(std::max<std::size_t>(std::min<std::uint64_t>(piece, size_), needed));
    }
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(window_.size(), size_ - start_));
    if (wanted > filled_) {
      read(start_ + filled_, window_.data() + filled_, wanted - filled_);
      filled_ = wanted;
    }
  }
  return {window_.data() + (offset - start_), size};
}

std::string WindowedFile::peek(std::uint64_t offset, std::size_t size) {
  std::string bytes(size, '\0');
  if (size == 0) {
    return bytes;
  }
  if (offset >= start_ && offset + size <= start_ + filled_) {
    std::memcpy(bytes.data(), window_.data() + (offset - start_), size);
  } else {
    read(offset, bytes.data(), size);
  }
  return bytes;
}

void WindowedFile::sum(std::string_view bytes) {
  if (hashed_) {
    hash_.update(bytes.data(), bytes.size());
  }
  if (left_ < sum_end_) {
    crc_ = crc32(bytes.substr(0, sum_end_ - left_), crc_);
  }
  left_ += bytes.size();
}

void WindowedFile::leave(std::uint64_t offset) {
  while (left_ < offset) {
    if (left_ >= start_ + filled_ && !hashed_ && left_ >= sum_end_) {
      left_ = offset;  // nobody asks for these bytes
    } else {
      const std::uint64_t in_window = left_ >= start_ && left_ < start_ + filled_ ? start_ + filled_ - left_ : piece;
      sum(view(left_, static_cast<std::size_t>(std::min(offset - left_, in_window))));
    }
  }
}

void WindowedFile::rewind() {
  start_ = left_ = 0;
  filled_ = 0;
  crc_ = 0;
  hash_ = files::Xxh64();
}

namespace {

constexpr std::array<std::pair<McapCompression, std::string_view>, 3> words = {
    {{McapCompression::none, ""}, {McapCompression::zstd, "zstd"}, {McapCompression::lz4, "lz4"}}};

constexpr int zstd_level = 1;  // as fast as recorders need it
constexpr std::size_t first_room = std::size_t{1} << 16;

struct FreeZstd {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
};

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

LZ4F_dctx* new_lz4() {
  LZ4F_dctx* context = nullptr;
  return LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) == 0 ? context : nullptr;
}

/// What one call of a decoder did.
struct Step {
  std::size_t consumed = 0;
  std::size_t produced = 0;
  bool frame_ended = false;
  const char* error = nullptr;
};

}  // namespace

std::string_view compression_word(McapCompression compression) {
  return words[static_cast<std::size_t>(compression)].second;
}

std::optional<McapCompression> compression_of(std::string_view word) {
  for (const auto& [compression, known] : words) {
    if (known == word) {
      return compression;
    }
  }
  return {};
}

struct Unpacker::Impl {
  std::unique_ptr<ZSTD_DCtx, FreeZstd> zstd{ZSTD_createDCtx()};
  std::unique_ptr<LZ4F_dctx, FreeLz4> lz4{new_lz4()};
  std::vector<char> room;

  Step zstd_step(std::string_view packed, char* to, std::size_t size) const {
    ZSTD_inBuffer in{packed.data(), packed.size(), 0};
    ZSTD_outBuffer out{to, size, 0};
    const std::size_t status = ZSTD_decompressStream(zstd.get(), &out, &in);
    return {in.pos, out.pos, status == 0, ZSTD_isError(status) != 0 ? ZSTD_getErrorName(status) : nullptr};
  }

  Step lz4_step(std::string_view packed, char* to, std::size_t size) const {
    std::size_t consumed = packed.size();
    std::size_t produced = size;
    const std::size_t status = LZ4F_decompress(lz4.get(), to, &produced, packed.data(), &consumed, nullptr);
    if (LZ4F_isError(status) != 0) {
      return {0, 0, false, LZ4F_getErrorName(status)};
    }
    return {consumed, produced, status == 0, nullptr};
  }

  /// Frame after frame until `packed` is used up. One byte more than `expected` has room, so that too much is seen.
  Result frames(bool is_zstd, std::string_view packed, std::uint64_t expected) {
    const auto most = static_cast<std::size_t>(expected) + 1;
    std::size_t done = 0;
    bool frame_ended = false;
    const auto result = [&](std::string defect) {
      return Result{{room.data(), static_cast<std::size_t>(std::min<std::uint64_t>(done, expected))},
                    std::move(defect)};
    };
    room.resize(std::max(room.size(), std::min(most, std::max(first_room, 4 * packed.size()))));
    while (!packed.empty() || !frame_ended) {
      if (done == room.size()) {
        room.resize(std::min(most, 2 * room.size()));
      }
      const std::size_t free = std::min(room.size(), most) - done;
      const Step step =
          is_zstd ? zstd_step(packed, room.data() + done, free) : lz4_step(packed, room.data() + done, free);
      if (step.error != nullptr) {
        return result(std::string("packing damaged (") + step.error + ")");
      }
      packed.remove_prefix(step.consumed);
      done += step.produced;
      frame_ended = step.frame_ended;
      if (done > expected) {
        return result("more bytes than its head says");
      }
      if (!frame_ended && packed.empty() && step.produced < free) {
        return result("packing ends early");
      }
      if (step.consumed == 0 && step.produced == 0) {
        return result("packing damaged (no progress)");
      }
    }
    return result(done < expected ? "fewer bytes than its head says" : "");
  }
};

Unpacker::Unpacker() : impl_(std::make_unique<Impl>()) {
  if (!impl_->zstd || !impl_->lz4) {
    throw Error("zstd or LZ4 cannot start");
  }
}
Unpacker::~Unpacker() = default;
Unpacker::Unpacker(Unpacker&&) noexcept = default;
Unpacker& Unpacker::operator=(Unpacker&&) noexcept = default;

Unpacker::Result Unpacker::unpack(McapCompression compression, std::string_view packed, std::uint64_t expected) {
  if (packed.empty() && expected == 0) {
    return {};
  }
  switch (compression) {
    case McapCompression::none: break;
    case McapCompression::zstd:
      ZSTD_DCtx_reset(impl_->zstd.get(), ZSTD_reset_session_only);
      return impl_->frames(true, packed, expected);
    case McapCompression::lz4:
      LZ4F_resetDecompressionContext(impl_->lz4.get());
      return impl_->frames(false, packed, expected);
  }
  if (packed.size() == expected) {
    return {packed, ""};
  }
  return {packed.substr(0, expected),
          packed.size() < expected ? "fewer bytes than its head says" : "more bytes than its head says"};
}

struct Packer::Impl {
  McapCompression compression = McapCompression::none;
  std::unique_ptr<ZSTD_CCtx, FreeZstd> zstd{ZSTD_createCCtx()};
  std::vector<char> room;
};

Packer::Packer(McapCompression compression) : impl_(std::make_unique<Impl>()) {
  impl_->compression = compression;
  if (!impl_->zstd) {
    throw Error("zstd cannot start");
  }
}
Packer::~Packer() = default;
Packer::Packer(Packer&&) noexcept = default;
Packer& Packer::operator=(Packer&&) noexcept = default;

std::string_view Packer::pack(std::string_view bytes) {
  std::vector<char>& room = impl_->room;
  std::size_t size = 0;
  if (impl_->compression == McapCompression::none) {
    room.assign(bytes.begin(), bytes.end());
    size = room.size();
  } else if (impl_->compression == McapCompression::zstd) {
    room.resize(std::max(room.size(), ZSTD_compressBound(bytes.size())));
    size = ZSTD_compressCCtx(impl_->zstd.get(), room.data(), room.size(), bytes.data(), bytes.size(), zstd_level);
    if (ZSTD_isError(size) != 0) {
      throw Error(std::string("zstd: ") + ZSTD_getErrorName(size));
    }
  } else {
    LZ4F_preferences_t preferences{};
    preferences.frameInfo.contentSize = bytes.size();
    room.resize(std::max(room.size(), LZ4F_compressFrameBound(bytes.size(), &preferences)));
    size = LZ4F_compressFrame(room.data(), room.size(), bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(size) != 0) {
      throw Error(std::string("LZ4: ") + LZ4F_getErrorName(size));
    }
  }
  return {room.data(), size};
}

}  // namespace wheelwright::logs::mcap
