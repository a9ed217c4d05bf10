// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/xxh64.hpp>

#include <new>

#include <fmt/format.h>
#include <xxhash.h>

namespace wheelwright::files {

void Xxh64::Free::operator()(XXH64_state_s* state) const { XXH64_freeState(state); }

Xxh64::Xxh64() : state_(XXH64_createState()) {
  if (!state_) {
    throw std::bad_alloc();
  }
  XXH64_reset(state_.get(), 0);
}

void Xxh64::update(const char* data, std::size_t size) { XXH64_update(state_.get(), data, size); }

std::uint64_t Xxh64::digest() const { return XXH64_digest(state_.get()); }

std::string Xxh64::text() const { return fmt::format("xxh64:{:016x}", digest()); }

}  // namespace wheelwright::files
