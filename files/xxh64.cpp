// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/files/xxh64.hpp>

#include <algorithm>
#include <bit>
#include <cstring>

#include <fmt/format.h>

namespace wheelwright {
namespace {

constexpr std::uint64_t prime1 = 0x9E3779B185EBCA87ULL;
constexpr std::uint64_t prime2 = 0xC2B2AE3D27D4EB4FULL;
constexpr std::uint64_t prime3 = 0x165667B19E3779F9ULL;
constexpr std::uint64_t prime4 = 0x85EBCA77C2B2AE63ULL;
constexpr std::uint64_t prime5 = 0x27D4EB2F165667C5ULL;

static_assert(std::endian::native == std::endian::little, "XXH64 reads little-endian words");

template <typename Word>
Word load(const char* data) {
  Word word;
  std::memcpy(&word, data, sizeof word);
  return word;
}

std::uint64_t round(std::uint64_t lane, std::uint64_t word) { return std::rotl(lane + word * prime2, 31) * prime1; }

}  // namespace

void Xxh64::stripe(const char* data) {
  for (std::size_t k = 0; k < 4; ++k) {
    lanes_[k] = round(lanes_[k], load<std::uint64_t>(data + 8 * k));
  }
}

void Xxh64::update(const char* data, std::size_t size) {
  total_ += size;
  if (rest_size_ > 0) {
    const std::size_t take = std::min(size, rest_.size() - rest_size_);
    std::memcpy(rest_.data() + rest_size_, data, take);
    rest_size_ += take;
    data += take;
    size -= take;
    if (rest_size_ < rest_.size()) {
      return;
    }
    stripe(rest_.data());
    rest_size_ = 0;
  }
  for (; size >= 32; data += 32, size -= 32) {
    stripe(data);
  }
  if (size > 0) {
    std::memcpy(rest_.data(), data, size);
    rest_size_ = size;
  }
}

std::uint64_t Xxh64::digest() const {
  std::uint64_t hash = prime5;
  if (total_ >= 32) {
    hash = std::rotl(lanes_[0], 1) + std::rotl(lanes_[1], 7) + std::rotl(lanes_[2], 12) + std::rotl(lanes_[3], 18);
    for (const std::uint64_t lane : lanes_) {
      hash = (hash ^ round(0, lane)) * prime1 + prime4;
    }
  }
  hash += total_;
  const char* data = rest_.data();
  std::size_t size = rest_size_;
  for (; size >= 8; data += 8, size -= 8) {
    hash = std::rotl(hash ^ round(0, load<std::uint64_t>(data)), 27) * prime1 + prime4;
  }
  if (size >= 4) {
    hash = std::rotl(hash ^ (load<std::uint32_t>(data) * prime1), 23) * prime2 + prime3;
    data += 4;
    size -= 4;
  }
  for (; size > 0; ++data, --size) {
    hash = std::rotl(hash ^ (static_cast<unsigned char>(*data) * prime5), 11) * prime1;
  }
  hash = (hash ^ (hash >> 33)) * prime2;
  hash = (hash ^ (hash >> 29)) * prime3;
  return hash ^ (hash >> 32);
}

std::string Xxh64::text() const { return fmt::format("xxh64:{:016x}", digest()); }

}  // namespace wheelwright
