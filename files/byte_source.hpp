// SPDX-License-Identifier: Apache-2.0
/// \file
/// The bytes of a file, unpacked where it is packed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

namespace wheelwright {

/// A stream of bytes from a plain, gzip or zstd file (told apart by their first bytes, not by their names).
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  /// Puts up to `size` unpacked bytes at `to` and returns how many; 0 only at the end. Throws InputError, naming the
  /// file, when it cannot be read or its packing is damaged or ends early.
  virtual std::size_t read(char* to, std::size_t size) = 0;
  /// Bytes of the file that were read from disk so far (packed).
  [[nodiscard]] virtual std::uint64_t file_bytes() const = 0;
  /// Xxh64::text() of those bytes; empty where hashing was not asked for.
  [[nodiscard]] virtual std::string hash() const = 0;
  /// "plain", "gzip" or "zstd".
  [[nodiscard]] virtual const char* packing() const = 0;
};

/// Opens `path`. Throws InputError, naming it, when it is missing, a directory, not a regular file, empty, unreadable,
/// or a known format that is not text (zip, SQLite, HDF5, MCAP, xz, bzip2, UTF-16).
[[nodiscard]] std::unique_ptr<ByteSource> open_bytes(const std::filesystem::path& path, bool hashed = false);

/// All bytes of `path`, unpacked. Throws InputError as open_bytes does, and when there are more than `limit`.
[[nodiscard]] std::string read_bytes(const std::filesystem::path& path, std::size_t limit);

}  // namespace wheelwright
