// SPDX-License-Identifier: Apache-2.0
/// \file
/// Messages that rosbag2 packed with zstd one by one (compression_mode MESSAGE).
#pragma once

#include <memory>
#include <optional>
#include <string_view>

namespace wheelwright::bag {

/// Whether a message is packed: it begins as a zstd frame does, and no CDR does.
[[nodiscard]] bool is_packed(std::string_view data);

/// Unpacks message after message with the same memory.
class MessageUnpacker {
 public:
  MessageUnpacker();
  ~MessageUnpacker();
  MessageUnpacker(MessageUnpacker&&) noexcept;
  MessageUnpacker& operator=(MessageUnpacker&&) noexcept;

  /// The message, until the next call; nothing where it is damaged, cut off or longer than 512 MiB. Memory grows with
  /// what comes out, not with what the frame says.
  std::optional<std::string_view> unpack(std::string_view data);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::bag
