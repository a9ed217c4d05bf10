// SPDX-License-Identifier: Apache-2.0
/// \file
/// Packing and unpacking of chunks: zstd and LZ4 frames (libzstd, liblz4).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/logs/mcap_types.hpp>

namespace wheelwright::mcap {

/// The word for it in the file: "", "zstd" or "lz4".
[[nodiscard]] std::string_view compression_word(McapCompression compression);
/// The compression that a word stands for; nothing for words that are not known.
[[nodiscard]] std::optional<McapCompression> compression_of(std::string_view word);

/// Unpacks chunk after chunk with the same memory.
class Unpacker {
 public:
  /// What came out.
  struct Result {
    std::string_view bytes;  ///< what could be unpacked, at most the expected size; until the next call
    std::string defect;      ///< empty when `packed` is whole and has exactly the expected size
  };

  Unpacker();
  ~Unpacker();
  Unpacker(Unpacker&&) noexcept;
  Unpacker& operator=(Unpacker&&) noexcept;

  /// Unpacks `packed`, which ought to give `expected` bytes. Memory grows with what comes out and not with `expected`.
  /// With McapCompression::none the result borrows `packed`.
  Result unpack(McapCompression compression, std::string_view packed, std::uint64_t expected);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Packs chunk after chunk with the same memory.
class Packer {
 public:
  explicit Packer(McapCompression compression);
  ~Packer();
  Packer(Packer&&) noexcept;
  Packer& operator=(Packer&&) noexcept;

  /// `bytes`, packed; until the next call.
  std::string_view pack(std::string_view bytes);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::mcap
