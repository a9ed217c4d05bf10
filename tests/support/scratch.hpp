// SPDX-License-Identifier: Apache-2.0
/// \file
/// Files that live as long as a test.
#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::testing {

/// A test with a directory of its own, which is removed afterwards.
class ScratchTest : public ::testing::Test {
 protected:
  ScratchTest() {
    const auto* info = ::testing::UnitTest::GetInstance()->current_test_info();
    directory_ = std::filesystem::path(::testing::TempDir()) / ("wheelwright_" + std::string(info->test_suite_name()) +
                                                                "_" + info->name() + "_" + std::to_string(::getpid()));
    std::filesystem::remove_all(directory_);
    std::filesystem::create_directories(directory_);
  }
  ~ScratchTest() override { std::filesystem::remove_all(directory_); }

  /// A path inside the directory.
  std::filesystem::path path(std::string_view name) const { return directory_ / name; }

  /// Puts `content` into a file and returns its path.
  std::filesystem::path put(std::string_view name, std::string_view content) const {
    std::filesystem::remove(path(name));  // a file that is new is not flushed to disk on closing
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }

  /// Bytes of a file.
  static std::string bytes(const std::filesystem::path& file) {
    std::ostringstream out;
    out << std::ifstream(file, std::ios::binary).rdbuf();
    return out.str();
  }

  std::size_t files() const {
    std::size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
      count += entry.exists() ? 1 : 0;
    }
    return count;
  }

  std::filesystem::path directory_;
};

/// Message of the InputError that `action` throws; empty, and a failed test, when it throws none.
template <typename Action>
std::string input_error(const Action& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  ADD_FAILURE() << "no InputError was thrown";
  return {};
}

}  // namespace wheelwright::testing
