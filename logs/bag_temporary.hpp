// SPDX-License-Identifier: Apache-2.0
/// \file
/// Copies of files that live as long as they are read.
#pragma once

#include <filesystem>

namespace wheelwright::bag {

/// A directory of its own in the system's directory for temporary files; gone, with all in it, when this is.
class TemporaryDirectory {
 public:
  /// Throws InputError, naming the directory, when it cannot be made.
  TemporaryDirectory();
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace wheelwright::bag
