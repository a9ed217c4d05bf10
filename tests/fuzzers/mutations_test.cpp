// SPDX-License-Identifier: Apache-2.0
// Every reader on seeded mutations of its corpus, in a process of its own: what it does with them, how long the slowest
// takes and how much memory it needs. WHEELWRIGHT_MUTATIONS=COUNT makes so many of each (tests/long.sh mutations) and
// holds time and memory against their limits.
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/fuzzers/fuzzers.hpp"
#include "tests/fuzzers/mutations.hpp"

namespace wheelwright::fuzz_test {
namespace {

constexpr std::uint64_t kSeed = 1;
constexpr std::size_t kFew = 100;          // mutations of each reader in the ordinary suite
constexpr std::size_t kGrownEvery = 2000;  // mutations, of which one is grown to as much as kLargestInput
constexpr std::size_t kMostFindings = 20;
constexpr double kMostSeconds = 2.0;
constexpr double kMostMemory = 512.0;  // MiB
constexpr unsigned int kHangs = 60;    // s

Random& mutator_random() {
  static Random random;
  return random;
}

/// A fuzzer, and what it is to read.
struct Reader {
  std::string name;
  Fuzzer* fuzzer;
  std::vector<std::string> inputs;
};

/// Where a process is with the mutations of its reader; in memory that is shared with the process that started it.
struct Progress {
  std::size_t number;  ///< of the mutation that is read
  double slowest;      ///< s
  std::size_t slowest_number;
};

struct Outcome {
  Progress progress{};
  double memory = 0.0;                ///< MiB
  std::vector<std::size_t> findings;  ///< numbers of mutations
};

}  // namespace
}  // namespace wheelwright::fuzz_test

// What libFuzzer offers to fuzzers with a mutation of their own, and that of MCAP: lengths and checksums fit.
extern "C" {
std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most) {
  std::string bytes(reinterpret_cast<const char*>(data), size);
  wheelwright::fuzz_test::change(bytes, {bytes}, wheelwright::fuzz_test::mutator_random());
  bytes.resize(std::min(bytes.size(), most));
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}
std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t most, unsigned int seed);
}

namespace wheelwright::fuzz_test {
namespace {

std::string mutation(const Reader& reader, std::size_t number) {
  const std::string told = fmt::format("{} {} {}", kSeed, reader.name, number);
  std::seed_seq words(told.begin(), told.end());
  Random random(words);
  if (reader.name == "mcap" && number % 2 == 0) {
    constexpr std::size_t kMore = 65536;
    std::string bytes = reader.inputs[below(random, reader.inputs.size())];
    const std::size_t size = bytes.size();
    bytes.resize(size + kMore);
    mutator_random().seed(random());
    bytes.resize(LLVMFuzzerCustomMutator(reinterpret_cast<std::uint8_t*>(bytes.data()), size, bytes.size(),
                                         static_cast<unsigned int>(random())));
    return bytes;
  }
  std::string bytes = mutated(reader.inputs, random);
  if (number % kGrownEvery == kGrownEvery - 1) {
    grow(bytes, random);
  }
  return bytes;
}

/// Processor time that a fuzzer takes, s: the machine may be busy with something else.
double seconds(Fuzzer& fuzzer, const std::string& bytes) {
  const std::clock_t began = std::clock();
  hand(fuzzer, bytes);
  return static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC;
}

/// Reads the mutations from progress.number up to `count`, and ends the process. What is thrown ends it as well. One
/// that seems to be the slowest is read a second time, and the better of both counts.
[[noreturn]] void read_all(const Reader& reader, std::size_t count, bool timed, Progress& progress) noexcept {
  for (; progress.number < count; ++progress.number) {
    const std::string bytes = mutation(reader, progress.number);
    ::alarm(timed ? kHangs : 0);
    double took = seconds(*reader.fuzzer, bytes);
    took = took > progress.slowest ? std::min(took, seconds(*reader.fuzzer, bytes)) : took;
    if (took > progress.slowest) {
      progress.slowest = took;
      progress.slowest_number = progress.number;
    }
  }
  ::_exit(0);
}

/// Removes what a process has left, which ended without a look back.
void remove_files_of(pid_t process) {
  const std::string stem = "wheelwright-fuzz-" + std::to_string(process) + ".";
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::temp_directory_path())) {
    if (entry.path().filename().string().starts_with(stem)) {
      std::filesystem::remove_all(entry.path(), ignored);
    }
  }
}

