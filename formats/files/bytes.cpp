// SPDX-License-Identifier: Apache-2.0
#include "formats/files/bytes.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <xxhash.h>
#include <zlib.h>
#include <zstd.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::files {

void Xxh64::Free::operator()(XXH64_state_s* state) const { XXH64_freeState(state); }

Xxh64::Xxh64() : state_(XXH64_createState()) {
  if (!state_) {
    throw std::bad_alloc();
  }
  XXH64_reset(state_.get(), 0);
}

void Xxh64::update(const char* data, std::size_t size) { XXH64_update(state_.get(), data, size); }

std::uint64_t Xxh64::digest() const { return XXH64_digest(state_.get()); }

std::string Xxh64::text() const { return fmt::format("xxh64:{:016x}", digest()); }

namespace {

constexpr std::size_t bytes_at_once = std::size_t{1} << 18;
constexpr std::uint64_t always_unpacked = std::uint64_t{1} << 26;
constexpr std::uint64_t largest_ratio = 100;

}  // namespace

bool is_zstd(std::string_view head) {
  const bool skippable =
      head.size() >= 4 && (static_cast<unsigned char>(head[0]) & 0xF0U) == 0x50U && head.substr(1, 3) == "\x2A\x4D\x18";
  return skippable || head.starts_with("\x28\xB5\x2F\xFD");
}

std::uint64_t most_unpacked(std::uint64_t packed) {
  return packed > std::numeric_limits<std::uint64_t>::max() / largest_ratio
             ? std::numeric_limits<std::uint64_t>::max()
             : std::max(always_unpacked, largest_ratio * packed);
}

std::string ros1_bag(const std::filesystem::path& path) {
  const std::filesystem::path bag = path.has_filename() ? path : path.parent_path();
  const std::string name = bag.string();
  const std::string to = (bag.parent_path() / bag.stem()).string() + "_ros2";
  return fmt::format(
      "is a ROS 1 bag: expected rosbag2 (MCAP, SQLite), HDF5 or CSV; `pip install rosbags`, then `rosbags-convert "
      "--src {0} --dst {1}` makes a rosbag2 directory of it (older versions: `rosbags-convert {0} --dst {1}`)",
      name, to);
}

std::string too_much_unpacked(std::uint64_t packed) {
  return fmt::format(
      "more than {} bytes come out of its {}: expected at most {}, or {} times its size; unpack it first, or read a "
      "log with --trust",
      most_unpacked(packed), packed, always_unpacked, largest_ratio);
}

namespace {

/// The file itself, with count and hash of what was read.
class RawFile {
 public:
  RawFile(const std::filesystem::path& path, bool hashed) : name_(path.string()), hashed_(hashed) {
    file_.reset(std::fopen(path.c_str(), "rb"));
    if (!file_) {
      throw InputError(name_ + ": cannot be opened (" + std::strerror(errno) + "): expected a readable file");
    }
    std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  }

  std::size_t read(char* to, std::size_t size) {
    const std::size_t got = std::fread(to, 1, size, file_.get());
    if (got < size && std::ferror(file_.get()) != 0) {
      throw InputError(name_ + ": cannot be read (" + std::strerror(errno) + "): expected a readable file");
    }
    bytes_ += got;
    if (hashed_) {
      hash_.update(to, got);
    }
    return got;
  }

  [[noreturn]] void fail(std::string_view what) const { throw InputError(name_ + ": " + std::string(what)); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }
  [[nodiscard]] std::string hash() const { return hashed_ ? hash_.text() : std::string(); }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string name_;
  bool hashed_;
  std::unique_ptr<std::FILE, Close> file_;
  std::uint64_t bytes_ = 0;
  Xxh64 hash_;
};

/// What the three kinds share: the raw file and its first bytes, already read; the bytes of all of it, or none where
/// what comes out is not limited.
class FileSource : public ByteSource {
 public:
  FileSource(RawFile raw, std::string head, std::optional<std::uint64_t> packed)
      : raw_(std::move(raw)), packed_(packed), pending_(std::move(head)) {}
  [[nodiscard]] std::uint64_t file_bytes() const override { return raw_.bytes(); }
  [[nodiscard]] std::string hash() const override { return raw_.hash(); }

