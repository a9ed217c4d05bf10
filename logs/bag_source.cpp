// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_source.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/byte_source.hpp>
#include <wheelwright/logs/bag_temporary.hpp>
#include <wheelwright/logs/mcap_file.hpp>
#include <wheelwright/logs/mcap_records.hpp>

namespace wheelwright::bag {
namespace {

constexpr std::size_t bag_piece = std::size_t{1} << 18;

/// A file that was packed with zstd as a whole, read from its unpacked copy.
class PackedSource final : public Source {
 public:
  PackedSource(const std::filesystem::path& path, bool hashed)
      : shown_(path.string()), file_(directory_.path() / "unpacked") {
    unpack(path, hashed);
    const std::string name = shown_ + " (unpacked)";
    switch (content_of(file_)) {
      case Content::mcap: source_ = open_mcap(file_, name, false); break;
      case Content::sqlite: source_ = open_sqlite(file_, name, false); break;
      default:
        throw InputError(
            fmt::format("{}: is no recording: {}expected an MCAP file or an SQLite database inside the zstd "
                        "file",
                        shown_, loss_.empty() ? "" : loss_ + "; "));
    }
  }

  [[nodiscard]] const std::vector<SourceTopic>& topics() const override { return source_->topics(); }
  bool next(BagMessage& message) override { return source_->next(message); }
  void rewind() override { source_->rewind(); }
  [[nodiscard]] std::optional<std::string> first_message(std::size_t topic) override {
    return source_->first_message(topic);
  }

  [[nodiscard]] BagReport report() const override {
    BagReport report = source_->report();
    report.path = shown_;
    report.bytes = bytes_;
    report.hash = hash_;
    if (!loss_.empty()) {
      report.losses.insert(report.losses.begin(), loss_);
    }
    return report;
  }

 private:
  void unpack(const std::filesystem::path& path, bool hashed) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> to(std::fopen(file_.c_str(), "wb"), &std::fclose);
    const auto check = [&](bool written) {
      if (!written) {
        throw InputError(
            fmt::format("{}: cannot be unpacked to {} ({}): expected room there, or TMPDIR to name another "
                        "directory",
                        shown_, file_.string(), std::strerror(errno)));
      }
    };
    check(to != nullptr);
    const auto from = open_bytes(path, hashed);
    std::vector<char> buffer(bag_piece);
    std::uint64_t unpacked = 0;
    try {
      while (const std::size_t got = from->read(buffer.data(), buffer.size())) {
        check(std::fwrite(buffer.data(), 1, got, to.get()) == got);
        unpacked += got;
      }
    } catch (const InputError& error) {
      if (unpacked == 0 || std::ferror(to.get()) != 0) {
        throw;
      }
      loss_ = fmt::format("{}; unpacked up to byte {} of the file, {} bytes of its content", error.what(),
                          from->file_bytes(), unpacked);
    }
    check(std::fflush(to.get()) == 0);
    bytes_ = std::filesystem::file_size(path);
    if (hashed) {
      mcap::WindowedFile file(path, true);
      file.leave(file.size());
      hash_ = file.hash();
    }
  }

  std::string shown_;
  TemporaryDirectory directory_;
  std::filesystem::path file_;
  std::unique_ptr<Source> source_;
  std::uint64_t bytes_ = 0;
  std::string hash_;
  std::string loss_;
};

}  // namespace

std::optional<std::string> Source::first_message(std::size_t /*topic*/) { return std::nullopt; }

Content content_of(const std::filesystem::path& path) {
  mcap::WindowedFile file(path, false);
  const std::string head = file.peek(0, static_cast<std::size_t>(std::min<std::uint64_t>(16, file.size())));
  const std::string_view start = head;
  return start.empty()                                                  ? Content::empty
         : start.starts_with(mcap::magic.substr(0, 5))                  ? Content::mcap
         : start.starts_with(std::string_view("SQLite format 3\0", 16)) ? Content::sqlite
         : start.starts_with("\x28\xB5\x2F\xFD")                        ? Content::zstd
                                                                        : Content::other;
}

std::unique_ptr<Source> open_source(const std::filesystem::path& path, bool hashed) {
  const std::string name = path.string();
  switch (content_of(path)) {
    case Content::mcap: return open_mcap(path, name, hashed);
    case Content::sqlite: return open_sqlite(path, name, hashed);
    case Content::zstd: return std::make_unique<PackedSource>(path, hashed);
    case Content::empty: throw InputError(name + ": is empty: nothing was recorded, or nothing of it reached the disk");
    case Content::other: break;
  }
  throw InputError(name + ": at byte 0: is no recording: expected an MCAP file or an SQLite database of rosbag2");
}

std::string shown_time(std::int64_t time) {
  const std::int64_t seconds = time / 1'000'000'000, rest = time % 1'000'000'000;
  return fmt::format("{}{}.{:09} s", time < 0 ? "-" : "", seconds < 0 ? -seconds : seconds, rest < 0 ? -rest : rest);
}

}  // namespace wheelwright::bag
