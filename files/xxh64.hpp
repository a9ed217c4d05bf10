// SPDX-License-Identifier: Apache-2.0
/// \file
/// XXH64, the 64-bit hash by which results name the exact bytes of the files they come from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

struct XXH64_state_s;

namespace wheelwright::files {

/// XXH64 with seed 0 (Collet, xxHash), fed in pieces of any size, by libxxhash. It identifies recordings; it does not
/// protect against forgery.
class Xxh64 {
 public:
  Xxh64();
  /// Appends `size` bytes.
  void update(const char* data, std::size_t size);
  /// Hash of all bytes so far; more may follow.
  [[nodiscard]] std::uint64_t digest() const;
  /// "xxh64:" and 16 hexadecimal digits.
  [[nodiscard]] std::string text() const;

 private:
  struct Free {
    void operator()(XXH64_state_s* state) const;
  };
  std::unique_ptr<XXH64_state_s, Free> state_;
};

}  // namespace wheelwright::files
