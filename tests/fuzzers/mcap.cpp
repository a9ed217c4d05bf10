// SPDX-License-Identifier: Apache-2.0
// MCAP by its structure: records are changed one at a time, those inside an unpacked chunk too, and lengths and
// checksums made to fit again.
#include <algorithm>
#include <random>
#include <vector>

#include <zlib.h>

#include "tests/fuzzers/log.hpp"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);

namespace {

const std::string kMagic("\x89MCAP0\r\n", 8);
constexpr char kFooter = 2, kChunk = 6, kDataEnd = 15;

struct Record {
  char op;
  std::string content;
};

std::uint64_t number(std::string_view bytes, std::size_t at, std::size_t width) {
  std::uint64_t value = 0;
  for (std::size_t k = width; k-- > 0;) {
    value = value << 8 | static_cast<std::uint8_t>(bytes[at + k]);
  }
  return value;
}
std::string little(std::uint64_t value, std::size_t width) {
  std::string bytes;
  for (std::size_t k = 0; k < width; ++k) {
    bytes += static_cast<char>(value >> 8 * k);
  }
  return bytes;
}

std::vector<Record> records_of(std::string_view bytes) {
  std::vector<Record> records;
  while (bytes.size() >= 9) {
    const std::uint64_t length = std::min<std::uint64_t>(number(bytes, 1, 8), bytes.size() - 9);
    records.push_back({bytes[0], std::string(bytes.substr(9, length))});
    bytes.remove_prefix(9 + length);
  }
  return records;
}
std::string bytes_of(const std::vector<Record>& records) {
  std::string bytes;
  for (const Record& record : records) {
    bytes += record.op + little(record.content.size(), 8) + record.content;
  }
  return bytes;
}

std::string mutated(std::string bytes, std::size_t more) {
  const std::size_t size = bytes.size();
  bytes.resize(size + more);
  bytes.resize(LLVMFuzzerMutate(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size()));
  return bytes;
}

void change(std::vector<Record>& records, std::minstd_rand& random) {
  if (records.empty()) {
    return;
  }
  Record& record = records[random() % records.size()];
  // Of a chunk: times and sizes (24), checksum (4), name of the compression, length (8), records.
  if (record.op == kChunk && record.content.size() >= 40 && number(record.content, 28, 4) == 0 && random() % 8 != 0) {
    std::vector<Record> inside = records_of(std::string_view(record.content).substr(40));
    change(inside, random);
    const std::string body = bytes_of(inside);
    const auto checksum = ::crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
    record.content = record.content.substr(0, 16) + little(body.size(), 8) + little(checksum, 4) + little(0, 4) +
                     little(body.size(), 8) + body;
  } else if (random() % 16 == 0) {
    const Record copy = records[random() % records.size()];
    records.insert(records.begin() + static_cast<std::ptrdiff_t>(random() % records.size()), copy);
  } else {
    record.content = mutated(record.content, 64);
  }
}

}  // namespace

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most,
                                               unsigned int seed) {
  std::minstd_rand random(seed);
  const std::string_view bytes = wheelwright::fuzz::text_of(data, size);
  if (size < 2 * kMagic.size() || random() % 8 == 0) {
    return LLVMFuzzerMutate(data, size, most);
  }
  std::vector<Record> records = records_of(bytes.substr(kMagic.size(), size - 2 * kMagic.size()));
  change(records, random);
  for (Record& record : records) {  // a checksum of 0 is none
    if (record.op == kDataEnd && record.content.size() == 4) {
      record.content = little(0, 4);
    } else if (record.op == kFooter && record.content.size() == 20) {
      record.content.replace(16, 4, little(0, 4));
    }
  }
  const std::string made = kMagic + bytes_of(records) + kMagic;
  const std::size_t length = std::min(made.size(), most);
  std::copy_n(made.begin(), length, reinterpret_cast<char*>(data));
  return length;
}

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return wheelwright::fuzz::read_log(data, size, ".mcap");
}
