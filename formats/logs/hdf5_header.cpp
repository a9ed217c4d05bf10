// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/hdf5_header.hpp"

#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace wheelwright::logs::hdf5 {
namespace {

constexpr std::size_t most_blocks = 256;  // of one header
constexpr std::size_t longest_block = std::size_t{1} << 20;
constexpr unsigned layout_message = 0x08, attribute_message = 0x0C, continuation_message = 0x10;
constexpr unsigned chunked = 2;
constexpr unsigned least_sizes = 2;  // of a chunk: one dimension, and the size of an element

// A little-endian number of `size` bytes at `at`; 0 where they are not there.
std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t k = std::min(size, std::size_t{8}); k-- > 0 && at + size <= bytes.size();) {
    value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  }
  return value;
}

// Bytes of a file that stand there, or none.
std::string bytes_at(mcap::WindowedFile& file, std::uint64_t offset, std::uint64_t size) {
  const bool inside = size <= longest_block && offset <= file.size() && size <= file.size() - offset;
  return inside ? file.peek(offset, static_cast<std::size_t>(size)) : std::string();
}

// Bytes that a dataspace message needs: its head, and of each dimension the size and perhaps the largest one.
std::size_t dataspace_bytes(std::string_view data, std::size_t length_size) {
  const auto version = number(data, 0, 1), rank = number(data, 1, 1), flags = number(data, 2, 1);
  return (version == 1 ? 8 : 4) + rank * length_size * ((flags & 1U) != 0 ? 2 : 1);
}

// Whether name, datatype and dataspace of an attribute message stand inside it.
bool attribute_holds(std::string_view data, std::size_t length_size) {
  const auto version = number(data, 0, 1);
  std::size_t at = version < 3 ? 8 : 9;
  std::size_t dataspace = 0, dataspace_size = 0;
  for (const std::size_t field : {2, 4, 6}) {
    dataspace = at;
    dataspace_size = number(data, field, 2);
    at += version == 1 ? (dataspace_size + 7) / 8 * 8 : dataspace_size;
  }
  return at <= data.size() && dataspace_bytes(data.substr(dataspace), length_size) <= dataspace_size;
}

// Walks the messages of one header.
class Header {
 public:
  Header(mcap::WindowedFile& file, FieldSizes sizes) : file_(file), sizes_(sizes) {}

  std::string defect(std::uint64_t address) {
    begin(address);
    for (std::size_t k = 0; k < blocks_.size() && k < most_blocks; ++k) {
      const Block block = blocks_[k];
      if (std::string found = look_through(bytes_at(file_, block.at, block.size)); !found.empty()) {
        return found;
      }
    }
    return {};
  }

 private:
  struct Block {
    std::uint64_t at = 0, size = 0;
  };

  void begin(std::uint64_t address) {
    const std::string head = bytes_at(file_, address, std::min<std::uint64_t>(64, file_.size() - address));
    if (head.starts_with("OHDR")) {
      const auto flags = static_cast<unsigned>(number(head, 5, 1));
      const std::size_t width = std::size_t{1} << (flags & 3U);
      const std::size_t at = 6 + ((flags & 0x20U) != 0 ? 16 : 0) + ((flags & 0x10U) != 0 ? 4 : 0);
      second_version_ = true;
      message_header_ = (flags & 4U) != 0 ? 6 : 4;
      blocks_.push_back({address + at + width, number(head, at, width)});
    } else {
      blocks_.push_back({address + 16, number(head, 8, 4)});
    }
  }

  std::string look_through(std::string_view bytes) {
    for (std::size_t at = 0; at + message_header_ <= bytes.size();) {
      const auto type = number(bytes, at, second_version_ ? 1 : 2);
      const std::size_t size = number(bytes, at + (second_version_ ? 1 : 2), 2);
      const std::string_view data = bytes.substr(at + message_header_, size);
      at += message_header_ + size;
      if (type == continuation_message) {
        const Block next{number(data, 0, sizes_.offset), number(data, sizes_.offset, sizes_.length)};
        // "OCHK" in front of its messages, a checksum behind them
        blocks_.push_back(second_version_ && next.size >= 8 ? Block{next.at + 4, next.size - 8} : next);
      } else if (type == attribute_message && !attribute_holds(data, sizes_.length)) {
        return "has an attribute that ends outside of itself: the file is damaged";
      } else if (type == layout_message) {
        const auto version = number(data, 0, 1), kind = number(data, version < 3 ? 2 : 1, 1);
        const auto dimensions = number(data, version < 3 ? 1 : version == 3 ? 2 : 3, 1);
        if (kind == chunked && dimensions < least_sizes) {
          return fmt::format("is stored in chunks of {} dimensions: expected 1; the file is damaged",
                             dimensions > 0 ? dimensions - 1 : 0);
        }
        if (kind == chunked && has_empty_side(data, version, dimensions)) {
          return "is stored in chunks with a side of 0: the file is damaged";
        }
      }
    }
    return {};
  }

  // Sides of a chunk and the size of an element stand behind what the version has before them.
  [[nodiscard]] bool has_empty_side(std::string_view data, std::uint64_t version, std::uint64_t dimensions) const {
    const std::size_t at = version < 3 ? 8 + sizes_.offset : version == 3 ? 3 + sizes_.offset : 5;
    const std::size_t width = version < 4 ? 4 : number(data, 4, 1);
    for (std::size_t k = 0; k < dimensions; ++k) {
      if (number(data, at + k * width, width) == 0) {
        return true;
      }
    }
    return false;
  }

  mcap::WindowedFile& file_;
  FieldSizes sizes_;
  bool second_version_ = false;
  std::size_t message_header_ = 8;
  std::vector<Block> blocks_;
};

}  // namespace

std::string header_defect(mcap::WindowedFile& file, std::uint64_t address, FieldSizes sizes) {
  return Header(file, sizes).defect(address);
}

}  // namespace wheelwright::logs::hdf5
