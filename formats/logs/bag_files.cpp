// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/bag_files.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>
#include <zstd.h>

#include "core/error.hpp"
#include "core/words.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"

namespace wheelwright::logs::bag {
namespace {

namespace fs = std::filesystem;

/// Bytes of a file that are stored; `enough` where they are as many, where the file system does not tell, and where
/// they lie in so many pieces that somebody wrote them.
off_t stored_bytes(int file, off_t enough) {
  constexpr int most_pieces = 100'000;
  off_t stored = 0, at = 0;
  for (int piece = 0; piece < most_pieces && stored < enough; ++piece) {
    const off_t begin = ::lseek(file, at, SEEK_DATA);
    if (begin < 0) {
      return errno == ENXIO ? stored : enough;  // nothing is stored behind
    }
    at = ::lseek(file, begin, SEEK_HOLE);
    if (at <= begin) {
      return enough;
    }
    stored += at - begin;
  }
  return enough;
}

}  // namespace

void refuse_holes(const fs::path& path) {
  constexpr off_t always_read = off_t{1} << 26, largest_ratio = 100;
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) {
    return;  // who reads it says so
  }
  const off_t size = ::lseek(file, 0, SEEK_END), enough = size / largest_ratio;
  const off_t stored = size > always_read ? stored_bytes(file, enough) : enough;
  ::close(file);
  if (stored < enough) {
    throw InputError(
        fmt::format("{}: has {} bytes, of which {} are stored and the others are holes: expected a file that was "
                    "written, or --trust",
                    path.string(), size, stored));
  }
}

std::string storage_ending(const fs::path& name) {
  fs::path plain = name;
  if (plain.extension() == ".zstd" || plain.extension() == ".zst") {
    plain = plain.stem();
  }
  return plain.extension() == ".mcap" ? "mcap" : plain.extension() == ".db3" ? "db3" : "";
}

namespace {

/// Throws unless `file` is below `home`, a directory without links, when all links are followed. One that is missing is
/// told later.
void stays_in(const fs::path& home, const fs::path& file) {
  std::error_code error;
  const fs::path real = fs::canonical(file, error);
  if (error || home.empty()) {
    return;
  }
  if (std::mismatch(home.begin(), home.end(), real.begin(), real.end()).first != home.end()) {
    throw InputError(
        fmt::format("{}: is a link to {}, outside of the recording's directory: expected a file in it, or "
                    "--trust",
                    file.string(), real.string()));
  }
}

/// The file that metadata mean by `name`: below the directory, or, where it is not there, by its last part.
fs::path named_part(const fs::path& directory, const std::string& name) {
  std::error_code error;
  const fs::path inside = fs::path(name).relative_path().lexically_normal();
  const bool leaves = !inside.empty() && *inside.begin() == "..";
  return !leaves && fs::exists(directory / inside, error) ? directory / inside : directory / fs::path(name).filename();
}

/// The recordings that lie in a directory and are none of `named`, in their order.
std::vector<std::string> left_beside(const fs::path& directory, const std::set<fs::path>& named) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(directory, error), end; !error && at != end; at.increment(error)) {
    if (!storage_ending(at->path().filename()).empty() && !named.contains(at->path())) {
      names.push_back(at->path().filename().string());
    }
  }
  std::sort(names.begin(), names.end(), core::natural_less);
  return names;
}

}  // namespace

Parts parts_of(const fs::path& path, bool trust) {
  Parts parts;
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    parts.files.push_back({path});
    return parts;
  }
  const fs::path metadata = path / "metadata.yaml";
  const fs::path home = fs::canonical(path, error);
  const auto check_links = [&] {
    for (const Part& part : parts.files) {
      if (!trust) {
        stays_in(home, part.path);
      }
    }
  };
  if (fs::exists(metadata, error)) {
    parts.metadata = metadata.string();
    if (!trust) {
      stays_in(home, metadata);
    }
    std::optional<Metadata> found;
    try {
      found = read_metadata(metadata);
    } catch (const InputError& problem) {
      parts.losses.push_back(fmt::format("{}; all files beside it are read", problem.what()));
    }
    if (found) {
      std::set<fs::path> met;
      for (const std::string& name : found->files) {
        const fs::path part = named_part(path, name);
        if (met.insert(part).second) {
          parts.files.push_back({part, false});
        }
      }
      if (met.size() < found->files.size()) {
        parts.losses.push_back(fmt::format("{}: names {} files, {} of them again: each is read once", metadata.string(),
                                           found->files.size(), found->files.size() - met.size()));
      }
      if (const auto beside = left_beside(path, met); !beside.empty()) {
        parts.losses.push_back(fmt::format("{}: does not name {}, which {} not read", metadata.string(),
                                           core::listed(beside), beside.size() == 1 ? "was" : "were"));
      }
      parts.files.front().demanded = parts.files.size() == 1;
      parts.promised = found->messages;
      check_links();
      return parts;
    }
  }
  std::vector<std::string> names, kinds;
  for (fs::directory_iterator at(path, error), end; !error && at != end; at.increment(error)) {
    const std::string kind = storage_ending(at->path().filename());
    if (!kind.empty()) {
      names.push_back(at->path().filename().string());
      kinds.push_back(kind);
    }
  }
  if (error) {
    throw InputError(
        fmt::format("{}: cannot be read ({}): expected the directory of a recording", path.string(), error.message()));
  }
  if (names.empty()) {
    throw InputError(path.string() +
                     ": holds no recording: expected *.mcap or *.db3, and the metadata.yaml of rosbag2");
  }
  if (std::adjacent_find(kinds.begin(), kinds.end(), std::not_equal_to<>()) != kinds.end()) {
    throw InputError(path.string() +
                     ": holds both *.mcap and *.db3 and no metadata.yaml that says which to read: expected "
                     "the files by name");
  }
  std::sort(names.begin(), names.end(), core::natural_less);
  for (const std::string& name : names) {
    parts.files.push_back({path / name, names.size() == 1});
  }
  check_links();
  return parts;
}

