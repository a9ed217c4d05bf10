// SPDX-License-Identifier: Apache-2.0
/// \file
/// Skipping of tests whose requirements are missing. GTEST_SKIP stands in no other file.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace wheelwright::testing_support {

/// True if the test has to end here, since `there` is false: skipped, and failed where the environment variable
/// WHEELWRIGHT_NO_SKIPS is 1 (`.ci/run` sets it, and installs all that tests need). For programs that a machine may
/// lack.
///
///     if (skip_unless(has_c_compiler(), "there is no cc")) return;
[[nodiscard]] inline bool skip_unless(bool there, const std::string& why) {
  if (there) {
    return false;
  }
  const char* strict = std::getenv("WHEELWRIGHT_NO_SKIPS");
  const auto tell = [&] {
    if (strict != nullptr && std::string_view(strict) == "1") {
      FAIL() << why << " (WHEELWRIGHT_NO_SKIPS=1)";
    }
    GTEST_SKIP() << why;
  };
  tell();
  return true;
}

/// The same for recordings, which do not ship with the project: skipped where `path` does not exist, in CI as well.
[[nodiscard]] inline bool skip_without_recordings(const std::filesystem::path& path) {
  if (std::filesystem::exists(path)) {
    return false;
  }
  [&] { GTEST_SKIP() << "no recordings in " << path; }();
  return true;
}

}  // namespace wheelwright::testing_support
