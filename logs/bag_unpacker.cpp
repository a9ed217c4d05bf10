// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_unpacker.hpp>

#include <algorithm>
#include <cstddef>
#include <vector>

#include <zstd.h>

#include <wheelwright/core/error.hpp>

namespace wheelwright::bag {
namespace {

constexpr std::size_t longest = std::size_t{1} << 29;

struct Free {
  void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
};

}  // namespace

struct MessageUnpacker::Impl {
  std::unique_ptr<ZSTD_DStream, Free> stream;
  std::vector<char> bytes;
};

MessageUnpacker::MessageUnpacker() : impl_(std::make_unique<Impl>()) {}
MessageUnpacker::~MessageUnpacker() = default;
MessageUnpacker::MessageUnpacker(MessageUnpacker&&) noexcept = default;
MessageUnpacker& MessageUnpacker::operator=(MessageUnpacker&&) noexcept = default;

bool is_packed(std::string_view data) { return data.starts_with("\x28\xB5\x2F\xFD"); }

std::optional<std::string_view> MessageUnpacker::unpack(std::string_view data) {
  if (!impl_->stream) {
    impl_->stream.reset(ZSTD_createDStream());
    if (!impl_->stream) {
      throw Error("zstd cannot start");
    }
    impl_->bytes.resize(4096);
  }
  ZSTD_DCtx_reset(impl_->stream.get(), ZSTD_reset_session_only);
  ZSTD_inBuffer in{data.data(), data.size(), 0};
  std::size_t filled = 0;
  while (true) {
    ZSTD_outBuffer out{impl_->bytes.data(), impl_->bytes.size(), filled};
    const std::size_t status = ZSTD_decompressStream(impl_->stream.get(), &out, &in);
    if (ZSTD_isError(status) != 0) {
      return std::nullopt;
    }
    const bool room = out.pos < out.size;
    filled = out.pos;
    if (status == 0) {
      return in.pos == in.size ? std::optional(std::string_view(impl_->bytes.data(), filled)) : std::nullopt;
    }
    if (room && in.pos == in.size) {
      return std::nullopt;
    }
    if (!room) {
      if (impl_->bytes.size() >= longest) {
        return std::nullopt;
      }
      impl_->bytes.resize(std::min(longest, 2 * impl_->bytes.size()));
    }
  }
}

}  // namespace wheelwright::bag
