// SPDX-License-Identifier: Apache-2.0
/// \file
/// CDR laid down by hand: an encoder that knows alignment and byte order and nothing of the library's.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace wheelwright::testing {

/// Bytes of a message, in either byte order (DDSI-RTPS 2.3, 10.2: a primitive is aligned to its size, counted from
/// behind the 4 bytes of encapsulation).
class HandCdr {
 public:
  explicit HandCdr(bool little) : little_(little) { bytes_ = {'\0', little ? '\1' : '\0', '\0', '\0'}; }

  template <typename Number>
  HandCdr& put(Number value) {
    while ((bytes_.size() - 4) % sizeof value != 0) {
      bytes_ += '\x5A';  // what padding holds does not matter
    }
    std::uint64_t bits = 0;
    if constexpr (std::is_floating_point_v<Number>) {
      std::conditional_t<sizeof value == 8, std::uint64_t, std::uint32_t> pattern;
      std::memcpy(&pattern, &value, sizeof value);
      bits = pattern;
    } else {
      bits = static_cast<std::uint64_t>(value);
    }
    for (std::size_t k = 0; k < sizeof value; ++k) {
      const std::size_t byte = little_ ? k : sizeof value - 1 - k;
      bytes_ += static_cast<char>(bits >> (8 * byte) & 0xFF);
    }
    return *this;
  }
  HandCdr& put(const std::string& text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text;
    bytes_ += '\0';
    return *this;
  }
  HandCdr& put(const char* text) { return put(std::string(text)); }
  template <typename Item>
  HandCdr& list(const std::vector<Item>& items) {
    put(static_cast<std::uint32_t>(items.size()));
    for (const Item& item : items) {
      put(item);
    }
    return *this;
  }

  [[nodiscard]] const std::string& str() const { return bytes_; }

 private:
  bool little_;
  std::string bytes_;
};

}  // namespace wheelwright::testing
