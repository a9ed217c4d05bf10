// SPDX-License-Identifier: Apache-2.0
/// \file
/// Lines of a byte stream, in bounded memory and without copying them.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/files/byte_source.hpp>

namespace wheelwright {

/// Walks the lines of a ByteSource. Line ends are LF or CRLF; a UTF-8 byte order mark at the beginning is skipped.
class LineReader {
 public:
  /// Takes `source` over; `path` is for messages.
  LineReader(std::unique_ptr<ByteSource> source, std::string path);

  /// Sets `line` to the next line, its end removed, and returns true; false at the end of the stream. `line` stays
  /// valid until the next call. Throws InputError for a line of more than 2^18 bytes.
  bool next(std::string_view& line);

  /// Number of the line that was returned last; the first is 1.
  [[nodiscard]] std::size_t number() const { return number_; }
  /// Whether the line that was returned last had a line end (only the last of a file may lack it).
  [[nodiscard]] bool terminated() const { return terminated_; }
  /// The stream.
  [[nodiscard]] const ByteSource& source() const { return *source_; }

 private:
  bool refill();

  std::unique_ptr<ByteSource> source_;
  std::string path_;
  std::vector<char> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t number_ = 0;
  bool terminated_ = false;
};

}  // namespace wheelwright
