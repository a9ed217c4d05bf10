// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which files a path stands for.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace wheelwright::bag {

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
/// InputError, naming it, for a directory without any, and for one with files of both storages and no metadata.
[[nodiscard]] Parts parts_of(const std::filesystem::path& path);

}  // namespace wheelwright::bag
