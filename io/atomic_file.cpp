// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/io/atomic_file.hpp>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>
#include <utility>

#include <wheelwright/core/error.hpp>

namespace wheelwright {
namespace {

/// A file beside `path` that did not exist before, opened for writing; nullptr with errno set where there can be none.
std::FILE* open_beside(const std::filesystem::path& path, std::filesystem::path& temporary) {
  for (int attempt = 0; attempt < 1000; ++attempt) {
    temporary = path;
    temporary += ".part" + std::to_string(attempt);
    if (std::FILE* file = std::fopen(temporary.c_str(), "wbx")) {
      return file;
    }
    if (errno != EEXIST) {
      break;
    }
  }
  return nullptr;
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path_, ignored)) {
    throw InputError(path_.string() + ": is a directory: expected the name of a file to write");
  }
  file_ = open_beside(path_, temporary_);
  if (file_ == nullptr) {
    throw InputError(path_.string() + ": cannot be written (" + std::strerror(errno) +
                     "): expected a file name in an existing, writable directory");
  }
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) {
    std::fclose(file_);
    std::error_code ignored;
    std::filesystem::remove(temporary_, ignored);
  }
}

void AtomicFile::fail(std::string_view what) {
  throw InputError(path_.string() + ": " + std::string(what) + " (" + std::strerror(errno) +
                   "): expected enough room on the disk and the right to write");
}

void AtomicFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) {
    fail("cannot be written");
  }
}

void AtomicFile::commit() {
  if (std::fflush(file_) != 0) {
    fail("cannot be written");
  }
  std::FILE* const file = std::exchange(file_, nullptr);
  std::error_code error;
  if (std::fclose(file) == 0) {
    std::filesystem::rename(temporary_, path_, error);
    if (!error) {
      return;
    }
    errno = error.value();
  }
  const int reason = errno;
  std::filesystem::remove(temporary_, error);
  errno = reason;
  fail("cannot be put in its place");
}

void atomic_write(const std::filesystem::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace wheelwright
