// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/bag_temporary.hpp>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string>
#include <system_error>

#include <wheelwright/core/error.hpp>

namespace wheelwright::bag {

TemporaryDirectory::TemporaryDirectory() {
  std::error_code error;
  const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
  std::string pattern = (parent / "wheelwright-bag-XXXXXX").string();
  if (error || ::mkdtemp(pattern.data()) == nullptr) {
    throw InputError((error ? "TMPDIR" : parent.string()) + ": no directory for temporary files can be made there (" +
                     (error ? error.message() : std::strerror(errno)) + "): expected TMPDIR to name a writable one");
  }
  path_ = pattern;
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace wheelwright::bag
