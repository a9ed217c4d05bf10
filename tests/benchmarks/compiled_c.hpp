// SPDX-License-Identifier: Apache-2.0
/// \file
/// An exported detector, compiled as a user would and loaded into the program.
#pragma once

#include <dlfcn.h>

#include <bit>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <system_error>

#include <fmt/format.h>

namespace wheelwright::bench {

/// `code`, which includes "robot.h", compiled by `cc -O2` where there is one.
class CompiledC {
 public:
  /// `header` is what robot.h says. Nothing is left on the disk.
  CompiledC(const std::string& header, const std::string& code) {
    const auto folder =
        std::filesystem::temp_directory_path() / fmt::format("wheelwright-bench-{}", std::random_device{}());
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "robot.h") << header;
    std::ofstream(folder / "robot.c") << code;
    const std::string command =
        fmt::format("cc -std=c99 -O2 -ffp-contract=off -shared -fPIC -o '{0}/robot.so' '{0}/robot.c' -lm 2> /dev/null",
                    folder.string());
    if (std::system(command.c_str()) == 0) {
      library_ = dlopen((folder / "robot.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    }
    std::error_code ignored;
    std::filesystem::remove_all(folder, ignored);
  }
  ~CompiledC() {
    if (library_ != nullptr) {
      dlclose(library_);
    }
  }
  CompiledC(const CompiledC&) = delete;
  CompiledC& operator=(const CompiledC&) = delete;

  /// A function of it, or null where it could not be compiled.
  template <class Function>
  [[nodiscard]] Function* function(const char* name) const {
    return library_ != nullptr ? std::bit_cast<Function*>(dlsym(library_, name)) : nullptr;
  }

 private:
  void* library_ = nullptr;
};

}  // namespace wheelwright::bench
