// SPDX-License-Identifier: Apache-2.0
/// \file
/// What every fuzzer does: any bytes make a result or an InputError. Everything else that is thrown ends the fuzzer, as
/// does what the sanitizers find.
#pragma once

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <system_error>

#include "core/error.hpp"

namespace wheelwright::fuzz {

/// Bytes of the longest input of which a log's promises are asked, each of which reads or writes it again. Of longer
/// ones time and memory of the reading alone are measured (tests/fuzzers/mutations_test.cpp).
inline constexpr std::size_t kMostPromised = 65536;

/// Bytes of the longest robot file, scenario and study, and of the longest file of controllers: what is longer is
/// refused before it is parsed.
inline constexpr std::size_t kLongestYaml = std::size_t{1} << 20;
inline constexpr std::size_t kLongestControllers = std::size_t{1} << 20;

/// The input as text.
inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

/// The same, where it is no longer than `longest`; else nothing.
inline std::string_view text_of(const std::uint8_t* data, std::size_t size, std::size_t longest) {
  return size <= longest ? text_of(data, size) : std::string_view();
}

/// Calls `use`; an InputError is what bad input is to have.
template <typename Use>
int clean(const Use& use) {
  try {
    use();
  } catch (const InputError&) {
  }
  return 0;
}

/// Ends the fuzzer where something that was promised does not hold.
inline void require(bool holds) {
  if (!holds) {
    std::abort();
  }
}

/// Calls `use`, which must not find what it reads bad.
template <typename Use>
void promised(const Use& use) {
  try {
    use();
  } catch (const InputError& error) {
    std::fputs(error.what(), stderr);
    std::abort();
  }
}

/// A file or folder that is gone with the process.
struct FileOfProcess {
  std::filesystem::path path;
  ~FileOfProcess() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

/// Puts `bytes` into a file of this process with that ending, and returns its path. It is removed when the process
/// ends.
inline std::filesystem::path on_disk(std::string_view bytes, const std::string& ending) {
  const auto path =
      std::filesystem::temp_directory_path() / ("wheelwright-fuzz-" + std::to_string(::getpid()) + ending);
  static std::map<std::string, FileOfProcess> of_process;
  of_process[ending].path = path;
  std::filesystem::remove(path);  // a file that is new is not flushed to disk on closing
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path;
}

/// A folder of this process with that ending, which is empty. It is removed when the process ends.
inline std::filesystem::path folder_on_disk(const std::string& ending) {
  const std::filesystem::path made = on_disk("", ending);
  std::filesystem::remove(made);
  std::filesystem::create_directory(made);
  return made;
}

}  // namespace wheelwright::fuzz

/// libFuzzer's entry point.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
