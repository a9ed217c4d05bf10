// SPDX-License-Identifier: Apache-2.0
// The line of a pair that is timed.
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/benchmarks/bench.hpp"

namespace wheelwright::bench::compare_test {
namespace {

class Compare : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    char program[] = "test_bench";
    ASSERT_TRUE(take_options({program}, nullptr));
  }

  /// What is printed; `failed` where an error was thrown.
  static std::string printed(Form form, const Subject& subject, const Work& ours, const Work& peer, int repetitions,
                             bool failed = false) {
    bool thrown = false;
    ::testing::internal::CaptureStdout();
    try {
      compare(form, subject, ours, peer, repetitions);
    } catch (const std::runtime_error&) {
      thrown = true;
    }
    const std::string text = ::testing::internal::GetCapturedStdout();
    EXPECT_EQ(thrown, failed);
    return text;
  }
};

TEST_F(Compare, PrintsOneObjectWithTheMediansAndTheirRatio) {
  std::size_t call = 0;
  const std::vector<double> times = {100.0, 5.0, 1.0, 2.0};  // the first is not counted
  const Subject subject{"logs/csv", 1000, 4, 2, "bare read", [](double s) { return fmt::format("{} s", s); }};
  const auto ours = [&] { return times.at(call++); };
  const auto peer = [] { return 6.0; };
  const std::string text = printed(Form::json, subject, ours, peer, 3);
  EXPECT_EQ(text.find('\n'), text.size() - 1);
  EXPECT_EQ(nlohmann::json::parse(text), nlohmann::json::parse(R"({"name": "logs/csv", "rows": 1000, "p": 4,
    "threads": 2, "seconds": 2.0, "peer": "bare read", "peer_seconds": 6.0, "ratio": 3.0, "note": "2 s"})"));
  call = 0;
  const std::string row = printed(Form::table, subject, ours, peer, 3);
  EXPECT_THAT(row, ::testing::MatchesRegex("logs/csv .* 2\\.0+ s +bare read .* 6\\.0+ s +ratio +3 +2 s\n"));
  EXPECT_EQ(call, times.size());
}

TEST_F(Compare, RepetitionsOfBothAreMixed) {
  std::string calls;
  const auto call = [&](char side) {
    return [&calls, side] {
      calls += side;
      return 1.0;
    };
  };
  static_cast<void>(printed(Form::json, {"name", 1, 0, 1, "peer"}, call('a'), call('b'), 40));
  EXPECT_EQ(std::ranges::count(calls, 'a'), 41);
  EXPECT_EQ(std::ranges::count(calls, 'b'), 41);
  std::size_t turns = 0;
  for (std::size_t k = 1; k < calls.size(); ++k) {
    turns += calls[k] != calls[k - 1] ? 1 : 0;
  }
  EXPECT_GT(turns, 15u) << calls;  // 40 on average, with a deviation of 4.4
}

TEST_F(Compare, ShortWorkIsDoneAgainAndItsMeanCounts) {
  std::size_t calls = 0;
  double sum = 0.0;
  const auto ours = [&] {
    ++calls;
    for (int k = 0; k < 10000; ++k) DoNotOptimize(sum += k);
  };
  const auto peer = [] { return 1.0; };
  const auto line = nlohmann::json::parse(printed(Form::json, {"name", 1, 0, 1, "peer"}, ours, peer, 3));
  EXPECT_GT(calls, 30u);
  EXPECT_LT(line.at("seconds").get<double>(), 0.03);
}

TEST_F(Compare, AWrongAnswerPrintsNothing) {
  const auto work = [] { return 1.0; };
  const auto wrong = []() -> double { throw std::runtime_error("peers disagree"); };
  EXPECT_EQ(printed(Form::json, {"name", 1, 0, 1, "peer"}, work, wrong, 2, true), "");
  const auto note = [](double) -> std::string { throw std::runtime_error("off by the width"); };
  EXPECT_EQ(printed(Form::json, {"name", 1, 0, 1, "peer", note}, work, work, 2, true), "");
  EXPECT_NE(printed(Form::json, {"name", 1, 0, 1, "peer"}, work, work, 2), "");
}

TEST_F(Compare, KnowsNoOtherOptions) {
  char program[] = "test_bench", other[] = "--frobnicate", known[] = "--benchmark_min_time=0.1";
  EXPECT_FALSE(take_options({program, other}, nullptr));
  EXPECT_TRUE(take_options({program, known}, nullptr));
}

}  // namespace
}  // namespace wheelwright::bench::compare_test
