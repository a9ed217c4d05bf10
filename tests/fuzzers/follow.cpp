// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "formats/files/bytes.hpp"
#include "formats/logs/csv.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

namespace {

// Hands bytes out in pieces of a few, as a pipe does.
class Pieces final : public files::ByteSource {
 public:
  explicit Pieces(std::string_view bytes) : bytes_(bytes) {}

  std::size_t read(char* to, std::size_t size) override {
    const std::size_t got = std::min({size, bytes_.size() - at_, std::size_t{1} + at_ % 61});
    std::memcpy(to, bytes_.data() + at_, got);
    at_ += got;
    return got;
  }
  [[nodiscard]] std::uint64_t file_bytes() const override { return at_; }
  [[nodiscard]] std::string hash() const override { return {}; }
  [[nodiscard]] const char* packing() const override { return "plain"; }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace

// Lines of a stream: a row is finite, and time grows but where a segment starts.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    files::LineReader in(std::make_unique<Pieces>(fuzz::text_of(data, size)), "stream");
    std::string_view line;
    if (!in.next(line)) {
      return;
    }
    logs::CsvRowParser parser(line, {}, 0.01);
    LogBlock row;
    double last = 0.0;
    while (in.next(line)) {
      if (bool taken = false; fuzz::clean([&] { taken = parser.parse(line, row); }), taken) {
        fuzz::require(row.rows() == 1 && row.columns.size() == parser.columns().size());
        fuzz::require(!row.segment_starts.empty() || row.t[0] > last);
        fuzz::require(std::ranges::all_of(row.columns, [](const auto& column) { return std::isfinite(column[0]); }));
        last = row.t[0];
      }
    }
  });
}