namespace {

constexpr std::size_t longest_metadata = std::size_t{1} << 20;
constexpr std::size_t most_files = 10'000;

[[noreturn]] void fail(const std::string& name, const YAML::Mark& mark, const std::string& what) {
  throw InputError(mark.is_null() ? fmt::format("{}: {}", name, what)
                                  : fmt::format("{}:{}: {}", name, mark.line + 1, what));
}

/// A text in quotes.
std::string quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

}  // namespace

Metadata read_metadata(const std::filesystem::path& path) {
  const std::string name = path.string();
  const std::string text = files::read_bytes(path, longest_metadata);
  try {
    const YAML::Node information = YAML::Load(text)["rosbag2_bagfile_information"];
    if (!information.IsDefined() || !information.IsMap()) {
      fail(name, YAML::Mark::null_mark(), "no rosbag2_bagfile_information: expected the metadata of a recording");
    }
    Metadata metadata;
    const YAML::Node files = information["relative_file_paths"];
    if (!files.IsDefined() || !files.IsSequence() || files.size() == 0) {
      fail(name, information.Mark(), "relative_file_paths: expected a list of at least one file");
    }
    if (files.size() > most_files) {
      fail(name, files.Mark(),
           fmt::format("relative_file_paths: {} files: expected at most {}", files.size(), most_files));
    }
    for (const YAML::Node& file : files) {
      if (!file.IsScalar() || file.Scalar().empty()) {
        fail(name, file.Mark(), "relative_file_paths: expected the name of a file");
      }
      metadata.files.push_back(file.Scalar());
    }
    const YAML::Node count = information["message_count"];
    std::uint64_t messages = 0;
    if (count.IsDefined() && YAML::convert<std::uint64_t>::decode(count, messages)) {
      metadata.messages = messages;
    }
    return metadata;
  } catch (const YAML::Exception& error) {
    fail(name, error.mark, error.msg);
  }
}

std::string metadata_text(const WrittenBag& bag) {
  const std::int64_t duration = bag.messages > 0 ? bag.last - bag.first : 0;
  std::string topics;
  for (const WrittenTopic& topic : bag.topics) {
    topics += fmt::format(
        "    - topic_metadata:\n        name: {}\n        type: {}\n        serialization_format: cdr\n"
        "        offered_qos_profiles: {}\n      message_count: {}\n",
        quoted(topic.name), quoted(topic.type), quoted(topic.qos), topic.messages);
  }
  return fmt::format(
      "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: {0}\n  duration:\n    nanoseconds: {1}\n"
      "  starting_time:\n    nanoseconds_since_epoch: {2}\n  message_count: {3}\n  topics_with_message_count:{4}\n{5}"
      "  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n    - {6}\n  files:\n"
      "    - path: {6}\n      starting_time:\n        nanoseconds_since_epoch: {2}\n      duration:\n"
      "        nanoseconds: {1}\n      message_count: {3}\n",
      bag.storage, duration, bag.first, bag.messages, bag.topics.empty() ? " []" : "", topics, quoted(bag.file));
}

std::unique_ptr<files::Temporary> temporary_directory() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  return std::make_unique<files::Temporary>(parent / fmt::format("wheelwright-copy-{}-", geteuid()),
                                            files::Temporary::Kind::private_directory,
                                            error ? "TMPDIR" : parent.string(), "TMPDIR to name a writable directory");
}

namespace {

constexpr std::size_t longest = std::size_t{1} << 29;
constexpr std::size_t always_long = std::size_t{1} << 25;
constexpr std::size_t largest_ratio = 100;

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

std::optional<std::string_view> MessageUnpacker::unpack(std::string_view data, bool trust) {
  const std::size_t most = trust ? longest : std::min(longest, std::max(always_long, largest_ratio * data.size()));
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
      if (impl_->bytes.size() >= most) {
        return std::nullopt;
      }
      impl_->bytes.resize(std::min(most, 2 * impl_->bytes.size()));
    }
  }
}

}  // namespace wheelwright::logs::bag