 protected:
  /// Next packed bytes: the head first, then the file.
  std::size_t read_raw(char* to, std::size_t size) {
    if (head_used_ < pending_.size()) {
      const std::size_t take = std::min(size, pending_.size() - head_used_);
      std::memcpy(to, pending_.data() + head_used_, take);
      head_used_ += take;
      return take;
    }
    return raw_.read(to, size);
  }

  /// Counts unpacked bytes; returns how many they are.
  std::size_t count(std::size_t size) {
    unpacked_ += size;
    if (packed_ && unpacked_ > most_unpacked(*packed_)) {
      raw_.fail(too_much_unpacked(*packed_));
    }
    return size;
  }
  RawFile raw_;

 private:
  std::optional<std::uint64_t> packed_;
  std::uint64_t unpacked_ = 0;
  std::string pending_;
  std::size_t head_used_ = 0;
};

class PlainSource final : public FileSource {
 public:
  using FileSource::FileSource;
  std::size_t read(char* to, std::size_t size) override { return read_raw(to, size); }
  [[nodiscard]] const char* packing() const override { return "plain"; }
};

class GzipSource final : public FileSource {
 public:
  GzipSource(RawFile raw, std::string head, std::optional<std::uint64_t> packed)
      : FileSource(std::move(raw), std::move(head), packed), buffer_(bytes_at_once) {
    if (inflateInit2(&stream_, 15 + 16) != Z_OK) {
      throw Error("zlib cannot start");
    }
  }
  ~GzipSource() override { inflateEnd(&stream_); }
  GzipSource(const GzipSource&) = delete;
  GzipSource& operator=(const GzipSource&) = delete;

  std::size_t read(char* to, std::size_t size) override {
    stream_.next_out = reinterpret_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(std::min(size, bytes_at_once));
    const uInt wanted = stream_.avail_out;
    while (stream_.avail_out == wanted) {
      if (stream_.avail_in == 0) {
        stream_.avail_in = static_cast<uInt>(read_raw(buffer_.data(), buffer_.size()));
        stream_.next_in = reinterpret_cast<Bytef*>(buffer_.data());
        if (stream_.avail_in == 0) {
          if (!between_members_) {
            raw_.fail("gzip stream ends early: expected a complete file (was the copy cut off?)");
          }
          return 0;
        }
      }
      between_members_ = false;
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status == Z_STREAM_END) {
        inflateReset(&stream_);
        between_members_ = true;
      } else if (status != Z_OK && status != Z_BUF_ERROR) {
        raw_.fail(std::string("damaged gzip stream (") + (stream_.msg != nullptr ? stream_.msg : "zlib error") +
                  "): expected a valid file");
      }
    }
    return count(wanted - stream_.avail_out);
  }
  [[nodiscard]] const char* packing() const override { return "gzip"; }

 private:
  std::vector<char> buffer_;
  z_stream stream_{};
  bool between_members_ = false;
};

class ZstdSource final : public FileSource {
 public:
  ZstdSource(RawFile raw, std::string head, std::optional<std::uint64_t> packed)
      : FileSource(std::move(raw), std::move(head), packed), buffer_(bytes_at_once), stream_(ZSTD_createDStream()) {
    if (!stream_) {
      throw Error("zstd cannot start");
    }
  }

  std::size_t read(char* to, std::size_t size) override {
    ZSTD_outBuffer out{to, size, 0};
    while (out.pos == 0) {
      if (in_.pos == in_.size) {
        in_ = {buffer_.data(), read_raw(buffer_.data(), buffer_.size()), 0};
        if (in_.size == 0) {
          if (!between_frames_) {
            raw_.fail("zstd stream ends early: expected a complete file (was the copy cut off?)");
          }
          return 0;
        }
      }
      const std::size_t status = ZSTD_decompressStream(stream_.get(), &out, &in_);
      if (ZSTD_isError(status) != 0) {
        raw_.fail(std::string("damaged zstd stream (") + ZSTD_getErrorName(status) + "): expected a valid file");
      }
      between_frames_ = status == 0;
    }
    return count(out.pos);
  }
  [[nodiscard]] const char* packing() const override { return "zstd"; }

 private:
  struct Free {
    void operator()(ZSTD_DStream* stream) const { ZSTD_freeDStream(stream); }
  };
  std::vector<char> buffer_;
  std::unique_ptr<ZSTD_DStream, Free> stream_;
  ZSTD_inBuffer in_{nullptr, 0, 0};
  bool between_frames_ = true;
};

