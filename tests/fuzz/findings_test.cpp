// SPDX-License-Identifier: Apache-2.0
// What fuzzers found once (fuzz/found/NAME/*), handed to them again.
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

// The fuzzers' entry points, each under a name of its own (tests/CMakeLists.txt).
using Fuzzer = int(const std::uint8_t* data, std::size_t size);
extern "C" {
Fuzzer fuzz_controllers, fuzz_csv, fuzz_db3, fuzz_fleet, fuzz_follow, fuzz_hdf5, fuzz_journal, fuzz_mcap, fuzz_messages,
    fuzz_metadata, fuzz_model, fuzz_robot, fuzz_scenario, fuzz_study, fuzz_urdf;
// libFuzzer has it; nothing is mutated here.
std::size_t LLVMFuzzerMutate(std::uint8_t*, std::size_t size, std::size_t) { return size; }
}

namespace wheelwright::fuzz_test {
namespace {

const std::map<std::string, Fuzzer*> fuzzers = {
    {"controllers", fuzz_controllers}, {"csv", fuzz_csv},           {"db3", fuzz_db3},         {"fleet", fuzz_fleet},
    {"follow", fuzz_follow},           {"hdf5", fuzz_hdf5},         {"journal", fuzz_journal}, {"mcap", fuzz_mcap},
    {"messages", fuzz_messages},       {"metadata", fuzz_metadata}, {"model", fuzz_model},     {"robot", fuzz_robot},
    {"scenario", fuzz_scenario},       {"study", fuzz_study},       {"urdf", fuzz_urdf},
};

// A promise that does not hold ends the program.
TEST(Findings, MakeAResultThatKeepsItsPromisesOrAnInputError) {
  std::size_t found = 0;
  for (const auto& folder : std::filesystem::directory_iterator(WHEELWRIGHT_SOURCE_DIR "/fuzz/found")) {
    Fuzzer* const fuzzer = fuzzers.at(folder.path().filename().string());
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      std::ostringstream read;
      read << std::ifstream(file.path(), std::ios::binary).rdbuf();
      const std::string bytes = read.str();
      std::cout << file.path().string() << std::endl;
      EXPECT_EQ(fuzzer(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), 0);
      ++found;
    }
  }
  EXPECT_GT(found, 0U);
}

// Each fuzzer runs, on what every one of them is to stand.
TEST(Fuzzers, StandNothingAndNoise) {
  std::string noise(4096, '\0');
  for (std::size_t k = 0; k < noise.size(); ++k) {
    noise[k] = static_cast<char>(k * 2654435761U >> 13);
  }
  for (const auto& [name, fuzzer] : fuzzers) {
    for (const std::string& bytes :
         {std::string(), std::string("\0", 1), std::string("{}"), std::string("a: [1, 2]\n"), noise}) {
      EXPECT_EQ(fuzzer(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()), 0) << name;
    }
  }
}

}  // namespace
}  // namespace wheelwright::fuzz_test
