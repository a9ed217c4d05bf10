// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/mcap_file.hpp>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/logs/mcap_records.hpp>

namespace wheelwright::mcap {
namespace {

constexpr std::size_t piece = std::size_t{1} << 20;

}  // namespace

WindowedFile::WindowedFile(const std::filesystem::path& path, bool hashed) : name_(path.string()), hashed_(hashed) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw InputError(name_ + ": no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError(name_ + ": is a directory: expected a file");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw InputError(name_ + ": is a pipe or a device: expected a regular file, whose end can be read first");
  }
  file_.reset(std::fopen(path.c_str(), "rb"));
  if (!file_) {
    throw InputError(name_ + ": cannot be opened (" + std::strerror(errno) + "): expected a readable file");
  }
  std::setvbuf(file_.get(), nullptr, _IONBF, 0);
  size_ = std::filesystem::file_size(path, error);
  if (error) {
    throw InputError(name_ + ": has no known size (" + error.message() + "): expected a regular file");
  }
}

void WindowedFile::read(std::uint64_t offset, char* to, std::size_t size) {
  if (offset != position_ && std::fseek(file_.get(), static_cast<long>(offset), SEEK_SET) != 0) {
    throw InputError(fmt::format("{}: at byte {}: cannot be read ({})", name_, offset, std::strerror(errno)));
  }
  position_ = offset + std::fread(to, 1, size, file_.get());
  if (position_ != offset + size) {
    const std::string why = std::ferror(file_.get()) != 0 ? std::strerror(errno) : "the file has become shorter";
    throw InputError(fmt::format("{}: at byte {}: cannot be read ({})", name_, position_, why));
  }
}

std::string_view WindowedFile::view(std::uint64_t offset, std::size_t size) {
  if (offset < start_ || offset + size > start_ + filled_) {
    const std::uint64_t keep = std::min(left_, offset);  // what is not left behind stays
    if (keep > start_ && keep < start_ + filled_) {
      const auto drop = static_cast<std::size_t>(keep - start_);
      std::memmove(window_.data(), window_.data() + drop, filled_ - drop);
      filled_ -= drop;
      start_ = keep;
    } else if (keep != start_) {
      filled_ = 0;
      start_ = keep;
    }
    const auto needed = static_cast<std::size_t>(offset + size - start_);
    if (window_.size() < needed) {
      window_.resize(std::max<std::size_t>(std::min<std::uint64_t>(piece, size_), needed));
    }
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(window_.size(), size_ - start_));
    if (wanted > filled_) {
      read(start_ + filled_, window_.data() + filled_, wanted - filled_);
      filled_ = wanted;
    }
  }
  return {window_.data() + (offset - start_), size};
}

std::string WindowedFile::peek(std::uint64_t offset, std::size_t size) {
  std::string bytes(size, '\0');
  if (size == 0) {
    return bytes;
  }
  if (offset >= start_ && offset + size <= start_ + filled_) {
    std::memcpy(bytes.data(), window_.data() + (offset - start_), size);
  } else {
    read(offset, bytes.data(), size);
  }
  return bytes;
}

void WindowedFile::sum(std::string_view bytes) {
  if (hashed_) {
    hash_.update(bytes.data(), bytes.size());
  }
  if (left_ < sum_end_) {
    crc_ = crc32(bytes.substr(0, sum_end_ - left_), crc_);
  }
  left_ += bytes.size();
}

void WindowedFile::leave(std::uint64_t offset) {
  while (left_ < offset) {
    if (left_ >= start_ + filled_ && !hashed_ && left_ >= sum_end_) {
      left_ = offset;  // nobody asks for these bytes
    } else {
      const std::uint64_t in_window = left_ >= start_ && left_ < start_ + filled_ ? start_ + filled_ - left_ : piece;
      sum(view(left_, static_cast<std::size_t>(std::min(offset - left_, in_window))));
    }
  }
}

void WindowedFile::rewind() {
  start_ = left_ = 0;
  filled_ = 0;
  crc_ = 0;
  hash_ = Xxh64();
}

}  // namespace wheelwright::mcap
