// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/line_reader.hpp>

#include <cstring>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>

namespace wheelwright {

LineReader::LineReader(std::unique_ptr<ByteSource> source, std::string path)
    : source_(std::move(source)), path_(std::move(path)), buffer_(std::size_t{1} << 18) {}

/// Moves the unread rest to the front of the buffer and reads on; false when the stream is at its end.
bool LineReader::refill() {
  std::memmove(buffer_.data(), buffer_.data() + begin_, end_ - begin_);
  end_ -= begin_;
  begin_ = 0;
  if (end_ == buffer_.size()) {
    throw InputError(fmt::format("{}:{}: a line of more than {} bytes: expected text with one row a line", path_,
                                 number_ + 1, buffer_.size()));
  }
  const std::size_t got = source_->read(buffer_.data() + end_, buffer_.size() - end_);
  end_ += got;
  return got > 0;
}

bool LineReader::next(std::string_view& line) {
  std::size_t searched = 0;
  const char* newline = nullptr;
  while (newline == nullptr) {
    newline = static_cast<const char*>(std::memchr(buffer_.data() + begin_ + searched, '\n', end_ - begin_ - searched));
    searched = end_ - begin_;
    if (newline == nullptr && !refill()) {
      break;
    }
  }
  terminated_ = newline != nullptr;
  if (!terminated_ && begin_ == end_) {
    return false;
  }
  const std::size_t stop = terminated_ ? static_cast<std::size_t>(newline - buffer_.data()) : end_;
  line = std::string_view(buffer_.data() + begin_, stop - begin_);
  begin_ = terminated_ ? stop + 1 : stop;
  ++number_;
  if (number_ == 1 && line.starts_with("\xEF\xBB\xBF")) {
    line.remove_prefix(3);
  }
  if (line.ends_with('\r')) {
    line.remove_suffix(1);
  }
  return true;
}

}  // namespace wheelwright
