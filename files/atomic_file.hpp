// SPDX-License-Identifier: Apache-2.0
/// \file
/// Files that are either written whole or not at all.
#pragma once

#include <cstdio>
#include <filesystem>
#include <string_view>

namespace wheelwright::files {

/// A new, empty file beside the place that it is written for, for libraries that write by name. put() renames it; where
/// that is not reached, nothing is left behind and an older file of the place's name stays as it was.
class FileBeside {
 public:
  /// Makes the file. Throws InputError, naming the place, when it cannot be made (no such directory, no right to write,
  /// the place is a directory).
  explicit FileBeside(std::filesystem::path place);
  ~FileBeside();
  FileBeside(const FileBeside&) = delete;
  FileBeside& operator=(const FileBeside&) = delete;

  /// Of the file itself, until put().
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::filesystem::path& place() const { return place_; }
  /// Renames it, closed by its writer, to its place. Throws InputError when that fails. To be called once, last.
  void put();

 private:
  std::filesystem::path place_;
  std::filesystem::path path_;  ///< empty behind put()
};

/// A file that is written beside its place under a temporary name and renamed into it by commit(). Where commit() is
/// not reached, nothing is left behind and an older file of that name stays as it was.
class AtomicFile {
 public:
  /// Opens the temporary. Throws InputError as FileBeside does.
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Appends `bytes`. Throws InputError when they cannot be written (disk full).
  void write(std::string_view bytes);
  /// Closes and renames. Throws InputError when either fails. To be called once, last.
  void commit();

 private:
  FileBeside beside_;
  std::FILE* file_ = nullptr;
};

/// Puts `content` at `path`, whole or not at all. Throws InputError as AtomicFile does.
void atomic_write(const std::filesystem::path& path, std::string_view content);

}  // namespace wheelwright::files