/// UTF-16 as UTF-8, its byte order mark included; what is no character is U+FFFD.
class Utf16Source final : public FileSource {
 public:
  Utf16Source(RawFile raw, std::string head, bool big_endian)
      : FileSource(std::move(raw), std::move(head), std::nullopt), big_endian_(big_endian), buffer_(bytes_at_once) {}

  std::size_t read(char* to, std::size_t size) override {
    while (used_ == ready_.size() && refill()) {
    }
    const std::size_t take = std::min(size, ready_.size() - used_);
    std::memcpy(to, ready_.data() + used_, take);
    used_ += take;
    return take;
  }
  [[nodiscard]] const char* packing() const override { return "plain"; }

 private:
  bool refill() {
    ready_.clear();
    used_ = 0;
    const std::size_t size = read_raw(buffer_.data(), buffer_.size());
    for (std::size_t k = 0; k < size; ++k) {
      const auto byte = static_cast<unsigned char>(buffer_[k]);
      if (!first_) {
        first_ = byte;
        continue;
      }
      add(static_cast<std::uint32_t>(big_endian_ ? *first_ << 8U | byte : byte << 8U | *first_));
      first_.reset();
    }
    if (size == 0 && (high_ != 0 || first_)) {
      high_ = 0;
      first_.reset();
      put(replacement);
      return true;
    }
    return size > 0;
  }

  void add(std::uint32_t unit) {
    const bool low = unit >= 0xDC00U && unit < 0xE000U;
    if (high_ != 0) {
      put(low ? 0x10000U + ((high_ - 0xD800U) << 10U) + (unit - 0xDC00U) : replacement);
    }
    const bool paired = high_ != 0 && low;
    high_ = unit >= 0xD800U && unit < 0xDC00U ? unit : 0;
    if (!paired && high_ == 0) {
      put(low ? replacement : unit);
    }
  }

  void put(std::uint32_t character) {
    const auto tail = [&](unsigned shift) { ready_ += static_cast<char>(0x80U | ((character >> shift) & 0x3FU)); };
    if (character < 0x80U) {
      ready_ += static_cast<char>(character);
    } else if (character < 0x800U) {
      ready_ += static_cast<char>(0xC0U | (character >> 6U));
      tail(0);
    } else if (character < 0x10000U) {
      ready_ += static_cast<char>(0xE0U | (character >> 12U));
      tail(6);
      tail(0);
    } else {
      ready_ += static_cast<char>(0xF0U | (character >> 18U));
      tail(12);
      tail(6);
      tail(0);
    }
  }

  static constexpr std::uint32_t replacement = 0xFFFDU;
  bool big_endian_;
  std::vector<char> buffer_;
  std::string ready_;
  std::size_t used_ = 0;
  std::optional<unsigned> first_;  ///< byte of a unit whose second is still to come
  std::uint32_t high_ = 0;         ///< first half of a pair, 0: none
};

/// Whether `head` is UTF-16 without a byte order mark, by the zeros of its ASCII: its byte order; else nothing.
std::optional<bool> unmarked_utf16(std::string_view head) {
  constexpr std::size_t enough = 8;
  for (const std::size_t zero : {std::size_t{0}, std::size_t{1}}) {
    bool all = head.size() >= enough;
    for (std::size_t k = 0; all && k < head.size(); ++k) {
      const auto byte = static_cast<unsigned char>(head[k]);
      all = k % 2 == zero ? byte == 0 : byte >= 0x09 && byte < 0x7F;
    }
    if (all) {
      return zero == 0;
    }
  }
  return std::nullopt;
}

struct Magic {
  std::string_view bytes;
  std::string_view format;
};

constexpr std::array<Magic, 7> not_text = {{{"PK\x03\x04", "a zip archive"},
                                            {"SQLite format 3", "an SQLite file (rosbag2?)"},
                                            {"\x89HDF", "an HDF5 file"},
                                            {"\x89MCAP", "an MCAP file"},
                                            {"\xFD"
                                             "7zXZ",
                                             "an xz file"},
                                            {"BZh", "a bzip2 file"},
                                            {"\x7F"
                                             "ELF",
                                             "a program"}}};

}  // namespace

