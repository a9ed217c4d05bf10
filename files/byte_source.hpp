// SPDX-License-Identifier: Apache-2.0
/// \file
/// Byte streams of files, decompressed where needed, and their lines, in bounded memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace wheelwright::files {

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

/// Walks the lines of a ByteSource. Line ends are LF or CRLF; a UTF-8 byte order mark at the beginning is skipped.
class LineReader {
 public:
  /// Takes `source` over; `path` is for messages.
  LineReader(std::unique_ptr<ByteSource> source, std::string path);

  /// Sets `line` to the next line, its end removed, and returns true; false at the end of the stream. `line` stays
  /// valid until the next call. Throws InputError for a line of more than 2^18 bytes.
  bool next(std::string_view& line);

  /// Number of the line that was returned last; the first is 1.
  [[nodiscard]] std::size_t number() const { return number_; }
  /// True if the line that was returned last had a line end (only the last of a file may lack it).
  [[nodiscard]] bool terminated() const { return terminated_; }
  /// The stream.
  [[nodiscard]] const ByteSource& source() const { return *source_; }

 private:
  bool refill();

  std::unique_ptr<ByteSource> source_;
  std::string path_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
  bool terminated_ = false;
};

}  // namespace wheelwright::files
