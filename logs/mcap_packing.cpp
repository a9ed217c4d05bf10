// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_packing.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include <lz4frame.h>
#include <zstd.h>

#include <wheelwright/core/error.hpp>

namespace wheelwright::mcap {
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

}  // namespace wheelwright::mcap