std::unique_ptr<ByteSource> open_bytes(const std::filesystem::path& path, bool hashed, bool unlimited) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(path.string() + ": no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError(path.string() + ": is a directory: expected a file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(path.string() + ": is a pipe or a device: expected a regular file, which can be read twice");
  }
  RawFile raw(path, hashed);
  std::string head(16, '\0');
  head.resize(raw.read(head.data(), head.size()));
  if (head.empty()) {
    raw.fail("is empty: expected text");
  }
  const std::string_view start = head;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  const std::optional<std::uint64_t> packed = unlimited || error ? std::nullopt : std::optional<std::uint64_t>(size);
  if (start.starts_with("\x1F\x8B")) {
    return std::make_unique<GzipSource>(std::move(raw), std::move(head), packed);
  }
  if (is_zstd(start)) {
    return std::make_unique<ZstdSource>(std::move(raw), std::move(head), packed);
  }
  if (start.starts_with("\xFF\xFE") || start.starts_with("\xFE\xFF")) {
    const bool big_endian = start.starts_with("\xFE");
    return std::make_unique<Utf16Source>(std::move(raw), std::move(head), big_endian);
  }
  if (const std::optional<bool> big_endian = unmarked_utf16(start)) {
    return std::make_unique<Utf16Source>(std::move(raw), std::move(head), *big_endian);
  }
  if (start.starts_with(ros1_bag_magic)) {
    raw.fail(ros1_bag(path));
  }
  for (const Magic& magic : not_text) {
    if (start.starts_with(magic.bytes)) {
      raw.fail("is " + std::string(magic.format) + ": expected text, plain or packed with gzip or zstd");
    }
  }
  return std::make_unique<PlainSource>(std::move(raw), std::move(head), std::nullopt);
}

namespace {

class StreamSource final : public ByteSource {
 public:
  StreamSource(int descriptor, std::string name) : descriptor_(descriptor), name_(std::move(name)) {}

  std::size_t read(char* to, std::size_t size) override {
    ssize_t got = -1;
    do {
      got = ::read(descriptor_, to, size);
    } while (got < 0 && errno == EINTR);
    if (got < 0) {
      throw InputError(name_ + ": cannot be read (" + std::strerror(errno) + "): expected a readable stream");
    }
    bytes_ += static_cast<std::uint64_t>(got);
    return static_cast<std::size_t>(got);
  }
  [[nodiscard]] std::uint64_t file_bytes() const override { return bytes_; }
  [[nodiscard]] std::string hash() const override { return {}; }
  [[nodiscard]] const char* packing() const override { return "plain"; }

