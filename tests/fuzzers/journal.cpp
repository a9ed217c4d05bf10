// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "formats/logs/log_file.hpp"
#include "tests/fuzzers/log.hpp"

using namespace wheelwright;

namespace {

/// A recording of our own, and a file that a journal may name.
std::filesystem::path recording() {
  const std::vector<std::string> names = {"omega_r", "omega_l", "tau_r", "tau_l"};
  LogBlock block;
  block.columns.resize(names.size());
  for (int k = 0; k < 60; ++k) {
    block.t.push_back(0.01 * k);
    for (std::size_t j = 0; j < names.size(); ++j) {
      block.columns[j].push_back(0.1 * k + static_cast<double>(j));
    }
  }
  block.segment_starts = {0};
  const auto path = fuzz::on_disk("", ".journal.db3");
  std::filesystem::remove(path);
  const auto writer = logs::create_log(path, names);
  writer->write(block);
  writer->commit();
  return path;
}

void put(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc)
      .write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

// Beside a recording lies the input, as write-ahead log (its first byte is even) or rollback journal: what is read is
// clean, and neither recording, journal nor any other file is changed.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path path = recording();
  static const std::uintmax_t bytes = std::filesystem::file_size(path);
  if (size < 1) {
    return 0;
  }
  const std::filesystem::path beside = path.string() + (data[0] % 2 == 0 ? "-wal" : "-journal");
  const std::filesystem::path victim = path.string() + "-victim";
  put(beside, fuzz::text_of(data + 1, size - 1));
  put(victim, "stays");
  logs::LogOptions options;
  options.min_rows = 1;
  fuzz::clean([&] {
    const auto log = logs::open_log({path}, options);
    const LogTable table = read_all(*log);
    fuzz::require_clean(*log, table);
  });
  fuzz::require(std::filesystem::file_size(path) == bytes && std::filesystem::file_size(beside) == size - 1 &&
                std::filesystem::exists(victim));
  std::filesystem::remove(beside);
  std::filesystem::remove(victim);
  return 0;
}
