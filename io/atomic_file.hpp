// SPDX-License-Identifier: Apache-2.0
/// \file
/// Files that are either written whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace wheelwright {

/// A file that is written beside its place under a temporary name and renamed into it by commit(). Where commit() is
/// not reached, nothing is left behind and an older file of that name stays as it was.
class AtomicFile {
 public:
  /// Opens the temporary. Throws InputError, naming the path, when it cannot be made (no such directory, no right to
  /// write, the path is a directory).
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Appends `bytes`. Throws InputError when they cannot be written (disk full).
  void write(std::string_view bytes);
  /// Closes and renames. Throws InputError when either fails. To be called once, last.
  void commit();

 private:
  [[noreturn]] void fail(std::string_view what);

  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::FILE* file_ = nullptr;
};

/// Puts `content` at `path`, whole or not at all. Throws InputError as AtomicFile does.
void atomic_write(const std::filesystem::path& path, std::string_view content);

}  // namespace wheelwright