 private:
  int descriptor_;
  std::string name_;
  std::uint64_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<ByteSource> open_stream(int descriptor, std::string name) {
  return std::make_unique<StreamSource>(descriptor, std::move(name));
}

std::string read_bytes(const std::filesystem::path& path, std::size_t limit) {
  const auto source = open_bytes(path);
  std::string text;
  std::vector<char> buffer(bytes_at_once);
  while (const std::size_t got = source->read(buffer.data(), buffer.size())) {
    text.append(buffer.data(), got);
    if (text.size() > limit) {
      throw InputError(path.string() + ": is longer than " + std::to_string(limit) + " bytes: expected a smaller file");
    }
  }
  return text;
}

LineReader::LineReader(std::unique_ptr<ByteSource> source, std::string path)
    : source_(std::move(source)), path_(std::move(path)), buffer_(std::size_t{1} << 18) {}

/// Moves the unread rest to the front of the buffer and reads on; false when the stream is at its end.
bool LineReader::refill() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (end_ == buffer_.size()) {
    throw InputError(fmt::format("{}:{}: a line of more than {} bytes: expected text with one row a line", path_,
                                 number_ + 1, buffer_.size()));
  }
  const std::size_t got = source_->read(buffer_.data() + end_, buffer_.size() - end_);
  end_ += got;
  return got > 0;
}

bool LineReader::next(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  while (newline == nullptr) {
    newline = static_cast<const char*>(std::memchr(buffer_.data() + begin_ + searched, '\n', end_ - begin_ - searched));
    searched = end_ - begin_;
    if (newline == nullptr && !refill()) {
      break;
    }
  }
  terminated_ = newline != nullptr;
  if (!terminated_ && begin_ == end_) {
    return false;
  }
  const std::size_t stop = terminated_ ? static_cast<std::size_t>(newline - buffer_.data()) : end_;
  line = std::string_view(buffer_.data() + begin_, stop - begin_);
  begin_ = terminated_ ? stop + 1 : stop;
  ++number_;
  if (number_ == 1 && line.starts_with("\xEF\xBB\xBF")) {
    line.remove_prefix(3);
  }
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  return true;
}

namespace {

[[noreturn]] void cannot(const std::filesystem::path& place, std::string_view what) {
  throw InputError(place.string() + ": " + std::string(what) + " (" + std::strerror(errno) +
                   "): expected enough room on the disk and the right to write");
}

constexpr int most_links = 40;

/// Where what is written for a place goes: to a file, which is replaced, or to what is open or not a file at all.
struct Destination {
  std::filesystem::path file;
  bool as_it_is = false;
  int descriptor = -1;  ///< of a stream of this program that the place names
};

Destination destination(const std::filesystem::path& place) {
  namespace fs = std::filesystem;
  std::error_code error;
  const fs::file_status status = fs::status(place, error);
  if (fs::is_directory(status)) {
    throw InputError(place.string() + ": is a directory: expected the name of a file to write");
  }
  const fs::path own_streams = fs::canonical("/proc/self/fd", error);
  fs::path file = place;
  for (int links = 0; fs::is_symlink(fs::symlink_status(file, error)); ++links) {
    if (links == most_links) {
      throw InputError(place.string() + ": is a link that leads nowhere: expected the name of a file to write");
    }
    if (!own_streams.empty() && fs::weakly_canonical(file.parent_path(), error) == own_streams) {
      const int number = static_cast<int>(to_number(file.filename().string()).value_or(-1.0));
      return {file, true, number};
    }
    file = file.parent_path() / fs::read_symlink(file, error);
  }
  if (!fs::exists(status) && fs::is_symlink(fs::symlink_status(place, error))) {
    throw InputError(
        fmt::format("{}: is a link to {}, which is not there: expected the name of a file to write; take "
                    "the link away, or make the file that it leads to",
                    place.string(), file.string()));
  }
  return {file, fs::exists(status) && !fs::is_regular_file(status)};
}

/// The file that `place` leads to. Throws InputError where it is none.
std::filesystem::path file_to_replace(const std::filesystem::path& place) {
  const Destination to = destination(place);
  if (to.as_it_is) {
    throw InputError(place.string() + ": is a pipe or a device: expected a file, which can be written in any order");
  }
  if (access(to.file.c_str(), W_OK) != 0 && errno == EACCES && std::filesystem::exists(to.file)) {
    throw InputError(place.string() + ": cannot be replaced (" + std::strerror(EACCES) +
                     "): expected a file that may be written, or a new name");
  }
  return to.file;
}

constexpr const char* suffix = ".wheelwright-part";

std::filesystem::path with_suffix(std::filesystem::path path) { return path += suffix; }

}  // namespace

void check_destination(const std::filesystem::path& place) { static_cast<void>(destination(place)); }

FileBeside::FileBeside(std::filesystem::path place)
    : place_(std::move(place)),
      target_(file_to_replace(place_)),
      beside_(with_suffix(target_), Temporary::Kind::file, place_.string(),
              "a file name in an existing, writable directory") {}

void FileBeside::put() {
  if (const std::string why = beside_.move_to(target_); !why.empty()) {
    throw InputError(place_.string() + ": cannot be put in its place (" + why +
                     "): expected enough room on the disk and the right to write");
  }
}

AtomicFile::AtomicFile(std::filesystem::path path) : place_(std::move(path)) {
  const Destination to = destination(place_);
  if (to.descriptor >= 0) {
    file_ = fdopen(dup(to.descriptor), "wb");
  } else if (to.as_it_is) {
    file_ = std::fopen(place_.c_str(), "wb");
  } else {
    beside_.emplace(place_);
    file_ = std::fopen(beside_->path().c_str(), "wb");
  }
  if (file_ == nullptr) {
    cannot(place_, "cannot be written");
  }
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) {
    std::fclose(file_);
  }
}

void AtomicFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) {
    cannot(place_, "cannot be written");
  }
}

void AtomicFile::commit() {
  const bool flushed = std::fflush(file_) == 0;
  if (!flushed || std::fclose(std::exchange(file_, nullptr)) != 0) {
    cannot(place_, "cannot be written");
  }
  if (beside_) {
    beside_->put();
  }
}

void atomic_write(const std::filesystem::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace wheelwright::files
