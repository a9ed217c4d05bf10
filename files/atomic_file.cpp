// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/atomic_file.hpp>

#include <cerrno>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <wheelwright/core/error.hpp>

namespace wheelwright::files {
namespace {

[[noreturn]] void cannot(const std::filesystem::path& place, std::string_view what) {
  throw InputError(place.string() + ": " + std::string(what) + " (" + std::strerror(errno) +
                   "): expected enough room on the disk and the right to write");
}

}  // namespace

FileBeside::FileBeside(std::filesystem::path place) : place_(std::move(place)) {
  std::error_code ignored;
  if (std::filesystem::is_directory(place_, ignored)) {
    throw InputError(place_.string() + ": is a directory: expected the name of a file to write");
  }
  for (int attempt = 0; attempt < 1000; ++attempt) {
    path_ = place_;
    path_ += ".part" + std::to_string(attempt);
    if (std::FILE* file = std::fopen(path_.c_str(), "wbx")) {
      std::fclose(file);
      return;
    }
    if (errno != EEXIST) {
      break;
    }
  }
  throw InputError(place_.string() + ": cannot be written (" + std::strerror(errno) +
                   "): expected a file name in an existing, writable directory");
}

FileBeside::~FileBeside() {
  if (!path_.empty()) {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
}

void FileBeside::put() {
  std::error_code error;
  std::filesystem::rename(path_, place_, error);
  if (error) {
    errno = error.value();
    cannot(place_, "cannot be put in its place");
  }
  path_.clear();
}

AtomicFile::AtomicFile(std::filesystem::path path)
    : beside_(std::move(path)), file_(std::fopen(beside_.path().c_str(), "wb")) {
  if (file_ == nullptr) {
    cannot(beside_.place(), "cannot be written");
  }
}

AtomicFile::~AtomicFile() {
  if (file_ != nullptr) {
    std::fclose(file_);
  }
}

void AtomicFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) {
    cannot(beside_.place(), "cannot be written");
  }
}

void AtomicFile::commit() {
  const bool flushed = std::fflush(file_) == 0;
  if (!flushed || std::fclose(std::exchange(file_, nullptr)) != 0) {
    cannot(beside_.place(), "cannot be written");
  }
  beside_.put();
}

void atomic_write(const std::filesystem::path& path, std::string_view content) {
  AtomicFile file(path);
  file.write(content);
  file.commit();
}

}  // namespace wheelwright::files
