// SPDX-License-Identifier: Apache-2.0
/// \file
/// The bytes of a file through a window that moves forward, with checksums of what it has left behind.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/files/xxh64.hpp>

namespace wheelwright::mcap {

/// A regular file, read in large pieces. Its size is that of the moment of opening: a recording that grows meanwhile is
/// read up to there.
class WindowedFile {
 public:
  /// Opens `path`. Throws InputError, naming it, when it is missing, a directory, not a regular file or unreadable.
  WindowedFile(const std::filesystem::path& path, bool hashed);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Bytes [offset, offset + size), which must lie in the file and not before what has been left behind; borrowed until
  /// the next call of any member. The window grows to `size`. Throws InputError, naming file and offset, when they
  /// cannot be read.
  std::string_view view(std::uint64_t offset, std::size_t size);

  /// The same for a few bytes anywhere; the window stays where it is.
  std::string peek(std::uint64_t offset, std::size_t size);

  /// Leaves behind everything before `offset`, which is read where it was not: it goes into the checksums.
  void leave(std::uint64_t offset);

  /// CRC-32 of the bytes left behind up to `end` (fixed by sum_until); valid when `end` has been left behind.
  [[nodiscard]] std::uint32_t crc() const { return crc_; }
  /// From the start: bytes from `end` on do not go into crc(), 0 means none do. To be called before leave().
  void sum_until(std::uint64_t end) { sum_end_ = end; }
  /// Xxh64::text() of the bytes left behind; empty where hashing was not asked for.
  [[nodiscard]] std::string hash() const { return hashed_ ? hash_.text() : std::string(); }

  /// Back to the beginning, checksums too.
  void rewind();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  void read(std::uint64_t offset, char* to, std::size_t size);
  void sum(std::string_view bytes);

  std::string name_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t size_ = 0;
  std::uint64_t position_ = 0;  ///< of file_
  std::vector<char> window_;
  std::uint64_t start_ = 0;  ///< of the window in the file
  std::size_t filled_ = 0;
  std::uint64_t left_ = 0;
  std::uint64_t sum_end_ = 0;
  std::uint32_t crc_ = 0;
  bool hashed_;
  Xxh64 hash_;
};

}  // namespace wheelwright::mcap
