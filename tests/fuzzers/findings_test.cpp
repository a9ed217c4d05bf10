// SPDX-License-Identifier: Apache-2.0
// What fuzzers found once (tests/fuzzers/found/NAME/*) and what they learnt (tests/fuzzers/corpus/NAME.gz), handed to
// them again.
#include <cstddef>
#include <filesystem>
#include <iostream>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/fuzzers/fuzzers.hpp"

namespace wheelwright::fuzz_test {
namespace {

std::set<std::string> stems(const std::filesystem::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.insert(entry.path().stem().string());
  }
  return names;
}

TEST(Findings, MakeAResultThatKeepsItsPromisesOrAnInputError) {
  std::size_t found = 0;
  for (const auto& [name, fuzzer] : fuzzers) {
    for (const std::filesystem::path& file : findings_of(name)) {
      std::cout << file.string() << std::endl;
      EXPECT_EQ(hand(*fuzzer, bytes_of(file)), 0);
      ++found;
    }
  }
  EXPECT_GT(found, 0U);
  for (const std::string& name : stems(fuzz_folder() / "found")) {
    EXPECT_TRUE(fuzzers.contains(name)) << name;
  }
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
      EXPECT_EQ(hand(*fuzzer, bytes), 0) << name;
    }
  }
}

TEST(Corpora, AreThereForEachFuzzerAndSmall) {
  constexpr std::uintmax_t kMostOfOne = 60 << 10, kMostOfAll = 1 << 20;
  std::set<std::string> names;
  std::uintmax_t all = 0;
  for (const auto& [name, fuzzer] : fuzzers) {
    const std::uintmax_t bytes = std::filesystem::file_size(fuzz_folder() / "corpus" / (name + ".gz"));
    EXPECT_LE(bytes, kMostOfOne) << name;
    all += bytes;
    names.insert(name);
  }
  EXPECT_LE(all, kMostOfAll);
  EXPECT_EQ(stems(fuzz_folder() / "corpus"), names);
}

class Corpus : public ::testing::TestWithParam<std::string> {};

TEST_P(Corpus, KeepsItsPromises) {
  std::size_t inputs = 0;
  for (const std::string& bytes : corpus_of(GetParam())) {
    EXPECT_EQ(hand(*fuzzers.at(GetParam()), bytes), 0) << "input " << inputs;
    ++inputs;
  }
  EXPECT_GT(inputs, 2U);
}

INSTANTIATE_TEST_SUITE_P(Of, Corpus, ::testing::ValuesIn(stems(fuzz_folder() / "corpus")),
                         [](const auto& test) { return test.param; });

}  // namespace
}  // namespace wheelwright::fuzz_test
