// SPDX-License-Identifier: Apache-2.0
/// \file
/// Bytes of files: their hash, by which results name the files they come from; streams of them, decompressed where
/// needed, and their lines, in bounded memory; files that are either written whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/temporary.hpp"

struct XXH64_state_s;

namespace wheelwright::files {

/// XXH64 with seed 0 (Collet, xxHash), fed in pieces of any size, by libxxhash. It identifies recordings; it does not
/// protect against forgery.
class Xxh64 {
 public:
  Xxh64();
  /// Appends `size` bytes.
  void update(const char* data, std::size_t size);
  /// Hash of all bytes so far; more may follow.
  [[nodiscard]] std::uint64_t digest() const;
  /// "xxh64:" and 16 hexadecimal digits.
  [[nodiscard]] std::string text() const;

 private:
  struct Free {
    void operator()(XXH64_state_s* state) const;
  };
  std::unique_ptr<XXH64_state_s, Free> state_;
};

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

/// True if `head`, the first bytes of a file, begins a zstd stream: a frame, or one to be skipped.
[[nodiscard]] bool is_zstd(std::string_view head);

/// Bytes that may come out of a packed file of `packed` bytes: 64 MiB, or 100 times its size. Logs are packed to a
/// twentieth of their size; a file that is made to fill a disk, to a ten thousandth.
[[nodiscard]] std::uint64_t most_unpacked(std::uint64_t packed);

/// "more than 67108864 bytes come out of its 1042: expected …", when that was too much for a file of `packed` bytes.
[[nodiscard]] std::string too_much_unpacked(std::uint64_t packed);

/// First bytes of a ROS 1 bag, of every version.
inline constexpr std::string_view ros1_bag_magic = "#ROSBAG V";

/// "is a ROS 1 bag: expected …", with the commands that convert the one at `path`.
[[nodiscard]] std::string ros1_bag(const std::filesystem::path& path);

/// Opens `path`; UTF-16 comes out as UTF-8. Throws InputError, naming it, when it is missing, a directory, not a
/// regular file, empty, unreadable, or a known format that is not text (zip, SQLite, HDF5, MCAP, xz, bzip2, a ROS 1
/// bag). Its source throws, without `unlimited`, where more than most_unpacked() bytes come out.
[[nodiscard]] std::unique_ptr<ByteSource> open_bytes(const std::filesystem::path& path, bool hashed = false,
                                                     bool unlimited = false);

/// What comes from the open descriptor `descriptor`, as it comes: read() waits for the first byte only. It is neither
/// unpacked nor hashed; `name` is for messages.
[[nodiscard]] std::unique_ptr<ByteSource> open_stream(int descriptor, std::string name);

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

/// Throws InputError where no file can be put at `place`: it is a directory, or a link that leads to nothing.
void check_destination(const std::filesystem::path& place);

/// A new, empty file beside the place that it is written for, for libraries that write by name. put() renames it; where
/// that is not reached, nothing is left behind and an older file of the place's name stays as it was. Where the place
/// is a symbolic link, what it leads to is replaced; a link that leads to nothing is refused.
class FileBeside {
 public:
  /// Makes the file. Throws InputError, naming the place, when it cannot be made (no such directory, no right to write,
  /// the place is a directory, a pipe or a device).
  explicit FileBeside(std::filesystem::path place);

  /// Of the file itself, until put().
  [[nodiscard]] const std::filesystem::path& path() const { return beside_.path(); }
  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  /// Renames it, closed by its writer, to its place, when all of it is on disk. Throws InputError when that fails. To
  /// be called once, last.
  void put();

 private:
  std::filesystem::path place_;
  std::filesystem::path target_;  ///< what the place leads to
  Temporary beside_;
};

/// A file that is written from its beginning to its end: beside its place under a temporary name, and renamed into it
/// by commit(), as FileBeside does. A pipe or a device is written to as it is, and so is a stream of the program's own
/// ("/dev/stdout").
class AtomicFile {
 public:
  /// Opens it. Throws InputError as FileBeside does, but for pipes and devices.
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Appends `bytes`. Throws InputError when they cannot be written (disk full).
  void write(std::string_view bytes);
  /// Closes and renames. Throws InputError when either fails. To be called once, last.
  void commit();

 private:
  std::filesystem::path place_;
  std::optional<FileBeside> beside_;  ///< none where the place is written to as it is
  std::FILE* file_ = nullptr;
};

/// Puts `content` at `path`, whole or not at all. Throws InputError as AtomicFile does.
void atomic_write(const std::filesystem::path& path, std::string_view content);

}  // namespace wheelwright::files
