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
Fuzzer fuzz_csv, fuzz_db3, fuzz_follow, fuzz_hdf5, fuzz_mcap, fuzz_messages, fuzz_model, fuzz_robot, fuzz_study,
    fuzz_urdf;
// libFuzzer has it; nothing is mutated here.
std::size_t LLVMFuzzerMutate(std::uint8_t*, std::size_t size, std::size_t) { return size; }
}

namespace wheelwright::fuzz_test {
namespace {

const std::map<std::string, Fuzzer*> fuzzers = {
    {"csv", fuzz_csv},           {"db3", fuzz_db3},     {"follow", fuzz_follow}, {"hdf5", fuzz_hdf5},
    {"mcap", fuzz_mcap},         {"model", fuzz_model}, {"robot", fuzz_robot},   {"study", fuzz_study},
    {"messages", fuzz_messages}, {"urdf", fuzz_urdf},
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

}  // namespace
}  // namespace wheelwright::fuzz_test
