// SPDX-License-Identifier: Apache-2.0
/// \file
/// XXH64, the 64-bit hash by which results name the exact bytes of the files they come from.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace wheelwright {

/// XXH64 with seed 0 (Collet, "xxHash fast digest algorithm", specification 0.1.1, section XXH64), fed in pieces of any
/// size. It tells one recording from another; it is no protection against a forger.
class Xxh64 {
 public:
  /// Appends `size` bytes.
  void update(const char* data, std::size_t size);
  /// Hash of all bytes so far; more may follow.
  [[nodiscard]] std::uint64_t digest() const;
  /// "xxh64:" and 16 hexadecimal digits.
  [[nodiscard]] std::string text() const;

 private:
  static constexpr std::uint64_t prime1 = 0x9E3779B185EBCA87ULL;
  static constexpr std::uint64_t prime2 = 0xC2B2AE3D27D4EB4FULL;

  void stripe(const char* data);

  std::array<std::uint64_t, 4> lanes_{prime1 + prime2, prime2, 0, 0 - prime1};
  std::array<char, 32> rest_{};
  std::size_t rest_size_ = 0;
  std::uint64_t total_ = 0;
};

}  // namespace wheelwright
