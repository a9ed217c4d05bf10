// SPDX-License-Identifier: Apache-2.0
/// \file
/// The files of a rosbag2 recording: those that a path stands for, metadata.yaml, copies to read, packed messages.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/temporary.hpp"

namespace wheelwright::logs::bag {

/// Bytes of the largest journal of a database that is copied without LogOptions::trust.
inline constexpr std::uintmax_t largest_journal = std::uintmax_t{4} << 30;
/// Bytes of the largest database that is copied, and of what a packed recording may have unpacked, without
/// LogOptions::trust.
inline constexpr std::uintmax_t largest_copy = std::uintmax_t{16} << 30;

/// Throws InputError where a file of more than 64 MiB consists of holes but for a hundredth, which would be read as
/// zeros for as long as it says.
void refuse_holes(const std::filesystem::path& path);

/// A file to be read.
struct Part {
  std::filesystem::path path;
  bool demanded = true;  ///< the user named it: what is wrong with it is an error
};

/// The files of one argument, and what was wrong with its metadata.
struct Parts {
  std::vector<Part> files;
  std::vector<std::string> losses;
  std::optional<std::uint64_t> promised;  ///< messages that the metadata name
  std::string metadata;                   ///< its path
};

/// "mcap" or "db3" of a name that a recording's file has (also where it is packed); empty otherwise.
[[nodiscard]] std::string storage_ending(const std::filesystem::path& name);

/// The file itself, or those of a directory: as its metadata.yaml lists them, else all, "_2" before "_10". Throws
/// InputError, naming it, for a directory without any, and for one with files of both storages and no metadata. Of a
/// name in the metadata that leads out of the directory only the last part counts; a file that is named twice is read
/// once; without `trust`, a link that leads out of the directory is an InputError.
[[nodiscard]] Parts parts_of(const std::filesystem::path& path, bool trust = false);

/// Metadata that reading needs.
struct Metadata {
  std::vector<std::string> files;         ///< relative to its directory, in their order
  std::optional<std::uint64_t> messages;  ///< in all files
};

/// Reads `path`. Throws InputError, naming file and line, when it is no YAML, names no file or more than 10,000, or has
/// more than 16 MiB.
[[nodiscard]] Metadata read_metadata(const std::filesystem::path& path);

/// A topic that was written.
struct WrittenTopic {
  std::string name;
  std::string type;
  std::string qos;
  std::uint64_t messages = 0;
};

/// A recording of one file that was written.
struct WrittenBag {
  std::string storage;               ///< "mcap" or "sqlite3"
  std::string file;                  ///< its name
  std::int64_t first = 0, last = 0;  ///< log times, ns
  std::uint64_t messages = 0;
  std::vector<WrittenTopic> topics;
};

/// The text of metadata.yaml in version 5 (Humble), which later distributions read too.
[[nodiscard]] std::string metadata_text(const WrittenBag& bag);

/// A directory of its own in the system's directory for temporary files. Throws InputError, naming that, when it cannot
/// be made.
[[nodiscard]] std::unique_ptr<files::Temporary> temporary_directory();

/// True if a message is packed: it begins as a zstd frame does, and no CDR does.
[[nodiscard]] bool is_packed(std::string_view data);

/// Unpacks message after message with the same memory.
class MessageUnpacker {
 public:
  MessageUnpacker();
  ~MessageUnpacker();
  MessageUnpacker(MessageUnpacker&&) noexcept;
  MessageUnpacker& operator=(MessageUnpacker&&) noexcept;

  /// The message, until the next call; nothing where it is damaged, cut off or longer than 512 MiB, or, without
  /// `trust`, than 32 MiB and than 100 times `data`. Memory grows with what comes out, not with what the frame says.
  std::optional<std::string_view> unpack(std::string_view data, bool trust = false);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace wheelwright::logs::bag