Outcome read_mutations(const Reader& reader, std::size_t count, bool timed) {
  void* const shared = ::mmap(nullptr, sizeof(Progress), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    throw std::system_error(errno, std::generic_category(), "mmap");
  }
  auto& progress = *new (shared) Progress{};
  Outcome outcome;
  while (progress.number < count && outcome.findings.size() < kMostFindings) {
    std::cout.flush();
    const pid_t process = ::fork();
    if (process < 0) {
      throw std::system_error(errno, std::generic_category(), "fork");
    }
    if (process == 0) {
      read_all(reader, count, timed, progress);
    }
    int status = 0;
    rusage usage{};
    ::wait4(process, &status, 0, &usage);
    remove_files_of(process);
    outcome.memory = std::max(outcome.memory, static_cast<double>(usage.ru_maxrss) / 1024.0);
    if (status != 0) {
      outcome.findings.push_back(progress.number++);
    }
  }
  outcome.progress = progress;
  ::munmap(shared, sizeof(Progress));
  return outcome;
}

class Mutations : public ::testing::TestWithParam<std::string> {};

TEST_P(Mutations, AreReadOrRefused) {
  const char* const asked = std::getenv("WHEELWRIGHT_MUTATIONS");
  const bool timed = asked != nullptr;
  const std::size_t count = timed ? std::stoul(asked) : kFew;
  Reader reader{GetParam(), fuzzers.at(GetParam()), corpus_of(GetParam())};
  for (const std::filesystem::path& file : findings_of(reader.name)) {
    reader.inputs.push_back(bytes_of(file));
  }
  const Outcome outcome = read_mutations(reader, count, timed);
  EXPECT_EQ(outcome.progress.number, count);

  const auto keep = [&](std::size_t number, const std::string& why) {
    const std::filesystem::path folder = std::filesystem::path(WHEELWRIGHT_BINARY_DIR) / "mutations";
    std::filesystem::create_directories(folder);
    const std::filesystem::path file = folder / (reader.name + "-" + why);
    const std::string bytes = mutation(reader, number);
    std::ofstream(file, std::ios::binary) << bytes;
    return std::pair{file.string(), bytes.size()};
  };
  for (const std::size_t number : outcome.findings) {
    ADD_FAILURE() << reader.name << ": mutation " << number << " of seed " << kSeed
                  << " ends the reader: " << keep(number, "finding-" + std::to_string(number)).first;
  }
  const std::size_t size = keep(outcome.progress.slowest_number, "slowest").second;
  std::cout << fmt::format("{:<12} {:>9} {:>10.4f} {:>9} {:>7.0f} {:>9}", reader.name, outcome.progress.number,
                           outcome.progress.slowest, size, outcome.memory, outcome.findings.size())
            << std::endl;
  if (timed) {
    EXPECT_LE(outcome.progress.slowest, kMostSeconds) << reader.name;
    EXPECT_LE(outcome.memory, kMostMemory) << reader.name;
  }
}

std::vector<std::string> names() {
  std::vector<std::string> all;
  for (const auto& [name, fuzzer] : fuzzers) {
    all.push_back(name);
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Of, Mutations, ::testing::ValuesIn(names()), [](const auto& test) { return test.param; });

// The same number makes the same input, whatever was made before.
TEST(Mutation, IsToldByItsNumber) {
  const Reader reader{"mcap", fuzz_mcap, corpus_of("mcap")};
  std::vector<std::string> forwards;
  for (std::size_t number = 0; number < 20; ++number) {
    forwards.push_back(mutation(reader, number));
  }
  std::size_t changed = 0;
  for (std::size_t number = 20; number-- > 0;) {
    EXPECT_EQ(mutation(reader, number), forwards[number]) << number;
    changed += std::ranges::find(reader.inputs, forwards[number]) == reader.inputs.end() ? 1 : 0;
  }
  EXPECT_GT(changed, 15U);
}

TEST(Mutation, GrowsToTheLargestInputAndNotBeyond) {
  std::size_t largest = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed);
    std::string bytes = "a,b\n1,2\n3,4\n";
    grow(bytes, random);
    largest = std::max(largest, bytes.size());
  }
  EXPECT_GT(largest, kLargestInput / 2);
  EXPECT_LE(largest, kLargestInput);
}

int ends_at_short_inputs(const std::uint8_t* data, std::size_t size) {
  if (size < 3) {
    throw std::length_error(std::string(data, data + size));
  }
  return 0;
}

TEST(Mutation, ThatEndsAReaderIsToldAndTheNextIsRead) {
  constexpr std::size_t kCount = 60;
  const Reader reader{"short", ends_at_short_inputs, {"four", "and five"}};
  std::vector<std::size_t> expected;
  for (std::size_t number = 0; number < kCount; ++number) {
    if (mutation(reader, number).size() < 3) {
      expected.push_back(number);
    }
  }
  ASSERT_GT(expected.size(), 1U);
  ASSERT_LT(expected.size(), kMostFindings);
  const Outcome outcome = read_mutations(reader, kCount, false);
  EXPECT_EQ(outcome.findings, expected);
  EXPECT_EQ(outcome.progress.number, kCount);
  EXPECT_GT(outcome.memory, 0.0);
}

}  // namespace
}  // namespace wheelwright::fuzz_test
