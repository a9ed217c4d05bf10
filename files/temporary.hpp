// SPDX-License-Identifier: Apache-2.0
/// \file
/// Files and directories that are there for a while: gone with their object, with the program that is interrupted, or,
/// where it was killed, with the next one of their name or beside it.
#pragma once

#include <filesystem>
#include <string>

namespace wheelwright::files {

/// A new, empty file or directory under a name that nobody has. While it lives a lock says so, by which those of killed
/// programs are told from those that are in use: they are removed before the name is taken again.
class Temporary {
 public:
  enum class Kind { file, directory, private_directory };

  /// Makes `stem` + a number. Where `stem` ends in ".wheelwright-part", those that killed programs left in its directory
  /// for other names are removed, too, at a program's first there. Throws InputError, naming `shown` and `expected`, when that cannot be.
  Temporary(const std::filesystem::path& stem, Kind kind, const std::string& shown, const std::string& expected);
  /// Removes it with all that is in it, unless move_to() did its work.
  ~Temporary();
  Temporary(const Temporary&) = delete;
  Temporary& operator=(const Temporary&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  /// Renames it, on disk with all that was written to it, to `place`. Returns why not, in words; empty where it did.
  [[nodiscard]] std::string move_to(const std::filesystem::path& place);

 private:
  std::filesystem::path path_;  ///< empty behind move_to()
  int lock_ = -1;               ///< descriptor that holds the lock
};

/// Removes all that live, and lets no more be made: for a program that ends now, whatever its threads are at. To be
/// called outside of signal handlers.
void remove_temporaries();

}  // namespace wheelwright::files
