// SPDX-License-Identifier: Apache-2.0
/// \file
/// Seeded mutations of inputs, without libFuzzer.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace wheelwright::fuzz_test {

/// Bytes of the largest input that is made.
inline constexpr std::size_t kLargestInput = 10'000'000;

using Random = std::mt19937_64;

/// A number below `count`, which is > 0.
inline std::size_t below(Random& random, std::size_t count) { return random() % count; }

/// A place and a length of bytes inside `bytes`, which are not empty; short ones are as likely as long ones, a third
/// are whole lines.
inline std::pair<std::size_t, std::size_t> piece_of(const std::string& bytes, Random& random) {
  const std::size_t at = below(random, bytes.size());
  if (below(random, 3) == 0) {
    const std::size_t before = bytes.rfind('\n', at);
    const std::size_t from = before == std::string::npos || before == at ? at : before + 1;
    return {from, std::min(bytes.find('\n', at), bytes.size() - 1) + 1 - from};
  }
  const std::size_t most = bytes.size() - at;
  const auto scale = static_cast<std::size_t>(std::log2(static_cast<double>(most))) + 1;
  return {at, 1 + below(random, std::min(most, std::size_t{1} << below(random, scale + 1)))};
}

/// Puts a number that lies at the end of what 1, 2, 4 or 8 bytes hold, or is the size of `bytes`, over bytes of it.
inline void put_boundary(std::string& bytes, Random& random) {
  const std::size_t width = std::size_t{1} << below(random, 4);
  if (bytes.size() < width) {
    return;
  }
  const std::uint64_t all = ~std::uint64_t{0} >> (64 - 8 * width);
  const std::array<std::uint64_t, 9> numbers = {
      0, 1, all, all - 1, all >> 1, (all >> 1) + 1, all >> 2, bytes.size(), random() % 256};
  const std::uint64_t number = numbers[below(random, numbers.size())];
  const std::size_t at = below(random, bytes.size() - width + 1);
  const bool little = below(random, 4) != 0;
  for (std::size_t k = 0; k < width; ++k) {
    bytes[at + (little ? k : width - 1 - k)] = static_cast<char>(number >> 8 * k);
  }
}

/// Puts an extreme number in the place of one that stands in `bytes` as text.
inline void put_number(std::string& bytes, Random& random) {
  constexpr std::array<std::string_view, 20> kNumbers = {"0",
                                                         "-0",
                                                         "-1",
                                                         "1e308",
                                                         "-1e308",
                                                         "1e-308",
                                                         "5e-324",
                                                         "1e999",
                                                         "nan",
                                                         ".nan",
                                                         "inf",
                                                         "-.inf",
                                                         "2147483648",
                                                         "4294967296",
                                                         "9223372036854775808",
                                                         "18446744073709551616",
                                                         "0x7fffffff",
                                                         "1e17",
                                                         "1000000007",
                                                         "0.1e-9"};
  constexpr std::string_view kDigits = "0123456789";
  if (bytes.empty()) {
    return;
  }
  std::size_t at = bytes.find_first_of(kDigits, below(random, bytes.size()));
  at = at == std::string::npos ? bytes.find_first_of(kDigits) : at;
  if (at != std::string::npos) {
    const std::size_t end = std::min(bytes.find_first_not_of("0123456789.eE+-", at), bytes.size());
    bytes.replace(at, end - at, kNumbers[below(random, kNumbers.size())]);
  }
}

/// Changes `bytes` once; pieces of another input come from `inputs`, which are not empty.
inline void change(std::string& bytes, const std::vector<std::string>& inputs, Random& random) {
  constexpr std::array<unsigned char, 10> kBytes = {0, 1, 0x7F, 0x80, 0xFF, '\n', ' ', '-', '"', '['};
  const std::string& other = inputs[below(random, inputs.size())];
  if (bytes.empty()) {
    bytes = other;
    return;
  }
  const auto [at, length] = piece_of(bytes, random);
  switch (below(random, 11)) {
    case 0: bytes[at] = static_cast<char>(bytes[at] ^ 1 << below(random, 8)); break;
    case 1: bytes[at] = static_cast<char>(kBytes[below(random, kBytes.size())]); break;
    case 2:
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), std::min<std::size_t>(length, 16),
                  static_cast<char>(random()));
      break;
    case 3: put_boundary(bytes, random); break;
    case 4: put_number(bytes, random); break;
    case 5: bytes.erase(at, length); break;
    case 6: bytes.insert(below(random, bytes.size() + 1), bytes.substr(at, length)); break;
    case 7: {  // two neighbours change places
      const std::size_t more = std::min(length, bytes.size() - at - length);
      const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
      std::rotate(begin, begin + static_cast<std::ptrdiff_t>(length),
                  begin + static_cast<std::ptrdiff_t>(length + more));
      break;
    }
    case 8: bytes.resize(at); break;
    case 9: bytes = bytes.substr(0, at) + other.substr(below(random, other.size() + 1)); break;
    default:
      if (!other.empty()) {
        const auto [from, count] = piece_of(other, random);
        bytes.replace(at, std::min<std::size_t>(below(random, 2) * count, bytes.size() - at), other, from, count);
      }
  }
}

/// Repeats a piece of `bytes` until they are between 64 KiB and kLargestInput, small sizes as likely as large ones.
inline void grow(std::string& bytes, Random& random) {
  constexpr double kSmallest = 65536.0, kRange = static_cast<double>(kLargestInput) / kSmallest;
  if (bytes.empty()) {
    return;
  }
  const double share = static_cast<double>(random() % 1001) / 1000.0;
  const auto size = static_cast<std::size_t>(kSmallest * std::pow(kRange, share));
  auto [at, length] = piece_of(bytes, random);
  std::string more;
  while (bytes.size() + more.size() + length <= size) {
    more.append(bytes, at, length);
  }
  bytes.insert(at, more);
}

/// One of `inputs`, which are not empty, changed once to eight times.
inline std::string mutated(const std::vector<std::string>& inputs, Random& random) {
  std::string bytes = inputs[below(random, inputs.size())];
  for (std::size_t changes = std::size_t{1} << below(random, 4); changes > 0; --changes) {
    change(bytes, inputs, random);
  }
  bytes.resize(std::min(bytes.size(), kLargestInput));
  return bytes;
}

}  // namespace wheelwright::fuzz_test
