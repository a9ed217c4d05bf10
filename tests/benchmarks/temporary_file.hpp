// SPDX-License-Identifier: Apache-2.0
/// \file
/// A file to be measured with.
#pragma once

#include <filesystem>
#include <random>
#include <string_view>
#include <system_error>

#include <fmt/format.h>

namespace wheelwright::bench {

/// A file in the system's temporary directory that is gone when the benchmark is.
struct TemporaryFile {
  /// `ending` without its dot.
  explicit TemporaryFile(std::string_view ending)
      : path(std::filesystem::temp_directory_path() /
             fmt::format("wheelwright-bench-{}.{}", std::random_device{}(), ending)) {}
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
  }

  std::filesystem::path path;
};

}  // namespace wheelwright::bench
