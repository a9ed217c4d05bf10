// SPDX-License-Identifier: Apache-2.0
#include "app/run_items.hpp"
#include "app/common.hpp"

#include <atomic>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::app {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using wheelwright::testing::input_error;

class RunItemsTest : public wheelwright::testing::ScratchTest {
 protected:
  RunItemsTest() {
    common_.out = path("out");
    common_.quiet = true;
  }

  ItemsToRun items() {
    return {{20,
             [this](std::size_t item) {
               ++calls_;
               return std::to_string(item * item);
             }},
            [](std::size_t item) { return "robot " + std::to_string(item); },
            {{"--beta", "40"}}};
  }

  ItemsRun run(const ScaleOptions& scale = {}) { return run_items(items(), common_, scale); }

  static std::string texts(results::SqliteResults& results) {
    std::string all;
    results.each(
        [&](std::size_t item, std::string_view text) { all += std::to_string(item) + "=" + std::string(text) + "\n"; });
    return all;
  }

  CommonOptions common_;
  std::atomic<int> calls_ = 0;
};

TEST(ShardOf, CountsFromOne) {
  const std::optional<study::Shard> shard = shard_of("3/7");
  ASSERT_TRUE(shard);
  EXPECT_EQ(shard->index, 2U);
  EXPECT_EQ(shard->count, 7U);
  for (const char* const wrong : {"0/7", "8/7", "3", "3/", "/7", "a/b", "3/7x", "-1/7", "1/0"}) {
    EXPECT_FALSE(shard_of(wrong)) << wrong;
  }
}

TEST_F(RunItemsTest, AnyThreadsAndAnyShardsGiveTheSame) {
  common_.out.clear();
  const std::string expected = texts(*run().results);
  EXPECT_FALSE(std::filesystem::exists(path("out")));
  common_.out = path("threads");
  common_.threads = 2;
  EXPECT_EQ(texts(*run().results), expected);
  common_.out = path("out");
  for (std::size_t index = 0; index < 7; ++index) {
    EXPECT_EQ(run({.shard = study::Shard{index, 7}}).results, nullptr);
  }
  calls_ = 0;
  EXPECT_EQ(texts(*run({.merge = true}).results), expected);
  EXPECT_EQ(calls_, 0);
}

TEST_F(RunItemsTest, GoesOnAndBeginsAfresh) {
  EXPECT_EQ(run().count.evaluated, 20U);
  const ItemsRun again = run();
  EXPECT_EQ(again.count.found, 20U);
  EXPECT_EQ(again.count.evaluated, 0U);
  EXPECT_THAT(input_error([&] { static_cast<void>(run()); }), HasSubstr("another process"));
}

TEST_F(RunItemsTest, FreshEvaluatesAll) {
  static_cast<void>(run());
  EXPECT_EQ(run({.fresh = true}).count.evaluated, 20U);
}

TEST_F(RunItemsTest, AMergeSaysWhatIsMissing) {
  EXPECT_THAT(input_error([&] { static_cast<void>(run({.merge = true})); }), HasSubstr("no shard-"));
  for (const std::size_t index : {0U, 1U, 3U}) {
    static_cast<void>(run({.shard = study::Shard{index, 4}}));
  }
  EXPECT_THAT(
      input_error([&] { static_cast<void>(run({.merge = true})); }),
      AllOf(HasSubstr("5 of 20 items are missing"), HasSubstr("'robot 2', 'robot 6'"), HasSubstr("--shard 3/4")));
  calls_ = 0;
  EXPECT_EQ(run().count.evaluated, 5U);  // as the message says
  EXPECT_EQ(calls_, 5);
}

TEST_F(RunItemsTest, OptionsThatDoNotGoTogether) {
  EXPECT_THAT(input_error([&] {
                static_cast<void>(run({.shard = study::Shard{0, 2}, .merge = true}));
              }),
              AllOf(HasSubstr("--shard"), HasSubstr("--merge")));
  common_.out.clear();
  EXPECT_THAT(input_error([&] { static_cast<void>(run({.merge = true})); }), HasSubstr("--out"));
  EXPECT_THAT(input_error([&] { static_cast<void>(run({.fresh = true})); }), HasSubstr("--out"));
}

}  // namespace
}  // namespace wheelwright::app
