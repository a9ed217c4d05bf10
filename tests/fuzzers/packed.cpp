// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <optional>
#include <string>

#include "formats/files/bytes.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

/// What came out, and whether it ended as it should.
struct Unpacked {
  std::string bytes;
  bool whole = false;
  std::string hash;

  friend bool operator==(const Unpacked&, const Unpacked&) = default;
};

/// All that comes out of a file, in pieces of `piece` bytes.
std::optional<Unpacked> unpacked(const std::filesystem::path& path, std::size_t piece, std::size_t size) {
  std::optional<Unpacked> out;
  fuzz::clean([&] {
    const auto source = files::open_bytes(path, true);
    out.emplace();
    std::string buffer(piece, '\0');
    while (const std::size_t got = source->read(buffer.data(), buffer.size())) {
      fuzz::require(got <= buffer.size());
      out->bytes.append(buffer, 0, got);
    }
    fuzz::require(source->file_bytes() <= size);
    out->whole = true;
    out->hash = source->hash();
  });
  return out;
}

}  // namespace

// Whatever the size of the pieces the same bytes come out of a file, no more than its size allows, under its hash.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kSmall = 4093, kLarge = std::size_t{1} << 18;
  const std::string_view text = fuzz::text_of(data, size);
  const auto path = fuzz::on_disk(text, ".packed");
  const std::optional<Unpacked> once = unpacked(path, kLarge, size);
  if (!once) {
    return 0;
  }
  fuzz::require(once->bytes.size() <= files::most_unpacked(size));
  if (once->whole) {
    files::Xxh64 hash;
    hash.update(text.data(), text.size());
    fuzz::require(once->hash == hash.text());
    fuzz::require(unpacked(path, kSmall, size) == once);
  }
  return 0;
}
