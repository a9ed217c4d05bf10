// SPDX-License-Identifier: Apache-2.0
/// \file
/// Files and directories that are there for a while: gone with their object, with the program that is interrupted, or,
/// where it was killed, with the next one of their name or beside it. Locks of what is there, which leave nothing
/// behind.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wheelwright::files {

/// A new, empty file or directory under a name that nobody has. While it lives a lock says so, by which those of killed
/// programs are told from those that are in use: they are removed before the name is taken again.
class Temporary {
 public:
  enum class Kind { file, directory, private_directory };

  /// Makes `stem` + a number. Where `stem` ends in ".wheelwright-part", those that killed programs left in its
  /// directory for other names, files and directories, are removed, too, at a program's first there. Throws InputError,
  /// naming `shown` and `expected`, when that cannot be.
  Temporary(const std::filesystem::path& stem, Kind kind, const std::string& shown, const std::string& expected);
  /// Removes it with all that is in it, unless move_to() did its work.
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Renames it, on disk with all that was written to it, to `place`, and brings the new name to disk: a power cut
  /// leaves what was there or what is new, either whole. A file that is replaced hands on its mode; one that may not be
  /// written is not replaced. Returns why not, in words; empty where it did.
  [[nodiscard]] std::string move_to(const std::filesystem::path& place);

 private:
  std::filesystem::path path_;  ///< empty behind move_to()
  int lock_ = -1;               ///< descriptor that holds the lock
};

/// A lock of a directory, for programs that would put files of one name into it, or of a file that they would append
/// to. It ends with the object or the process, and leaves nothing behind.
class PathLock {
 public:
  enum class Kind { alone, shared };

  /// Takes the lock, or finds that it is taken; waits for nobody.
  PathLock(const std::filesystem::path& path, Kind kind);
  ~PathLock();
  PathLock(const PathLock&) = delete;
  PathLock& operator=(const PathLock&) = delete;

  /// True where another holds the lock. False also where the file system knows no locks, where `path` is neither a file
  /// nor a directory, or may not be read.
  [[nodiscard]] bool taken() const { return taken_; }
  /// True where what is locked was removed before it was.
  [[nodiscard]] bool gone() const;

 private:
  int descriptor_ = -1;
  bool taken_ = false;
};

/// Brings the names in `directory` (the working one where that is empty) to disk: what was renamed there is found there
/// after a power cut. Returns why not, in words; empty where it did, where the file system cannot be asked, and for a
/// directory that may be written and not read.
[[nodiscard]] std::string sync_directory(const std::filesystem::path& directory);

/// Renames the files `names` of `from`, on disk, into the directory `to`, in order, and removes `gone` there before:
/// what belongs together is there together. An interruption (remove_temporaries()) waits until it is done; where one
/// cannot be renamed, those before it are undone, on file systems that know hard links; a run that is killed leaves the
/// first ones. Modes are handed on as move_to() does.
/// Returns why not, in words; empty where all are on disk. For files of one directory that lies in the other.
[[nodiscard]] std::string move_together(const std::filesystem::path& from, const std::filesystem::path& to,
                                        const std::vector<std::string>& names,
                                        const std::vector<std::string>& gone = {});

/// Removes all that live, and lets no more be made: for a program that ends now, whatever its threads are at. To be
/// called outside of signal handlers.
void remove_temporaries();

}  // namespace wheelwright::files
