// SPDX-License-Identifier: Apache-2.0
/// \file
/// The fuzzers (tests/fuzzers/NAME.cpp) as functions, and inputs that the repository has for them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/bytes.hpp"

/// Entry point of a fuzzer, each under a name of its own (tests/CMakeLists.txt).
using Fuzzer = int(const std::uint8_t* data, std::size_t size);
extern "C" {
Fuzzer fuzz_bag, fuzz_claims, fuzz_columns, fuzz_controllers, fuzz_csv, fuzz_db3, fuzz_fleet, fuzz_follow, fuzz_gap,
    fuzz_hdf5, fuzz_journal, fuzz_mcap, fuzz_messages, fuzz_metadata, fuzz_model, fuzz_packed, fuzz_record, fuzz_robot,
    fuzz_scenario, fuzz_simulator, fuzz_store, fuzz_study, fuzz_urdf;
}

namespace wheelwright::fuzz_test {

/// All of them by their names.
inline const std::map<std::string, Fuzzer*> fuzzers = {
    {"bag", fuzz_bag},           {"claims", fuzz_claims},
    {"columns", fuzz_columns},   {"controllers", fuzz_controllers},
    {"csv", fuzz_csv},           {"db3", fuzz_db3},
    {"fleet", fuzz_fleet},       {"follow", fuzz_follow},
    {"gap", fuzz_gap},           {"hdf5", fuzz_hdf5},
    {"journal", fuzz_journal},   {"mcap", fuzz_mcap},
    {"messages", fuzz_messages}, {"metadata", fuzz_metadata},
    {"model", fuzz_model},       {"packed", fuzz_packed},
    {"record", fuzz_record},     {"robot", fuzz_robot},
    {"scenario", fuzz_scenario}, {"simulator", fuzz_simulator},
    {"store", fuzz_store},       {"study", fuzz_study},
    {"urdf", fuzz_urdf},
};

/// Hands `bytes` to a fuzzer. A promise that does not hold ends the program.
inline int hand(Fuzzer& fuzzer, std::string_view bytes) {
  return fuzzer(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
}

/// The folder of the fuzzers' sources.
inline std::filesystem::path fuzz_folder() { return std::filesystem::path(WHEELWRIGHT_SOURCE_DIR) / "tests/fuzzers"; }

/// Files with what the fuzzer `name` found once; none where it found nothing.
inline std::vector<std::filesystem::path> findings_of(const std::string& name) {
  std::vector<std::filesystem::path> files;
  if (const std::filesystem::path folder = fuzz_folder() / "found" / name; std::filesystem::exists(folder)) {
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      files.push_back(file.path());
    }
  }
  std::ranges::sort(files);
  return files;
}

/// All bytes of a file.
inline std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream read;
  read << std::ifstream(file, std::ios::binary).rdbuf();
  return read.str();
}

/// The corpus of the fuzzer `name`, as tests/fuzzers/corpus.py packs it: "SIZE\n", the input and a line end, again and
/// again.
inline std::vector<std::string> corpus_of(const std::string& name) {
  constexpr std::size_t kMost = std::size_t{16} << 20;
  const std::string packed = files::read_bytes(fuzz_folder() / "corpus" / (name + ".gz"), kMost);
  std::vector<std::string> inputs;
  for (std::size_t at = 0; at < packed.size();) {
    const std::size_t from = packed.find('\n', at) + 1;
    const std::size_t size = std::stoul(packed.substr(at, from - at));
    if (from + size >= packed.size() || packed[from + size] != '\n') {
      throw std::runtime_error("tests/fuzzers/corpus/" + name + ".gz is not as tests/fuzzers/corpus.py packs it");
    }
    inputs.push_back(packed.substr(from, size));
    at = from + size + 1;
  }
  return inputs;
}

}  // namespace wheelwright::fuzz_test
